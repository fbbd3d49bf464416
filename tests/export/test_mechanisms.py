"""Mechanisms are exported: the tree's poses are the tables', and MuJoCo's loops are ours."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from dh2sim.engines.mujoco_mechanism import MujocoMechanism
from dh2sim.export import ALL_FORMATS, Format, drift, export_robot, losses
from dh2sim.kinematics.loop_closure import FREEDOMS
from dh2sim.kinematics.table_oracle import table_mechanism_frames
from dh2sim.kinematics.tree import build_tree, tree_frames
from dh2sim.model.mechanism import MechanismModel, build_mechanism
from dh2sim.robot.mechanism import ClosureType
from dh2sim.robot.read import load_robot, parse_robot
from tests.program import dh2sim

TWO_CHAINS = """\
name: two_chains
convention: standard
base: {{xyz: [0.1, -0.2, 0.3], rpy: [0.2, -0.4, 1.1]}}
joints:
  - {{type: revolute, a: 0.3, alpha: 0.651, d: 0.1, theta: 0.2}}
  - {{type: prismatic, convention: modified, a: 0.2, alpha: -0.7, theta: 0.4, flip: true}}
  - {{type: revolute, a: 0.25, alpha: 0.4, d: 0.2, flip: true}}
branches:
  side:
    from: dh_1
    pose: {{xyz: [0.1, 0.2, -0.1], rpy: [0.7, 0.3, -0.2]}}
    joints:
      - {{type: revolute, a: 0.4, alpha: -0.651}}
      - {{type: revolute, a: 0.2, alpha: 0.9, d: 0.1}}
      - {{type: revolute, convention: modified, a: 0.3, alpha: 0.3, d: -0.1}}
      - {{type: revolute, alpha: 0.8, a: 0.1}}
      - {{type: revolute, alpha: -0.5, d: 0.1}}
closures:
  - {{name: pin, between: [dh_3, side/dh_5], type: {kind}}}
actuated: [joint_1]
"""


def _model(name: str) -> MechanismModel:
    return build_mechanism(load_robot(name) if name == "four_bar" else parse_robot(TWO_CHAINS.format(kind=name)))


KINDS = ["four_bar", *(kind.value for kind in ClosureType)]


@pytest.mark.parametrize("name", KINDS)
def test_a_mechanism_is_exported_and_verified(name: str, tmp_path: Path) -> None:
    """Poses within rounding, loops closed at home, and as many freedoms left as ours."""
    model = _model(name)
    report = export_robot(model, tmp_path)
    assert [check.format for check in report.verified] == list(ALL_FORMATS)
    for check in report.verified:
        assert max(check.position_error, check.rotation_error) < 2e-14
    engine = MujocoMechanism(tmp_path / model.name / f"{model.name}.xml")
    gap, freedoms = engine.loops_at_home()
    assert gap < 1e-12
    if name != "four_bar":  # odd twists: no constraint is redundant
        assert freedoms == model.tree.n - 6 + FREEDOMS[ClosureType(name)]
    assert drift(model, tmp_path) == []
    mujoco.MjModel.from_xml_path(str(tmp_path / model.name / "scene.xml"))


def _ends(model: Any) -> tuple[Any, Any]:
    data = mujoco.MjData(model)
    return data, [model.site("dh_2").id, model.site("rocker/dh_1").id]


def test_a_four_bar_stays_closed_in_motion(tmp_path: Path) -> None:
    """The distance of the two ends by the sites' poses, with the crank driven to and fro; and it holds at home."""
    model = _model("four_bar")
    export_robot(model, tmp_path, formats=[Format.MJCF])
    path = tmp_path / "four_bar" / "four_bar.xml"
    compiled = mujoco.MjModel.from_xml_path(str(path))
    data, (a, b) = _ends(compiled)
    assert data.qpos.tolist() == pytest.approx(model.q.tolist(), abs=0)
    mujoco.mj_resetDataKeyframe(compiled, data, 0)
    home, worst = data.ctrl.copy(), 0.0
    while data.time < 1.0:
        data.ctrl[:] = home + 0.5 * np.sin(2 * np.pi * data.time)
        mujoco.mj_step(compiled, data)
        worst = max(worst, float(np.linalg.norm(data.site_xpos[a] - data.site_xpos[b])))
    assert worst < 1e-3 * model.size
    assert MujocoMechanism(path).gap_in_motion(0.5) < 1e-3 * model.size


@pytest.mark.parametrize("gravity", ["[0, -9.81, 0]", "[3, -4, 1]"])
def test_the_keyframes_control_holds_the_loop_at_home(gravity: str, tmp_path: Path) -> None:
    source = load_robot("four_bar").source_file
    assert source is not None
    text = source.text.replace("joints:\n", f"gravity: {gravity}\njoints:\n", 1)
    model = build_mechanism(parse_robot(text))
    export_robot(model, tmp_path, formats=[Format.MJCF])
    compiled = mujoco.MjModel.from_xml_path(str(tmp_path / "four_bar" / "four_bar.xml"))
    data, _ = _ends(compiled)
    mujoco.mj_resetDataKeyframe(compiled, data, 0)
    assert abs(data.ctrl[0] - model.q[0]) > 1e-6
    for _ in range(1000):
        mujoco.mj_step(compiled, data)
    assert np.abs(data.qpos - model.q).max() < 1e-3


def test_the_tables_frames_are_those_of_the_tree() -> None:
    spec = parse_robot(TWO_CHAINS.format(kind="spherical"))
    q = np.random.default_rng(5).uniform(-1, 1, len(spec.moving_rows))
    ours, table = tree_frames(build_tree(spec), q), table_mechanism_frames(spec, q)
    assert {"dh_3", "tool0", "side/dh_0", "side/dh_5"} <= set(table)
    assert max(np.abs(ours[name] - table[name]).max() for name in table) < 1e-14


def test_closures_are_reported_as_not_carried_over_to_urdf(tmp_path: Path) -> None:
    lost = [str(loss) for loss in losses(_model("four_bar"), ALL_FORMATS)]
    assert "URDF: joints that close loops: C" in lost
    run = dh2sim("export", "four_bar", "--out", tmp_path)
    assert run.status == 0
    assert "not carried over: URDF: joints that close loops: C\n" in run.out
    assert dh2sim("export", "four_bar", "--out", tmp_path, "--check").status == 0
