"""When and between which links a rollout's first contact is, told by geometry alone."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np

from dh2sim import parse_robot
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.simulate import rollout
from dh2sim.simulate.description import FirstContact, describe

CLAPPER = """\
name: clapper
convention: standard
gravity: [0, 0, 0]
joints:
  - {type: revolute, name: first, a: 1, limits: {position: [-3, 3]}}
  - {type: revolute, name: middle, a: 0.6, limits: {position: [-3, 3]}}
  - {type: revolute, name: last, a: 0.6, limits: {position: [-3, 3]}}
configurations: {home: [0, 0.5, 0.5]}
"""
"""Three links in a plane. Where both bends grow, the last link's end runs into the first one."""


def clapper() -> RobotModel:
    return build_model(parse_robot(CLAPPER))


def closing(folder: Path, *rates: float) -> str:
    """A controller that bends the middle and the last joint of each rollout, at these rates in rad/s."""
    time = 0.002 * np.arange(600)
    bends = 0.5 + np.multiply.outer(rates, time)
    q = np.stack((np.zeros_like(bends), bends, bends), axis=2)
    path = folder / "closing.npy"
    np.save(path, np.clip(q, -2.9, 2.9))
    return f"replay:file={path},as=reference"


def test_only_a_rollout_in_which_the_arm_closes_has_a_contact(tmp_path: Path) -> None:
    run = rollout(clapper(), rollouts=3, steps=600, controller=closing(tmp_path, 2.5, 0.0, -4.0), record="qpos")
    meanings = dict(
        zip(
            run.contact_link_a.attrs["flag_values"],
            run.contact_link_a.attrs["flag_meanings"].split(),
            strict=True,
        )
    )
    touched = run.contact_step.values >= 0
    assert touched.tolist() == [True, False, True]
    for i in np.flatnonzero(touched):
        links = {meanings[int(run[name].values[i])] for name in ("contact_link_a", "contact_link_b")}
        assert links == {"link_1", "link_3"}
    assert meanings[int(run.contact_link_a.values[1])] == "none"
    # the end of the last link is on the first at bends of 2 pi / 3, and links have some thickness
    at = run.qpos.values[0, run.contact_step.values[0]]
    before = run.qpos.values[0, run.contact_step.values[0] - 1]
    assert 0.6 * 2 * math.pi / 3 < at[1] < 2 * math.pi / 3
    model = mujoco.MjModel.from_xml_string(run.attrs["mjcf"])
    data = mujoco.MjData(model)
    for q, touching in ((before, False), (at, True)):
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        assert bool(data.ncon) is touching


def test_a_contact_does_not_depend_on_what_is_recorded(tmp_path: Path) -> None:
    controller = closing(tmp_path, 2.5, 2.0, 0.0)
    runs = [
        rollout(clapper(), rollouts=3, steps=600, controller=controller, record=record, every=every)
        for record, every in (("qpos", 1), ("ctrl", 5), (("qpos", "contacts", "energy"), 10))
    ]
    for run in runs:
        for name in ("contact_step", "contact_link_a", "contact_link_b"):
            assert run[name].values.tolist() == runs[0][name].values.tolist()
    assert (runs[0].contact_step.values >= 0).tolist() == [True, True, False]


def test_a_description_names_the_first_rollout_with_a_contact(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    run = rollout(clapper(), rollouts=3, steps=600, controller=closing(tmp_path, 0.0, 2.0, 2.5), out=path)
    described = describe(path)
    step = int(run.contact_step.values[1])
    assert step > run.contact_step.values[2] > 0
    assert described.touched == 2
    assert described.first_contact == FirstContact(
        rollout=1, step=step, time=0.002 * step, links=("link_1", "link_3")
    )


def test_links_that_touch_at_the_start_do_so_in_step_zero(tmp_path: Path) -> None:
    np.save(tmp_path / "closed.npy", np.array([0.0, 2.09, 2.09]))
    for integrator in ("implicitfast", "RK4"):
        run = rollout(
            clapper(), rollouts=1, steps=3, integrator=integrator, start=str(tmp_path / "closed.npy"), record="qpos"
        )
        assert run.contact_step.values.tolist() == [0]
