"""Runs on disk: committed block by block, verified, resumed."""
