"""The misprints that docs/misprints.md lists: the printed entry is wrong, and the right one right."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np
import pytest

from dh2sim.kinematics.table_oracle import table_frame_poses
from dh2sim.typing import Array
from tests.sample_robots import robot

from .samples import random_configurations


class Misprint(NamedTuple):
    """An entry of T_dh(first - 1)_dh(last), as a document prints it and as it must be."""

    robot: str
    first: int
    last: int
    row: int
    column: int
    printed: str
    right: str


MISPRINTS: Final = {
    "PUMA 560, r11": Misprint(
        "puma560",
        1,
        6,
        1,
        1,
        "c1*(c23*(c4*c5*c6 - s4*s5) - s23*s5*c5) + s1*(s4*c5*c6 + c4*s6)",
        "c1*(c23*(c4*c5*c6 - s4*s6) - s23*s5*c6) + s1*(s4*c5*c6 + c4*s6)",
    ),
    "planar arm, entry (2, 4) of A1": Misprint("planar_2r", 1, 1, 2, 4, "a1*c1", "a1*s1"),
    "planar arm, entry (2, 4) of A2": Misprint("planar_2r", 2, 2, 2, 4, "a2*c2", "a2*s2"),
    "wrist, r12": Misprint("stanford", 4, 6, 1, 2, "-c4*c5*s6 - s5*c6", "-c4*c5*s6 - s4*c6"),
    "Stanford arm, r11": Misprint(
        "stanford_shoulder_origin",
        1,
        6,
        1,
        1,
        "c1*(c2*(c4*c5*c6 - s4*c6) - s2*s5*c6) - s1*(s4*c5*c6 + c4*s6)",
        "c1*(c2*(c4*c5*c6 - s4*s6) - s2*s5*c6) - s1*(s4*c5*c6 + c4*s6)",
    ),
    "Stanford arm, r21": Misprint(
        "stanford_shoulder_origin",
        1,
        6,
        2,
        1,
        "s1*(c2*(c4*c5*c6 - s4*c6) - s2*s5*c6) + c1*(s4*c5*c6 + c4*s6)",
        "s1*(c2*(c4*c5*c6 - s4*s6) - s2*s5*c6) + c1*(s4*c5*c6 + c4*s6)",
    ),
    "Stanford arm, r12": Misprint(
        "stanford_shoulder_origin",
        1,
        6,
        1,
        2,
        "c1*(-c2*(c4*c5*s6 + s4*c6) + s2*s5*s6) - s1*(-s4*c5*c6 + c4*s6)",
        "c1*(-c2*(c4*c5*s6 + s4*c6) + s2*s5*s6) - s1*(-s4*c5*s6 + c4*c6)",
    ),
    "Stanford arm, r22": Misprint(
        "stanford_shoulder_origin",
        1,
        6,
        2,
        2,
        "s1*(-c2*(c4*c5*s6 + s4*c6) + s2*s5*s6) + c1*(-s4*c5*c6 + c4*s6)",
        "s1*(-c2*(c4*c5*s6 + s4*c6) + s2*s5*s6) + c1*(-s4*c5*s6 + c4*c6)",
    ),
    "Stanford arm, r32": Misprint(
        "stanford_shoulder_origin",
        1,
        6,
        3,
        2,
        "s2*(c4*c5*c6 + s4*s6) + c2*s5*c6",
        "s2*(c4*c5*s6 + s4*c6) + c2*s5*s6",
    ),
    "cylindrical arm with wrist, r12": Misprint(
        "cylindrical_wrist", 1, 6, 1, 2, "unreadable", "-c1*c4*c5*s6 - c1*s4*c6 - s1*s5*s6"
    ),
    "cylindrical arm with wrist, r13": Misprint("cylindrical_wrist", 1, 6, 1, 3, "unreadable", "c1*c4*s5 - s1*c5"),
    "cylindrical arm with wrist, r22": Misprint(
        "cylindrical_wrist", 1, 6, 2, 2, "unreadable", "-s1*c4*c5*s6 - s1*s4*c6 + c1*s5*s6"
    ),
    "cylindrical arm with wrist, r23": Misprint("cylindrical_wrist", 1, 6, 2, 3, "unreadable", "s1*c4*s5 + c1*c5"),
    "cylindrical arm with wrist, r32": Misprint("cylindrical_wrist", 1, 6, 3, 2, "unreadable", "s4*c5*s6 - c4*c6"),
}


def symbols(name: str, q: Array) -> Mapping[str, Array | float]:
    """Return s1, c1, … for the coordinates of shape (count, n), s23, c23 and the robot's parameters."""
    values: dict[str, Array | float] = dict(robot(name).parameters)
    for number, coordinate in enumerate(q.T, start=1):
        values |= {f"s{number}": np.sin(coordinate), f"c{number}": np.cos(coordinate)}
    if q.shape[1] > 2:
        values |= {"s23": np.sin(q[:, 1] + q[:, 2]), "c23": np.cos(q[:, 1] + q[:, 2])}
    return values


def entry_of_the_product(misprint: Misprint, q: Array) -> Array:
    poses = table_frame_poses(robot(misprint.robot), q)
    relative = np.linalg.solve(poses[:, misprint.first - 1], poses[:, misprint.last])
    return np.asarray(relative[:, misprint.row - 1, misprint.column - 1])


def largest_difference(expression: str, misprint: Misprint) -> float:
    q = random_configurations(robot(misprint.robot), seed=31)
    value = eval(expression, {}, symbols(misprint.robot, q))
    return float(np.max(np.abs(value - entry_of_the_product(misprint, q))))


@pytest.mark.parametrize("place", MISPRINTS)
def test_right_entry_is_that_of_the_product(place: str) -> None:
    assert largest_difference(MISPRINTS[place].right, MISPRINTS[place]) < 1e-12


@pytest.mark.parametrize("place", [place for place, m in MISPRINTS.items() if m.printed != "unreadable"])
def test_printed_entry_is_not_that_of_the_product(place: str) -> None:
    assert largest_difference(MISPRINTS[place].printed, MISPRINTS[place]) > 0.1


def test_second_column_of_the_printed_wrist_is_too_long() -> None:
    """The example of the first check in docs/misprints.md."""
    q = np.array([0.3, 0.5, 0.7])
    s4, s5, s6 = np.sin(q)
    c4, c5, c6 = np.cos(q)
    below = [-s4 * c5 * s6 + c4 * c6, s5 * s6]
    printed, right = [-c4 * c5 * s6 - s5 * c6, *below], [-c4 * c5 * s6 - s4 * c6, *below]
    assert [f"{x:.3f}" for x in printed] == ["-0.907", "0.564", "0.309"]
    assert f"{np.linalg.norm(printed):.2f}" == "1.11"
    assert f"{right[0]:.3f}" == "-0.766"
    assert abs(np.linalg.norm(right) - 1) < 1e-15
