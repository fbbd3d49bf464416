"""Each random quantity does what it says: a plain loop with the quantity set by hand moves the same."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
import pytest
import xarray as xr
from mujoco.batch import Batch

from dh2sim import Continuous, Prismatic, Revolute, Robot
from dh2sim.errors import ControllerError, SettingsError
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.row import ActuatorSpec, ActuatorType
from dh2sim.simulate import rollout
from dh2sim.simulate.disturbances import Pushes
from dh2sim.simulate.options import RolloutOptions
from dh2sim.simulate.prepare import prepare
from dh2sim.simulate.quantities import QUANTITIES, distribution_of
from dh2sim.typing import Array
from tests.simulate import robots

STEPS = 20


def odd(actuators: ActuatorType = ActuatorType.POSITION) -> RobotModel:
    """Rows of all conventions at odd angles, a flipped one, a slide, and a tool."""
    rows = [
        Revolute(d=0.3, a=0.1, alpha=1.1, theta=0.2),
        Revolute(convention="modified", a=0.4, alpha=-0.7, d=0.1, theta=-0.4, flip=True),
        Prismatic(a=0.05, alpha=0.6, theta=0.3, limits=(-0.2, 0.4)),
        Continuous(convention="hayati", a=0.25, alpha=0.3, beta=0.2, theta=0.1),
    ]
    model = Robot(rows, name="odd", tool=(0.05, 0.02, 0.1)).model
    spec = replace(
        model.spec,
        rows=tuple(
            replace(row, actuator=ActuatorSpec(type=actuators), limits=replace(row.limits, effort=30.0))
            for row in model.spec.rows
        ),
    )
    return build_model(spec)


def run_of(model: RobotModel, randomize: Mapping[str, float | str], **more: Any) -> xr.Dataset:
    options = {"rollouts": 2, "steps": STEPS, "controller": "random", "record": "qpos,qvel,ctrl,tool_pose", **more}
    return rollout(model, randomize=randomize, **options)


def by_hand(run: xr.Dataset, i: int, change: Callable[[mujoco.MjSpec], None]) -> tuple[Array, Array]:
    """Joint positions and tool poses of a rollout, of its MJCF changed before it is compiled, by ``mj_step``."""
    spec = mujoco.MjSpec.from_string(run.attrs["mjcf"])
    change(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = run.qpos.values[i, 0], run.qvel.values[i, 0]
    q, tool = [data.qpos.copy()], []
    for control in run.ctrl.values[i]:
        data.ctrl[:] = control
        mujoco.mj_step(model, data)
        tool.append(np.concatenate([data.sensor("tool0_pos").data, data.sensor("tool0_quat").data]))
        q.append(data.qpos.copy())
    return np.array(q), np.array(tool)


def assert_same(run: xr.Dataset, change: Callable[[mujoco.MjSpec, int], None], atol: float = 1e-9) -> None:
    for i in range(run.sizes["rollout"]):
        q, tool = by_hand(run, i, lambda spec, i=i: change(spec, i))  # type: ignore[misc]
        np.testing.assert_allclose(run.qpos.values[i], q, rtol=0, atol=atol)
        found = run.tool_pose.values[i, :-1]
        np.testing.assert_allclose(np.abs((found[:, 3:] * tool[:, 3:]).sum(axis=1)), 1.0, rtol=0, atol=atol)
        np.testing.assert_allclose(found[:, :3], tool[:, :3], rtol=0, atol=atol)
    still = run_of(odd(), {}, rollouts=2)
    assert np.abs(run.qpos.values[:, -1] - still.qpos.values[:, -1]).max() > 1e-7, "it does something"


def test_centres_of_mass_are_moved() -> None:
    run = run_of(odd(), {"com": 0.05})
    assert run.com_offset.dims == ("rollout", "link", "axis")

    def change(spec: mujoco.MjSpec, i: int) -> None:
        for link, offset in zip(run.link.values, run.com_offset.values[i], strict=True):
            spec.body(str(link)).ipos += offset

    assert_same(run, change)


@pytest.mark.parametrize("joints", [1, 2])
def test_a_centre_of_mass_leaves_an_axis_that_it_was_on(joints: int) -> None:
    rows = [Revolute(d=0.2, limits=(-1, 1)), Prismatic(limits=(-0.1, 0.3))][:joints]
    model = Robot(rows, name="turntable").model
    run = run_of(model, {"com": 0.1, "gravity": 0.4})

    def change(spec: mujoco.MjSpec, i: int) -> None:
        spec.option.gravity = run.gravity.values[i]
        for link, offset in zip(run.link.values, run.com_offset.values[i], strict=True):
            spec.body(str(link)).ipos += offset

    for i in range(2):
        q, _ = by_hand(run, i, lambda spec, i=i: change(spec, i))  # type: ignore[misc]
        np.testing.assert_allclose(run.qpos.values[i], q, rtol=0, atol=1e-9)


def test_a_payload_is_a_point_mass_at_the_tool() -> None:
    run = run_of(odd(), {"payload": 3.0, "payload_com": 0.04})
    assert run.payload.values.min() > 0.0
    assert np.abs(run.payload_com.values).max() <= 0.04

    def change(spec: mujoco.MjSpec, i: int) -> None:
        site = spec.site("tool0")
        R = np.zeros(9)
        mujoco.mju_quat2Mat(R, site.quat)
        place = site.pos + R.reshape(3, 3) @ run.payload_com.values[i]
        load = spec.body("link_4").add_body(name="load", pos=place)
        load.mass, load.inertia, load.ipos = run.payload.values[i], [1e-12] * 3, [0.0] * 3
        load.explicitinertial = True

    assert_same(run, change)


def test_gravity_is_tilted_and_as_strong() -> None:
    run = run_of(odd(), {"gravity": 0.3}, rollouts=2)
    g = run.gravity.values
    np.testing.assert_allclose(np.linalg.norm(g, axis=1), 9.81, rtol=1e-12)
    assert (np.arccos(-g[:, 2] / 9.81) <= 0.3).all()

    def change(spec: mujoco.MjSpec, i: int) -> None:
        spec.option.gravity = g[i]

    assert_same(run, change)


def test_stiffness_and_damping_are_multiplied_apart() -> None:
    run = run_of(odd(), {"kp": 0.4, "kv": 0.5})

    def change(spec: mujoco.MjSpec, i: int) -> None:
        for k, actuator in enumerate(spec.actuators):
            actuator.gainprm[0] *= run.kp_scale.values[i, k]
            actuator.biasprm[1] *= run.kp_scale.values[i, k]
            actuator.biasprm[2] *= run.kv_scale.values[i, k]

    assert_same(run, change)


def test_limits_of_effort_are_multiplied() -> None:
    model = odd(ActuatorType.MOTOR)
    run = run_of(model, {"effort": "uniform:0.2:1.5"}, controller="tests.simulate.drivers:Strong")
    most = 30.0 * run.effort_scale.values
    np.testing.assert_allclose(np.abs(run.ctrl.values).max(axis=1), most, rtol=1e-12)
    assert (most > 30.0).any()
    soft = run_of(odd(), {"effort": "uniform:0.05:0.1"}, record="torque", controller="sine:amplitude=1")
    torque = np.abs(soft.torque.values)
    assert (torque <= 30.0 * soft.effort_scale.values[:, None] * (1.0 + 1e-12)).all()
    assert (torque.max(axis=1) > 29.9 * soft.effort_scale.values).any()


@pytest.mark.parametrize(
    "what", [{"zero": 0.1}, {"row_length": 0.02, "row_angle": 0.05}, {"row_angle[joint_2]": 0.2}]
)
def test_the_tool_is_where_the_table_with_its_errors_has_it(what: dict[str, float | str]) -> None:
    model = odd()
    run = run_of(model, what, rollouts=3, start="random")
    lengths = run.get("row_length_error", xr.DataArray(np.zeros((3, 4, 2)))).values
    angles = run.get("row_angle_error", xr.DataArray(np.zeros((3, 4, 3)))).values
    zeros = run.get("zero_offset", xr.DataArray(np.zeros((3, 4)))).values
    assert max(np.abs(lengths).max(), np.abs(angles).max(), np.abs(zeros).max()) > 0.01
    for i in range(3):
        rows = []
        for k, row in enumerate(model.spec.rows):
            errors = dict(zip(("a", "d", "alpha", "theta", "beta"), (*lengths[i, k], *angles[i, k]), strict=True))
            off = {name: getattr(row, name) + error for name, error in errors.items() if error}
            rows.append(replace(row, **off))
        wrong = replace(model.spec, rows=tuple(rows))
        for step in (0, STEPS):
            T = table_tool_pose(wrong, run.qpos.values[i, step] + zeros[i])
            pose = run.tool_pose.values[i, step]
            R = np.zeros(9)
            mujoco.mju_quat2Mat(R, pose[3:])
            np.testing.assert_allclose(pose[:3], T[:3, 3], rtol=0, atol=1e-12)
            np.testing.assert_allclose(R.reshape(3, 3), T[:3, :3], rtol=0, atol=1e-12)


def test_encoders_err_by_a_constant_and_by_noise_and_are_late() -> None:
    how = {"controller": "tests.simulate.drivers:Seen", "rollouts": 3, "start": "random", "record": "qpos,qvel,ctrl"}
    model = odd(ActuatorType.MOTOR)
    biased = run_of(model, {"encoder_bias": 0.2}, **how)
    seen = biased.ctrl.values
    np.testing.assert_allclose(seen, biased.qpos.values[:, :-1] + biased.encoder_bias.values[:, None], atol=1e-12)
    noisy = run_of(model, {"encoder_noise": "fixed:0.1"}, **{**how, "steps": 200})
    errors = noisy.ctrl.values - noisy.qpos.values[:, :-1]
    assert errors.std() == pytest.approx(0.1, rel=0.05)
    assert abs(errors.mean()) < 0.01
    assert abs(np.corrcoef(errors[0, 1:, 0], errors[0, :-1, 0])[0, 1]) < 0.25
    late = run_of(model, {"sensor_delay": "uniform:0.004:0.02"}, **how)
    for i, delay in enumerate(np.round(late.sensor_delay.values / 0.002).astype(int)):
        assert delay >= 2
        steps = np.maximum(np.arange(STEPS) - delay, 0)
        np.testing.assert_array_equal(late.ctrl.values[i], late.qpos.values[i, steps])
    with pytest.raises(ControllerError, match=r"^controller 'sine' looks at no state"):
        run_of(odd(), {"encoder_bias": 0.1}, controller="sine")


@pytest.mark.parametrize("controller", ["random", "tests.simulate.drivers:Seen"])
def test_controls_are_late_and_the_start_is_held_before_they_come(controller: str) -> None:
    model = odd(ActuatorType.POSITION if controller == "random" else ActuatorType.MOTOR)
    how = {"controller": controller, "rollouts": 3, "seed": 4}
    prompt, late = run_of(model, {}, **how), run_of(model, {"control_delay": 0.02}, **how)
    delays = np.round(late.control_delay.values / 0.002).astype(int)
    assert delays.max() >= 2
    for i, delay in enumerate(delays):
        if controller == "random":
            np.testing.assert_array_equal(late.ctrl.values[i, delay:], prompt.ctrl.values[i, : STEPS - delay])
        else:
            np.testing.assert_array_equal(late.ctrl.values[i, delay:], late.qpos.values[i, : STEPS - delay])
        held = late.ctrl.values[i, :delay]
        assert (held == held[:1]).all()
        moved = np.abs(late.qpos.values[i, delay] - late.qpos.values[i, 0]).max()
        assert moved < 1e-3 or controller != "random", "actuators that are strong enough hold it"


def test_pushes_come_at_intervals_at_the_tool() -> None:
    run = run_of(odd(), {"push": "fixed:20", "push_interval": 0.02, "push_duration": 0.006})
    force, start = run.push_force.values, run.push_start.values
    assert force.shape == (2, 2, 3)
    np.testing.assert_allclose(np.linalg.norm(force, axis=-1), 20.0, rtol=1e-12)
    np.testing.assert_allclose(np.diff(start, axis=1), 0.02, rtol=1e-12)
    assert ((start[:, 0] >= 0.0) & (start[:, 0] < 0.02)).all()
    for i in range(2):
        model = mujoco.MjModel.from_xml_string(run.attrs["mjcf"])
        data = mujoco.MjData(model)
        data.qpos[:] = run.qpos.values[i, 0]
        pushed = 0
        for step, control in enumerate(run.ctrl.values[i]):
            mujoco.mj_fwdPosition(model, data)
            on = (start[i] <= step * 0.002) & (step * 0.002 < start[i] + 0.006)
            pushed += int(on.sum())
            data.qfrc_applied[:] = 0.0
            body, point = model.site("tool0").bodyid[0], data.site("tool0").xpos
            mujoco.mj_applyFT(model, data, force[i][on].sum(axis=0), np.zeros(3), point, body, data.qfrc_applied)
            data.ctrl[:] = control
            mujoco.mj_step(model, data)
            np.testing.assert_allclose(run.qpos.values[i, step + 1], data.qpos, rtol=0, atol=1e-9)
        assert pushed in range(3, 7)


def test_a_simulation_that_is_put_back_is_pushed_as_before() -> None:
    plant = prepare(odd(), RolloutOptions(rollouts=3)).plant
    batch = Batch(plant.model, 3, 1)
    drawn = {"push_force": np.arange(9.0).reshape(3, 1, 3), "push_start": np.zeros((3, 1))}
    pushes, forces = Pushes(plant, batch, drawn, 1.0, 1.0), batch.bind("xfrc_applied")
    batch.bind("qpos")[:] = [[0.1], [0.2], [0.3]]
    batch.forward()
    pushes.apply(0)
    before = forces.copy()
    assert len(np.unique(before)) > 9, "forces and moments of each"
    batch.bind("qpos")[:] = 0.0
    batch.forward()
    forces[1:] = 0.0
    pushes.apply_again(np.array([1, 2]))
    np.testing.assert_array_equal(forces, before)


def test_draws_do_not_depend_on_what_else_is_drawn_nor_on_how_rollouts_are_divided() -> None:
    everything: dict[str, float | str] = {
        name: "normal:0.1" if quantity.kind == "factor" else 0.02
        for name, quantity in QUANTITIES.items()
        if not name.startswith(("encoder", "sensor", "push_")) and name != "gain"
    }
    del everything["friction"], everything["armature"], everything["damping"]
    whole = run_of(odd(), everything, rollouts=3, steps=5)
    for name in ("com", "row_angle", "payload", "kp"):
        alone = run_of(odd(), {name: everything[name]}, rollouts=2, steps=5)
        variable = QUANTITIES[name].variable
        np.testing.assert_array_equal(alone[variable].values, whole[variable].values[:2])
    other = run_of(odd(), everything, rollouts=3, steps=5)
    xr.testing.assert_identical(whole.drop_attrs(), other.drop_attrs())


def test_a_name_in_brackets_is_of_one_joint_and_overrides_what_is_of_all() -> None:
    run = run_of(robots.worm(), {"friction": 0.1, "friction[joint_3]": 0.9, "mass[link_2]": "fixed:2"}, rollouts=50)
    spread = np.abs(run.friction_scale.values - 1.0).max(axis=0)
    assert (spread[[0, 1, 3, 4]] <= 0.1).all()
    assert 0.5 < spread[2] <= 0.9
    assert run.mass_scale.values.tolist() == [[1.0, 2.0, 1.0, 1.0, 1.0]] * 50
    plain = run_of(robots.worm(), {"friction": 0.1}, rollouts=50)
    np.testing.assert_array_equal(run.friction_scale.values[:, :2], plain.friction_scale.values[:, :2])


@pytest.mark.parametrize(
    ("setting", "mean", "deviation"),
    [
        ("uniform:0.5:2", 1.25, 1.5 / math.sqrt(12.0)),
        ("log-uniform:0.5:2", 1.5 / math.log(4.0), None),
        ("normal:0.1", 1.0, 0.1),
        ("normal:1.2:0.05", 1.2, 0.05),
        ("fixed:1.5", 1.5, 0.0),
    ],
)
def test_distributions_have_their_mean_and_deviation(setting: str, mean: float, deviation: float | None) -> None:
    found = distribution_of(QUANTITIES["mass"], setting)
    values = [found.at((k + 0.5) / 4000) for k in range(4000)]
    assert np.mean(values) == pytest.approx(mean, rel=1e-3)
    assert deviation is None or np.std(values) == pytest.approx(deviation, rel=5e-3)
    assert found.least <= min(values)
    assert max(values) <= found.at(1.0)


@pytest.mark.parametrize(
    ("name", "setting", "problem"),
    [
        ("mass", "normal:0.5", "must be above 0 in all draws, got normal:0.5, which reaches -1"),
        ("payload", -1.0, "must have the lower end first and at least 0 as X, got -1"),
        ("com", "uniform:2:1", "must have the lower end first and at least 0 as X, got uniform:2:1"),
        ("com", "loguniform:0:1", "must have ends above 0, got loguniform:0:1"),
        ("push_interval", "uniform:1:2", "must be a number, got uniform:1:2"),
        ("encoder_noise", "uniform:-1:2", "must be at least 0 in all draws, got uniform:-1:2"),
        ("gravity", math.inf, "must have finite numbers of at most 1e+06, got inf"),
    ],
)
def test_impossible_distributions_are_refused(name: str, setting: float | str, problem: str) -> None:
    with pytest.raises(ValueError, match="must") as caught:
        distribution_of(QUANTITIES[name], setting)
    assert str(caught.value) == problem


def test_wrong_names_in_brackets_and_missing_partners_are_reported() -> None:
    with pytest.raises(SettingsError) as caught:
        run_of(odd(), {"friction[joint_9]": 0.1, "payload[link_1]": 1.0, "payload_com": 0.1})
    assert str(caught.value).splitlines() == [
        "randomize must not contain 'payload[link_1]': a rollout has one payload",
    ]
    with pytest.raises(SettingsError) as caught:
        run_of(odd(), {"zero[joint_9]": 0.1, "payload_com": 0.1})
    assert str(caught.value) == "randomize must not contain 'payload_com' without 'payload'"
    with pytest.raises(SettingsError) as caught:
        run_of(odd(), {"zero[joint_9]": 0.1})
    assert str(caught.value).startswith("randomize must not contain 'zero[joint_9]'. Did you mean 'joint_4'?")
