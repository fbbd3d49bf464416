from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dh2sim.robot.row import ActuatorType
from dh2sim.simulate.controllers.protocol import ClosedLoop, Follows, OpenLoop
from tests.simulate.controllers.samples import arm, cuts, make, observe

MIXED = (ActuatorType.POSITION, ActuatorType.MOTOR, ActuatorType.VELOCITY)
OPEN = ["passive", "hold", "sine", "sine:fade=0.1,harmonics=9", "random", "random:rate=31", "replay:file=MOTION"]
CLOSED = ["gravity-compensation", "gravity-compensation:damping=2", "pd", "pd:gravity=false,kp=70", "computed-torque"]
STEPS = 300


@pytest.fixture
def named(tmp_path: Path) -> Path:
    rows = [[0.001 * i, 0.2 * np.sin(0.1 * i), 0.1, -0.3 * i] for i in range(200)]
    text = "\n".join(["time,joint_1,joint_2,joint_3", *(",".join(map(repr, map(float, row))) for row in rows)])
    (tmp_path / "motion.csv").write_text(text, encoding="utf-8")
    return tmp_path / "motion.csv"


def whole(controls: np.ndarray, count: int) -> np.ndarray:
    return np.broadcast_to(controls, (controls.shape[0], count, controls.shape[2]))


@pytest.mark.parametrize("text", OPEN)
@pytest.mark.parametrize("sizes", [[1], [7, 1, 64], [299, 1], [100]])
def test_controls_do_not_depend_on_how_the_steps_are_cut_up(text: str, sizes: list[int], named: Path) -> None:
    controller, _ = make(text.replace("MOTION", str(named)), arm(MIXED), steps=STEPS)
    assert isinstance(controller, OpenLoop)
    at_once = whole(controller.controls(0, STEPS), STEPS)
    parts = [whole(controller.controls(first, count), count) for first, count in cuts(STEPS, sizes)]
    assert np.array_equal(np.concatenate(parts, axis=1), at_once)


@pytest.mark.parametrize("text", OPEN)
def test_steps_may_be_asked_for_in_any_order_and_again(text: str, named: Path) -> None:
    controller, _ = make(text.replace("MOTION", str(named)), arm(MIXED), steps=STEPS)
    assert isinstance(controller, OpenLoop)
    late = controller.controls(200, 50).copy()
    controller.controls(0, 10)
    assert np.array_equal(controller.controls(200, 50), late)


@pytest.mark.parametrize("text", OPEN)
@pytest.mark.parametrize("part", [range(1), range(3, 4), range(2, 7)])
def test_controls_do_not_depend_on_which_rollouts_are_together(text: str, part: range, named: Path) -> None:
    spec, name = arm(MIXED), text.replace("MOTION", str(named))
    together, _ = make(name, spec, range(7), steps=STEPS)
    apart, _ = make(name, spec, part, steps=STEPS)
    assert isinstance(together, OpenLoop)
    assert isinstance(apart, OpenLoop)
    found = whole(apart.controls(13, 170), 170)
    assert np.array_equal(found, whole(together.controls(13, 170), 170)[part.start : part.stop])


@pytest.mark.parametrize("text", CLOSED)
@pytest.mark.parametrize("part", [range(1), range(3, 4), range(2, 7)])
def test_torques_do_not_depend_on_which_rollouts_are_together(text: str, part: range) -> None:
    source = np.random.default_rng(8)
    q, v = source.normal(size=(2, 7, 3))
    together, group = make(text, arm(), range(7), steps=STEPS)
    apart, _ = make(text, arm(), part, steps=STEPS)
    assert isinstance(together, ClosedLoop)
    assert isinstance(apart, ClosedLoop)
    rows = slice(part.start, part.stop)
    for step in (0, 1, 70, 299):
        found = apart.control(observe(group.plant, step, q[rows], v[rows]))
        assert np.array_equal(found, together.control(observe(group.plant, step, q, v))[rows])


@pytest.mark.parametrize("text", ["sine", "pd", "computed-torque", "replay:file=MOTION"])
def test_references_do_not_depend_on_how_they_are_cut_up(text: str, named: Path) -> None:
    name = text.replace("MOTION", str(named))
    controller, _ = make(name, arm(), range(7), steps=STEPS)
    apart, _ = make(name, arm(), range(5, 7), steps=STEPS)
    assert isinstance(controller, Follows)
    assert isinstance(apart, Follows)
    for i in (0, 1):
        at_once = controller.reference(0, STEPS + 1)[i]
        assert at_once.shape == (7, STEPS + 1, 3)
        parts = [controller.reference(first, count)[i] for first, count in cuts(STEPS + 1, [1, 64, 13])]
        assert np.array_equal(np.concatenate(parts, axis=1), at_once)
        assert np.array_equal(apart.reference(0, STEPS + 1)[i], at_once[5:7])


@pytest.mark.parametrize("text", ["sine", "random", "pd", "computed-torque"])
def test_a_longer_run_begins_as_a_shorter_one(text: str) -> None:
    short, _ = make(text, arm(), steps=STEPS)
    long, _ = make(text, arm(), steps=10 * STEPS)
    if isinstance(short, OpenLoop) and isinstance(long, OpenLoop):
        assert np.array_equal(short.controls(0, STEPS), long.controls(0, STEPS))
    elif isinstance(short, Follows) and isinstance(long, Follows):
        assert np.array_equal(short.reference(0, STEPS)[0], long.reference(0, STEPS)[0])


@pytest.mark.parametrize("text", ["sine", "random", "computed-torque"])
def test_every_rollout_has_its_own(text: str) -> None:
    controller, _ = make(text, arm(), steps=STEPS, q0=np.zeros(3))
    end = controller.controls(299, 1) if isinstance(controller, OpenLoop) else controller.reference(299, 1)[0]  # type: ignore[attr-defined]
    assert len(np.unique(end[:, 0, 0])) == 7
