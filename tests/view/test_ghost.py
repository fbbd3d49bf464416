from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given

from dh2sim.errors import ConfigurationError
from dh2sim.kinematics.forward import joint_poses
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.model.build import build_model
from dh2sim.robot.row import Limits, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from dh2sim.view.scene.ghost import (
    ToolOffset,
    ghost_configuration,
    ghost_scene,
    ghost_text,
    misread,
    misread_offset,
    misread_text,
)
from dh2sim.view.scene.items import Placed, Solid
from tests.sample_robots import HAYATI, MODIFIED, ODD_ROBOT, STANDARD, robot, row
from tests.strategies import robots_with_joint_vectors


def limited(entry: Row, lower: float, upper: float) -> Row:
    return replace(entry, limits=Limits(position=(lower, upper)))


def arm(name: str, *rows: Row, **more: Array) -> RobotSpec:
    return RobotSpec(name=name, rows=rows, configurations=more)


def test_a_ghost_is_the_robot_in_one_translucent_colour() -> None:
    model = build_model(ODD_ROBOT)
    q = model.home + 0.1
    scene = ghost_scene(model, q, (0.1, 0.2, 0.3), 0.25)
    assert scene["/ghost"] == Placed()
    solids = [item for item in scene.values() if isinstance(item, Solid)]
    assert len(solids) == sum(len(link.shapes) for link in model.all_links)
    assert {(solid.color, solid.opacity) for solid in solids} == {((0.1, 0.2, 0.3), 0.25)}
    for i, T in enumerate(joint_poses(model.chain, q), start=1):
        np.testing.assert_allclose(scene[f"/ghost/link_{i}"].position, T[:3, 3], rtol=0, atol=1e-15)
    assert all(name == "/ghost" or name.startswith("/ghost/") for name in scene)


def test_a_ghost_needs_a_joint_vector_of_its_own_length() -> None:
    with pytest.raises(ConfigurationError, match="expected 5 joint coordinates"):
        ghost_scene(build_model(ODD_ROBOT), np.zeros(6))


def test_joints_are_matched_by_name_whatever_their_order() -> None:
    here = build_model(arm("here", row("a", a=0.3), row("b", a=0.2), row("c", a=0.1)))
    there = build_model(arm("there", row("c", a=0.4), row("a", a=0.1)))
    found = ghost_configuration(there, here, [0.1, 0.2, 0.3])
    assert found.q.tolist() == [0.3, 0.1]
    assert found.notes == ()


def test_joints_are_matched_by_order_where_no_name_is_the_same_and_the_rest_stays_at_home() -> None:
    here = build_model(arm("here", row("a", a=0.3), row("b", a=0.2)))
    there = build_model(
        arm("there", row("one", a=0.4), row("two", a=0.1), row("three", a=0.1), home=np.array([0.5, 0.6, 0.7]))
    )
    found = ghost_configuration(there, here, [0.1, 0.2])
    assert found.q.tolist() == [0.1, 0.2, 0.7]
    assert found.notes == ("Joints of there that here does not have, shown at home: three.",)


def test_angles_and_lengths_are_never_confused() -> None:
    here = build_model(arm("here", row("a", a=0.3), row("b", "prismatic", a=0.2)))
    there = build_model(arm("there", row("a", "prismatic", a=0.4), row("b", "prismatic", a=0.1)))
    found = ghost_configuration(there, here, [1.5, 0.1])
    assert found.q.tolist() == [there.home[0], 0.1]
    assert found.notes == ("Joints of there that here does not have, shown at home: a.",)


def test_a_ghost_stops_at_its_limits() -> None:
    here = build_model(arm("here", row("a", a=0.3), row("b", a=0.3), row("c", "continuous", a=0.3)))
    there = build_model(
        arm("there", limited(row("a", a=0.4), -1.0, 0.5), limited(row("b", a=0.1), -0.5, 1.0), row("c", "continuous"))
    )
    found = ghost_configuration(there, here, [2.0, -2.0, 9.0])
    assert found.q.tolist() == [0.5, -0.5, 9.0]
    assert found.notes == ("Joints of there at their limits: a, b.",)


def test_another_robot_is_described_by_its_tool_and_the_joints_that_differ() -> None:
    here, there = build_model(robot("puma560")), build_model(robot("planar_2r"))
    q = np.radians([10.0, -40.0, 20.0, 30.0, 50.0, 60.0])
    configuration = ghost_configuration(there, here, q)
    ours, theirs = table_tool_pose(robot("puma560"), q), table_tool_pose(robot("planar_2r"), configuration.q)
    distance = np.linalg.norm(theirs[:3, 3] - ours[:3, 3])
    angle = np.degrees(np.arccos(0.5 * (np.trace(ours[:3, :3].T @ theirs[:3, :3]) - 1.0)))
    assert ghost_text(there, here, q) == (f"planar_2r has tool0 {distance:.3g} m away and turned by {angle:.3g}°.")
    limited_there = build_model(arm("there", limited(row("a", a=0.3), -1.0, 0.5)))
    wide = build_model(arm("here", limited(row("a", a=0.3), -1.0, 2.5)))
    assert ghost_text(limited_there, wide, [2.0]).endswith(" Joints of there at their limits: a.")


def test_misreading_keeps_the_numbers_and_changes_the_convention() -> None:
    read = misread(ODD_ROBOT)
    assert [entry.convention for entry in read.rows] == [
        STANDARD if entry.convention is MODIFIED else MODIFIED for entry in ODD_ROBOT.rows
    ]
    for name in ("name", "type", "a", "alpha", "d", "theta", "beta", "flip", "limits"):
        assert [getattr(entry, name) for entry in read.rows] == [getattr(entry, name) for entry in ODD_ROBOT.rows]
    assert (read.name, read.convention) == ("odd_misread", MODIFIED)
    assert read.base is ODD_ROBOT.base
    assert read.tool is ODD_ROBOT.tool


def test_misreading_twice_gives_the_table_back() -> None:
    back = misread(misread(ODD_ROBOT))
    assert [entry.convention for entry in back.rows] == [entry.convention for entry in ODD_ROBOT.rows]


def test_hayati_rows_have_no_other_reading() -> None:
    mixed = RobotSpec(name="m", rows=(row("one", convention=HAYATI, beta=0.1), row("two", a=0.1)))
    assert [entry.convention for entry in misread(mixed).rows] == [HAYATI, MODIFIED]
    pure = RobotSpec(name="h", rows=(row("one", convention=HAYATI, a=0.3, beta=0.1),))
    assert misread_text(pure, [0.3]) == "All rows are Hayati rows, which have no other reading."


@given(robots_with_joint_vectors(max_rows=6))
def test_the_offset_is_that_between_the_tables_themselves(drawn: tuple[RobotSpec, Array]) -> None:
    spec, vectors = drawn
    offset = misread_offset(spec, vectors[0])
    here, there = table_tool_pose(spec, vectors[0]), table_tool_pose(misread(spec), vectors[0])
    assert offset.distance == pytest.approx(np.linalg.norm(there[:3, 3] - here[:3, 3]), rel=1e-9, abs=1e-12)
    cosine = 0.5 * (np.trace(here[:3, :3].T @ there[:3, :3]) - 1.0)
    assert math.cos(offset.angle) == pytest.approx(cosine, abs=1e-12)


def test_the_offset_of_the_misread_puma_is_given_in_metres_and_degrees() -> None:
    q = np.radians([10.0, -40.0, 20.0, 30.0, 50.0, 60.0])
    spec = robot("puma560")
    here, there = table_tool_pose(spec, q), table_tool_pose(misread(spec), q)
    distance = np.linalg.norm(there[:3, 3] - here[:3, 3])
    angle = np.degrees(np.arccos(0.5 * (np.trace(here[:3, :3].T @ there[:3, :3]) - 1.0)))
    assert misread_text(spec, q) == (
        f"Read as standard, this table has tool0 {distance:.3g} m away and turned by {angle:.3g}°."
    )


def test_mixed_conventions_are_swapped() -> None:
    assert misread_text(ODD_ROBOT, np.zeros(5)).startswith(
        "Read with standard and modified swapped, this table has tool0 "
    )


@pytest.mark.parametrize(
    ("offset", "text"),
    [
        (ToolOffset(distance=0.0, angle=0.0), "at the same pose"),
        (ToolOffset(distance=1e-12, angle=1e-12), "at the same pose"),
        (ToolOffset(distance=0.123456, angle=0.0), "0.123 m away"),
        (ToolOffset(distance=0.0, angle=math.pi), "turned by 180°"),
        (ToolOffset(distance=1234.5, angle=0.5), "1230 m away and turned by 28.6°"),
        (ToolOffset(distance=1.5e-5, angle=1e-6), "0.000015 m away and turned by 0.0000573°"),
    ],
)
def test_an_offset_is_written_with_three_digits(offset: ToolOffset, text: str) -> None:
    assert offset.text == text


def test_misreading_a_table_of_parallel_axes_makes_no_difference() -> None:
    spec = RobotSpec(name="turner", rows=(row("a", d=0.2), row("b", d=0.3)))
    assert misread_text(spec, [0.3, 0.4]) == "Read as modified, this table has tool0 at the same pose."
