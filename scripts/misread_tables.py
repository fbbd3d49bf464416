"""Misread 10 000 right tables, and write 10 000 others in another way: is each called what it is?

    python scripts/misread_tables.py [--from SEED] [--count N]

A misreading is named if it is among those that ``diff`` finds, same rows and columns; some change nothing of the
mechanism, which is checked with the equation of ``diff`` on the textbook's matrices. Exits with 1 if one is wrong.
docs/compare.md has the figures.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from dh2sim.compare.comparison import diff
from tests.compare.disguises import disguised, equation_error, random_table
from tests.compare.misread_tables import KINDS, misread


def main() -> int:
    """Try the tables of a range of seeds, and print how many were called what they are."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--from", dest="first", type=int, default=0, help="first seed")
    parser.add_argument("--count", type=int, default=10_000, help="how many seeds")
    options = parser.parse_args()
    counts: Counter[tuple[str, str]] = Counter()
    for seed in range(options.first, options.first + options.count):
        kind = KINDS[seed % len(KINDS)]
        counts[kind, _called(seed)] += 1
        counts["written otherwise", _recognised(seed)] += 1
    outcomes = ("named", "named, with others", "same mechanism", "wrong")
    print(f"{'':18}{''.join(f'{outcome:>20}' for outcome in outcomes)}")
    for kind in (*KINDS, "written otherwise"):
        print(f"{kind:18}{''.join(f'{counts[kind, outcome]:>20}' for outcome in outcomes)}")
    return int(any(counts[kind, "wrong"] for kind in (*KINDS, "written otherwise")))


def _called(seed: int) -> str:
    made = misread(seed)
    found = diff(made.right, made.wrong)
    if found.equivalence is not None:
        fine = equation_error(made.right, made.wrong, found.equivalence) < 1e-3 * max(1.0, made.size)
        return "same mechanism" if fine else _wrong(seed, "called the same")
    names = [(misreading.kind, misreading.rows, misreading.columns) for misreading in found.misreadings]
    if (made.kind, made.rows, made.columns) not in names:
        return _wrong(seed, f"{made.kind.value} {made.rows} {made.columns} is called {names}")
    return "named" if len(names) == 1 else "named, with others"


def _recognised(seed: int) -> str:
    rng = np.random.default_rng([seed, 1])
    table = random_table(rng, int(rng.integers(1, 8)), odd=seed % 2 == 0)
    other = disguised(table, rng)
    same = diff(table, other).equivalence
    if same is None:
        return _wrong(seed, "not recognised when written otherwise")
    return (
        "same mechanism" if equation_error(table, other, same) < 1e-9 else _wrong(seed, "the equation does not hold")
    )


def _wrong(seed: int, what: str) -> str:
    print(f"seed {seed}: {what}", file=sys.stderr)
    return "wrong"


if __name__ == "__main__":
    sys.exit(main())
