from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mujoco
import pinocchio
import pytest
import yourdfpy

from dh2sim.engines.pinocchio_engine import PinocchioEngine
from dh2sim.errors import EngineCapacityError, EngineError
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.formats.urdf.write import to_urdf
from dh2sim.model.build import build_model
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec
from tests.engines.files import ENGINES, joint_names, path_of, pose_engine, write
from tests.refusals import refusal
from tests.sample_robots import model

READ: dict[str, Callable[[str], object]] = {
    "mujoco": mujoco.MjModel.from_xml_path,
    "pinocchio": pinocchio.buildModelFromUrdf,
    "yourdfpy": lambda path: yourdfpy.URDF.load(path, load_meshes=False),
}
"""How each library itself reads a file, for its own words of complaint."""
URDF = ENGINES[1:]
JOINTS = joint_names(model("odd"))


def message(name: str, folder: Path, joints: list[str] = JOINTS, rows: int = 6) -> str:
    """What an engine says of the file that it refuses, without the file's path."""
    path = path_of(name, folder)
    text = refusal(EngineError, pose_engine, name, path, joints, rows)
    assert text.startswith(f"{path}: ")
    return text.removeprefix(f"{path}: ")


def spoiled(folder: Path, *changes: tuple[str, str]) -> None:
    """Both files of the odd robot, with texts replaced that must be in at least one."""
    files = {"robot.xml": to_mjcf(model("odd")), "robot.urdf": to_urdf(model("odd"))}
    for old, new in changes:
        assert any(old in text for text in files.values())
        files = {name: text.replace(old, new) for name, text in files.items()}
    for name, text in files.items():
        (folder / name).write_text(text)


@pytest.mark.parametrize("name", [name for name in ENGINES if name != "pybullet"])
@pytest.mark.parametrize("content", ["this is not XML", "", "<robot", "<mujoco><nonsense/></mujoco>", None])
def test_a_file_that_an_engine_cannot_read_is_refused_in_its_words(
    name: str, content: str | None, tmp_path: Path
) -> None:
    path = path_of(name, tmp_path)
    if content is not None:
        path.write_text(content)
    library = name.split("-")[0]
    with pytest.raises(Exception) as caught:  # noqa: PT011
        READ[library](str(path))
    words = " ".join(str(caught.value).split())
    assert words
    title = "MuJoCo" if library == "mujoco" else library
    assert message(name, tmp_path) == f"{title} refuses the file: {words}"


@pytest.mark.parametrize("name", ENGINES)
def test_a_missing_dh_frame_is_named(name: str, tmp_path: Path) -> None:
    spoiled(tmp_path, ('name="dh_3"', 'name="other_3"'), ('link="dh_3"', 'link="other_3"'))
    assert message(name, tmp_path) == "frame not found: dh_3"


@pytest.mark.parametrize("name", ENGINES)
def test_missing_frames_are_all_named(name: str, tmp_path: Path) -> None:
    spoiled(tmp_path, *((f'"{old}"', f'"not_{old}"') for old in ("dh_0", "dh_5", "tool0")))
    assert message(name, tmp_path) == "frame not found: dh_0, dh_5, tool0"


@pytest.mark.parametrize("name", ENGINES)
def test_fewer_frames_than_the_table_has_are_noticed(name: str, tmp_path: Path) -> None:
    write(model("odd"), tmp_path)
    assert message(name, tmp_path, rows=8) == "frame not found: dh_7, dh_8"


@pytest.mark.parametrize("name", URDF)
def test_a_urdf_may_leave_out_all_dh_frames(name: str, tmp_path: Path) -> None:
    (tmp_path / "robot.urdf").write_text(to_urdf(model("odd"), dh_frames=False))
    assert pose_engine(name, tmp_path / "robot.urdf", JOINTS, 6).frames == ("tool0",)


def test_an_mjcf_may_not(tmp_path: Path) -> None:
    spoiled(tmp_path, *((f'<site name="dh_{i}"', f'<site name="x_{i}"') for i in range(7)))
    frames = ", ".join(f"dh_{i}" for i in range(7))
    assert message("mujoco-mjcf", tmp_path) == f"frame not found: {frames}"


@pytest.mark.parametrize("name", ENGINES)
def test_a_missing_joint_is_named(name: str, tmp_path: Path) -> None:
    write(model("odd"), tmp_path)
    assert message(name, tmp_path, [*JOINTS, "seven", "eight"]) == "moving joint not found: seven, eight"


@pytest.mark.parametrize("name", ENGINES)
def test_a_joint_too_many_is_named(name: str, tmp_path: Path) -> None:
    write(model("odd"), tmp_path)
    expected = "the joint two moves, but the robot file has no such moving row"
    assert message(name, tmp_path, [joint for joint in JOINTS if joint != "two"]) == expected


@pytest.mark.parametrize("name", URDF)
def test_a_joint_that_the_file_holds_fixed_is_missed(name: str, tmp_path: Path) -> None:
    spoiled(tmp_path, ('name="six" type="revolute"', 'name="six" type="fixed"'))
    assert message(name, tmp_path) == "moving joint not found: six"


def test_a_ball_joint_is_refused(tmp_path: Path) -> None:
    spoiled(tmp_path, ('name="four" type="hinge"', 'name="four" type="ball"'))
    text = (tmp_path / "robot.xml").read_text()
    body = text.split("<actuator>")[0]
    (tmp_path / "robot.xml").write_text(f"{body}</mujoco>")
    assert message("mujoco-mjcf", tmp_path) == "a joint is neither a hinge nor a slide"


@pytest.mark.slow
def test_pinocchio_is_not_asked_for_more_joints_than_memory_allows(tmp_path: Path) -> None:
    rows = tuple(
        Row(name=f"q{i}", type=JointType.REVOLUTE, convention=Convention.STANDARD, a=0.1) for i in range(241)
    )
    path = tmp_path / "snake.urdf"
    path.write_text(to_urdf(build_model(RobotSpec(name="snake", rows=rows))), encoding="utf-8")
    with pytest.raises(EngineCapacityError) as refusal:
        PinocchioEngine(path, [row.name for row in rows], len(rows))
    assert str(refusal.value) == "pinocchio needs 0.4 GB for 241 joints; at most 240 are allowed"
