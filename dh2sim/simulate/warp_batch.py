"""A batch of simulations in MuJoCo Warp, on a GPU or slowly on a CPU, in place of MuJoCo's own ``Batch``.

Warp computes in single precision, and on a GPU in no fixed order: its numbers are near MuJoCo's, and never the same
bits, not even those of the same run made twice. See docs/warp.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import mujoco
import numpy as np
from mujoco.batch import SimulationError
from numpy.typing import NDArray

from dh2sim.errors import EngineError
from dh2sim.extras import require_extra
from dh2sim.simulate.plant import Plant
from dh2sim.typing import Array

TOLERANCE: Final = 1e-5
"""By which positions may differ from MuJoCo's after the first time step, rad or m, and relative to a position."""
CONTACTS: Final = 64
"""Contacts that there is room for, of each simulation on average."""
_HUGE: Final = 1e10
"""Where MuJoCo calls a number bad (``mjMAXVAL``)."""


def require_warp() -> None:
    """Check that MuJoCo Warp is installed.

    Raises:
        MissingExtraError: It is not.
    """
    require_extra("warp", "mujoco_warp", "warp", what="the engine 'warp'")


def warp_versions() -> dict[str, str]:
    """Return the versions of MuJoCo Warp and of Warp."""
    import mujoco_warp
    import warp

    return {"mujoco_warp": mujoco_warp.__version__, "warp": warp.__version__}


def warp_device() -> str:
    """Return the name of what Warp computes on."""
    import warp

    _start()
    return str(warp.get_device().name)


def _start() -> None:
    import warp

    warp.config.log_level = warp.LOG_ERROR  # or it prints what it finds and compiles
    warp.init()


class WarpBatch:
    """Simulations of one model: what ``simulate_open_loop`` uses of MuJoCo's ``Batch``, with the same meaning.

    States are kept here, in double precision, and sent to the device for each call, which is for many time steps.
    """

    def __init__(self, plant: Plant, simulations: int) -> None:
        """Make simulations of a plant, at its zero.

        Raises:
            EngineError: MuJoCo Warp cannot simulate the model.
        """
        import mujoco_warp
        import warp

        _start()
        model = plant.model
        self.nsim = simulations
        self.state = np.tile(np.concatenate([model.qpos0, np.zeros(model.nv)]), (simulations, 1))
        """Positions and velocities, shape (simulations, nq + nv)."""
        self.warning = np.zeros((simulations, int(mujoco.mjtWarning.mjNWARNING), 2), dtype=np.int32)
        self.status = np.zeros(simulations, dtype=np.int32)
        self._start_state = self.state[0].copy()
        self._room = 4 * CONTACTS + 2 * model.nv
        try:
            self._model = mujoco_warp.put_model(model)
            self._data = mujoco_warp.make_data(model, nworld=simulations, nconmax=CONTACTS, njmax=self._room)
        except NotImplementedError as error:
            raise EngineError(f"MuJoCo Warp cannot simulate this robot: {str(error).rstrip('.')}") from error
        self._bad = warp.zeros(simulations, dtype=int)
        self._device_fields = {
            name: getattr(self._data, name) for name in ("qpos", "qvel", "qacc", "ctrl", "sensordata", "energy")
        }
        self._device_fields["ncon"] = warp.zeros(simulations, dtype=int)
        self._step: Any = None
        nq = model.nq
        self._bound: dict[str, NDArray[Any]] = {"qpos": self.state[:, :nq], "qvel": self.state[:, nq:]}
        self._bound["ctrl"] = np.zeros((simulations, model.nu))

    def bind(self, field: str) -> NDArray[Any]:
        """Return a field of all simulations: of the state and the controls to write to, others as last computed."""
        if field not in self._bound:
            self._bound[field] = self._device_fields[field].numpy().astype(np.float64)
        return self._bound[field]

    def forward(self, ids: NDArray[np.int32] | None = None, *, stage: int) -> None:  # noqa: ARG002 - all stages
        """Compute what follows from the states."""
        import mujoco_warp

        rows = self._rows(ids)
        self._send(rows, None)
        mujoco_warp.forward(self._model, self._data)
        for field in {*self._bound} - {"qpos", "qvel", "ctrl"}:
            self._bound[field][rows] = self._device_fields[field].numpy()[rows]

    def rollout(
        self,
        count: int,
        controls: Array | None = None,
        *,
        record: Sequence[str],
        ids: NDArray[np.int32] | None = None,
        out: Mapping[str, NDArray[Any]],
    ) -> None:
        """Simulate time steps.

        Args:
            count: How many.
            controls: Of each of the simulations and steps, shape (ids, count, actuators); None: those that are bound.
            record: Fields to record.
            ids: Which simulations; None: all.
            out: Arrays for the fields, shape (ids, count, …).

        Raises:
            SimulationError: Some simulations went wrong; ``warning`` says how.
        """
        import warp

        rows = self._rows(ids)
        self._send(rows, controls)
        sent = None
        if controls is not None:
            every = np.zeros((count, self.nsim, controls.shape[2]), dtype=np.float32)
            every[:, rows] = controls.swapaxes(0, 1)
            sent = warp.array(every, dtype=float)
        kept = {}
        for field in record:
            source = self._device_fields[field]
            kept[field] = warp.empty((count, *source.shape), dtype=source.dtype)
        for step in range(count):
            if sent is not None:
                size = self._data.ctrl.size
                warp.copy(self._data.ctrl, sent, src_offset=step * size, count=size)
            self._take_step()
            for field, pages in kept.items():
                source = self._device_fields[field]
                warp.copy(pages, source, dest_offset=step * source.size, count=source.size)
        for field, pages in kept.items():
            out[field][...] = pages.numpy().swapaxes(0, 1)[rows].reshape(out[field].shape)
        for field in ("qpos", "qvel"):
            self._bound[field][rows] = self._device_fields[field].numpy()[rows]
        self._report(rows)

    def _rows(self, ids: NDArray[np.int32] | None) -> NDArray[np.intp]:
        return np.arange(self.nsim) if ids is None else np.asarray(ids, dtype=np.intp)

    def _send(self, rows: NDArray[np.intp], controls: Array | None) -> None:
        """Send the states of some simulations to the device; the others, which may not be finite, rest at zero."""
        state = np.tile(self._start_state, (self.nsim, 1))
        state[rows] = self.state[rows]
        nq = self._bound["qpos"].shape[1]
        self._data.qpos.assign(state[:, :nq].astype(np.float32))
        self._data.qvel.assign(state[:, nq:].astype(np.float32))
        self._data.qacc_warmstart.zero_()
        if controls is None and self._bound["ctrl"].size:
            resting = np.zeros_like(self._bound["ctrl"], dtype=np.float32)
            resting[rows] = self._bound["ctrl"][rows]
            self._data.ctrl.assign(resting)
        self._bad.zero_()

    def _take_step(self) -> None:
        """Take a step on the device; on a GPU all of its kernels are recorded once and started together."""
        import warp

        if self._step is None and warp.get_device().is_cuda:
            self._one_step()  # compiles, which cannot be recorded
            self._bad.zero_()
            state = [warp.clone(getattr(self._data, name)) for name in ("qpos", "qvel")]
            with warp.ScopedCapture() as capture:
                self._one_step()
            self._step = capture.graph
            for name, values in zip(("qpos", "qvel"), state, strict=True):
                getattr(self._data, name).assign(values)
        if self._step is None:
            self._one_step()
        else:
            warp.capture_launch(self._step)

    def _one_step(self) -> None:
        import mujoco_warp
        import warp

        from dh2sim.simulate.warp_kernels import count_contacts, watch

        mujoco_warp.step(self._model, self._data)
        data, counts = self._data, self._device_fields["ncon"]
        counts.zero_()
        contacts = data.contact.worldid
        warp.launch(count_contacts, dim=contacts.size, inputs=[data.nacon, contacts], outputs=[counts])
        inputs = [data.qpos, data.qvel, data.qacc, data.nefc, self._room, _HUGE]
        warp.launch(watch, dim=self.nsim, inputs=inputs, outputs=[self._bad])

    def _report(self, rows: NDArray[np.intp]) -> None:
        """Count warnings as MuJoCo does, and raise if there are any.

        Raises:
            SimulationError: There are.
        """
        found = self._bad.numpy()
        overfull = int(self._data.nacon.numpy()[0]) > self._data.contact.worldid.size
        kinds = (
            (found & 1, mujoco.mjtWarning.mjWARN_BADQPOS),
            (found & 2, mujoco.mjtWarning.mjWARN_BADQVEL),
            (found & 4, mujoco.mjtWarning.mjWARN_BADQACC),
            (found & 8, mujoco.mjtWarning.mjWARN_CNSTRFULL),
            (np.full(self.nsim, overfull), mujoco.mjtWarning.mjWARN_CONTACTFULL),
        )
        failed = np.zeros(self.nsim, dtype=bool)
        for which, kind in kinds:
            wrong = rows[which[rows] != 0]
            self.warning[wrong, int(kind), 1] += 1
            failed[wrong] = True
        if failed.any():
            raise SimulationError(np.flatnonzero(failed), "the state is not finite, or there is no room")
