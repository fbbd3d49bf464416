"""The parts of ``scripts/bench`` that measure rollouts, against MuJoCo itself in the same run."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dh2sim.processors import available_processors
from scripts.bench_timing import Ratios, Row, Usage, measure, run_python

if TYPE_CHECKING:
    from dh2sim.simulate.block import Job

ROLLOUTS, STEPS = 1024, 2000
TOGETHER = 256
"""Rollouts of a closed loop of one's own, and of MuJoCo's calls alone."""
RECORD = ("qpos", "qvel", "ctrl")


def rollouts() -> Iterator[Row]:
    """1024 rollouts of 2000 steps of the Stanford arm into Zarr, against what MuJoCo can do at most."""
    import mujoco
    import mujoco.rollout

    from dh2sim.simulate.mujoco_runtime import quiet_engine

    mjcf, q0, ctrl = _held_arms()
    model = mujoco.MjModel.from_xml_string(mjcf)  # as exported
    lean = mujoco.MjModel.from_xml_string(mjcf)
    lean.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SENSOR)  # as simulated: no sensor is recorded
    ceiling, lowest, stock, closed, alike, least, own_loop = (Ratios() for _ in range(7))
    runs: list[Usage] = []
    calls_alone = _calls_alone()
    with TemporaryDirectory() as folder:
        # so that nothing is imported while the clock runs
        for controller in ("hold", "sine", "computed-torque", Spring):
            _run(folder, controller, 64)
        for _ in range(7):
            with quiet_engine():
                bare = measure(lambda: _bare_steps(model, q0, ctrl))
                without_sensors = measure(lambda: _bare_steps(lean, q0, ctrl))
            own = measure(lambda: _run(folder, "hold", ROLLOUTS))
            runs.append(own)
            ceiling.add(bare, own)
            lowest.add(without_sensors, own)
            stock.add(measure(lambda: _stock_rollout(model, q0, ctrl)), own)
            controlled = measure(lambda: _run(folder, "computed-torque", ROLLOUTS))
            closed.add(controlled, own)
            alike.add(controlled, measure(lambda: _run(folder, "sine", ROLLOUTS)))
            some = measure(lambda: _run(folder, "hold", TOGETHER))
            own_loop.add(measure(lambda: _run(folder, Spring, TOGETHER)), some)
            with quiet_engine():
                least.add(measure(calls_alone), some)
    threads = available_processors()
    rate = threads * ROLLOUTS * STEPS / statistics.median(usage.cpu for usage in runs)
    by_wall = ROLLOUTS * STEPS / statistics.median(usage.wall for usage in runs)
    figure = f"{rate:,.0f}, by wall time {by_wall:,.0f}"
    yield f"steps/s end to end into Zarr, {threads} idle processors", figure, "", None
    yield ceiling.row("mj_step in C, nothing recorded / the same steps into Zarr", least=0.95)
    yield lowest.row("mj_step in C without sensors / the same steps into Zarr")
    yield stock.row("mujoco.rollout, left in memory / the same steps into Zarr", least=1.25)
    yield alike.row("computed-torque / sine, whose data take as much space, both into Zarr", most=1.3)
    yield closed.row("computed-torque / hold, whose data take a third of it")
    yield least.row(f"MuJoCo's calls alone, step by step / hold, {TOGETHER} rollouts")
    yield own_loop.row(f"spring and damper in Python / hold, {TOGETHER} rollouts into Zarr", most=1.5)


class Spring:
    """A closed loop of one's own: a spring and damper to the start, with gravity and other forces balanced."""

    actuation = "motor"

    def __init__(self, batch: Any) -> None:
        """Remember the start."""
        self._start = batch.q0

    def control(self, observation: Any) -> NDArray[np.float64]:
        """Return torques and forces, shape (batch, n)."""
        torque = observation.bias + 5.0 * (self._start - observation.q) - 0.5 * observation.v
        return np.asarray(torque)


def _calls_alone() -> Callable[[], None]:
    """Return what drives arms by the torques of computed torque, one step at a time, without computing them anew."""
    from mujoco.batch import Batch

    from dh2sim.simulate.block import simulate_block
    from dh2sim.simulate.mujoco_runtime import VELOCITY_STAGE

    job = _job("computed-torque", TOGETHER)
    block = simulate_block(job, range(TOGETHER))
    torques = np.ascontiguousarray(block["ctrl"].swapaxes(0, 1))

    def step_by_step() -> None:
        batch = Batch(job.plant.model, TOGETHER, available_processors(), persistent=True)
        batch.bind("qpos")[:] = block["qpos"][:, 0]
        for field in ("M", "qfrc_bias", "qfrc_passive", "ncon"):
            batch.bind(field)
        controls = batch.bind("ctrl")
        batch.forward(stage=VELOCITY_STAGE)
        for torque in torques:
            controls[:] = torque
            batch.step(stage=VELOCITY_STAGE)

    return step_by_step


def memory() -> Iterator[Row]:
    """20 000 rollouts of 1000 steps into Zarr as a process of its own, and a run of half as many."""
    peaks = []
    for count in (10_000, 20_000):
        with TemporaryDirectory() as folder:
            arguments = ["rollout", "stanford", "--out", f"{folder}/run.zarr", "--quiet"]
            options = ["--rollouts", str(count), "--steps", "1000", "--record", "qpos,qvel,ctrl"]
            peaks.append(run_python("-m", "dh2sim", *arguments, *options).peak)
            if count == 20_000:
                size = sum(path.stat().st_size for path in Path(folder).rglob("*") if path.is_file())
    yield "memory of 20 000 rollouts of 1000 steps", f"{peaks[1] / 1e6:.0f} MB", "< 2000 MB", peaks[1] < 2e9
    growth = peaks[1] / peaks[0]
    yield "the same / that of half as many", f"{growth:.2f} ({size / 1e9:.1f} GB on disk)", "<= 1.25", growth <= 1.25


def steady() -> Iterator[Row]:
    """60 s of simulation of 1000 arms: time per step in the last tenth, against the first."""
    from dh2sim import build_model, load_robot
    from dh2sim.simulate.block import simulate_block
    from dh2sim.simulate.options import RolloutOptions
    from dh2sim.simulate.prepare import prepare

    model = build_model(load_robot("stanford"))
    for controller in ("sine", "computed-torque"):
        options = RolloutOptions(rollouts=1000, duration=60.0, controller=controller, every=100, record=("qpos",))
        job = prepare(model, options)
        paces = _Paces(job.options.steps)
        choice = replace(job.controller, make=paces.watched(job.controller.make))
        simulate_block(replace(job, controller=choice), range(1000))
        ratio = paces.late / paces.early
        what = f"60 s of 1000 arms, {controller}: step at the end / start"
        yield (
            what,
            f"{ratio:.2f} ({paces.early * 1e3:.2f} ms for {1000 // paces.groups} arms)",
            "<= 1.15",
            ratio <= 1.15,
        )


class _Paces:
    """Reads the thread's processor time whenever a controller is asked: seconds a step early and late in rollouts."""

    def __init__(self, steps: int) -> None:
        self._steps = steps
        self._groups: list[list[tuple[int, float]]] = []

    def watched(self, make: Callable[[Any], Any]) -> Callable[[Any], Any]:
        """Make controllers that are timed."""

        def make_watched(batch: Any) -> Any:
            controller = make(batch)
            ticks: list[tuple[int, float]] = []
            self._groups.append(ticks)
            name = "control" if hasattr(controller, "control") else "controls"
            asked = getattr(controller, name)

            def ask(first: Any, *rest: int) -> Any:
                ticks.append((first if isinstance(first, int) else first.step, time.thread_time()))
                return asked(first, *rest)

            setattr(controller, name, ask)
            return controller

        return make_watched

    @property
    def groups(self) -> int:
        """Number of groups that arms were simulated in."""
        return len(self._groups)

    @property
    def early(self) -> float:
        """Seconds a step from 2 % to 12 % of the way; the first steps warm up."""
        return self._pace(0.02, 0.12)

    @property
    def late(self) -> float:
        """Seconds a step from 90 % of the way to the end."""
        return self._pace(0.90, 1.0)

    def _pace(self, begin: float, end: float) -> float:
        paces = []
        for ticks in self._groups:
            inside = [tick for tick in ticks if begin * self._steps <= tick[0] <= end * self._steps]
            paces.append((inside[-1][1] - inside[0][1]) / (inside[-1][0] - inside[0][0]))
        return statistics.median(paces)


def _job(controller: str | type, count: int) -> Job:
    from dh2sim import build_model, load_robot
    from dh2sim.simulate.options import RolloutOptions
    from dh2sim.simulate.prepare import prepare

    options = RolloutOptions(rollouts=count, steps=STEPS, controller=controller, start="random", record=RECORD)
    return prepare(build_model(load_robot("stanford")), options)


def _held_arms() -> tuple[str, NDArray[np.float64], NDArray[np.float64]]:
    """The model as exported, and starts and constant controls of the run that is measured."""
    from dh2sim import build_model, load_robot, to_mjcf
    from dh2sim.simulate.block import simulate_block

    job = _job("hold", ROLLOUTS)
    block = simulate_block(replace(job, options=job.options.replace(steps=1)), range(ROLLOUTS))
    return to_mjcf(build_model(load_robot("stanford"))), block["qpos"][:, 0], block["ctrl"][:, 0]


def _run(folder: str, controller: str | type, count: int) -> None:
    """Simulate into Zarr, from the robot file's name to the last file that is safe on disk."""
    from dh2sim.simulate import rollout

    rollout(
        "stanford",
        out=Path(folder) / "run.zarr",
        overwrite=True,
        rollouts=count,
        steps=STEPS,
        controller=controller,
        start="random",
        record=RECORD,
    )


def _bare_steps(model: Any, q0: NDArray[np.float64], ctrl: NDArray[np.float64]) -> None:
    """Step the same arms in C on all processors; nothing is recorded."""
    import mujoco

    threads = available_processors()

    def work(thread: int) -> None:
        data = mujoco.MjData(model)
        for i in range(thread, len(q0), threads):
            mujoco.mj_resetData(model, data)
            data.qpos[:], data.ctrl[:] = q0[i], ctrl[i]
            mujoco.mj_step(model, data, STEPS)

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(work, range(threads)))


def _stock_rollout(model: Any, q0: NDArray[np.float64], ctrl: NDArray[np.float64]) -> None:
    """Roll the same arms out with mujoco.rollout, as imported; its arrays stay in memory."""
    import mujoco
    import mujoco.rollout

    threads = available_processors()
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    initial = np.zeros((len(q0), size))
    initial[:, 1 : 1 + q0.shape[1]] = q0
    controls = np.repeat(ctrl[:, None], STEPS, axis=1)
    with mujoco.rollout.Rollout(nthread=threads) as pool:
        pool.rollout(model, [mujoco.MjData(model) for _ in range(threads)], initial, controls)
