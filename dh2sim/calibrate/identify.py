"""Which parameters measurements determine: a basis of the identifiable ones, and what the others fold into."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from dh2sim.calibrate.parameters import Group, Parameter
from dh2sim.typing import Array

DEPENDENT: Final = 1e-8
"""Of a column's length: what is left of it, when others are taken off, that counts as nothing."""
_CLEAR: Final = 0.1
"""What is left of a column that is clearly another one."""
_GUESS: Final = 0.03
"""m or rad: what is known no better is not determined. A tool that noise has moved off the last axis by 0.01 mm makes
twists and zeros of the last joints independent, to a fraction of a turn; a fit would go astray."""
_PART: Final = 0.02
"""Of the greatest share, from which on a parameter is named among those that another one folds into."""
_ORDER: Final = (None, Group.BASE, Group.TOOL, Group.A, Group.ALPHA, Group.BETA, Group.D, Group.THETA)
"""What is determined first: placements of base and tool take the constants of the table that do the same."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Basis:
    """Parameters that are determined independently of each other, and what the others do the same as."""

    kept: tuple[int, ...]
    """Columns, ascending."""
    folded: dict[int, tuple[int, ...]]
    """The columns that do the same as another one does, by that one's column; none for what does nothing."""
    condition: float
    """Greatest by least singular value of the kept columns, each scaled to length one."""


def find_basis(
    J: Array, unknowns: Sequence[Parameter], columns: Sequence[int], *, scale: float | None = None
) -> Basis:
    """Choose independent columns of a Jacobian: those of the measurement, of base and tool, then of the table.

    A QR factorisation with pivoting that takes the first column of which enough is left, in place of the greatest;
    what counts as enough decreases by powers of ten.

    Args:
        J: Weighted derivatives, shape (E, U).
        unknowns: What its columns are.
        columns: Those that may be chosen.
        scale: What makes of derivatives such in standard deviations; given, what is known no better than to 0.03 m or
            rad when those before it are known is not chosen.
    """
    order = sorted(columns, key=lambda k: (_ORDER.index(unknowns[k].group), k))
    length = np.linalg.norm(J[:, order], axis=0)
    greatest = float(length.max(initial=0.0))
    present = [k for k, size in zip(order, length.tolist(), strict=True) if size > 1e-12 * greatest]
    # the triangle of a QR factorisation has all scalar products of the columns
    scaled = J[:, present] / np.linalg.norm(J[:, present], axis=0) if present else np.zeros((len(J), 0))
    least = (
        np.zeros(len(present)) if scale is None else 1.0 / (_GUESS * scale * np.linalg.norm(J[:, present], axis=0))
    )
    triangle: Array = np.asarray(np.linalg.qr(scaled)[1]) if len(J) > len(present) else scaled
    kept: list[int] = []
    rest = triangle.copy()
    limit = _CLEAR
    while limit >= DEPENDENT:  # who is first comes first, but not before others that are determined much better
        for k in range(len(present)):
            if k not in kept and np.linalg.norm(rest[:, k]) > max(limit, least[k]):
                kept.append(k)
                direction = rest[:, k] / np.linalg.norm(rest[:, k])
                for _ in range(2):  # twice is enough (W. Kahan)
                    rest = rest - np.outer(direction, direction @ rest)
        limit *= 0.1
    singular = np.linalg.svd(triangle[:, kept], compute_uv=False) if kept else np.ones(1)
    folded: dict[int, tuple[int, ...]] = {k: () for k in order if k not in present}
    left_out = [k for k in range(len(present)) if k not in kept]
    if left_out:
        shares = np.abs(np.linalg.lstsq(triangle[:, kept], triangle[:, left_out], rcond=None)[0])
        for k, share in zip(left_out, shares.T, strict=True):
            into = np.flatnonzero(share > _PART * share.max(initial=0.0))
            folded[present[k]] = tuple(present[kept[j]] for j in into.tolist())
    return Basis(
        kept=tuple(sorted(present[k] for k in kept)),
        folded=dict(sorted(folded.items())),
        condition=float(singular[0] / singular[-1]),
    )
