"""Denavit-Hartenberg tables as people write them: Markdown, CSV, TSV and the printouts of Corke's toolboxes."""
