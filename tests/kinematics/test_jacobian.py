from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given

from dh2sim.errors import ConfigurationError
from dh2sim.kinematics.batch_frame import BLOCK
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.forward import frame_names, frame_pose, geometric_jacobian
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.sample_robots import ODD_ROBOT, STANFORD, row
from tests.strategies import robots_with_joint_vectors


def differences_of_the_table(spec: RobotSpec, q: Array) -> Array:
    """Central differences of the textbook product, shape (count, 6, n)."""
    step = 1e-5
    n = q.shape[-1]
    ahead = table_tool_pose(spec, q[:, None] + step * np.eye(n))
    behind = table_tool_pose(spec, q[:, None] - step * np.eye(n))
    rate = (ahead - behind) / (2 * step)
    spin = rate[..., :3, :3] @ np.swapaxes(table_tool_pose(spec, q)[:, None, :3, :3], -1, -2)
    columns = [*np.moveaxis(rate[..., :3, 3], -1, 0), spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]]
    return np.stack(columns, axis=1)


@given(robots_with_joint_vectors(must_move=False))
def test_jacobian_equals_central_differences_of_the_table(robot: tuple[RobotSpec, Array]) -> None:
    spec, q = robot
    found = geometric_jacobian(build_chain(spec), q)
    np.testing.assert_allclose(found, differences_of_the_table(spec, q), rtol=0, atol=3e-9)


@pytest.mark.parametrize("spec", [ODD_ROBOT, STANFORD])
def test_jacobian_blocks_join_without_a_seam(spec: RobotSpec) -> None:
    q = np.random.default_rng(2).uniform(-3, 3, (BLOCK + 10, len(spec.moving_rows)))
    found = geometric_jacobian(build_chain(spec), q)
    np.testing.assert_allclose(found[-40:], differences_of_the_table(spec, q[-40:]), rtol=0, atol=1e-9)


@pytest.mark.parametrize("spec", [ODD_ROBOT, STANFORD])
def test_jacobian_of_any_frame_equals_its_central_differences(spec: RobotSpec) -> None:
    chain, step = build_chain(spec), 1e-5
    n = chain.n
    q = np.random.default_rng(1).uniform(-1, 1, n)
    for frame in frame_names(chain):
        found = geometric_jacobian(chain, q, frame=frame)
        ahead, behind = (frame_pose(chain, frame, q + sign * step * np.eye(n)) for sign in (1, -1))
        rate = (ahead - behind) / (2 * step)
        spin = rate[:, :3, :3] @ frame_pose(chain, frame, q)[:3, :3].T
        expected = [*rate[:, :3, 3].T, spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]]
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9, err_msg=frame)


@pytest.mark.parametrize("batch", [(), (0,), (1,), (2, 3)])
def test_jacobian_takes_any_batch_shape(batch: tuple[int, ...]) -> None:
    chain = build_chain(ODD_ROBOT)
    q = np.random.default_rng(0).uniform(-1, 1, (*batch, 5))
    found = geometric_jacobian(chain, q)
    assert found.shape == (*batch, 6, 5)
    for index in np.ndindex(batch):
        np.testing.assert_allclose(found[index], geometric_jacobian(chain, q[index]), rtol=0, atol=1e-15)


def test_a_flipped_joint_flips_its_column() -> None:
    plain, flipped = (
        build_chain(
            RobotSpec(
                name="r",
                rows=(row("one", a=0.3, alpha=0.5, flip=flip), row("two", "prismatic", alpha=1.0, flip=flip)),
            )
        )
        for flip in (False, True)
    )
    q = np.array([0.4, -0.2])
    np.testing.assert_allclose(geometric_jacobian(flipped, -q), -geometric_jacobian(plain, q), rtol=0, atol=1e-15)


def test_jacobian_of_what_is_no_joint_vector_is_refused() -> None:
    with pytest.raises(ConfigurationError) as caught:
        geometric_jacobian(build_chain(ODD_ROBOT), [0.0])
    expected = "expected 5 joint coordinates (one, two, four, five, six) along the last axis, got shape (1,)"
    assert str(caught.value) == expected
