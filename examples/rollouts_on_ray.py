"""Simulate rollouts on a Ray cluster: Ray's tasks behind the protocol of concurrent.futures, in a few lines."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any

import dh2sim

try:
    import ray
except ImportError:
    raise SystemExit("this example needs Ray: pip install ray") from None


class RayExecutor(Executor):
    """Starts functions as tasks of Ray, which starts them again where a node is lost."""

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Start a function on any node."""
        future: Future[Any] = ray.remote(function).remote(*args, **kwargs).future()
        return future


if __name__ == "__main__":
    with ray.init(num_cpus=2):
        run = dh2sim.Robot.load("planar_2r").rollout(
            64, steps=100, block_size=8, out="run.zarr", executor=RayExecutor()
        )
    print(run.status.to_series().value_counts())
