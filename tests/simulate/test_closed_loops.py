"""Closed loops as they are simulated, against MuJoCo's own constraint Jacobian, finite differences and the tables."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import mujoco
import numpy as np
import pytest

import dh2sim
from dh2sim.errors import ControllerError, SettingsError
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.kinematics.loop_closure import closure_gaps
from dh2sim.kinematics.loop_motion import mechanism_configuration
from dh2sim.model.mechanism import MechanismModel, build_mechanism
from dh2sim.robot.read import load_robot
from dh2sim.simulate import rollout
from dh2sim.simulate.closed_loops import ClosedLoops, Kinematics
from dh2sim.simulate.plant import Plant, compile_plant

ALL = ("four_bar", "slider_crank", "bennett", "spherical_four_bar", "parallel_four_bar", "delta", "stewart")


@cache
def plant_of(name: str) -> tuple[MechanismModel, Plant, ClosedLoops]:
    model = build_mechanism(load_robot(name))
    plant = compile_plant(to_mjcf(model), model)
    assert plant.loops is not None
    return model, plant, plant.loops


def moved(name: str, by: float) -> tuple[Plant, ClosedLoops, np.ndarray]:
    _, plant, loops = plant_of(name)
    qpos, reached = loops.follow(loops.start[None], loops.start[None, loops.driven] + by)
    assert reached.all()
    return plant, loops, qpos[0]


def at(loops: ClosedLoops, qpos: np.ndarray) -> Kinematics:
    data = mujoco.MjData(loops.model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(loops.model, data)
    return Kinematics.of_data(data)


@pytest.mark.parametrize("name", ALL)
def test_the_jacobian_has_the_rows_of_mujocos_own(name: str) -> None:
    plant, loops, qpos = moved(name, 0.06)
    data = mujoco.MjData(plant.model)
    data.qpos[:] = qpos
    mujoco.mj_forward(plant.model, data)
    own = np.zeros((data.nefc, plant.model.nv))
    if mujoco.mj_isSparse(plant.model):
        mujoco.mju_sparse2dense(own, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
    else:
        own = np.array(data.efc_J).reshape(own.shape)
    own = own[data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY]
    motions = loops.motions(at(loops, qpos))[0]
    assert np.abs(own @ motions).max() < 1e-7
    assert (
        np.linalg.matrix_rank(motions) == len(loops.driven) == plant.model.nv - np.linalg.matrix_rank(own, tol=1e-7)
    )


@pytest.mark.parametrize("name", ALL)
def test_passive_joints_are_where_the_mechanisms_own_kinematics_have_them(name: str) -> None:
    plant, _, qpos = moved(name, 0.06)
    model = plant_of(name)[0]
    driven = [model.q[plant.joints.index(joint)] + 0.06 for joint in model.spec.actuated or plant.controlled.joints]
    assert qpos[plant.positions] == pytest.approx(mechanism_configuration(model.spec, driven), abs=1e-9)


@pytest.mark.parametrize("name", ALL)
def test_the_drift_is_the_change_of_velocities_while_driven_joints_keep_theirs(name: str) -> None:
    _, loops, qpos = moved(name, 0.05)
    driven = np.linspace(0.3, 0.7, len(loops.driven))
    here = at(loops, qpos)
    v = loops.motions(here)[0] @ driven
    _, drift = loops.motions_and_drift(here, v[None])
    h = 1e-5
    sides = []
    for step in (h, -h):
        there, reached = loops.follow(qpos[None], qpos[None, loops.driven] + step * driven)
        assert reached.all()
        sides.append(loops.motions(at(loops, there[0]))[0] @ driven)
    assert drift[0] == pytest.approx((sides[0] - sides[1]) / (2 * h), abs=1e-6 * max(1.0, np.abs(drift).max()))


@pytest.mark.parametrize("name", ["four_bar", "bennett", "delta"])
def test_computed_torque_follows_its_reference_through_closed_loops(name: str) -> None:
    run = rollout(name, rollouts=2, steps=120, controller="computed-torque:amplitude=0.2")
    assert not run.saturation.any()
    assert float(np.nanmax(np.abs(run.qpos - run.qpos_ref))) < 1e-3
    assert float(np.abs(run.qpos - run.qpos[:, 0]).max()) > 0.02
    passive = [joint for joint in run.joint.values if joint not in plant_of(name)[1].controlled.joints]
    assert np.isnan(run.qpos_ref.sel(joint=passive)).all()
    assert float(run.loop_gap.max()) < 1e-3 * run.loop_gap.attrs["size"]


def test_positions_are_in_the_order_of_the_table_and_gaps_are_those_of_the_table() -> None:
    model = plant_of("delta")[0]
    run = rollout("delta", rollouts=1, steps=40, controller="random:rate=20", record="qpos,torque")
    assert run.joint.values.tolist() == [joint.name for joint in model.moving_joints]
    assert run.qpos.values[0, 0] == pytest.approx(model.q, abs=1e-12)
    passive = [joint.name for joint in model.moving_joints if joint.name not in (model.spec.actuated or ())]
    assert not run.torque.sel(joint=passive).values.any()
    arm = 0.1 * model.size
    gaps = [
        [max(gap.position, arm * gap.rotation) for gap in closure_gaps(model.tree, q)] for q in run.qpos.values[0]
    ]
    assert run.loop_gap.values[0] == pytest.approx(np.max(gaps, axis=0), rel=1e-6)


def test_random_starts_are_spread_and_closed_and_the_same_in_any_company() -> None:
    model = plant_of("slider_crank")[0]
    many = rollout("slider_crank", rollouts=6, steps=4, start="random", controller="computed-torque", threads=1)
    few = rollout("slider_crank", rollouts=3, steps=4, start="random", controller="computed-torque", threads=2)
    assert (many.qpos.values[:3] == few.qpos.values).all()
    starts = many.qpos.values[:, 0]
    assert np.ptp(starts[:, 0]) > 1.0
    assert max(gap.position for q in starts for gap in closure_gaps(model.tree, q)) < 1e-10


def test_states_of_a_file_must_be_closed(tmp_path: Path) -> None:
    model = plant_of("stewart")[0]
    np.save(tmp_path / "closed.npy", np.array(mechanism_configuration(model.spec, [0.1, 0.05, 0, 0.02, 0, 0.05])))
    run = rollout("stewart", rollouts=1, steps=2, controller="hold", start=str(tmp_path / "closed.npy"))
    assert float(run.loop_gap.max()) < 1e-5  # bodies inside closures started where they belong
    np.save(tmp_path / "open.npy", np.array(model.q) + 0.01)
    with pytest.raises(SettingsError, match=r"open\.npy: in the state the loops are open$"):
        rollout("stewart", rollouts=1, steps=2, start=str(tmp_path / "open.npy"))
    moving = np.zeros((1, 2, model.tree.n))
    moving[0, 0], moving[0, 1, 0] = model.q, 1.0
    np.save(tmp_path / "moving.npy", moving)
    with pytest.raises(SettingsError, match="the velocities of passive joints are not those that the driven ones'"):
        rollout("stewart", rollouts=1, steps=2, start=str(tmp_path / "moving.npy"))


def test_joints_that_cannot_be_driven_independently_are_refused(tmp_path: Path) -> None:
    text = Path("robots/mechanisms/four_bar.yaml").read_text(encoding="utf-8")
    every = tmp_path / "four_bar.yaml"
    every.write_text(text.replace("actuated: [joint_1]\n", ""), encoding="utf-8")
    message = (
        "controller must be one of hold, passive, replay: sine moves joint_1, joint_2, rocker_joint_1 independently "
        "of each other, but the loops leave 1 freedom at the assembly. Say in 'actuated' which joints are driven"
    )
    with pytest.raises(SettingsError) as caught:
        rollout(every, rollouts=1, steps=2)
    assert str(caught.value) == message
    assert (rollout(every, rollouts=1, steps=2, controller="hold").status == 0).all()
    text = Path("robots/mechanisms/five_bar.yaml").read_text(encoding="utf-8")
    under = tmp_path / "five_bar.yaml"
    under.write_text(text.replace("actuated: [joint_1, right_joint_1]", "actuated: [joint_1]"), encoding="utf-8")
    with pytest.raises(ControllerError, match="1 driven joint and 2 freedoms at the assembly"):
        rollout(under, rollouts=1, steps=2, controller="computed-torque")


def test_a_mechanism_does_not_float() -> None:
    with pytest.raises(SettingsError, match=r"^floating_base must not be given for four_bar: it is a mechanism$"):
        dh2sim.Robot.load("four_bar").rollout(1, steps=2, floating_base=True)
