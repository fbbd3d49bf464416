"""Sizes as people read them."""

from __future__ import annotations


def size_text(count: int) -> str:
    """Return a number of bytes as in '12.3 MB'."""
    size, unit = float(count), "B"
    for larger in ("kB", "MB", "GB", "TB"):
        if size < 999.95:
            break
        size, unit = size / 1000.0, larger
    return f"{size:.0f} {unit}" if unit == "B" else f"{size:.1f} {unit}"
