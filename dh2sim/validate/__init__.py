"""Validation: every engine against the table, and motions against physics."""
