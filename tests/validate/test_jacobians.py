from __future__ import annotations

import math

import numpy as np
import pytest

from dh2sim.kinematics.chain import build_chain
from dh2sim.robot.row import JointType
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from dh2sim.validate.kinematics import LibraryEngine, check_jacobian, check_poses, table_jacobian
from dh2sim.validate.report import Check
from tests.sample_robots import row

A1, A2 = 1.0, 0.7
PLANAR = RobotSpec(name="planar", rows=(row("one", a=A1), row("two", a=A2)))


def _by_hand(q1: float, q2: float) -> Array:
    """x = a1 cos q1 + a2 cos (q1 + q2), y likewise with sines, differentiated on paper."""
    s1, c1, s12, c12 = math.sin(q1), math.cos(q1), math.sin(q1 + q2), math.cos(q1 + q2)
    return np.array(
        [
            [-A1 * s1 - A2 * s12, -A2 * s12],
            [A1 * c1 + A2 * c12, A2 * c12],
            [0, 0],
            [0, 0],
            [0, 0],
            [1, 1],
        ]
    )


def test_differences_of_the_table_equal_the_planar_arms_jacobian_derived_by_hand() -> None:
    q = np.random.default_rng(0).uniform(-3, 3, (50, 2))
    expected = np.array([_by_hand(q1, q2) for q1, q2 in q.tolist()])
    np.testing.assert_allclose(table_jacobian(PLANAR, q), expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize(("flip", "sign"), [(False, 1.0), (True, -1.0)])
def test_a_slide_moves_along_its_axis_and_turns_nothing(flip: bool, sign: float) -> None:
    spec = RobotSpec(name="slide", rows=(row("slide", "prismatic", alpha=0.5, flip=flip),))
    assert spec.rows[0].type is JointType.PRISMATIC
    expected = np.array([[[0.0], [0.0], [sign], [0.0], [0.0], [0.0]]])
    np.testing.assert_allclose(table_jacobian(spec, np.array([[0.3]])), expected, rtol=0, atol=1e-10)


def _check(error: Array) -> Check:
    """Check the library's Jacobian against its own, with an error added."""
    engine = LibraryEngine(build_chain(PLANAR))
    q = np.array([[0.1, 0.2], [0.3, 0.4]])
    return check_jacobian(engine, engine.jacobian(q) + error, q, 1e-12, 2.0, ["one", "two"])


@pytest.mark.parametrize("value", [1e-11, -1e-11, math.nan, math.inf])
@pytest.mark.parametrize(("sample", "entry", "joint"), [(0, 0, 0), (1, 5, 1), (1, 2, 0)])
def test_any_entry_that_is_off_or_no_number_fails_and_is_named(
    value: float, sample: int, entry: int, joint: int
) -> None:
    error = np.zeros((2, 6, 2))
    error[sample, entry, joint] = value
    check = _check(error)
    assert check.ok is False
    assert check.worst is not None
    assert (check.worst.where, check.worst.sample) == (["one", "two"][joint], sample)


def test_linear_entries_count_as_a_share_of_the_reach() -> None:
    error = np.zeros((2, 6, 2))
    error[:, :3], error[:, 3:] = 1.9e-12, 0.9e-12
    check = _check(error)
    assert check.ok is True
    assert check.max_error == pytest.approx(0.95e-12, rel=1e-3)


class Astray(LibraryEngine):
    """The library, with an error in one entry of one pose."""

    def __init__(self, spec: RobotSpec, place: tuple[int, ...], error: float) -> None:
        super().__init__(build_chain(spec))
        self._place, self._error = place, error

    def frame_poses(self, q: Array) -> Array:
        poses = super().frame_poses(q)
        poses[self._place] += self._error
        return poses


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e-6])
@pytest.mark.parametrize("place", [(0, 0, 0, 3), (2, 1, 1, 1), (1, 2, 2, 0)])
def test_a_pose_that_is_off_or_no_number_fails_and_is_named(value: float, place: tuple[int, ...]) -> None:
    spec, q = RobotSpec(name="still", rows=(row("still", "fixed", a=0.3),)), np.zeros((3, 0))
    assert check_poses(Astray(spec, place, 0.0), spec, q, 1e-12, 1.0).ok is True
    check = check_poses(Astray(spec, place, value), spec, q, 1e-12, 1.0)
    assert check.ok is False
    assert check.worst is not None
    assert (check.worst.sample, check.worst.where) == (place[0], ("dh_0", "dh_1", "tool0")[place[1]])
