"""Plots of a rollout, by matplotlib; nothing here touches its global figures."""
