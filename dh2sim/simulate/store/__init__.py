"""Runs on disk: written block by block, each committed by one record, and resumed."""
