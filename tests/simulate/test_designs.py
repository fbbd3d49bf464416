"""Rollouts of different designs: each is what its own table gives alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import xarray as xr

from dh2sim.errors import DesignFileError, SettingsError
from dh2sim.formats.mjcf.elements import MjcfOptions
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.kinematics.transforms import quaternion_from_rotation
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.variants import with_actuators
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.robot.row import ActuatorType
from dh2sim.simulate import rollout
from dh2sim.simulate.block import simulate_block
from dh2sim.simulate.design_plants import groups
from dh2sim.simulate.designs import Designs, read_design_table
from dh2sim.simulate.options import RolloutOptions
from dh2sim.simulate.prepare import prepare
from dh2sim.simulate.recorded_model import recorded_model
from dh2sim.typing import Array
from tests.simulate import plain

FILE = """
name: arm
convention: {convention}
units: {{angle: deg, length: mm}}
parameters: {{reach: {reach}, half: reach / 2}}
joints:
  - {{type: revolute, a: half, alpha: {alpha}, d: 120, limits: {{position: [-150, 160], velocity: 200}}}}
  - {{type: revolute, a: reach, alpha: -7, theta: 20, flip: true, limits: {{position: [-140, 150]}}}}
  - {{type: prismatic, a: 30, alpha: 12.7, d: 40, limits: {{position: [0, 200], effort: {effort}}}}}
tool: {{xyz: [10, 20, 60], rpy: [5, -8, 11], mass: {mass}}}
configurations: {{home: [20, -30, 90]}}
"""
VARY = {
    "reach": "uniform:250:350",
    "alpha1": "normal:3",
    "joint_3.limits.effort": "0.2",
    "tool.mass": "loguniform:0.1:1",
}


def file(
    reach: float = 300, alpha: float = 37.3, effort: float = 60, mass: float = 0.4, *, of: str = "standard"
) -> str:
    return FILE.format(convention=of, reach=repr(reach), alpha=repr(alpha), effort=repr(effort), mass=repr(mass))


def model_of_rollout(run: xr.Dataset, i: int, convention: str) -> RobotModel:
    """The robot of a rollout, from a file with its numbers in it."""
    names = ("reach", "alpha1", "joint_3_limits_effort", "tool_mass")
    return build_model(parse_robot(file(*(float(run[name][i]) for name in names), of=convention)))


@pytest.mark.parametrize(
    ("convention", "controller", "start"),
    [("standard", "sine", "home"), ("modified", "tests.simulate.drivers:Spring", "random")],
)
def test_each_rollout_is_bit_for_bit_that_of_its_own_file_compiled_alone(
    convention: str, controller: str, start: str
) -> None:
    run = rollout(
        build_model(parse_robot(file(of=convention))),
        rollouts=5,
        steps=40,
        vary=VARY,
        controller=controller,
        start=start,
        seed=3,
    )
    assert len(np.unique(run.reach.values)) == len(np.unique(run.tool_mass.values)) == 5
    for i in range(5):
        robot = model_of_rollout(run, i, convention)
        text = to_mjcf(
            robot if controller == "sine" else with_actuators(robot, ActuatorType.MOTOR),
            MjcfOptions(integrator="implicitfast", sensors=True),
        )
        own = mujoco.MjModel.from_xml_string(text)
        control = plain.replayed(run) if controller == "sine" else plain.spring
        found = plain.track(own, run.qpos.values[i, 0], run.qvel.values[i, 0], control, 40, i)
        np.testing.assert_array_equal(run.qpos.values[i], found.qpos)
        np.testing.assert_array_equal(run.qvel.values[i], found.qvel)
        np.testing.assert_array_equal(run.tool_pose.values[i], found.tool_pose)
        T = table_tool_pose(robot.spec, run.qpos.values[i, 7])
        np.testing.assert_allclose(run.tool_pose.values[i, 7, :3], T[:3, 3], atol=1e-12)
        quaternion = quaternion_from_rotation(T[:3, :3])
        assert abs(np.dot(quaternion, run.tool_pose.values[i, 7, 3:])) == pytest.approx(1.0, abs=1e-12)


def test_a_design_that_is_no_robot_is_named_before_anything_runs() -> None:
    with pytest.raises(SettingsError, match=r"design 0 \(joint_1.link.mass=-1\): joints\[0\].link.mass: must not be"):
        rollout("planar_2r", rollouts=2, steps=2, vary={"joint_1.link.mass": "uniform:-1:-1"})


def lone(run: xr.Dataset, i: int, convention: str, factors: dict[str, Array]) -> plain.Track:
    """Rollout ``i`` by the plain loop, on its own model with multiplied fields."""
    text = to_mjcf(model_of_rollout(run, i, convention), MjcfOptions(sensors=True))
    own = plain.scaled(text, factors)
    return plain.track(own, run.qpos.values[i, 0], run.qvel.values[i, 0], plain.replayed(run), 30, i)


def test_designs_are_randomized_as_models_of_their_own_are() -> None:
    run = rollout(
        build_model(parse_robot(file())), rollouts=4, steps=30, vary=VARY, randomize={"mass": 0.3, "gain": 0.2}
    )
    for i in range(4):
        found = lone(run, i, "standard", {name: run[f"{name}_scale"].values[i] for name in ("mass", "gain")})
        np.testing.assert_array_equal(run.qpos.values[i], found.qpos)
        np.testing.assert_array_equal(run.tool_pose.values[i], found.tool_pose)


def test_designs_of_different_layouts_are_simulated_in_groups_with_the_same_bits() -> None:
    """A twist close to a right angle gives the model a body more, and long links exclude other pairs."""
    twists = [37.3, 90.0, 90.00001, 40.0, 89.99999]
    run = rollout(
        build_model(parse_robot(file())), steps=30, designs={"alpha1": twists, "reach": [300, 250, 900, 20, 310]}
    )
    for i, alpha in enumerate(twists):
        text = file(float(run.reach[i]), alpha)
        own = mujoco.MjModel.from_xml_string(to_mjcf(build_model(parse_robot(text)), MjcfOptions(sensors=True)))
        control = plain.replayed(run)
        found = plain.track(own, run.qpos.values[i, 0], run.qvel.values[i, 0], control, 30, i)
        np.testing.assert_array_equal(run.qpos.values[i], found.qpos, err_msg=f"{alpha}")
    layouts = {
        (own.nbody, own.nexclude)
        for own in (
            mujoco.MjModel.from_xml_string(to_mjcf(build_model(parse_robot(file(reach, alpha)))))
            for reach, alpha in zip([300, 250, 900, 20, 310], twists, strict=True)
        )
    }
    assert len(layouts) > 1


def test_designs_that_differ_in_numbers_alone_are_simulated_in_one_batch() -> None:
    options = RolloutOptions(rollouts=6, steps=1, vary={"a2": 0.05, "d3": 0.05})
    job = prepare(build_model(load_robot("puma560")), options)
    assert job.designs is not None
    assert list(groups(job.designs.of(range(6), {}))) == [[0, 1, 2, 3, 4, 5]]


def test_successive_rollouts_share_a_design_and_blocks_do_not_show() -> None:
    how = {"rollouts": 6, "per_design": 3, "steps": 5, "vary": {"a1": "uniform:0.3:0.5"}, "seed": 8}
    run = rollout("planar_2r", **how)  # type: ignore[arg-type]
    assert run.design.values.tolist() == [0, 0, 0, 1, 1, 1]
    assert len(set(run.a1.values.tolist())) == 2
    np.testing.assert_array_equal(run.dh_a.values[:, 0], run.a1.values)
    job = prepare(build_model(load_robot("planar_2r")), RolloutOptions(**how))  # type: ignore[arg-type]
    np.testing.assert_array_equal(simulate_block(job, range(2, 5))["qpos"], run.qpos.values[2:5])


def test_draws_of_one_number_do_not_depend_on_the_others() -> None:
    alone = rollout("planar_2r", rollouts=3, steps=1, vary={"a2": 0.1})
    both = rollout("planar_2r", rollouts=3, steps=1, vary={"a1": "normal:0.01", "a2": 0.1})
    np.testing.assert_array_equal(alone.a2, both.a2)
    assert np.abs(alone.a2.values / alone.a2.values.mean() - 1).max() < 0.2


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("a1,a9\n1,2\n", (1, 4, "a9"), "is of row 9, and the table has 2"),
        ("a1,a2\n0.4,x\n", (2, 5, "a2"), "unknown name 'x'"),
        ("# lengths\n\na1; a2\n0.4; 0.3\n0.5\n", (5, 1, ""), "expected 2 cells, as in line 3, found 1"),
        ("a1,a1\n1,2\n", (1, 4, ""), "duplicate column 'a1'"),
        ("a1\n", (1, 1, ""), "expected a line of names, and a line of numbers for each design"),
        ("a1\n0.4\n1e300\n", (3, 1, "design 1 (a1=1e+300)"), r"joints\[0\].a: must be from"),
    ],
)
def test_a_wrong_file_of_designs_is_named_with_its_place(
    tmp_path: Path, text: str, place: tuple[int, int, str], message: str
) -> None:
    path = tmp_path / "designs.csv"
    path.write_text(text)
    with pytest.raises(DesignFileError, match=message) as caught:
        rollout("planar_2r", designs=path, steps=1)
    problem = caught.value.problems[0]
    assert (problem.file, problem.line, problem.column, problem.path) == (str(path), *place)


def test_of_a_file_that_is_wrong_throughout_the_first_problems_are_reported(tmp_path: Path) -> None:
    path = tmp_path / "designs.csv"
    path.write_text("a1\n" + "zork\n" * 1000)
    with pytest.raises(DesignFileError) as caught:
        rollout("planar_2r", designs=path, steps=1)
    assert len(caught.value.problems) == 51
    assert str(caught.value.problems[-1]) == f"{path}:52:1: nothing was read from here on: too many errors"


def test_designs_are_no_longer_checked_when_many_are_wrong(tmp_path: Path) -> None:
    path = tmp_path / "designs.csv"
    path.write_text("a1\n" + "0.4\n" + "1e300\n" * 1000)
    checked: list[int] = []
    designs = Designs(load_robot("planar_2r"), draws={}, table=read_design_table(path), count=1, seed=0)
    with pytest.raises(DesignFileError) as caught:
        designs.check(checked.append)
    assert sum(checked) == 20
    assert len(caught.value.problems) == 21
    assert (
        str(caught.value.problems[-1])
        == f"{path}:23:1: too many designs are wrong: the 980 from here on were not checked"
    )


def test_a_file_of_more_designs_than_can_be_checked_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dh2sim.simulate.designs.MOST_DESIGNS", 3)
    path = tmp_path / "designs.csv"
    path.write_text("a1\n1\n2\n3\n")
    assert len(read_design_table(path)) == 3
    path.write_text("a1\n1\n2\n3\n4\n5\n")
    with pytest.raises(DesignFileError, match=r":5:1: at most 3 designs are allowed in a file: give them in parts"):
        read_design_table(path)


def test_cells_are_plain_numbers_or_expressions(tmp_path: Path) -> None:
    path = tmp_path / "designs.csv"
    path.write_bytes(b'\xef\xbb\xbfa1,alpha1\r\n# a remark\r\n0.5, 90\r\n"1/4",2*pi\r\n')
    table = read_design_table(path)
    np.testing.assert_array_equal(table.values, [[0.5, 90.0], [0.25, 2.0 * np.pi]])
    assert table.lines.tolist() == [1, 3, 4]
    assert table.places == (1, 4)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"vary": {"a1": "often"}}, r"vary a1: must be X \(a factor from 1 - X to 1 \+ X\), normal:SD"),
        ({"vary": {"a1": "uniform:2:1"}}, "must have bounds in ascending order"),
        ({"vary": {"d1": 0.1}}, "vary d1: is 0 in the robot file, and 0.1 of that is 0"),
        ({"vary": {"joint_1.link.mass": 0.1}}, "is not given in the robot file"),
        (
            {"vary": {"b1": 0.1}},
            "b1: is not the name of a number of planar_2r. Names: a1, a2, alpha1, d1, theta1",
        ),
        (
            {"vary": {"b1": 0.1, "a1": "often"}, "every": 0},
            r"(?s)every must be .*\nvary a1: must be X .*\nvary b1: is not the name of a number of planar_2r",
        ),
        ({"per_design": 2}, "per_design must be given together with vary or designs"),
        ({"designs": {"a1": [1, 2]}, "rollouts": 3}, "rollouts must be a multiple of the 2 designs, got 3"),
        ({"designs": {"a1": [1]}, "vary": {"a1": 0.1}}, "vary must not contain a1, which the designs have too"),
        ({"designs": {"a1": [1, 2], "a2": [1]}}, "all of one length"),
    ],
)
def test_wrong_options_of_designs_are_named(options: dict[str, Any], message: str) -> None:
    with pytest.raises(SettingsError, match=message):
        rollout("planar_2r", **{"steps": 1, **options})


def test_the_model_that_a_rollout_is_shown_with_is_that_of_its_design() -> None:
    run = rollout("stanford", rollouts=2, steps=3, vary={"d1": 0.2, "d2": 0.2})
    for i in range(2):
        one = run.isel(rollout=i)
        model = recorded_model(run.attrs, scene=True, design={"d1": float(one.d1), "d2": float(one.d2)})
        data = mujoco.MjData(model)
        data.qpos[:] = one.qpos.values[-1]
        mujoco.mj_kinematics(model, data)
        np.testing.assert_allclose(data.site("tool0").xpos, one.tool_pose.values[-1, :3], atol=1e-12)
