"""Notation to plain characters: LaTeX, Markdown, HTML and Unicode become plain arithmetic."""

from __future__ import annotations

import functools
import html
import re
import unicodedata
from collections.abc import Callable
from typing import Final, TypeAlias

LONGEST_CELL: Final = 400
"""Characters of a cell that are read; no number is longer."""

_BEFORE: Final = str.maketrans(
    {
        "º": "°", "˚": "°", "∘": "°", "½": "(1/2)", "¼": "(1/4)", "¾": "(3/4)",
        "⁰": "**0", "¹": "**1", "²": "**2", "³": "**3", "⁴": "**4",
        "\u200b": "", "\u200c": "", "\u200d": "", "\ufeff": "", "\u2060": "",
    }
)  # fmt: skip
"""Characters that compatibility normalisation would turn into something else."""
_AFTER: Final = str.maketrans(
    {
        "−": "-", "–": "-", "‒": "-", "—": "-", "―": "-", "‐": "-", "‑": "-",
        "×": "*", "·": "*", "∙": "*", "⋅": "*", "∗": "*", "⋆": "*", "★": "*", "÷": "/", "∕": "/", "⁄": "/",
        "π": "pi", "ϖ": "pi", "θ": "theta", "ϑ": "theta", "Θ": "theta", "α": "alpha", "⍺": "alpha", "ɑ": "alpha",
        "Ɵ": "theta", "ɵ": "theta", "Ө": "theta", "ө": "theta", "Ѳ": "theta", "ѳ": "theta",
        "φ": "phi", "Φ": "phi", "ψ": "psi", "Ψ": "psi", "γ": "gamma", "Γ": "gamma", "δ": "delta", "Δ": "delta",
        "ε": "epsilon", "λ": "lambda", "ω": "omega", "μ": "mu", "ρ": "rho", "τ": "tau",
        "β": "beta", "σ": "sigma", "ς": "sigma", "√": "sqrt",
    }
)  # fmt: skip

_Change: TypeAlias = tuple[re.Pattern[str], str | Callable[[re.Match[str]], str]]
_HTML: Final[tuple[_Change, ...]] = (
    (re.compile(r"<sup>\s*(?:o|0|°|&deg;)\s*</sup>", re.IGNORECASE), "°"),
    (re.compile(r"<sup>\s*\*\s*</sup>", re.IGNORECASE), "*"),
    (re.compile(r"<sub>([^<>]*)</sub>", re.IGNORECASE), r"_\1"),
    (re.compile(r"</?(?:b|i|em|strong|code|span|br|sup|p|tt|var)\b[^<>]*>", re.IGNORECASE), " "),
)
_LATEX: Final[tuple[_Change, ...]] = (
    (re.compile(r"\$|\\[()\[\]]"), ""),
    (re.compile(r"~"), " "),
    (re.compile(r"\\ang\s*\{([^{}]*)\}"), r"\1°"),
    (re.compile(r"\\milli\s*\\met(?:re|er)\s*|\\mm(?![A-Za-z])"), "mm"),
    (re.compile(r"\\centi\s*\\met(?:re|er)\s*|\\cm(?![A-Za-z])"), "cm"),
    (re.compile(r"\\met(?:re|er)(?![A-Za-z])"), "m"),
    (re.compile(r"\\radians?(?![A-Za-z])"), "rad"),
    (re.compile(r"\\(?:SI|qty)\s*\{([^{}]*)\}\s*\{([^{}]*)\}"), r"\1 \2"),
    (re.compile(r"\\(?:si|unit|num|ensuremath|bm|boldsymbol|mathsf|emph|textsuperscript)(?![A-Za-z])"), ""),
    (re.compile(r"\\([_*|#%&])"), r"\1"),
    (re.compile(r"\\(?:mathrm|mathbf|mathit|textbf|textit|text|operatorname|rm|bf)(?![A-Za-z])"), ""),
    (re.compile(r"\\(?:left|right|quad|qquad|[,;:! ])(?![A-Za-z])|\\[,;:! ]"), " "),
    (re.compile(r"\^\s*\{?\s*(?:\\circ|°|o\b)\s*\}?|\\(?:circ|degree|textdegree)(?![A-Za-z])"), "°"),
    (re.compile(r"\^\s*\{?\s*(?:\\ast|\\star|\*)\s*\}?|\\(?:ast|star)(?![A-Za-z])"), "*"),
    (re.compile(r"\\(?:cdot|times)(?![A-Za-z])"), "*"),
    (re.compile(r"\\pm(?![A-Za-z])"), "±"),
    (re.compile(r"\\l?dots(?![A-Za-z])"), "..."),
    (re.compile(r"\\var(theta|phi|epsilon)"), r"\\\1"),
    (
        re.compile(
            r"\\(theta|alpha|beta|sigma|pi|phi|psi|gamma|delta|epsilon|lambda|omega|mu|rho|tau)(?![A-Za-z])", re.I
        ),
        r"\1",
    ),
    (re.compile(r"\\?(?<![A-Za-z])(sin|cos|tan)\s*\^\s*\{?\s*-\s*1\s*\}?"), r"a\1"),
    (re.compile(r"\\?(?<![A-Za-z])arc(sin|cos|tan2?)(?![A-Za-z0-9])"), r"a\1"),
    (re.compile(r"\\?(?<![A-Za-z])arctg(?![A-Za-z0-9])"), "atan"),
    (re.compile(r"\\(sqrt|a?sin|a?cos|a?tan2?)(?![A-Za-z])"), r"\1"),
)
_FRACTION: Final = re.compile(r"\\[dt]?frac\s*(?:\{([^{}]*)\}|(pi|\d))\s*(?:\{([^{}]*)\}|(\d))")
_NESTED: Final[tuple[_Change, ...]] = (
    (re.compile(r"_\{([^{}]*)\}"), r"_\1"),
    (re.compile(r"\^\s*(?:\{([^{}]*)\}|(\d+(?:\.\d+)?))"), lambda found: f"**({found[1] or found[2]})"),
    (re.compile(r"(?<![A-Za-z])(sqrt|a?sin|a?cos|a?tan2?)\s*\{([^{}]*)\}"), r"\1(\2)"),
    (_FRACTION, lambda found: f"(({found[1] or found[2] or ''})/({found[3] or found[4] or ''}))"),
)
"""Changes inside braces, innermost first."""
_DEEPEST: Final = 8
_ROOTS: Final[tuple[_Change, ...]] = (
    (re.compile(r"√\s*(\d+(?:[.,]\d+)?|[A-Za-z]\w*)"), r"sqrt(\1)"),
    (re.compile(r"(?<![A-Za-z])(sin|cos|tan)\s*⁻¹"), r"a\1"),
)
_EMPHASIS: Final[tuple[_Change, ...]] = (
    (re.compile(r"`+([^`]*)`+"), r"\1"),
    (re.compile(r"(?<![\w)])\*\*(?=\S)(.+?)(?<=\S)\*\*(?![\w(*])"), r"\1"),
    (re.compile(r"(?<!\w)__(?=\S)(.+?)(?<=\S)__(?!\w)"), r"\1"),
    (re.compile(r"^\*(?=[^\s*])([^*]*[^\s*])\*$"), r"\1"),
)


@functools.lru_cache(maxsize=4096)
def plain(text: str) -> str:
    r"""Return a heading, a cell or a line in plain characters.

    Greek letters get their names (``θ₁``, ``$\theta_{1}$`` and ``&theta;<sub>1</sub>`` become ``theta1`` or
    ``theta_1``), every dash becomes ``-``, every sign for times ``*``, fractions become divisions, emphasis goes.
    A star that marks a variable and the degree sign stay.

    Args:
        text: As written; what is longer than a cell can be is cut off.
    """
    text = _changed(html.unescape(_changed(text[:LONGEST_CELL], _HTML)), _ROOTS).translate(_BEFORE)
    text = unicodedata.normalize("NFKC", text).translate(_AFTER)
    text = _changed(text, _EMPHASIS[:3])
    text = _changed(text, _LATEX)
    for _ in range(_DEEPEST):
        before, text = text, _changed(text, _NESTED)
        if text == before:
            break
    text = text.replace("{", "").replace("}", "").strip()
    return " ".join(_changed(text, _EMPHASIS[3:]).split())


def _changed(text: str, changes: tuple[_Change, ...]) -> str:
    for pattern, replacement in changes:
        text = pattern.sub(replacement, text)
    return text
