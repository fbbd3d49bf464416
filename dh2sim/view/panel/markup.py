"""HTML of the panel, in which foreign text is escaped."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape

_CELL = "padding:0.1em 0.4em;white-space:nowrap"
_MONO = "font-family:ui-monospace,Menlo,Consolas,monospace;font-size:0.78em"


def text(content: object) -> str:
    """Return text as HTML."""
    return escape(str(content))


def lines_of_text(content: str) -> str:
    """Return text as HTML, one line below the other."""
    return "<br>".join(text(line) for line in content.split("\n"))


def table(rows: Iterable[Sequence[str]], *, head: Sequence[str] = (), name: str = "") -> str:
    """Return a table of numbers; cells are HTML.

    Args:
        rows: Cells.
        head: Cells of the first line.
        name: For tests and style sheets.
    """
    top = f"<tr>{''.join(f'<th style={chr(34)}{_CELL};opacity:0.65{chr(34)}>{cell}</th>' for cell in head)}</tr>"
    body = "".join(
        f"<tr>{''.join(f'<td style={chr(34)}{_CELL};text-align:right{chr(34)}>{cell}</td>' for cell in row)}</tr>"
        for row in rows
    )
    return (
        f'<div data-dh2sim="{escape(name)}" style="overflow-x:auto;padding:0.3em 0.6em;{_MONO}">'
        f'<table style="border-collapse:collapse">{top if head else ""}{body}</table></div>'
    )


def banner(content: str, *, error: bool = False, name: str = "") -> str:
    """Return a text, given as HTML, that covers the lower left corner of the window, so that it moves nothing."""
    if not content:
        return note("", name=name)
    border = "#b42318" if error else "#235394"
    style = (
        "position:fixed;left:1rem;bottom:1rem;z-index:50;max-height:50vh;overflow:auto;"
        "max-width:max(14rem,min(34rem,calc(100vw - 27rem)));"  # beside the panel
        f"background:#fff;border:1px solid #d5dae1;border-left:4px solid {border};border-radius:4px"
    )
    return f'<div style="{style}">{note(content, error=error, name=name)}</div>'


def style(rules: Mapping[str, str], *, name: str) -> str:
    """Return a style sheet by selectors, in an element that ``holder`` finds."""
    sheet = "".join(f"{selector}{{{rule}}}" for selector, rule in rules.items())
    return f'<div data-dh2sim="{escape(name)}"><style>{sheet}</style></div>'


def holder(name: str) -> str:
    """Return the selector of the container of widgets that holds the style sheet of a name."""
    return f'div:has(>div>[data-dh2sim="{name}"])'


def lines(pairs: Iterable[tuple[str, str]], *, name: str = "") -> str:
    """Return lines of names and values, both HTML."""
    body = "".join(
        f'<tr><td style="{_CELL};opacity:0.65">{key}</td><td style="{_CELL}">{value}</td></tr>'
        for key, value in pairs
    )
    return (
        f'<div data-dh2sim="{escape(name)}" style="overflow-x:auto;padding:0.3em 0.6em;{_MONO}">'
        f'<table style="border-collapse:collapse">{body}</table></div>'
    )


def note(content: str, *, error: bool = False, name: str = "") -> str:
    """Return a line of text, given as HTML; an empty element without text."""
    if not content:
        return f'<div data-dh2sim="{escape(name)}"></div>'
    color = "#b42318" if error else "inherit"
    style = f"padding:0.3em 0.8em;font-size:0.82em;line-height:1.35;color:{color};overflow-wrap:anywhere"
    return f'<div data-dh2sim="{escape(name)}" style="{style}">{content}</div>'
