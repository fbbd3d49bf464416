"""Batches by compiled code."""

from __future__ import annotations

import importlib.util
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dh2sim.errors import ConfigurationError, MissingExtraError
from dh2sim.kinematics import batches, numba_kernels
from dh2sim.kinematics.batch_frame import BLOCK
from dh2sim.kinematics.chain import KinematicChain, build_chain
from dh2sim.kinematics.forward import forward_kinematics, frame_pose, geometric_jacobian
from dh2sim.kinematics.numba_kernels import LARGEST, cache_folder
from dh2sim.kinematics.trig import sin_cos
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec
from tests.sample_robots import ODD_ROBOT

needs_numba = pytest.mark.skipif(importlib.util.find_spec("numba") is None, reason="numba is not installed")
TURNTABLE = RobotSpec(name="turntable", convention=Convention.STANDARD, rows=(Row(type=JointType.REVOLUTE),))


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba_kernels, "cache_folder", lambda: tmp_path / "kernels")


@pytest.fixture
def chain() -> KinematicChain:
    return build_chain(ODD_ROBOT)


@needs_numba
@pytest.mark.slow
def test_compiled_poses_and_jacobians_are_those_of_numpy(chain: KinematicChain) -> None:
    q = np.random.default_rng(0).uniform(-3, 3, (7, 11, 5))
    found = geometric_jacobian(chain, q, backend="numba")
    assert found.shape == (7, 11, 6, 5)
    np.testing.assert_allclose(found, geometric_jacobian(chain, q), rtol=0, atol=1e-14)
    out = np.empty((*found.shape, 2))[..., 0]
    assert geometric_jacobian(chain, q, backend="numba", out=out, threads=2) is out
    np.testing.assert_array_equal(out, found)
    for frame in ("dh_0", "tool0"):  # of one no code is made, as nothing moves it
        found = frame_pose(chain, frame, q, backend="numba", rows=3)
        np.testing.assert_allclose(found, frame_pose(chain, frame, q, rows=3), rtol=0, atol=1e-14)


@needs_numba
@pytest.mark.slow
def test_sines_and_cosines_are_correct_to_one_unit_in_the_last_place() -> None:
    rng = np.random.default_rng(0)
    near_quarters = rng.integers(-(2**20), 2**20, 2000) * (math.pi / 2)
    parts = [
        rng.uniform(-4, 4, 2000),
        rng.uniform(-LARGEST, LARGEST, 2000),
        np.clip(near_quarters, -LARGEST, LARGEST),
        [-826882.8943881015, -413441.44719405076],  # nearest of all to a multiple of a quarter turn
    ]
    q = np.concatenate(parts)
    T = forward_kinematics(build_chain(TURNTABLE), q[:, None], backend="numba")
    exact = np.array([sin_cos(value) for value in q.tolist()]).T
    for found, expected in zip((T[:, 1, 0], T[:, 0, 0]), exact, strict=True):
        assert np.abs((found - expected) / np.spacing(np.abs(expected))).max() <= 1.0


@needs_numba
@pytest.mark.slow
def test_a_coordinate_that_is_not_finite_is_refused_in_the_same_words(chain: KinematicChain) -> None:
    q = np.zeros((2, 3, 5))
    q[1, 2, 4] = math.nan
    for frame in ("dh_1", "dh_0"):  # neither is moved by the last joint
        with pytest.raises(ConfigurationError) as expected:
            frame_pose(chain, frame, q)
        with pytest.raises(ConfigurationError) as found:
            frame_pose(chain, frame, q, backend="numba")
        assert str(found.value) == str(expected.value)


@needs_numba
@pytest.mark.slow
def test_numpy_computes_what_is_too_large_and_code_is_kept_on_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    q = np.array([[0.3], [1e9], [2.0]])
    chain = build_chain(TURNTABLE)
    np.testing.assert_array_equal(forward_kinematics(chain, q, backend="numba"), forward_kinematics(chain, q))
    kept = sorted(path.suffix for path in numba_kernels.cache_folder().rglob("*") if path.is_file())
    assert [suffix for suffix in kept if suffix in (".py", ".nbi", ".nbc")] == [".nbc", ".nbi", ".py"]
    times = [path.stat().st_mtime_ns for path in numba_kernels.cache_folder().rglob("*.nb?")]
    again = forward_kinematics(build_chain(TURNTABLE), q[:1], backend="numba")
    np.testing.assert_allclose(again, forward_kinematics(chain, q[:1]), rtol=0, atol=1e-15)
    assert times == [path.stat().st_mtime_ns for path in numba_kernels.cache_folder().rglob("*.nb?")]
    monkeypatch.setattr(numba_kernels, "cache_folder", lambda: Path("/dev/null/kernels"))
    here = forward_kinematics(build_chain(TURNTABLE), q[:1], backend="numba")
    np.testing.assert_array_equal(here, again)


@needs_numba
@pytest.mark.slow
def test_with_any_number_of_threads_numpy_computes_the_same_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(batches, "THREADED", 1)
    chain, q = build_chain(TURNTABLE), np.random.default_rng(0).uniform(-3, 3, (11 * BLOCK + 9, 1))
    q[3 * BLOCK] = 2.0 * LARGEST
    alone = forward_kinematics(chain, q, backend="numba")
    assert forward_kinematics(chain, q, backend="numba", threads=3).tobytes() == alone.tobytes()
    by_numpy = (alone == forward_kinematics(chain, q)).all(axis=(1, 2))
    assert by_numpy[3 * BLOCK : 4 * BLOCK].all()
    assert not by_numpy[: 3 * BLOCK].all()


@pytest.mark.parametrize("function", [forward_kinematics, geometric_jacobian])
def test_another_backend_is_refused(function: Any, chain: KinematicChain) -> None:
    with pytest.raises(ConfigurationError, match=r"^backend must be 'numpy' or 'numba', got 'jax'$"):
        function(chain, np.zeros((2, 5)), backend="jax")


def test_without_numba_the_message_says_how_to_get_it(chain: KinematicChain, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dh2sim.extras._installed", lambda _: False)
    with pytest.raises(
        MissingExtraError, match=r"backend='numba' needs the extra 'fast': pip install 'dh2sim\[fast\]'"
    ):
        forward_kinematics(chain, np.zeros((2, 5)), backend="numba")


def test_code_is_kept_in_the_users_cache_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "dh2sim" / "kernels"
    monkeypatch.setenv("XDG_CACHE_HOME", "not/absolute")
    assert cache_folder() == Path.home() / ".cache" / "dh2sim" / "kernels"
