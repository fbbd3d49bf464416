"""The scene of a state: things are where the table has them."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim import Robot
from dh2sim.formats.mjcf.scene import to_scene
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.kinematics.forward import joint_poses
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.model.variants import without_meshes
from dh2sim.robot.catalog import builtin_robots
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from dh2sim.view.events import (
    CompareMisread,
    EditCell,
    FoundWorkspace,
    MoveJoint,
    SelectRow,
    SetJoints,
    SetOpacity,
    Show,
)
from dh2sim.view.initial_state import open_state
from dh2sim.view.scene.ellipsoids import force_scale
from dh2sim.view.scene.items import Label, Lines, Points, Polyline, Scene, Solid, Triad
from dh2sim.view.scene.scene import scene_of
from dh2sim.view.state import Part, ViewState, within
from tests.strategies import robots_with_joint_vectors
from tests.view.states import STANFORD, WORKSPACE, after
from tests.view.test_frame_readout import jacobian_by_differences
from tests.view.test_solids import matrix, pose_in_scene


def below(scene: Scene, root: str) -> set[str]:
    return {name for name in scene if name.startswith(f"{root}/")}


def frame_path(state: ViewState, number: int) -> str:
    """The item of a DH frame: each link carries its own."""
    return f"/robot/{state.model.all_links[number].name}/dh_{number}"


@settings(max_examples=min(40, settings().max_examples))
@given(robots_with_joint_vectors(max_rows=6))
def test_links_and_frames_are_where_the_table_has_them(robot: tuple[RobotSpec, Array]) -> None:
    spec, vectors = robot
    opened = open_state(spec)
    state = after(opened, SetJoints(q=tuple(vectors[0].tolist())))
    assert state.q == within(opened.model, tuple(vectors[0].tolist()))
    scene = scene_of(state)
    scale = max(1.0, state.model.reach)
    frames = table_frame_poses(state.spec, state.q)
    for i, T in enumerate(frames):
        assert np.allclose(pose_in_scene(scene, frame_path(state, i)), T, rtol=0, atol=1e-12 * scale)
    tool = f"/robot/link_{len(spec.rows)}/tool0"
    expected = table_tool_pose(state.spec, state.q)
    assert np.allclose(pose_in_scene(scene, tool), expected, rtol=0, atol=1e-12 * scale)
    for i, T in enumerate(joint_poses(state.model.chain, state.q), start=1):
        assert np.allclose(matrix(scene[f"/robot/link_{i}"]), T, rtol=0, atol=1e-12 * scale)


def test_a_move_changes_poses_and_no_solid() -> None:
    before, moved = scene_of(STANFORD), scene_of(after(STANFORD, MoveJoint(joint=0, value=-1.0)))
    assert before.keys() == moved.keys()
    changed = {name for name in before if before[name] != moved[name]}
    assert changed >= {f"/robot/link_{i}" for i in range(1, 7)}
    assert not any(isinstance(before[name], Solid | Triad) for name in changed), "they follow what carries them"
    assert "/robot/base_link" not in changed


@pytest.mark.parametrize("name", builtin_robots())
def test_the_floor_and_the_pedestal_are_where_the_exported_scene_has_them(name: str) -> None:
    robot = Robot.load(name)
    assets = {f"{name}.xml": to_mjcf(without_meshes(robot.model)).encode()}
    compiled = mujoco.MjModel.from_xml_string(to_scene(robot.model), assets)
    scene = scene_of(open_state(load_robot(name)))
    assert scene["/grid"].position == tuple(compiled.geom("floor").pos)
    names = [compiled.geom(i).name for i in range(compiled.ngeom)]
    assert ("/pedestal" in scene) is ("pedestal" in names)
    if "pedestal" in names:
        data, geom = mujoco.MjData(compiled), compiled.geom("pedestal")
        mujoco.mj_kinematics(compiled, data)
        drawn = scene["/pedestal"]
        assert isinstance(drawn, Solid)
        placed = np.array(drawn.vertices) @ matrix(drawn)[:3, :3].T + drawn.position
        turned = (placed - data.geom_xpos[geom.id]) @ data.geom_xmat[geom.id].reshape(3, 3)
        radius, half = geom.size[:2]
        assert np.abs(turned[:, 2]).max() == pytest.approx(half)
        assert np.linalg.norm(turned[:, :2], axis=1).max() == pytest.approx(radius)
    hidden = scene_of(after(open_state(load_robot(name)), Show(part=Part.GRID, on=False)))
    assert not {"/grid", "/pedestal"} & hidden.keys()


@pytest.mark.parametrize(
    ("part", "kind", "root"),
    [
        (Part.SHAPES, Solid, "/robot"),
        (Part.FRAMES, Triad, "/robot"),
        (Part.ANNOTATIONS, Polyline, "/row"),
        (Part.FRAME_NAMES, Label, "/names"),
        (Part.GRID, Lines, "/grid"),
    ],
)
def test_what_is_hidden_is_not_in_the_scene(part: Part, kind: type, root: str) -> None:
    def found(state: ViewState) -> set[str]:
        scene = scene_of(state)
        return {name for name in below(scene, root) if isinstance(scene[name], kind)}

    assert found(STANFORD)
    assert not found(after(STANFORD, Show(part=part, on=False)))


def test_frames_with_one_origin_have_one_label_and_every_frame_is_named_once() -> None:
    scene = scene_of(STANFORD)
    texts = [scene[name].text for name in sorted(below(scene, "/names"))]  # type: ignore[union-attr]
    assert texts == ["{0}", "{1}", "{2}", "{3} {4} {5}", "{6} tool0"]


def test_the_first_page_shows_frames_and_an_explained_row_inside_a_robot_that_can_be_seen_through() -> None:
    scene = scene_of(STANFORD)
    assert {Part.FRAMES, Part.FRAME_NAMES, Part.ANNOTATIONS, Part.HANDLE} <= STANFORD.shown
    assert sum(isinstance(item, Triad) for item in scene.values()) == 8
    robot = [item for name, item in scene.items() if isinstance(item, Solid) and name.startswith("/robot/")]
    assert all(0.0 < item.opacity < 0.5 for item in robot)


def test_the_row_that_is_chosen_is_explained() -> None:
    explained = scene_of(after(STANFORD, SelectRow(row=1)))
    labels = {item.text for name in below(explained, "/row") if isinstance(item := explained[name], Label)}
    assert "α₂ = 90°" in labels
    assert "α₁ = -90°" not in labels


def test_opacity_is_a_factor_from_0_to_1_and_changes_nothing_but_the_robots_surfaces() -> None:
    compared = after(STANFORD, CompareMisread())
    scenes = {opacity: scene_of(after(compared, SetOpacity(opacity=opacity))) for opacity in (1.0, 0.25, 7.0)}
    changed = {name for name, item in scenes[1.0].items() if item != scenes[0.25][name]}
    assert changed == {name for name in below(scenes[1.0], "/robot") if isinstance(scenes[1.0][name], Solid)}
    for name in changed:
        opaque, faint = scenes[1.0][name], scenes[0.25][name]
        assert isinstance(opaque, Solid)
        assert isinstance(faint, Solid)
        assert faint.opacity == 0.25 * opaque.opacity
    assert scenes[7.0] == scenes[1.0]
    for wrong in (-0.1, float("nan")):
        assert after(compared, SetOpacity(opacity=wrong)) == compared


def test_without_soft_shading_surfaces_are_plain_and_nothing_else_changes() -> None:
    compared = after(STANFORD, CompareMisread())
    soft, plain = scene_of(compared), scene_of(after(compared, Show(part=Part.SHADING, on=False)))
    solids = {name for name, item in soft.items() if isinstance(item, Solid)}
    assert {name.split("/")[1] for name in solids} == {"robot", "ghost", "pedestal"}
    assert {name for name in soft if soft[name] != plain[name]} == solids
    assert all(item.plain for item in plain.values() if isinstance(item, Solid))
    assert not any(item.plain for item in soft.values() if isinstance(item, Solid))


def test_the_velocity_ellipsoid_is_around_tool0_with_the_half_axes_of_the_jacobian() -> None:
    state = after(STANFORD, Show(part=Part.ELLIPSOID, on=True), MoveJoint(joint=1, value=0.8))
    scene = scene_of(state)
    surface, axes = scene["/ellipsoid/surface"], scene["/ellipsoid/axes"]
    assert isinstance(surface, Solid)
    assert isinstance(axes, Lines)
    T = pose_in_scene(scene, "/ellipsoid/surface")
    assert np.allclose(T[:3, 3], table_tool_pose(state.spec, state.q)[:3, 3], rtol=0, atol=1e-12)
    J = jacobian_by_differences(state.spec, state.q)[:3]
    shape = T[:3, :3] @ np.diag(np.square(surface.scale)) @ T[:3, :3].T
    assert np.allclose(shape, 0.15**2 * J @ J.T, rtol=0, atol=1e-8)
    assert np.allclose([end for _, end in axes.segments], np.diag(surface.scale), rtol=0, atol=1e-12)
    assert np.allclose(np.linalg.norm(surface.vertices, axis=1), 1.0)
    assert not below(scene_of(STANFORD), "/ellipsoid")


def test_the_ellipsoid_of_a_planar_arm_is_flat_and_of_a_robot_that_cannot_move_none() -> None:
    planar = scene_of(after(open_state(load_robot("planar_2r")), Show(part=Part.ELLIPSOID, on=True)))
    surface = planar["/ellipsoid/surface"]
    assert isinstance(surface, Solid)
    assert 0.0 < surface.scale[2] < 0.02 * surface.scale[0]
    fixed = open_state(parse_robot("name: x\nconvention: standard\njoints: [{type: fixed, a: 1}]\n"))
    assert not below(scene_of(after(fixed, Show(part=Part.ELLIPSOID, on=True))), "/ellipsoid")


def test_the_ghost_is_where_the_misread_table_has_it() -> None:
    state = after(STANFORD, CompareMisread(), MoveJoint(joint=1, value=0.3))
    assert state.ghost is not None
    scene, ghost = scene_of(state), state.ghost.model
    frames = table_frame_poses(ghost.spec, state.q)
    for i, joint in enumerate(ghost.chain.joints, start=1):
        assert np.allclose(matrix(scene[f"/ghost/link_{i}"]) @ joint.T_joint_dh, frames[i], rtol=0, atol=1e-12)
    assert not below(scene_of(after(state, Show(part=Part.GHOST, on=False))), "/ghost")


def test_the_trace_is_a_line_through_where_the_tool_was() -> None:
    state = after(
        STANFORD, Show(part=Part.TRACE, on=True), MoveJoint(joint=0, value=0.0), MoveJoint(joint=1, value=0.0)
    )
    trace = scene_of(state)["/trace"]
    assert isinstance(trace, Polyline)
    qs = [STANFORD.q, (0.0, *STANFORD.q[1:]), (0.0, 0.0, *STANFORD.q[2:])]
    assert np.allclose(trace.points, [table_tool_pose(STANFORD.spec, q)[:3, 3] for q in qs], rtol=0, atol=1e-12)


def test_the_grid_has_round_cells_whatever_the_robots_size() -> None:
    for name in ("stanford", "puma560", "ssrms", "planar_2r"):
        scene = scene_of(open_state(load_robot(name)))
        cells, axes = scene["/grid/cells"], scene["/grid/axes"]
        assert isinstance(cells, Lines)
        assert isinstance(axes, Lines)
        segments = [*cells.segments, *axes.segments]
        xs = sorted(start[0] for start, end in segments if start[0] == end[0])
        ys = sorted(start[1] for start, end in segments if start[1] == end[1])
        assert len(xs) == 21
        assert xs == ys
        assert np.allclose(np.diff(xs), xs[1] - xs[0])
        assert f"{xs[1] - xs[0]:.3e}"[:5] in ("1.000", "2.000", "5.000")
        assert [start[0] for start, end in axes.segments if start[0] == end[0]] == [0.0]


def test_the_row_that_is_edited_is_the_one_that_is_explained_from_the_beginning() -> None:
    assert scene_of(STANFORD) == scene_of(after(STANFORD, SelectRow(row=0)))


def test_the_force_ellipsoid_has_the_forces_that_joint_torques_of_norm_1_hold() -> None:
    state = after(STANFORD, Show(part=Part.FORCE, on=True), MoveJoint(joint=1, value=0.8))
    scene = scene_of(state)
    surface = scene["/force/surface"]
    assert isinstance(surface, Solid)
    T = pose_in_scene(scene, "/force/surface")
    J = jacobian_by_differences(state.spec, state.q)[:3]
    per_newton = force_scale(state.model)
    for axis, half in zip(T[:3, :3].T, surface.scale, strict=True):
        assert np.linalg.norm(J.T @ (half / per_newton * axis)) == pytest.approx(1.0, abs=1e-6)
    assert not below(scene_of(STANFORD), "/force")
    planar = scene_of(after(open_state(load_robot("planar_2r")), Show(part=Part.FORCE, on=True)))["/force/surface"]
    assert isinstance(planar, Solid)
    assert max(planar.scale) == planar.scale[2] < 2.0, "across the plane no joint has to hold a force: cut off"


def test_reached_points_are_drawn_by_their_manipulability_and_cut_open() -> None:
    state = after(STANFORD, Show(part=Part.WORKSPACE, on=True))
    assert not below(scene_of(state), "/workspace")
    found = WORKSPACE
    other = open_state(load_robot("planar_2r")).model
    assert after(state, FoundWorkspace(model=other, workspace=found)).workspace is None, "of another robot"
    state = after(state, FoundWorkspace(model=state.model, workspace=found))
    points = scene_of(state)["/workspace/points"]
    assert isinstance(points, Points)
    behind = found.centers[:, 1] > 0.0
    assert np.array_equal(points.points, found.centers[behind])
    brightest = int(np.argmax([sum(color) for color in points.colors]))
    assert found.manipulability[behind][brightest] > 0.98 * found.manipulability.max()
    whole = scene_of(after(state, Show(part=Part.CUT, on=False)))["/workspace/points"]
    assert isinstance(whole, Points)
    assert np.array_equal(whole.points, found.centers)
    assert after(state, EditCell(row=1, column="d", text="0.2")).workspace is None, "of the robot before"


def test_the_section_turns_with_the_arm_so_that_the_tool_is_in_its_plane() -> None:
    state = after(STANFORD, Show(part=Part.SECTION, on=True))
    state = after(state, FoundWorkspace(model=state.model, workspace=WORKSPACE), MoveJoint(joint=0, value=0.7))
    scene = scene_of(state)
    tool = table_tool_pose(state.spec, state.q)[:3, 3]
    in_plane = np.linalg.inv(pose_in_scene(scene, "/section/plane"))[:3] @ [*tool, 1.0]
    assert np.allclose(in_plane, [np.hypot(*tool[:2]), tool[2], 0.0], rtol=0, atol=1e-12)
    limits, singular = scene["/section/plane/limits"], scene["/section/plane/singular"]
    assert isinstance(limits, Lines)
    assert isinstance(singular, Lines)
    assert len(limits.segments) == 3
    assert singular.segments == (((0.9, 0.8, 0.0), (0.1, 0.8, 0.0)),)
    assert "/section/plane/inside" in scene
