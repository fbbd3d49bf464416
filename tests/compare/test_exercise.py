"""Random arms for exercises."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dh2sim.compare.exercise import LEVELS, make_exercise
from dh2sim.compare.grading import grade
from dh2sim.errors import Dh2simError
from dh2sim.kinematics.forward import frame_pose, geometric_jacobian
from dh2sim.robot.write import robot_file_text
from tests.compare.disguises import disguised
from tests.program import dh2sim
from tests.refusals import refusal


@pytest.mark.parametrize("level", LEVELS)
def test_the_solution_has_the_axes_of_the_text_and_full_points_however_it_is_cut(level: int, tmp_path: Path) -> None:
    made = make_exercise(7, level)
    q = np.zeros(len(made.joints))
    J = geometric_jacobian(made.solution, q)
    tip = frame_pose(made.solution, "tool0", q)[:3, 3]
    np.testing.assert_allclose(tip, made.tool, atol=1e-9)
    for joint, column in zip(made.joints, J.T, strict=True):
        z = np.array(joint.direction) / np.linalg.norm(joint.direction)
        wanted = [*np.cross(z, tip - joint.point), *z] if joint.turns else [*z, 0, 0, 0]
        np.testing.assert_allclose(column, wanted, atol=1e-9)
    own, recut = tmp_path / "own.yaml", tmp_path / "recut.yaml"
    own.write_text(made.solution_text, encoding="utf-8")
    recut.write_text(robot_file_text(disguised(made.solution, np.random.default_rng(level))), encoding="utf-8")
    assert [given.points for given in grade(own, [own, recut])] == [10, 10]


@pytest.mark.parametrize("level", LEVELS)
def test_every_level_makes_arms_of_its_kind(level: int) -> None:
    for seed in range(6):
        made = make_exercise(seed, level)
        slides = sum(not joint.turns for joint in made.joints)
        assert slides == (1 if level == 2 else 0)
        assert max(map(len, made.text("arm.svg").splitlines())) <= 80
        assert len(made.joints) in {1: (2, 3), 2: (3, 4), 3: (4, 5), 4: (6,)}[level]


def test_the_command_writes_the_same_bytes_for_the_same_seed(tmp_path: Path) -> None:
    written = []
    for name in ("one", "two"):
        run = dh2sim("exercise", "--seed", "7", "--level", "2", "-o", tmp_path / name)
        assert (run.status, run.err) == (0, "")
        written.append({path.name: path.read_bytes() for path in sorted((tmp_path / name).iterdir())})
    assert written[0] == written[1]
    assert list(written[0]) == ["arm.svg", "exercise.md", "solution.yaml"]
    text = written[0]["exercise.md"].decode()
    assert dh2sim("exercise", "--seed", "7", "--level", "2").out == text.replace(
        "![The arm at coordinates zero](arm.svg)\n\n", ""
    )
    assert max(map(len, text.splitlines())) <= 100
    again = dh2sim("exercise", "--seed", "8", "-o", tmp_path / "one")
    assert (again.status, again.out) == (2, "")
    assert "already exists" in again.err


def test_seeds_and_levels_that_are_not_allowed_are_refused() -> None:
    assert refusal(Dh2simError, make_exercise, -1, 1) == "seed must be a whole number from 0 to 2**63 - 1, got -1"
    assert refusal(Dh2simError, make_exercise, 0, 5) == "level must be a whole number from 1 to 4, got 5"
    assert dh2sim("exercise", "--level", "9").status == 2
