from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pytest
import trimesh

from dh2sim import build_model, parse_robot
from dh2sim.export import ALL_FORMATS, Format, Loss, Lost, losses
from dh2sim.model.robot_model import RobotModel
from tests.program import contents, dh2sim
from tests.robot_files import ODD, RICH, small, write

PAIRS = "URDF: 2 pairs of links that do not collide ('dh2sim info --srdf' lists them)"


def words(model: RobotModel, formats: Iterable[Format]) -> list[str]:
    return [str(loss) for loss in losses(model, list(formats))]


def test_a_loss_is_data_until_it_is_printed() -> None:
    velocity = losses(build_model(parse_robot(RICH)), [Format.MJCF])
    assert velocity == [Loss(what=Lost.VELOCITY, format=Format.MJCF, where=("joint_1", "elbow"))]


def test_whatever_a_format_cannot_carry_is_listed() -> None:
    assert words(build_model(parse_robot(RICH)), ALL_FORMATS) == [
        "URDF: actuators and their gains",
        "URDF: armature of joint_1",
        "URDF: configurations (home, up)",
        "URDF: gravity",
        PAIRS,
        "MJCF: velocity limits of joint_1, elbow",
    ]


def test_only_what_the_formats_written_lose_is_listed() -> None:
    model = build_model(parse_robot(RICH))
    assert words(model, [Format.MJCF]) == ["MJCF: velocity limits of joint_1, elbow"]
    assert len(losses(model, [Format.URDF])) == 5


@pytest.mark.parametrize(
    ("actuators", "lost"),
    [
        ("", []),
        ("actuators: {type: none}\n", []),
        ("actuators: {type: position}\n", []),
        ("actuators: {type: position, kv: 3}\n", ["URDF: actuators and their gains"]),
        ("actuators: {type: motor}\n", ["URDF: actuators and their gains"]),
        ("actuators: {type: velocity}\n", ["URDF: actuators and their gains"]),
    ],
)
def test_actuators_are_lost_where_the_file_says_something_of_them(actuators: str, lost: list[str]) -> None:
    model = build_model(parse_robot(small() + actuators))
    assert words(model, ALL_FORMATS) == [*lost, PAIRS]


def test_a_velocity_limit_is_not_lost_where_a_velocity_actuator_holds_it() -> None:
    model = build_model(parse_robot(RICH.replace("type: position, kp: 100, kv: 10", "type: velocity, kv: 10")))
    assert losses(model, [Format.MJCF]) == []


def test_a_fixed_row_loses_no_actuator() -> None:
    lost = words(build_model(parse_robot(ODD)), ALL_FORMATS)
    assert lost == ["URDF: 5 pairs of links that do not collide ('dh2sim info --srdf' lists them)"]


def test_a_converted_mesh_is_listed_and_written(tmp_path: Path) -> None:
    trimesh.creation.box((0.1, 0.2, 0.3)).export(tmp_path / "brick.obj")
    text = small().replace("alpha: 0.651,", "alpha: 0.651, link: {mesh: {file: brick.obj}},")
    run = dh2sim("export", write(tmp_path, text), "--out", tmp_path / "made")
    assert (run.status, run.err) == (0, "")
    assert (
        "  not carried over: mesh of link_1: converted from .obj to binary STL, which has\n"
        "    no colours or textures\n"
    ) in run.out
    assert "small/meshes/link_1.stl" in contents(tmp_path / "made")


def test_what_was_estimated_and_assumed_is_listed(tmp_path: Path) -> None:
    run = dh2sim("export", write(tmp_path, RICH), "--out", tmp_path / "made")
    assert run.out.splitlines()[-3:] == [
        "  estimated from the shapes: inertia of link_1.",
        "  estimated from the shapes: mass, com, inertia of link_2.",
        "  assumed: effort limits of elbow.",
    ]
