"""Exports in a folder that a stranger may have changed: read within limits, or refused in a sentence."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from dh2sim import build_model, load_robot
from dh2sim.export import drift, export_robot
from dh2sim.model.robot_model import RobotModel
from dh2sim.validate.run import validate_robot


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return build_model(load_robot("planar_2r"))


@pytest.fixture
def folder(model: RobotModel, tmp_path: Path) -> Path:
    export_robot(model, tmp_path)
    return tmp_path / model.name


def reasons(model: RobotModel, folder: Path) -> dict[str, str]:
    """Return why engines did not read their files, without the folder."""
    report = validate_robot(model, samples=2, folder=folder)
    return {
        check.engine: (check.reason or "").replace(f"{folder}{os.sep}", "")
        for check in report.checks
        if check.ok is False
    }


def insert(file: Path, end: str, text: str) -> None:
    file.write_text(file.read_text().replace(end, f"{text}{end}"))


BOMBS = {
    "a height field": (
        '<asset><hfield name="h" nrow="40000" ncol="40000" size="1 1 1 1"/></asset>',
        "1600000000 points",
    ),
    "copies": (
        '<worldbody><replicate count="1000000" offset="1 0 0"><geom size="1"/></replicate></worldbody>',
        "more than 10000 elements",
    ),
    "a soft body": (
        '<worldbody><flexcomp name="f" type="grid" count="90 90 90" spacing="1 1 1" dim="3"/></worldbody>',
        "more than 10000 elements",
    ),
    "a plugin": ('<extension><plugin plugin="mujoco.elasticity.cable"/></extension>', "plugins are never run"),
    "another file": ('<include file="/etc/passwd"/>', "only files in the model's folder"),
    "a picture elsewhere": (
        '<asset><texture name="t" type="2d" file="/etc/passwd"/></asset>',
        "<texture> names '/etc/passwd', which is not below the file's folder",
    ),
    "a folder elsewhere": ('<compiler meshdir="../.."/>', "<compiler> names '../..', which is not below"),
    "a huge picture": (
        '<asset><texture name="t" type="2d" builtin="flat" width="30000" height="30000"/></asset>',
        "MuJoCo refuses the file: it needs more than 1000 MB of memory",
    ),
}


@pytest.mark.parametrize("kind", BOMBS)
def test_a_bomb_in_an_mjcf_is_refused(kind: str, model: RobotModel, folder: Path) -> None:
    text, phrase = BOMBS[kind]
    insert(folder / f"{model.name}.xml", "</mujoco>", text)
    found = reasons(model, folder)
    assert [*found] == ["mujoco-mjcf"]
    assert phrase in found["mujoco-mjcf"]


def test_more_links_than_a_robot_has_are_refused_before_engines_read_them(model: RobotModel, folder: Path) -> None:
    insert(folder / f"{model.name}.urdf", "</robot>", "".join(f'<link name="x{i}"/>' for i in range(5000)))
    begin = time.perf_counter()
    found = reasons(model, folder)
    assert {*found.values()} == {f"{model.name}.urdf: has 5009 links; at most 4000 are read"}
    assert {"mujoco-urdf", "yourdfpy", "pinocchio", "pybullet"} >= {*found}
    assert time.perf_counter() - begin < 20


def _outside(folder: Path) -> str:
    (folder.parent / "private.stl").write_bytes(bytes(84))
    return "../private.stl"


def _link(folder: Path) -> str:
    (folder.parent / "private.stl").write_bytes(bytes(84))
    (folder / "link.stl").symlink_to(folder.parent / "private.stl")
    return "link.stl"


def _pipe(folder: Path) -> str:
    os.mkfifo(folder / "pipe.stl")
    return "pipe.stl"


def _miscounted(folder: Path) -> str:
    (folder / "few.stl").write_bytes(bytes(80) + (4_000_000_000).to_bytes(4, "little") + bytes(50))
    return "few.stl"


@pytest.mark.skipif(os.name == "nt", reason="no links and pipes here")
@pytest.mark.parametrize(
    ("make", "phrase"),
    [
        (lambda _: "/etc/passwd", "not below the file's folder"),
        (lambda _: "missing.stl", "cannot be read: No such file or directory"),
        (_outside, "not below the file's folder"),
        (_link, "not below the file's folder"),
        (_pipe, "cannot be read: is not a plain file"),
        (_miscounted, "not a binary STL file as exports have"),
    ],
)
def test_a_mesh_that_no_export_has_is_refused(
    make: Callable[[Path], str], phrase: str, model: RobotModel, folder: Path
) -> None:
    mesh = f'<visual><geometry><mesh filename="{make(folder)}"/></geometry></visual>'
    insert(folder / f"{model.name}.urdf", "</link>", mesh)
    found = reasons(model, folder)
    assert "mujoco-urdf" in found
    assert all(phrase in reason for reason in found.values())


@pytest.mark.skipif(os.name == "nt", reason="no links and pipes here")
def test_pipes_and_devices_in_the_place_of_exports_are_not_waited_for(model: RobotModel, folder: Path) -> None:
    scene, urdf = folder / "scene.xml", folder / f"{model.name}.urdf"
    for file in (scene, urdf):
        file.unlink()
    os.mkfifo(scene)
    urdf.symlink_to("/dev/zero")
    assert [(each.path.name, each.what) for each in drift(model, folder.parent)] == [
        (urdf.name, "differs from line 1"),
        ("scene.xml", "unreadable: is a named pipe, not a file"),
    ]
    assert {*reasons(model, folder).values()} == {f"{urdf.name}: no such file; write it with 'dh2sim export'"}


def test_an_export_that_grew_is_read_no_further_than_it_should_be(model: RobotModel, folder: Path) -> None:
    with (folder / "scene.xml").open("r+b") as stream:
        stream.truncate(50 * 10**9)  # with holes, which take no room
    (found,) = drift(model, folder.parent)
    assert found.what.startswith("differs from line ")
