"""Whatever is changed of the masses in a file that was written, validation finds it, and in which link."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from dh2sim import build_model, load_robot
from dh2sim.engines.mujoco_engine import MujocoEngine
from dh2sim.validate.dynamics import check_dynamics
from dh2sim.validate.report import Quantity
from tests.program import dh2sim
from tests.robot_files import write
from tests.validate.files import Change, change, failures, named, numbers, part, validated

MASSLESS = """\
name: odd
convention: standard
joints:
  - {type: revolute, a: 0.4, limits: {position: [-1, 1]}}
  - {type: fixed}
  - {type: revolute, a: 0.3, limits: {position: [-1, 1]}}
"""


def _stretched(values: list[float]) -> list[float]:
    return [values[0] * 1.001, *values[1:]]


def _shifted(values: list[float]) -> list[float]:
    return [values[0] + 1e-6, *values[1:]]


def _of_urdf(child: str, attribute: str, link: str = "link_2") -> Change:
    def how(root: ET.Element) -> None:
        inertial = part(root, "link", link, "inertial")
        element = inertial.find(child)
        assert element is not None
        numbers(element, attribute, _shifted if child == "origin" else _stretched)

    return how


def _of_mjcf(attribute: str) -> Change:
    def how(root: ET.Element) -> None:
        inertial = part(root, "body", "link_2", "inertial")
        name = attribute if attribute in inertial.attrib else "diaginertia"
        numbers(inertial, name, _shifted if attribute == "pos" else _stretched)

    return how


@pytest.mark.parametrize(
    ("file", "engine", "how"),
    [
        ("odd.urdf", "mujoco-urdf", _of_urdf("mass", "value")),
        ("odd.urdf", "mujoco-urdf", _of_urdf("inertia", "ixx")),
        ("odd.urdf", "mujoco-urdf", _of_urdf("inertia", "izz")),
        ("odd.urdf", "mujoco-urdf", _of_urdf("origin", "xyz")),
        ("odd.xml", "mujoco-mjcf", _of_mjcf("mass")),
        ("odd.xml", "mujoco-mjcf", _of_mjcf("fullinertia")),
        ("odd.xml", "mujoco-mjcf", _of_mjcf("pos")),
    ],
    ids=["URDF mass", "URDF ixx", "URDF izz", "URDF com", "MJCF mass", "MJCF inertia", "MJCF com"],
)
def test_a_changed_mass_property_is_found_in_its_file_and_link(
    exported: Path, file: str, engine: str, how: Change
) -> None:
    change(exported / "made" / "odd" / file, how)
    failed = failures(validated(exported / "odd.yaml", exported / "made"))
    assert [key for key in failed if key[1] == "link inertia"] == [(engine, "link inertia")]
    assert failed[engine, "link inertia"]["worst"]["where"] == "link_2"
    assert not [key for key in failed if key[1] in ("pose", "jacobian")]
    assert ("mujoco-urdf", "mass matrix") in failed, "the equations of motion of the two files differ, too"
    assert ("pinocchio", "mass matrix") in failed


@pytest.mark.parametrize(("file", "engine"), [("odd.urdf", "mujoco-urdf"), ("odd.xml", "mujoco-mjcf")])
def test_mass_given_to_a_link_that_has_none_is_found(tmp_path: Path, file: str, engine: str) -> None:
    robot = write(tmp_path, MASSLESS)
    assert dh2sim("export", robot, "--out", tmp_path).status == 0
    body = load_robot(robot)
    assert build_model(body).links[1].inertial is None
    assert validated(robot, tmp_path)["ok"] is True

    def weigh(root: ET.Element) -> None:
        if file.endswith("urdf"):
            part(root, "link", "link_2", "inertial/mass").set("value", "0.5")
            part(root, "link", "link_2", "inertial/inertia").attrib.update(ixx="1", iyy="1", izz="1")
        else:
            [inertial] = named(root, "body", "link_2").findall("inertial")
            inertial.attrib.update(mass="0.5", diaginertia="1 1 1")

    change(tmp_path / "odd" / file, weigh)
    failed = failures(validated(robot, tmp_path))
    assert failed[engine, "link inertia"]["worst"]["where"] == "link_2"
    assert failed[engine, "link inertia"]["max_error"] == 0.5


def test_the_comparison_of_dynamics_notices_a_changed_mass(exported: Path) -> None:
    model = build_model(load_robot(exported / "odd.yaml"))
    names = [joint.name for joint in model.moving_joints]
    path = exported / "made" / "odd" / "odd.xml"
    right = MujocoEngine(path, names, len(model.joints))
    change(path, _of_mjcf("mass"))
    wrong = MujocoEngine(path, names, len(model.joints))
    q, velocity = model.home[None], model.home[None] + 1.0
    reference = right.dynamic_terms(q, velocity, model.spec.gravity)
    same = check_dynamics(right, reference, model, q, velocity)
    assert [(check.ok, check.max_error) for check in same] == [(True, 0.0)] * 3
    checks = check_dynamics(wrong, reference, model, q, velocity)
    assert [check.quantity for check in checks] == [Quantity.MASS_MATRIX, Quantity.BIAS, Quantity.GRAVITY]
    assert [check.ok for check in checks] == [False] * 3
    for check in checks:
        assert check.max_error is not None
        assert 1e-5 < check.max_error < 1e-2
        assert check.worst is not None
        assert check.worst.where in names
