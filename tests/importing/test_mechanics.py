"""Masses of what was imported are those of its source, or it is said by how much they are not."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from dh2sim import import_robot, parse_robot
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.formats.urdf.write import to_urdf
from dh2sim.importing.mechanics import measure_mechanics, relative_errors
from dh2sim.importing.sources import read_arm
from tests.program import dh2sim
from tests.sample_robots import model


@pytest.fixture(params=["arm.urdf", "arm.xml"])
def source(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    built = model("odd")
    path = tmp_path / str(request.param)
    path.write_text(to_urdf(built) if path.suffix == ".urdf" else to_mjcf(built), encoding="utf-8")
    return path


def test_an_imported_robot_has_the_mass_matrix_of_its_source(source: Path) -> None:
    found = import_robot(source).mechanics
    assert found is not None
    assert found.configurations == 20
    assert found.small
    assert max(found.mass_matrix, found.gravity) < 1e-7


def test_a_mass_that_is_not_the_sources_is_found_at_the_joint_that_carries_it(source: Path) -> None:
    imported = import_robot(source)
    masses = re.findall(r"mass: (\S+)", imported.text)
    changed = imported.text.replace(f"mass: {masses[-1]}", f"mass: {1.3 * float(masses[-1])!r}")
    mechanics = read_arm(source).mechanics
    assert mechanics is not None
    found = measure_mechanics(parse_robot(changed), mechanics)
    assert found is not None
    assert not found.small
    assert found.mass_matrix > 0.01


def test_a_source_without_masses_has_nothing_to_compare(source: Path) -> None:
    text = source.read_text(encoding="utf-8")
    if source.suffix == ".xml":
        pytest.skip("MuJoCo refuses moving bodies without mass")
    source.write_text(re.sub(r"<inertial>.*?</inertial>", "", text, flags=re.DOTALL), encoding="utf-8")
    assert import_robot(source).mechanics is None


def test_errors_are_relative_to_the_joints_own_inertia_and_force() -> None:
    mass = np.array([[[4.0, 0.0], [0.0, 1.0]]])
    load = np.array([[10.0, 1.0]])
    off = np.array([[[4.4, 0.02], [0.02, 1.0]]])
    by_mass, by_load = relative_errors((off, np.array([[10.0, 1.5]])), (mass, load))
    np.testing.assert_allclose(by_mass, [[0.1, 0.01]])
    np.testing.assert_allclose(by_load, [[0.0, 0.5]])


def test_the_command_says_how_far_masses_are_off(source: Path) -> None:
    run = dh2sim("import", source, "--out", source.parent / "made.yaml")
    assert run.status == 0
    assert re.search(r"1000 configurations, its mass matrix by \d\.\de-\d\d\n", run.out)
    residual = json.loads(dh2sim("import", source, "--json").out)["residual"]
    assert 0.0 <= residual["mass_matrix"] < 1e-7
    assert 0.0 <= residual["gravity"] < 1e-7


def test_the_command_says_where_masses_had_to_be_estimated(tmp_path: Path) -> None:
    text = to_urdf(model("odd"))
    first = text.index("<inertial>", text.index('<link name="link_6"'))
    end = text.index("</inertial>", first)
    inertia = text.index("<inertia ", first)
    path = tmp_path / "arm.urdf"
    path.write_text(text[:inertia] + '<inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/>' + text[end:])
    run = dh2sim("import", path, "--out", tmp_path / "made.yaml")
    assert run.status == 0
    assert "The mass matrix differs from the file's by up to " in " ".join(run.err.split())


def test_rounding_of_an_arm_without_loads_is_no_difference() -> None:
    mass, load = np.array([[[20.0, 0.0], [0.0, 0.8]]]), np.array([[0.0, 1e-18]])
    by_mass, by_load = relative_errors((mass, np.array([[3e-14, 1e-15]])), (mass, load))
    assert by_mass.max() == 0.0
    assert by_load.max() < 1e-6
    _, by_load = relative_errors((mass, np.array([[0.2, 0.0]])), (mass, load))
    assert by_load.max() > 1e-6
