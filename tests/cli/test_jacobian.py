from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from dh2sim import build_chain, geometric_jacobian, load_robot
from dh2sim.kinematics.forward import frame_names
from tests.program import Outcome, dh2sim

STANFORD = build_chain(load_robot("stanford"))
Q = [0.3, -0.7, 0.5, 1.1, 0.6, -0.4]


@pytest.mark.parametrize("frame", frame_names(STANFORD))
def test_json_holds_the_jacobian_of_any_frame(frame: str) -> None:
    run = dh2sim("jacobian", "stanford", "--radians", *map(str, Q), "--frame", frame, "--json")
    assert (run.status, run.err) == (0, "")
    found = json.loads(run.out)
    J = geometric_jacobian(STANFORD, Q, frame=frame)
    assert [found[key] for key in ("robot", "frame", "q", "jacobian")] == ["stanford", frame, Q, J.tolist()]
    assert found["joints"] == [f"joint_{i}" for i in range(1, 7)]
    assert found["rank"] == np.linalg.matrix_rank(J)
    assert len(found["singular_values"]) == 6
    np.testing.assert_allclose(found["manipulability"], abs(np.linalg.det(J)), rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(J @ np.array(found["still_motions"]).T.reshape(6, -1), 0, atol=1e-14)
    np.testing.assert_allclose(J.T @ np.array(found["lost_directions"]).T.reshape(6, -1), 0, atol=1e-14)


def test_a_person_reads_rows_columns_and_units_and_what_is_lost() -> None:
    assert dh2sim("jacobian", "rpr", "90", "0.3", "0") == Outcome(
        status=0,
        out="""\
rpr: Jacobian of tool0 in base_link
q           90 deg, 0.3 m, 0 deg
               joint_1   joint_2    joint_3
             per rad/s   per m/s  per rad/s
  vx, m/s     0.000000  1.000000   0.000000
  vy, m/s     0.500000  0.000000   0.000000
  vz, m/s     0.000000  0.000000   0.000000
  wx, rad/s   0.000000  0.000000   1.000000
  wy, rad/s   0.000000  0.000000   0.000000
  wz, rad/s   1.000000  0.000000   0.000000
singular values  1.11803 1 1
manipulability   1.11803  (product of the singular values)
rank             3 of 3
""",
        err="",
    )


def test_a_straight_wrist_is_singular() -> None:
    out = dh2sim("jacobian", "stanford", "17", "-40", "0.5", "63", "0", "-23").out
    lines = out.splitlines()
    assert "rank             5 of 6: singular" in lines
    motions = lines.index("joint motions that leave tool0 still, rad/s and m/s:")
    assert lines[motions + 1] in ("  1 joint_4 - 1 joint_6", "  -1 joint_4 + 1 joint_6")
    assert lines[motions + 2] == "velocities that tool0 cannot have, m/s and rad/s:"


def test_a_redundant_robot_has_self_motions_and_loses_nothing() -> None:
    out = dh2sim("jacobian", "ssrms").out
    assert "rank             6 of 6\nself-motions, rad/s:\n  " in out
    assert "cannot" not in out


def test_a_robot_that_does_not_move_has_an_empty_jacobian(tmp_path: Path) -> None:
    robot = tmp_path / "still.yaml"
    robot.write_text("name: still\nconvention: standard\njoints: [{type: fixed}]\n", encoding="utf-8")
    run = dh2sim("jacobian", robot)
    assert (run.status, run.err) == (0, "")
    assert "singular values  none" in run.out
    assert json.loads(dh2sim("jacobian", robot, "--json").out)["jacobian"] == [[]] * 6


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--frame toll0", "unknown frame 'toll0'. Did you mean 'tool0'?"),
        ("1 2", "stanford has 6 joint coordinates, got 2: joint_1 (deg)"),
    ],
)
def test_what_is_wrong_is_reported(arguments: str, message: str) -> None:
    run = dh2sim("jacobian", "stanford", *arguments.split())
    assert (run.status, run.out) == (2, "")
    assert run.err.startswith(f"dh2sim: {message}")
