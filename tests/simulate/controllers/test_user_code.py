from __future__ import annotations

import hashlib
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from dh2sim.robot.row import ActuatorType
from dh2sim.simulate import rollout
from dh2sim.simulate.controllers.protocol import ClosedLoop, Follows, Observation, OpenLoop, RolloutBatch
from dh2sim.simulate.controllers.registry import choose
from dh2sim.typing import Array
from tests.simulate.controllers.samples import arm, make, observe, refused
from tests.simulate.controllers.user_code import SWING, line, write


def test_a_class_in_the_current_directory_is_a_controller(folder: Path) -> None:
    file = write(folder, "swinging.py", SWING)
    choice = choose("swinging:Swing:gain=2.0")
    assert (choice.text, choice.name) == ("swinging:Swing:gain=2", "swinging:Swing")
    assert choice.actuation is ActuatorType.MOTOR
    assert not choice.follows
    assert choice.digest == hashlib.sha256(file.read_bytes()).hexdigest()
    controller, group = make("swinging:Swing:gain=2", arm())
    assert isinstance(controller, ClosedLoop)
    assert not isinstance(controller, OpenLoop | Follows)
    q, v = np.random.default_rng(2).normal(size=(2, 7, 3))
    assert np.array_equal(controller.control(observe(group.plant, 0, q, v)), -2.0 * v)


def test_a_class_itself_is_the_controller_that_its_name_stands_for(folder: Path) -> None:
    write(folder, "swinging.py", SWING)
    named = choose("swinging:Swing")
    given = choose(sys.modules["swinging"].Swing)
    assert given == named
    assert given.digest == named.digest


def test_a_class_of_an_interactive_session_is_a_controller() -> None:
    class Sink:
        actuation = "motor"

        def __init__(self, batch: RolloutBatch, *, damping: float = 4.0) -> None:  # noqa: ARG002
            self.damping = damping

        def control(self, observation: Observation) -> Array:
            return -self.damping * observation.v

    Sink.__module__, Sink.__qualname__ = "__main__", "Sink"
    run = rollout(arm(), rollouts=2, steps=5, controller=Sink)
    assert run.attrs["controller"] == "__main__:Sink"
    assert np.isfinite(run.qpos.values).all()


def test_a_users_code_runs_in_the_thread_that_asks_for_rollouts() -> None:
    threads = set()

    class Sink:
        actuation = "motor"

        def __init__(self, batch: RolloutBatch) -> None:  # noqa: ARG002
            threads.add(threading.current_thread())

        def control(self, observation: Observation) -> Array:
            threads.add(threading.current_thread())
            return -observation.v

    rollout(arm(), rollouts=200, steps=2, controller=Sink, threads=3)
    assert threads == {threading.current_thread()}


def test_a_class_in_a_package_is_a_controller(folder: Path) -> None:
    write(folder, "mine/control.py", SWING)
    choice = choose("mine.control:Still")
    assert choice.actuation is None
    assert choice.follows
    controller, group = make("mine.control:Still", arm())
    assert isinstance(controller, OpenLoop)
    assert isinstance(controller, Follows)
    assert np.array_equal(controller.controls(0, 5), group.q0[:, None])


def test_a_digest_is_also_that_of_the_file_of_a_base_class(folder: Path) -> None:
    base = write(folder, "base_of_mine.py", SWING)
    write(folder, "derived.py", "import base_of_mine\n\n\nclass Mine(base_of_mine.Swing):\n    pass\n")
    before = choose("derived:Mine").digest
    base.write_text(base.read_text(encoding="utf-8") + "\n# another line\n", encoding="utf-8")
    assert choose("derived:Mine").digest != before


def test_an_inherited_constructor_keeps_its_options(folder: Path) -> None:
    text = "from dh2sim.simulate.controllers.torque import ComputedTorque\n\n\n"
    write(folder, "inheriting.py", f"{text}class Mine(ComputedTorque):\n    pass\n")
    assert choose("inheriting:Mine:bandwidth=5,period=2").text == "inheriting:Mine:bandwidth=5,period=2"


def test_the_current_directory_hides_nothing_afterwards(folder: Path) -> None:
    write(folder, "swinging.py", SWING)
    before = list(sys.path)
    choose("swinging:Swing")
    assert sys.path == [*before, str(folder)]


def test_a_controller_of_an_installed_package_is_known_by_its_name(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(folder, "site/dh2sim_swing.py", SWING)
    entry_points = (
        "[dh2sim.controllers]\nswing = dh2sim_swing:Swing\nlost = dh2sim_swing:Lost\nsine = dh2sim_swing:Swing\n"
    )
    info = folder / "site" / "dh2sim_swing-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: dh2sim-swing\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text(entry_points, encoding="utf-8")
    monkeypatch.syspath_prepend(folder / "site")
    assert "dh2sim_swing" not in sys.modules
    choice = choose("swing:gain=4")
    assert (choice.text, choice.actuation) == ("swing:gain=4", ActuatorType.MOTOR)
    assert isinstance(make("swing:gain=4", arm())[0], ClosedLoop)
    # its own are not replaced
    assert choose("sine").actuation is ActuatorType.POSITION
    assert refused("lost") == ("controller 'lost': AttributeError: module 'dh2sim_swing' has no attribute 'Lost'")
    assert refused("swign") == (
        "unknown controller 'swign'. Did you mean 'swing'? Known controllers: passive, hold, "
        "gravity-compensation, pd, computed-torque, sine, random, replay, lost, swing; your own is named "
        "MODULE:CLASS"
    )


def test_a_name_that_two_packages_have_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("one", "two"):
        info = folder / "site" / f"{name}-1.0.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", encoding="utf-8")
        (info / "entry_points.txt").write_text(f"[dh2sim.controllers]\nswing = {name}:Swing\n", encoding="utf-8")
    monkeypatch.syspath_prepend(folder / "site")
    assert refused("swing") == (
        "controller 'swing': more than one installed package has it; choose 'one:Swing' or 'two:Swing'"
    )


def test_options_are_checked_against_the_signature(folder: Path) -> None:
    write(folder, "swinging.py", SWING)
    assert refused("swinging:Swing:gian=2") == (
        "controller 'swinging:Swing': unknown option 'gian'. Did you mean 'gain'? Options: gain=3"
    )


PREPARED = """
    from pathlib import Path

    from dh2sim.simulate.controllers.protocol import Prepared


    class Reading:
        @staticmethod
        def prepare(*, file: str):
            digest = Path(file).read_text(encoding="utf-8")
            return Prepared(make=Reading, actuation="velocity", digest=digest)

        def __init__(self, batch):
            self.zero = 0.0 * batch.q0[:, None]

        def controls(self, first, count):
            return self.zero
"""


def test_a_class_may_read_files_before_it_drives(folder: Path) -> None:
    module = write(folder, "reading.py", PREPARED)
    write(folder, "table.txt", "abc")
    choice = choose("reading:Reading:file=table.txt")
    assert choice.actuation is ActuatorType.VELOCITY
    assert choice.digest == f"{hashlib.sha256(module.read_bytes()).hexdigest()} abc"
    assert isinstance(make("reading:Reading:file=table.txt", arm())[0], OpenLoop)
    assert refused("reading:Reading:file=tabel.txt") == (
        "controller 'reading:Reading': FileNotFoundError: [Errno 2] No such file or directory: 'tabel.txt' "
        f"(reading.py, line {line(module, 'read_text')})"
    )
