from __future__ import annotations

import platform
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from dh2sim import Robot
from dh2sim.errors import ConfigurationError
from dh2sim.kinematics import batches
from dh2sim.kinematics.batch_frame import BLOCK
from dh2sim.kinematics.batches import thread_count
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.forward import forward_kinematics, frame_poses, geometric_jacobian
from tests.sample_robots import ODD_ROBOT, STANFORD

ODD = build_chain(ODD_ROBOT)
FUNCTIONS = [forward_kinematics, geometric_jacobian, frame_poses]


@pytest.mark.parametrize("function", FUNCTIONS)
@pytest.mark.parametrize("batch", [(), (0,), (1,), (3, 4)])
def test_out_takes_the_result_and_is_returned(function: Any, batch: tuple[int, ...]) -> None:
    q = np.random.default_rng(0).uniform(-1, 1, (*batch, 5))
    expected = function(ODD, q)
    out = np.full(expected.shape, 7.0)
    assert function(ODD, q, out=out) is out
    np.testing.assert_array_equal(out, expected)
    strided = np.full((*expected.shape, 2), 7.0)[..., 0]
    assert function(ODD, q, out=strided) is strided
    np.testing.assert_array_equal(strided, expected)


def test_out_may_overlap_the_joint_vectors() -> None:
    memory = np.random.default_rng(0).uniform(-1, 1, 20_000 * 16)
    q = memory[: 20_000 * 5].reshape(20_000, 5)
    expected = forward_kinematics(ODD, q)
    np.testing.assert_array_equal(forward_kinematics(ODD, q, out=memory.reshape(20_000, 4, 4)), expected)


@pytest.mark.parametrize("function", FUNCTIONS)
@pytest.mark.parametrize("threads", [0, 2, 3])
def test_any_number_of_threads_gives_the_same_bits(
    function: Any, threads: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(batches, "THREADED", 1)
    q = np.random.default_rng(0).uniform(-3, 3, (9 * BLOCK + 777, 5))
    assert function(ODD, q, threads=threads).tobytes() == function(ODD, q).tobytes()


REPEATED = """
import resource
import numpy as np
from dh2sim import forward_kinematics, geometric_jacobian, load_robot, build_chain
chain, q = build_chain(load_robot("stanford")), np.zeros((8192, 6))
for function, shape in ((forward_kinematics, (4, 4)), (geometric_jacobian, (6, 6))):
    out = np.empty((8192, *shape))
    for count in (5, 20):
        before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
        for _ in range(count):
            function(chain, q, out=out)
    print((resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before) / count)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="it is glibc that gives memory back to the system")
def test_blocks_use_the_memory_of_those_before() -> None:
    done = subprocess.run([sys.executable, "-c", REPEATED], capture_output=True, text=True, check=True)
    assert max(map(float, done.stdout.split())) < 20  # pages a block; of its 700 all would be fresh


@pytest.mark.parametrize("batch", [(), (0,), (2, 3)])
def test_poses_may_lack_their_last_row(batch: tuple[int, ...]) -> None:
    arm = Robot.from_spec(STANFORD)
    q = np.random.default_rng(0).uniform(-1, 1, (*batch, 6))
    for frame in ("tool0", "dh_0", "base_link", "link_3"):
        whole, found = arm.fk(q, frame), arm.fk(q, frame, rows=3)
        np.testing.assert_array_equal(found, whole[..., :3, :])
        assert found.base is None or found.base.size == found.size
        out = np.empty((*batch, 3, 4))
        assert arm.fk(q, frame, rows=3, out=out) is out
        np.testing.assert_array_equal(out, found)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"rows": 5}, "rows must be 3 or 4, got 5"),
        ({"threads": -1}, "threads must be a whole number, 0 for all processors, got -1"),
        ({"threads": 1.5}, "threads must be a whole number, 0 for all processors, got 1.5"),
        ({"out": [[0.0]]}, "out must be an array of float64 of shape (4, 4), got list"),
        (
            {"out": np.empty((3, 4))},
            "out must be an array of float64 of shape (4, 4), got one of float64 of shape (3, 4)",
        ),
        (
            {"out": np.empty((4, 4), dtype=np.float32)},
            "out must be an array of float64 of shape (4, 4), got one of float32 of shape (4, 4)",
        ),
        ({"out": np.broadcast_to(0.0, (4, 4))}, "out must be an array that can be written to"),
    ],
)
def test_an_option_that_is_not_allowed_is_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        Robot.from_spec(STANFORD).fk(np.zeros(6), **options)
    assert str(caught.value) == message


def test_an_unknown_option_is_refused_with_the_ones_there_are() -> None:
    arm: Any = Robot.from_spec(STANFORD)
    with pytest.raises(
        TypeError, match=r"^unknown option 'thread'\. Did you mean 'threads'\? Options: out, threads, rows"
    ):
        arm.fk(np.zeros(6), thread=2)
    with pytest.raises(TypeError, match=r"^unknown option 'rows'"):
        arm.jacobian(np.zeros(6), rows=3)


def test_no_thread_count_means_the_processors_of_this_process() -> None:
    assert thread_count(0) >= 1
    assert thread_count(3) == 3
