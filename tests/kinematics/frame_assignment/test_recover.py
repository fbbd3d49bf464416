"""From axes in every special position to a table that is the chain's for all configurations."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dh2sim.errors import Dh2simError
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.far_frames import far_frames
from dh2sim.kinematics.frame_assignment.recover import chain_reach, measure_residual, recover_table, within
from dh2sim.kinematics.serial_chain import SerialChain, SerialJoint
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.kinematics.transforms import compose, invert
from dh2sim.robot.catalog import builtin_robots
from dh2sim.robot.read import load_robot
from dh2sim.robot.row import Convention, JointType
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.kinematics.frame_assignment.chains import Axis, chain_of, pose, random_axes, tip_by_exponentials, unit
from tests.kinematics.perturbed_arms import KINDS, REACHES, perturbed

CONVENTIONS = (Convention.STANDARD, Convention.MODIFIED)
Z = np.array([0.0, 0.0, 1.0])


def _off_by(spec: RobotSpec, axes: list[Axis], T_base_tip: Array, rng: np.random.Generator) -> float:
    """The largest difference of the tip's pose from the product of exponentials, at random configurations."""
    q = rng.uniform(-math.pi, math.pi, (20, len(axes)))
    expected = np.array([tip_by_exponentials(axes, T_base_tip, row) for row in q])
    return float(np.abs(table_tool_pose(spec, q) - expected).max())


def _serial(spec: RobotSpec) -> SerialChain:
    """A robot's chain as a URDF would tell it: links at their joints, fixed rows merged."""
    chain = build_chain(spec)
    joints, T = [], np.eye(4)
    for joint in chain.joints:
        T = T @ joint.T_parent_joint
        if joint.type.moves:
            axis = read_only([0.0, 0.0, joint.sign])
            joints.append(
                SerialJoint(name=joint.name, type=joint.type, T_parent_link=T, axis=axis, point=read_only([0, 0, 0]))
            )
            T = np.eye(4)
    return SerialChain(joints=tuple(joints), T_link_tip=T @ compose(chain.joints[-1].T_joint_dh, chain.T_dhn_tool0))


@pytest.mark.parametrize("noise", [0.0, 1e-12, 1e-9, 1e-6, 1e-3])
@settings(max_examples=min(60, settings().max_examples))
@given(seed=st.integers(0, 2**32), count=st.integers(1, 10), convention=st.sampled_from(CONVENTIONS))
def test_the_table_of_any_chain_is_the_chain_for_all_configurations(
    noise: float, seed: int, count: int, convention: Convention
) -> None:
    rng = np.random.default_rng(seed)
    axes, T_base_tip = random_axes(rng, count, noise)
    chain = chain_of(axes, T_base_tip, rng)
    recovery = recover_table(chain, convention=convention)
    allowed = 1e-9 * max(1.0, recovery.reach)
    assert _off_by(recovery.spec, axes, T_base_tip, rng) <= allowed
    assert within(measure_residual(recovery.spec, chain, 50, 1.0), 1e-9, recovery.reach)
    for row in recovery.spec.rows:
        assert max(abs(row.a), abs(row.d)) <= 11 * max(recovery.reach, 1e-9)
        assert row.convention in (convention, Convention.HAYATI, Convention.STANDARD)
        assert not row.flip
    if noise == 0.0:
        assert {row.convention for row in recovery.spec.rows} == {convention}


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("name", builtin_robots())
def test_every_robot_comes_back_to_rounding_error(name: str, convention: Convention) -> None:
    spec = load_robot(name)
    recovery = recover_table(_serial(spec), convention=convention)
    q = np.random.default_rng(3).uniform(-3, 3, (200, len(spec.moving_rows)))
    error = np.abs(table_tool_pose(recovery.spec, q) - table_tool_pose(spec, q)).max()
    assert error <= 1e-12 * max(1.0, recovery.reach)


@pytest.mark.parametrize("name", ["stanford", "puma560_standard", "scara", "cylindrical_wrist", "spherical_wrist"])
def test_a_table_with_the_simplest_choices_comes_back_number_for_number(name: str) -> None:
    spec = load_robot(name)
    again = recover_table(_serial(spec), convention=Convention.STANDARD).spec
    assert [(r.a, r.alpha, r.d, r.theta) for r in again.rows] == [(r.a, r.alpha, r.d, r.theta) for r in spec.rows]
    assert not again.base.pose.xyz.any()
    assert not again.tool.xyz.any()


@pytest.mark.parametrize("name", ["puma560", "rpr", "arm_5r"])
def test_so_does_a_modified_one(name: str) -> None:
    spec = load_robot(name)
    again = recover_table(_serial(spec), convention=Convention.MODIFIED).spec
    assert [(r.a, r.alpha, r.d, r.theta) for r in again.rows] == [(r.a, r.alpha, r.d, r.theta) for r in spec.rows]


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_each_dh_frame_stands_still_on_its_link(convention: Convention) -> None:
    rng = np.random.default_rng(5)
    axes, T_base_tip = random_axes(rng, 7, 1e-4)
    recovery = recover_table(chain_of(axes, T_base_tip), convention=convention)
    q = rng.uniform(-3, 3, 7)
    frames = table_frame_poses(recovery.spec, q)
    for i, T_link_dh in enumerate(recovery.T_link_dh, start=1):
        # links of this chain are turned like the base and stand on their axes at zero
        T_base_link = tip_by_exponentials(axes[:i], pose(np.eye(3), axes[i - 1].point), q[:i])
        assert np.abs(T_base_link @ T_link_dh - frames[i]).max() < 1e-9


def test_nearly_parallel_axes_make_a_hayati_row_and_no_distant_normal() -> None:
    tilted = unit([2e-5, 1e-5, 1.0])
    axes = [Axis(np.zeros(3), Z), Axis(np.array([0.4, 0.0, 0.0]), tilted), Axis(np.array([0.7, 0.0, 0.0]), Z)]
    T_base_tip = pose(np.eye(3), np.array([0.7, 0.0, 0.1]))
    recovery = recover_table(chain_of(axes, T_base_tip), tolerance=1e-12)
    assert [row.convention.value for row in recovery.spec.rows] == ["hayati", "hayati", "standard"]
    first = recovery.spec.rows[0]
    assert (first.a, first.d) == (0.4, 0.0)
    assert first.alpha == pytest.approx(-1e-5, rel=1e-9)
    assert first.beta == pytest.approx(2e-5, rel=1e-9)
    normal_at = recovery.assignment.steps[0].normal_at
    assert normal_at is not None
    assert normal_at > 10 * recovery.reach
    assert _off_by(recovery.spec, axes, T_base_tip, np.random.default_rng(0)) < 2e-12


@pytest.mark.slow
@pytest.mark.parametrize("convention", [Convention.STANDARD, Convention.MODIFIED])
@pytest.mark.parametrize("size", [1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1])
@pytest.mark.parametrize("kind", KINDS)
def test_frames_remain_within_reach_however_little_axes_are_turned(
    kind: str, size: float, convention: Convention
) -> None:
    for seed in range(2):
        axes, T_base_tip = perturbed(kind, size, seed)
        recovery = recover_table(chain_of(axes, T_base_tip), convention=convention)
        assert recovery.residual.largest < 1e-9
        assert _off_by(recovery.spec, axes, T_base_tip, np.random.default_rng(seed)) < 1e-9
        exact = recover_table(chain_of(axes, T_base_tip), convention=convention, tolerance=1e-13)
        assert exact.residual.largest < 3e-13
        q = np.random.default_rng(seed).uniform(-3, 3, (100, len(axes)))
        q[:, [axis.type is JointType.PRISMATIC for axis in axes]] *= 0.03
        for spec in (recovery.spec, exact.spec):
            assert np.linalg.norm(table_frame_poses(spec, q)[..., :3, 3], axis=-1).max() < REACHES[kind]
            assert not far_frames(spec).frames


@pytest.mark.parametrize("size", [0.0, 1e-4])
@pytest.mark.parametrize("kind", KINDS)
def test_a_file_that_puts_joints_far_along_their_axes_makes_no_far_frames(kind: str, size: float) -> None:
    axes, T_base_tip = perturbed(kind, size, 0)
    slid = [
        Axis(point=axis.point + 300.0 * (-1) ** i * axis.direction, direction=axis.direction, type=axis.type)
        for i, axis in enumerate(axes)
    ]
    recovery = recover_table(chain_of(slid, T_base_tip))
    assert recovery.residual.largest < 1e-9
    q = np.zeros(len(axes))
    assert np.linalg.norm(table_frame_poses(recovery.spec, q)[..., :3, 3], axis=-1).max() < REACHES[kind]
    assert recovery.reach == pytest.approx(recover_table(chain_of(axes, T_base_tip)).reach, rel=0.05)


def test_axes_turned_a_little_about_their_common_normal_make_a_standard_row() -> None:
    for angle in (1e-7, 1e-3):
        axes = [Axis(np.zeros(3), Z), Axis(np.array([0.4, 0.0, 0.1]), unit([0.0, -angle, 1.0]))]
        recovery = recover_table(chain_of(axes, pose(np.eye(3), np.array([0.6, 0.0, 0.1]))), tolerance=1e-12)
        first = recovery.spec.rows[0]
        assert first.convention is Convention.STANDARD
        assert (first.a, first.d) == (0.4, 0.1)
        assert first.alpha == pytest.approx(angle, rel=1e-5)


def test_of_a_modified_table_the_rows_before_a_hayati_row_are_standard_ones() -> None:
    tilted = unit([1e-5, 0.0, 1.0])
    x = np.array([1.0, 0.0, 0.0])
    axes = [
        Axis(np.zeros(3), x),
        Axis(np.zeros(3), Z),
        Axis(np.array([0.4, 0.0, 0.0]), tilted),
        Axis(np.array([0.4, 0.0, 0.0]), x),
        Axis(np.array([0.4, 0.0, 0.3]), x),
    ]
    T_base_tip = pose(np.eye(3), np.array([0.5, 0.0, 0.3]))
    recovery = recover_table(chain_of(axes, T_base_tip), convention=Convention.MODIFIED, tolerance=1e-12)
    assert [row.convention.value for row in recovery.spec.rows] == [
        "standard",
        "hayati",
        "modified",
        "modified",
        "modified",
    ]
    assert _off_by(recovery.spec, axes, T_base_tip, np.random.default_rng(0)) < 2e-12


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("seed", range(8))
def test_noise_of_a_tenth_of_a_nanometre_changes_no_number_by_more(seed: int, convention: Convention) -> None:
    tables: list[list[list[float]]] = []
    for noise in (0.0, 1e-10):
        axes, T_base_tip = random_axes(np.random.default_rng(seed), 4, noise)
        spec = recover_table(chain_of(axes, T_base_tip), convention=convention).spec
        tables.append([[r.a, math.sin(r.alpha), math.cos(r.alpha), r.d, math.sin(r.theta)] for r in spec.rows])
    assert np.abs(np.array(tables[0]) - np.array(tables[1])).max() < 2e-9


def test_noise_of_a_nanometre_leaves_a_parallel_arm_its_shape() -> None:
    """Lengths stay, no frame jumps: what the noise adds are second twists of its own size."""
    rng = np.random.default_rng(4)
    spec = load_robot("puma560_standard")
    clean = _serial(spec)
    noisy = SerialChain(
        joints=tuple(
            SerialJoint(
                name=j.name,
                type=j.type,
                T_parent_link=j.T_parent_link,
                axis=unit(j.axis + 1e-9 * rng.uniform(-1, 1, 3)),
                point=j.point,
            )
            for j in clean.joints
        ),
        T_link_tip=clean.T_link_tip,
    )
    rows = recover_table(noisy).spec.rows
    for row, meant in zip(rows, spec.rows, strict=True):
        assert abs(row.a - meant.a) < 1e-8
        assert abs(row.d - meant.d) < 1e-8
        assert abs(math.remainder(row.alpha - meant.alpha, math.tau)) < 1e-8
        assert abs(row.theta - meant.theta) < 1e-8
        assert abs(row.beta) < 1e-8


def test_a_looser_tolerance_makes_rounded_angles_right_ones() -> None:
    """1.5708 for pi/2, as many URDFs have it."""
    almost = math.pi / 2 - 1.5708
    axes = [
        Axis(np.zeros(3), Z),
        Axis(np.array([0.0, 0.0, 0.3]), unit([0.0, -1.0, almost])),
        Axis(np.array([0.4, 0.0, 0.3]), unit([0.0, -1.0, almost])),
    ]
    T_base_tip = pose(np.eye(3), np.array([0.7, 0.0, 0.3]))
    exact = recover_table(chain_of(axes, T_base_tip))
    simple = recover_table(chain_of(axes, T_base_tip), tolerance=1e-4)
    assert exact.spec.rows[0].alpha != math.pi / 2
    assert _off_by(exact.spec, axes, T_base_tip, np.random.default_rng(0)) < 1e-14
    assert simple.spec.rows[0].alpha == math.pi / 2
    assert [row.a for row in simple.spec.rows] == [0.0, 0.4, 0.3]
    assert 1e-7 < simple.residual.largest < 1e-4


def test_a_residual_that_is_no_number_is_not_within_any_tolerance() -> None:
    axes = [Axis(np.zeros(3), Z)]
    recovery = recover_table(chain_of(axes, np.eye(4)))
    assert within(recovery.residual, 1e-9, 1.0)
    broken = chain_of(axes, pose(np.eye(3), np.array([np.nan, 0.0, 0.0])))
    assert not within(measure_residual(recovery.spec, broken, 10, 1.0), 1e300, 1.0)


def test_the_residual_names_the_joint_that_is_wrong() -> None:
    chain = _serial(load_robot("puma560_standard"))
    spec = recover_table(chain).spec
    joint = chain.joints[3]
    moved = SerialJoint(
        name=joint.name,
        type=joint.type,
        T_parent_link=joint.T_parent_link,
        axis=-joint.axis,
        point=joint.point,
    )
    wrong = SerialChain(joints=(*chain.joints[:3], moved, *chain.joints[4:]), T_link_tip=chain.T_link_tip)
    residual = measure_residual(spec, wrong, 100, 1.0)
    assert residual.worst == "joint 'joint_4'"
    assert residual.rotation == pytest.approx(math.pi)
    assert residual.configurations == 100


def test_the_reach_is_the_way_over_all_joints() -> None:
    axes = [Axis(np.array([0.0, 0.0, 0.5]), Z), Axis(np.array([0.3, 0.4, 0.5]), Z, JointType.PRISMATIC)]
    assert chain_reach(chain_of(axes, pose(np.eye(3), np.array([0.3, 0.4, 0.0])))) == pytest.approx(1.5)


def test_a_chain_of_400_joints_is_recovered() -> None:
    rng = np.random.default_rng(8)
    axes, T_base_tip = random_axes(rng, 400, 0.0)
    chain = chain_of(axes, T_base_tip)
    # as a file would tell it, in links of its own: far from the base the axes above are rounded
    recovery = recover_table(chain)
    assert len(recovery.spec.rows) == 400
    assert within(recovery.residual, 1e-9, recovery.reach)


def test_hayati_is_no_convention_of_a_whole_table() -> None:
    with pytest.raises(Dh2simError, match=r"^a table is made in the standard or the modified convention$"):
        recover_table(chain_of([Axis(np.zeros(3), Z)], np.eye(4)), convention=Convention.HAYATI)


def test_the_transforms_of_links_are_rigid() -> None:
    axes, T_base_tip = random_axes(np.random.default_rng(2), 6, 0.0)
    for T in recover_table(chain_of(axes, T_base_tip)).T_link_dh:
        assert np.abs(compose(T, invert(T)) - np.eye(4)).max() < 1e-14
