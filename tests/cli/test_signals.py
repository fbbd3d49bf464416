"""The thread that repeats a signal does not outlive the program, in which Python could crash."""

from __future__ import annotations

import subprocess
import sys

from tests.program import environment

LATE = """
import _thread, signal, time
from dh2sim.cli.signals import Signals

start = _thread.start_new_thread
started = []

def late(function, arguments):
    time.sleep(0.2)  # as on a busy machine
    started.append(function)
    function(*arguments)

_thread.start_new_thread = lambda function, arguments: start(late, (function, arguments))
signals = Signals()
signals.listen()
try:
    signal.raise_signal(signal.SIGINT)
except KeyboardInterrupt:
    signals.end()
    print(len(started))
"""


def test_the_program_waits_for_its_own_thread_however_late_that_starts() -> None:
    done = subprocess.run(
        [sys.executable, "-c", LATE], env=environment(), capture_output=True, text=True, timeout=180
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "1\n", "")
