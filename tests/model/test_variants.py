"""The same robot driven, shown or held otherwise."""

from __future__ import annotations

import re
from dataclasses import asdict, replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

import dh2sim
from dh2sim.formats.mjcf.elements import MjcfOptions
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.model.build import build_model
from dh2sim.model.mass import MIN_MASS
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.variants import with_actuators, with_base_mass, without_meshes
from dh2sim.robot.row import ActuatorSpec, ActuatorType
from tests.sample_robots import NAMES, ODD_ROBOT, model

KINDS = list(ActuatorType)


def driven(kind: ActuatorType, **gains: float) -> RobotModel:
    actuator = ActuatorSpec(type=kind, **gains)
    rows = (replace(row, actuator=actuator) if row.type.moves else row for row in ODD_ROBOT.rows)
    return build_model(replace(ODD_ROBOT, rows=tuple(rows)))


def actuators(robot: RobotModel) -> list[dict[str, object]]:
    return [asdict(joint.actuator) for joint in robot.moving_joints]


@pytest.mark.parametrize("wanted", KINDS)
@pytest.mark.parametrize("own", KINDS)
def test_actuators_are_those_that_the_file_could_have_asked_for(own: ActuatorType, wanted: ActuatorType) -> None:
    changed, asked = with_actuators(driven(own), wanted), driven(wanted)
    assert actuators(changed) == actuators(asked)
    assert to_mjcf(changed) == to_mjcf(asked)


def test_gains_of_the_same_kind_stay() -> None:
    own = driven(ActuatorType.POSITION, kp=123.0, kv=4.5)
    assert actuators(with_actuators(own, ActuatorType.POSITION)) == actuators(own)
    assert {joint.actuator.kp for joint in own.moving_joints} == {123.0}


def test_nothing_else_of_the_robot_changes() -> None:
    own = model("odd")
    changed = with_actuators(own, ActuatorType.MOTOR)
    assert changed.links is own.links
    assert changed.spec is own.spec
    for before, after in zip(own.joints, changed.joints, strict=True):
        kept = set(after.__dataclass_fields__) - {"actuator"}
        assert all(getattr(after, name) is getattr(before, name) for name in kept)


@pytest.mark.parametrize("name", [*NAMES, "odd"])
def test_a_base_that_floats_weighs_what_its_shapes_do(name: str) -> None:
    heavy = with_base_mass(model(name))
    assert heavy.base.inertial is not None
    assert heavy.base.estimated == ("mass", "com", "inertia")
    compiled = mujoco.MjModel.from_xml_string(to_mjcf(heavy, MjcfOptions(floating_base=True)))
    base = compiled.body("base_link")
    assert base.mass[0] == heavy.base.inertial.mass > 0.0
    # MuJoCo computes the mass of shapes itself, given their density instead
    plain = re.sub(r'(<geom [^>]*)mass="0.0"', r'\1density="1300"', to_mjcf(model(name)))
    weighed = mujoco.MjModel.from_xml_string(plain)
    geoms = [i for i in range(weighed.ngeom) if weighed.geom_bodyid[i] == weighed.body("base_link").id]
    geoms = [i for i in geoms if weighed.geom_contype[i]]  # the rest is only shown
    assert geoms
    volumes = [_volume(weighed, i) for i in geoms]
    density = base.mass[0] / sum(volumes)
    assert density == pytest.approx(DENSITY, rel=1e-9)


@pytest.mark.parametrize("row", ["d: 6.1e-05", "a: 1.0e-09", "d: 1.0e-300", "a: 0.3"])
def test_mujoco_takes_a_base_that_floats_however_small_the_robot_is(row: str) -> None:
    tiny = dh2sim.parse_robot(f"name: tiny\nconvention: standard\njoints: [{{type: revolute, {row}}}]\n")
    heavy = with_base_mass(build_model(tiny))
    compiled = mujoco.MjModel.from_xml_string(to_mjcf(heavy, MjcfOptions(floating_base=True)))
    assert compiled.body("base_link").mass[0] >= MIN_MASS
    assert compiled.body("base_link").inertia.min() > 0.0


DENSITY = 1300.0


def _volume(compiled: mujoco.MjModel, geom: int) -> float:
    radius, half = compiled.geom_size[geom][:2]
    cylinder = 2.0 * np.pi * radius**2 * half
    if compiled.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return float(cylinder + 4.0 / 3.0 * np.pi * radius**3)
    return float(cylinder)


STL = """solid t
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 1 0 0
vertex 0 1 0
endloop
endfacet
facet normal 0 0 1
outer loop
vertex 0 0 0.1
vertex 1 0 0
vertex 0 1 0
endloop
endfacet
endsolid t
"""


def test_without_meshes_shapes_are_shown_and_no_file_is_needed(tmp_path: Path) -> None:
    (tmp_path / "part.stl").write_text(STL, encoding="utf-8")
    (tmp_path / "meshed.yaml").write_text(
        "name: meshed\nconvention: standard\nbase: {mesh: {file: part.stl}}\n"
        "joints: [{type: revolute, a: 0.3, link: {mesh: {file: part.stl}}}]\n",
        encoding="utf-8",
    )
    meshed = dh2sim.build_model(dh2sim.load_robot(tmp_path / "meshed.yaml"))
    assert meshed.base.mesh is not None
    with pytest.raises(ValueError, match=r"base_link\.stl"):
        mujoco.MjModel.from_xml_string(to_mjcf(meshed))
    bare = without_meshes(meshed)
    assert all(link.mesh is None for link in bare.all_links)
    compiled = mujoco.MjModel.from_xml_string(to_mjcf(bare))
    assert compiled.nmesh == 0
    assert compiled.body("link_1").mass[0] == meshed.links[0].inertial.mass  # type: ignore[union-attr]


def test_a_run_of_a_robot_with_meshes_needs_no_file(tmp_path: Path) -> None:
    (tmp_path / "part.stl").write_text(STL, encoding="utf-8")
    (tmp_path / "meshed.yaml").write_text(
        "name: meshed\nconvention: standard\njoints: [{type: revolute, a: 0.3, link: {mesh: {file: part.stl}}}]\n",
        encoding="utf-8",
    )
    from dh2sim.simulate import rollout

    run = rollout(tmp_path / "meshed.yaml", rollouts=2, steps=3)
    assert mujoco.MjModel.from_xml_string(run.attrs["mjcf"]).nmesh == 0
