"""``dh2sim view`` as a whole process, and the initial state of every built-in robot."""

from __future__ import annotations

import contextlib
import errno
import os
import random
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator, Sequence
from pathlib import Path

import mujoco
import numpy as np
import pytest

from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.catalog import builtin_robots
from dh2sim.robot.read import load_robot
from dh2sim.view.initial_state import folder_of, open_state
from dh2sim.view.scene.scene import scene_of
from tests.program import STARTED, dh2sim, dh2sim_process, environment

ADDRESS = "127.0.0.1"
TIMEOUT = 180.0
"""s."""

SIGNAL_LOST = """
import signal, sys
from dh2sim.cli.main import main
from dh2sim.view.server import Viewer

class Callback:
    def __del__(self):  # Python drops whatever is raised here
        signal.raise_signal(int(kind))

class Unraisable:
    def __del__(self):
        raise ValueError

def wait_after_the_signal(viewer):
    if where == "callback":
        callback = Callback()
        del callback
    elif where == "hook":  # what reports an exception that was dropped is itself interrupted
        sys.__unraisablehook__ = lambda error: signal.raise_signal(int(kind))
        dropped = Unraisable()
        del dropped
    else:  # a library catches everything
        try:
            signal.raise_signal(int(kind))
        except:
            pass
    wait(viewer)

kind, where = sys.argv.pop(1), sys.argv.pop(1)
wait, Viewer.wait = Viewer.wait, wait_after_the_signal
main()
"""


@contextlib.contextmanager
def serving(*arguments: str | Path, program: Sequence[str] = ("-m", "dh2sim")) -> Iterator[subprocess.Popen[str]]:
    """A viewer in a process of its own, which has not printed anything yet; killed with its context."""
    # not through a shell's '&': what that starts ignores SIGINT
    process = subprocess.Popen(
        [sys.executable, *program, "view", *map(str, arguments), "--no-browser"],
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    with process:
        try:
            yield process
        finally:
            process.kill()


def first_line(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline()


def unused_port() -> int:
    with socket.socket() as trial:
        trial.bind((ADDRESS, 0))
        return int(trial.getsockname()[1])


@contextlib.contextmanager
def taken_port() -> Iterator[int]:
    """A taken port, with others after it."""
    while True:
        with socket.socket() as listener:
            listener.bind((ADDRESS, 0))
            port = int(listener.getsockname()[1])
            if port < 65000:
                listener.listen()
                yield port
                return


def is_free(port: int) -> bool:
    with socket.socket() as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            trial.bind((ADDRESS, port))
        except OSError:
            return False
    return True


def page_of(url: str) -> str:
    with urllib.request.urlopen(url, timeout=TIMEOUT) as answer:
        assert answer.status == 200
        return str(answer.read().decode())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "status", "message"),
    [(signal.SIGINT, 130, "dh2sim: interrupted\n"), (signal.SIGTERM, 143, "")],
    ids=["SIGINT", "SIGTERM"],
)
def test_it_serves_a_page_at_the_printed_address_until_it_is_stopped(
    kind: signal.Signals, status: int, message: str
) -> None:
    port = unused_port()
    with serving("stanford", "--port", str(port)) as process:
        assert first_line(process) == f"stanford: http://{ADDRESS}:{port}  (stop with Ctrl-C)\n"
        assert page_of(f"http://{ADDRESS}:{port}").lstrip().lower().startswith("<!doctype html")
        process.send_signal(kind)
        started = time.monotonic()
        out, err = process.communicate(timeout=TIMEOUT)
        assert time.monotonic() - started < 60.0
    assert (process.returncode, out, err) == (status, "", message)
    assert is_free(port)


@pytest.mark.slow
def test_it_stops_at_once_with_a_page_open() -> None:
    client = pytest.importorskip("websockets.sync.client")
    import viser

    port = unused_port()
    with serving("stanford", "--port", str(port)) as process:
        first_line(process)
        protocols = [f"viser-v{viser.__version__}"]
        with client.connect(f"ws://{ADDRESS}:{port}", subprotocols=protocols, max_size=None) as connection:
            connection.recv(timeout=TIMEOUT)
            process.send_signal(signal.SIGINT)
            started = time.monotonic()
            out, err = process.communicate(timeout=TIMEOUT)
            assert time.monotonic() - started < 60.0
    assert (process.returncode, out, err) == (130, "", "dh2sim: interrupted\n")
    assert is_free(port)


@pytest.mark.slow
def test_an_interruption_while_it_starts_makes_no_traceback() -> None:
    rng = random.Random(0)
    for _ in range(6):
        with serving("stanford", "--port", str(unused_port()), program=["-c", STARTED]) as process:
            assert first_line(process) == "started\n"
            time.sleep(rng.uniform(0.0, 0.8))
            process.send_signal(signal.SIGINT)
            err = process.communicate(timeout=TIMEOUT)[1]
        # before the program listens, the signal itself ends the process
        assert process.returncode in (130, -signal.SIGINT)
        if process.returncode == 130:
            assert err == "dh2sim: interrupted\n"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "status", "message"),
    [(signal.SIGINT, 130, "dh2sim: interrupted\n"), (signal.SIGTERM, 143, "")],
    ids=["SIGINT", "SIGTERM"],
)
@pytest.mark.parametrize(
    "where", ["callback", *(pytest.param(name, marks=pytest.mark.slow) for name in ("hook", "library"))]
)
def test_a_signal_that_others_swallow_still_wakes_and_ends_the_viewer(
    where: str, kind: signal.Signals, status: int, message: str
) -> None:
    program = ["-c", SIGNAL_LOST, str(kind.value), where]
    with serving("stanford", "--port", str(unused_port()), program=program) as process:
        _, err = process.communicate(timeout=TIMEOUT)
    assert (process.returncode, err) == (status, message)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere 127.0.0.1 alone is this machine's own address")
def test_by_default_only_this_machine_can_reach_it() -> None:
    with serving("stanford", "--port", str(port := unused_port())) as process:
        first_line(process)
        # every address in 127.0.0.0/8 is this machine's; one that was not asked for is not listened at
        with socket.socket() as other:
            assert other.connect_ex(("127.0.0.2", port)) != 0
    with serving("stanford", "--port", str(port := unused_port()), "--host", "0.0.0.0") as process:
        assert first_line(process) == f"stanford: http://{ADDRESS}:{port}  (stop with Ctrl-C)\n"
        with socket.socket() as other:
            assert other.connect_ex(("127.0.0.2", port)) == 0
        process.send_signal(signal.SIGINT)
        warning, names, *rest = process.communicate(timeout=TIMEOUT)[1].splitlines()
    assert warning == "dh2sim: anyone who can reach this machine at any of its addresses can open the page"
    machine = socket.gethostname()
    assert re.fullmatch(
        rf"dh2sim: by an IP address or as localhost, {machine}, {machine}\.local; --allow-host adds a name",
        names,
        re.IGNORECASE,
    )
    assert rest == ["dh2sim: interrupted"]


@pytest.mark.slow
def test_an_address_that_only_this_machine_can_reach_gives_no_warning() -> None:
    with serving("stanford", "--port", str(unused_port()), "--host", "localhost", "--share", "never") as process:
        first_line(process)
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=TIMEOUT)[1] == "dh2sim: interrupted\n"


def test_the_next_free_port_is_used_and_printed_if_a_port_is_taken() -> None:
    with taken_port() as port, serving("stanford", "--port", str(port)) as process:
        found = re.fullmatch(
            rf"stanford: http://{re.escape(ADDRESS)}:(\d+)  \(stop with Ctrl-C\)\n", first_line(process)
        )
        assert found is not None
        chosen = int(found.group(1))
        assert port < chosen < port + 100
        assert "<html" in page_of(f"http://{ADDRESS}:{chosen}")
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=TIMEOUT)
    assert err == f"dh2sim: port {port} is taken; using {chosen}\ndh2sim: interrupted\n"
    assert process.returncode == 130


@pytest.mark.slow
def test_two_viewers_run_side_by_side() -> None:
    port = unused_port()
    with serving("stanford", "--port", str(port)) as first:
        first_line(first)
        with serving("scara", "--port", str(port)) as second:
            assert first_line(second) != f"scara: http://{ADDRESS}:{port}  (stop with Ctrl-C)\n"


def test_an_unknown_robot_is_refused() -> None:
    done = dh2sim("view", "stanfrod", "--no-browser")
    assert (done.status, done.out) == (2, "")
    assert done.err.startswith("dh2sim: no file or robot named 'stanfrod'. Did you mean 'stanford'?")


def test_an_address_of_another_machine_is_refused() -> None:
    # an address that is set aside for documentation, RFC 5737: no machine has it
    done = dh2sim_process("view", "stanford", "--no-browser", "--host", "192.0.2.1")
    why = os.strerror(errno.EADDRNOTAVAIL)
    assert (done.status, done.out, done.err) == (2, "", f"dh2sim: cannot listen at 192.0.2.1, port 8080: {why}\n")


@pytest.mark.slow
@pytest.mark.parametrize("host", ["256.0.0.1", "a..b", "x" * 64])
def test_an_invalid_host_is_refused(host: str) -> None:
    done = dh2sim_process("view", "stanford", "--no-browser", "--host", host)
    assert (done.status, done.out) == (2, "")
    assert done.err.startswith(f"dh2sim: cannot listen at {host}, port 8080: ")
    assert done.err.count("\n") == 1, "a sentence, no traceback"


@pytest.mark.parametrize("name", ["http://lab.example.org", "lab.example.org:80", "a b", "*"])
def test_an_invalid_name_of_this_machine_is_refused(name: str) -> None:
    done = dh2sim("view", "stanford", "--no-browser", "--allow-host", name)
    assert (done.status, done.out) == (2, "")
    assert done.err.endswith(
        f"--allow-host must be a name such as lab.example.org, without a scheme or a port, got {name!r}\n"
    )


@pytest.mark.parametrize("port", ["0", "65536", "-1", "eighty"])
def test_an_invalid_port_is_refused(port: str) -> None:
    done = dh2sim("view", "stanford", "--no-browser", "--port", port)
    assert (done.status, done.out) == (2, "")
    assert "--port" in done.err


def test_a_page_is_exported_as_one_file_and_nothing_else(tmp_path: Path) -> None:
    done = dh2sim_process("view", "stanford", "--export", "page.html", cwd=tmp_path)
    assert (done.status, done.out, done.err) == (0, "page.html: stanford\n", "")
    assert [path.name for path in tmp_path.iterdir()] == ["page.html"]
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert text.lstrip().lower().startswith("<!doctype html")
    assert not re.findall(r'(?:src|href)="https?:', text), "it needs no network"


def test_an_exported_page_replaces_another_only_with_force(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    assert dh2sim("view", "scara", "--export", page).status == 0
    scara = page.read_bytes()
    done = dh2sim("view", "stanford", "--export", page)
    message = f"dh2sim: '{page}' already exists; choose another name, or overwrite it with --force\n"
    assert (done.status, done.out, done.err) == (2, "", message)
    assert page.read_bytes() == scara
    assert dh2sim("view", "stanford", "--export", page, "--force").status == 0
    assert page.read_bytes() != scara
    assert b"stanford" in page.read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["page.html"]


def test_a_page_that_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    done = dh2sim_process("view", "stanford", "--export", "nowhere/page.html", cwd=tmp_path)
    assert (done.status, done.out) == (2, "")
    assert done.err == "dh2sim: cannot write 'nowhere/page.html': there is no folder 'nowhere'\n"
    assert not list(tmp_path.iterdir())


def test_a_page_is_written_only_to_html(tmp_path: Path) -> None:
    done = dh2sim("view", "stanford", "--export", tmp_path / "page.pdf")
    assert (done.status, done.out, list(tmp_path.iterdir())) == (2, "", [])
    assert "--export must be a file that ends in .html, got '" in done.err


def test_force_needs_export() -> None:
    done = dh2sim("view", "stanford", "--no-browser", "--force")
    assert (done.status, done.out) == (2, "")
    assert done.err.endswith("--force needs --export\n")


@pytest.mark.parametrize("word", ["public", "always", "", "Never"])
def test_pages_are_never_shared_over_the_internet(word: str) -> None:
    done = dh2sim("view", "stanford", "--no-browser", "--share", word)
    assert (done.status, done.out) == (2, "")
    assert done.err.endswith(f"--share must be 'never', got {word!r}; pages are never shared over the internet\n")


def test_a_run_in_the_place_of_its_robot_is_refused_with_how_to_play_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert (
        dh2sim("rollout", "stanford", "--rollouts", "1", "--steps", "1", "--out", "run.zarr", "--quiet").status == 0
    )
    Path("motion.csv").write_text("time,joint_1\n0,0\n1,1\n", encoding="utf-8")
    Path("table.csv").write_text("theta,d,a,alpha\nq1,0,1,0\n", encoding="utf-8")
    for arguments, refusal in (
        (["run.zarr"], "run.zarr: is a run, not a robot; 'dh2sim view stanford run.zarr' plays it"),
        (["run.zarr", "run.zarr"], "run.zarr: is a run, not a robot; 'dh2sim view stanford run.zarr' plays it"),
        (
            ["motion.csv", "run.zarr"],
            "motion.csv: is a trajectory file, not a robot; 'dh2sim view ROBOT motion.csv' plays it",
        ),
        (["run.zarr", "scara"], "run.zarr: is a run, not a robot; 'dh2sim view scara run.zarr' plays it"),
        (["motion.csv"], "motion.csv: is a trajectory file, not a robot; 'dh2sim view ROBOT motion.csv' plays it"),
    ):
        done = dh2sim("view", *arguments, "--no-browser")
        assert (done.status, done.out, done.err) == (2, "", f"dh2sim: {refusal}\n")
    assert "trajectory" not in dh2sim("view", "table.csv", "--no-browser").err


@pytest.mark.slow
def test_a_missing_run_is_refused_before_anything_is_served(tmp_path: Path) -> None:
    done = dh2sim_process("view", "stanford", "run.zarr", "--no-browser", cwd=tmp_path)
    assert (done.status, done.out, done.err) == (2, "", "dh2sim: there is no 'run.zarr'\n")


@pytest.mark.slow
@pytest.mark.parametrize("robot", builtin_robots())
def test_every_built_in_robot_opens_at_home_where_its_table_has_it(robot: str) -> None:
    spec = load_robot(robot)
    state = open_state(spec, folder_of(robot))
    assert (state.spec.name, state.table.errors, state.notice) == (spec.name, (), "")
    scene = scene_of(state)
    assert {f"/robot/link_{i}" for i in range(1, len(spec.rows) + 1)} <= set(scene)
    expected = table_tool_pose(spec, state.model.home)
    link = scene[f"/robot/link_{len(spec.rows)}"]
    tool = scene[f"/robot/link_{len(spec.rows)}/tool0"]
    turned = np.empty(3)
    mujoco.mju_rotVecQuat(turned, np.asarray(tool.position), np.asarray(link.orientation))
    assert np.allclose(turned + link.position, expected[:3, 3], rtol=0, atol=1e-12)
