"""The parts of ``scripts/bench`` that measure many different robots, against one robot in the same run."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from scripts.bench_timing import Ratios, Row, best, measure

if TYPE_CHECKING:
    from dh2sim.simulate.block import Job

TABLES, ROLLOUTS, STEPS = 100, 10, 1000
VARY = {"a2": 0.1, "a3": 0.1, "d3": 0.1, "d4": 0.1}
RECORD = ("qpos", "qvel", "ctrl")


def designs() -> Iterator[Row]:
    """Tables at once; models of tables; rollouts of 100 tables against as many of one, with two threads."""
    from dh2sim import TableBatch, load_robot
    from dh2sim.simulate.block import simulate_block

    random, count = np.random.default_rng(0), 10_000
    spec = load_robot("puma560")
    a, alpha, d, theta = random.normal(size=(4, count, 6))
    tables = TableBatch(a=a, alpha=alpha, d=d, theta=theta, convention="modified")
    q = random.uniform(-3.0, 3.0, (count, 6))
    for what, work in (("poses", tables.fk), ("Jacobians", tables.jacobian)):
        taken = best(lambda work=work: work(q)) * 1e3  # type: ignore[misc]
        yield (
            f"{what} of 10 000 different tables",
            f"{taken:.1f} ms",
            "<= 10 ms" if what == "poses" else "",
            (taken <= 10.0 if what == "poses" else None),
        )
    taken = best(lambda: TableBatch.from_robot(spec, {"a2": a[:, 1]})) * 1e3
    yield "the tables of 10 000 values of a2", f"{taken:.1f} ms", "", None

    many, one = _job(vary=VARY, per_design=ROLLOUTS), _job()
    assert many.designs is not None
    making = min(
        best(lambda start=start: many.designs.of(range(start, start + 250, ROLLOUTS), {}), 1)  # type: ignore[misc]
        for start in range(0, TABLES * ROLLOUTS, 250)
    )
    making *= 1e3 / (250 / ROLLOUTS)
    yield "a model of a table, compiled and compared with it", f"{making:.1f} ms", "<= 5 ms", making <= 5.0
    ratios, steps = Ratios(), Ratios()
    simulated = range(TABLES * ROLLOUTS)
    for _ in range(5):
        alone = measure(lambda: simulate_block(one, simulated, threads=2))
        ratios.add(measure(lambda: simulate_block(many, simulated, threads=2)), alone)
        steps.add(*_stepping(many))
    yield ratios.row(f"{TABLES} tables x {ROLLOUTS} x {STEPS} steps / the same steps of one table", most=1.35)
    yield steps.row("a step with a model a simulation / with one model", most=1.05)


def _job(**more: Any) -> Job:
    from dh2sim import build_model, load_robot
    from dh2sim.simulate.options import RolloutOptions
    from dh2sim.simulate.prepare import prepare

    options = RolloutOptions(rollouts=TABLES * ROLLOUTS, steps=STEPS, record=RECORD, controller="hold", **more)
    return prepare(build_model(load_robot("puma560")), options)


def _stepping(job: Job) -> tuple[Any, Any]:
    """Step 250 simulations with models of their own, and with one."""
    from mujoco.batch import Batch

    from dh2sim.simulate.mujoco_runtime import quiet_engine

    assert job.designs is not None
    models = [each.plant.model for each in job.designs.of(range(250), {})]
    taken = []
    with quiet_engine():
        for own in (True, False):
            batch = Batch(models[0], len(models), 2)
            if own:
                batch.set_models(models)
            batch.bind("qpos")[:] = job.plant.home
            taken.append(measure(lambda batch=batch: batch.rollout(STEPS, None, record=("qpos",))))  # type: ignore[misc]
    return taken[0], taken[1]
