"""``dh2sim rollout``."""

from __future__ import annotations

import fcntl
import json
import os
import pty
import re
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pytest
import xarray as xr

from dh2sim.cli.output import size_text
from dh2sim.simulate import open_dataset, rollout
from dh2sim.simulate.quantities import QUANTITIES
from tests.program import Outcome, contents, dh2sim, dh2sim_process, environment
from tests.robot_files import RICH, small, snake, write

KNOWN = "qpos, qvel, ctrl, tool_pose, reference, qacc, torque, energy, contacts"
QUICK = ("--rollouts", "3", "--steps", "10")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with a robot in it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["dh2sim"])
    write(tmp_path, RICH)
    return tmp_path


def printed(run: Outcome) -> list[str]:
    """The lines of an error of bad input."""
    assert (run.status, run.out) == (2, "")
    assert all(line.startswith("dh2sim: ") for line in run.err.splitlines())
    return [line.removeprefix("dh2sim: ") for line in run.err.splitlines()]


def test_a_run_is_written_and_summed_up(folder: Path) -> None:
    run = dh2sim("rollout", "rich.yaml", "--out", "run.zarr", "--rollouts", "1234", "--steps", "10", "--threads", "2")
    size = size_text(sum(map(len, contents(folder / "run.zarr").values())))
    assert (run.status, run.err) == (0, "")
    first, second, third, fourth = run.out.splitlines()
    assert first == "rich: 1,234 rollouts of 10 steps (0.02 s), sine, in run.zarr"
    assert re.fullmatch(r"  simulated 1,234 in \d+(\.\d+)? s: [\d,]+ steps/s", second)
    assert third == f"  recorded qpos, qvel, ctrl, tool_pose, qpos_ref, qvel_ref: {size}"
    assert fourth == "  finished 1,234"
    assert sorted(path.name for path in folder.iterdir()) == ["rich.yaml", "run.zarr"]


def test_it_is_the_run_that_the_library_makes(folder: Path) -> None:
    options = ["--controller", "random:rate=9", "--start", "up", "--seed", "7", "--every", "5", "--timestep", "0.004"]
    more = [
        "--integrator",
        "euler",
        "--record",
        "qpos,torque,qpos",
        "--randomize",
        "mass=0.1, friction=0.2",
        "--floating-base",
    ]
    run = dh2sim("rollout", "rich.yaml", "--out", "run.zarr", *QUICK, *options, *more)
    assert (run.status, run.err) == (0, "")
    made = rollout(
        "rich.yaml",
        rollouts=3,
        steps=10,
        controller="random:rate=9",
        start="up",
        seed=7,
        every=5,
        timestep=0.004,
        integrator="Euler",
        record=("qpos", "torque"),
        randomize={"mass": 0.1, "friction": 0.2},
        floating_base=True,
    )
    found = open_dataset("run.zarr").load()
    xr.testing.assert_identical(found.drop_attrs(deep=False), made.drop_attrs(deep=False))
    own = {"created": "", "command": ""}
    assert {**found.attrs, **own} == {**made.attrs, **own}


@pytest.mark.slow
def test_the_command_is_kept_as_a_shell_would_take_it(tmp_path: Path) -> None:
    write(tmp_path, small(), "my robot")
    arguments = ["rollout", "my robot.yaml", "--out", "a b.zarr", *QUICK]
    run = dh2sim_process(*arguments, cwd=tmp_path)
    assert (run.status, run.err) == (0, "")
    command = open_dataset(tmp_path / "a b.zarr").attrs["command"]
    assert command == "dh2sim rollout 'my robot.yaml' --out 'a b.zarr' --rollouts 3 --steps 10"


def test_quiet_prints_nothing(folder: Path) -> None:
    assert dh2sim("rollout", "rich.yaml", "--out", "run.zarr", *QUICK, "--quiet") == Outcome(status=0, out="", err="")
    assert dh2sim("rollout", "rich.yaml", "--out", "other.zarr", *QUICK, "-q") == Outcome(status=0, out="", err="")
    assert printed(dh2sim("rollout", "rich.yaml", "--out", "run.zarr", *QUICK, "-q")) == [
        "'run.zarr' already exists; resume it, overwrite it, or choose another folder"
    ]


def test_what_went_wrong_in_rollouts_is_counted(folder: Path) -> None:
    states = "joint_1,elbow,elbow_velocity\n0,0,0\n0,0,1e11\n0,0,1e12\n"
    (folder / "s.csv").write_text(states, encoding="utf-8")
    motor = ["--controller", "pd:kp=1e6", "--start", "s.csv"]
    run = dh2sim("rollout", "rich.yaml", "--out", "run.zarr", *QUICK, *motor)
    assert (run.status, run.err) == (0, "")
    assert run.out.splitlines()[-2:] == [
        "  finished 1, stopped early 2 (bad_qvel 2), controls clipped in 1: joint_1 in 1,",
        "    elbow in 1; a longer period takes less: --controller pd:kp=1000000,period=2",
    ]


def test_a_finished_run_has_nothing_to_resume(folder: Path) -> None:
    dh2sim("rollout", "rich.yaml", "--out", "run.zarr", *QUICK)
    run = dh2sim("rollout", "rich.yaml", "--out", "run.zarr", *QUICK, "--resume")
    assert (run.status, run.err) == (0, "")
    assert run.out.splitlines()[1] == "  all of them were simulated before"


def test_every_mistake_is_reported_at_once(folder: Path) -> None:
    mistakes = ["--steps", "10", "--every", "3", "--rollouts", "0", "--record", "qpos,qve", "--integrator", "rk5"]
    more = ["--randomize", "mas=0.1,gain=2", "--seed", "-1"]
    assert printed(dh2sim("rollout", "rich.yaml", "--out", "run.zarr", *mistakes, *more)) == [
        "--rollouts must be at least 1, got 0",
        "--integrator must be one of Euler, RK4, implicit, implicitfast, got 'rk5'. Did you mean 'RK4'?",
        "--seed must be at least 0, got -1",
        f"--record must not contain 'qve'. Did you mean 'qvel'? Allowed: {KNOWN}",
        f"--randomize must not contain 'mas'. Did you mean 'mass'? Allowed: {', '.join(QUANTITIES)}",
        "--randomize must have shares of at least 0 and below 1, got gain=2",
        "--every must divide the 10 steps of a rollout, got 3",
    ]
    unknown = ["--controller", "sine:amplitud=1", "--start", "hme"]
    assert printed(dh2sim("rollout", "rich.yaml", "--out", "run.zarr", *unknown)) == [
        "controller 'sine': unknown option 'amplitud'. Did you mean 'amplitude'? "
        "Options: harmonics=5, frequency=0.1, amplitude=0.3, fade=1",
        "--start must be one of home, zero, random, up, or a .csv or .npy file of joint positions, got 'hme'. "
        "Did you mean 'home'?",
    ]
    assert sorted(path.name for path in folder.iterdir()) == ["rich.yaml"]


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (
            ["--rollouts", "1000000000000"],
            "--rollouts must be at most 10,000,000, got 1000000000000; make several runs with other seeds",
        ),
        (["--duration", "1e300"], "--duration must be at most 1,000,000,000,000 time steps of 0.002 s, got 1e+300"),
        (["--steps", "1" + "0" * 30], f"--steps must be at most 1,000,000,000,000, got 1{'0' * 30}"),
        (["--timestep", "nan"], "--timestep must be above 0 s and at most 1 s, got nan"),
        (["--timestep", "-1"], "--timestep must be above 0 s and at most 1 s, got -1.0"),
        (["--record", ","], f"--record must not be empty. Allowed: {KNOWN}"),
        (["--resume", "--overwrite"], "--resume must not be given together with --overwrite"),
        (
            ["--timestep", "1e-9"],
            "one rollout would record 283.1 GB, and at most 1 GB are possible; record fewer states (every) or fewer "
            "quantities (record)",
        ),
        (
            ["--controller", "pd", "--randomize", "gain=0.1"],
            "--randomize must not contain 'gain': the robot as simulated has no gain to multiply",
        ),
        (
            ["--randomize", "mass=lots"],
            "--randomize must be X, uniform:LOW:HIGH, loguniform:LOW:HIGH, normal:SIGMA, normal:MEAN:SIGMA or "
            "fixed:X, got mass='lots'",
        ),
        (
            ["--controller", "random:rate=1e6"],
            "controller 'random': option 'rate' must be at most that of the time steps, 500 Hz, got 1e+06 Hz",
        ),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_one_mistake_is_reported_and_nothing_is_made(options: list[str], problem: str, folder: Path) -> None:
    assert printed(dh2sim("rollout", "rich.yaml", "--out", "run.zarr", *options)) == [problem]
    assert not (folder / "run.zarr").exists()


@pytest.mark.parametrize(
    ("share", "problem"),
    [
        ("mass", "'mass' is not of the form name=value, as in mass=0.1 or com=normal:0.01"),
        ("mass=", "'mass=' is not of the form name=value, as in mass=0.1 or com=normal:0.01"),
        ("mass=0.1,mass=0.2", "'mass' is given twice"),
    ],
)
def test_a_share_that_cannot_be_read_is_wrong_usage(share: str, problem: str, folder: Path) -> None:
    run = dh2sim("rollout", "rich.yaml", "--out", "run.zarr", "--randomize", share)
    assert (run.status, run.out) == (2, "")
    assert run.err.splitlines()[-1] == f"dh2sim: --randomize: {problem}"


@pytest.mark.parametrize(
    ("out", "words"),
    [
        ("rich.yaml", "'rich.yaml' is not a run of dh2sim; remove it yourself, or choose another folder"),
        ("rich.yaml/run.zarr", "cannot write to 'rich.yaml/run.zarr': Not a directory; nothing was changed"),
        (".", "'.' is not a run of dh2sim; remove it yourself, or choose another folder"),
        ("", "'.' is not a run of dh2sim; remove it yourself, or choose another folder"),
        ("x" * 300, f"cannot write to '{'x' * 300}': File name too long; nothing was changed"),
    ],
    ids=["a file", "in a file", "this folder", "nothing", "too long"],
)
def test_a_place_where_no_run_can_be_is_reported(out: str, words: str, folder: Path) -> None:
    assert printed(dh2sim("rollout", "rich.yaml", "--out", out, *QUICK)) == [words]
    assert sorted(path.name for path in folder.iterdir()) == ["rich.yaml"]


def test_folders_on_the_way_are_made(folder: Path) -> None:
    assert dh2sim("rollout", "rich.yaml", "--out", "a/b/run.zarr", *QUICK, "-q").status == 0
    assert open_dataset(folder / "a/b/run.zarr").sizes["rollout"] == 3


def test_a_robot_that_is_wrong_is_reported_as_by_every_command(folder: Path) -> None:
    (folder / "bad.yaml").write_text(
        "name: bad\nconvention: standard\njoints: [{tpye: revolute}]\n", encoding="utf-8"
    )
    run = dh2sim("rollout", "bad.yaml", "--out", "run.zarr")
    assert run == dh2sim("info", "bad.yaml")
    assert run.status == 2


def test_a_robot_that_does_not_move_has_nothing_to_simulate(folder: Path) -> None:
    (folder / "still.yaml").write_text(
        "name: still\nconvention: standard\njoints: [{type: fixed, a: 0.3}]\n", encoding="utf-8"
    )
    assert printed(dh2sim("rollout", "still.yaml", "--out", "run.zarr")) == [
        "still has no joint that moves: there is nothing to simulate"
    ]


@pytest.mark.parametrize(("controller", "joints"), [("sine", 60), pytest.param("pd", 25, marks=pytest.mark.slow)])
def test_many_joints_are_no_trouble(controller: str, joints: int, folder: Path) -> None:
    write(folder, snake(joints))
    run = dh2sim("rollout", "snake.yaml", "--out", "run.zarr", *QUICK, "--threads", "999", "--controller", controller)
    assert (run.status, run.err) == (0, "")
    assert open_dataset("run.zarr").qpos.shape == (3, 11, joints)


def test_a_seed_may_be_of_any_size(folder: Path) -> None:
    seed = str(2**500)
    assert dh2sim("rollout", "rich.yaml", "--out", "run.zarr", *QUICK, "--seed", seed, "-q").status == 0
    assert open_dataset("run.zarr").attrs["seed"] == 2**500
    assert dh2sim("rollout", "rich.yaml", "--out", "run.zarr", *QUICK, "--seed", seed, "--resume", "-q").status == 0


@pytest.mark.slow
def test_no_bar_is_drawn_into_a_file(folder: Path) -> None:
    run = dh2sim_process("rollout", "rich.yaml", "--out", "run.zarr", *QUICK, cwd=folder)
    assert (run.status, run.err) == (0, "")
    assert "\x1b" not in run.out


@pytest.mark.slow
@pytest.mark.parametrize("quiet", [False, True])
def test_a_bar_is_drawn_on_a_terminal_unless_it_should_be_quiet(quiet: bool, folder: Path) -> None:
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    command = [sys.executable, "-m", "dh2sim", "rollout", "rich.yaml", "--out", "run.zarr", *QUICK]
    process = subprocess.Popen(
        [*command, *(["--quiet"] if quiet else [])],
        cwd=folder,
        env=environment(TERM="xterm"),
        stdout=subprocess.PIPE,
        stderr=theirs,
    )
    os.close(theirs)
    drawn = b""
    while True:
        try:
            part = os.read(ours, 4096)
        except OSError:  # the other end is closed
            break
        if not part:
            break
        drawn += part
    out, _ = process.communicate(timeout=180)
    os.close(ours)
    assert process.returncode == 0
    assert bool(out) is not quiet
    assert (b"simulating" in drawn) is not quiet
    assert (b"of 3 rollouts" in drawn) is not quiet


def test_the_help_says_what_comes_next_in_eighty_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    run = dh2sim("rollout", "--help")
    assert (run.status, run.err) == (0, "")
    assert max(map(len, run.out.splitlines())) <= 80
    for words in ("--out RUN.zarr", "dh2sim runs run.zarr", "dh2sim plot run.zarr", "dh2sim render run.zarr"):
        assert words in run.out


def test_every_example_of_the_help_works(folder: Path) -> None:
    write(folder, small("my_arm"))
    lines = dh2sim("rollout", "--help").out.split("Examples:\n")[1].split("  Then:")[0].splitlines()
    commands = [line.split()[1:] for line in lines if line.strip()]
    assert len(commands) == 7
    for number, command in enumerate(commands):
        at = command.index("--out") + 1
        run = dh2sim(*command[:at], f"{number}.zarr", *command[at + 1 :], *QUICK)
        assert (run.status, run.err) == (0, ""), command


def test_help_of_the_command_simulates_nothing_and_imports_nothing_heavy() -> None:
    script = (
        "import sys\nfrom dh2sim.cli.app import app\n"
        "try: app(['rollout', '--help'])\nexcept SystemExit: pass\n"
        "print(sorted({'mujoco', 'xarray', 'zarr', 'numpy'} & sys.modules.keys()))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], env=environment(), capture_output=True, text=True, timeout=180, check=True
    )
    assert done.stdout.splitlines()[-1] == "[]"


SHARED = ("planar_2r", "--rollouts", "10", "--steps", "4", "--block-size", "2", "--out", "run.zarr")


def test_shares_in_any_order_make_the_run_of_one_process(folder: Path) -> None:
    done = dh2sim("rollout", *SHARED, "--share", "2/3")
    assert (done.status, done.err) == (0, "")
    assert re.search(r"^planar_2r: 2 of 5 blocks, 4 rollouts, sine, in run.zarr\n  simulated 4 in ", done.out)
    assert done.out.endswith("\n  the run has 2 of 5 blocks\n")
    described = json.loads(dh2sim("runs", "run.zarr", "--json").out)
    assert described["blocks_missing"] == [0, 2, 3]
    incomplete = dh2sim("runs", "run.zarr", "--verify")
    assert incomplete.status == 1
    assert "  blocks      2 of 5 done and verified; blocks 0, 2 to 3 are missing\n" in incomplete.out
    assert dh2sim("rollout", *SHARED, "--blocks", "2:4").status == 0
    last = dh2sim("rollout", *SHARED, "--share", "1/1", "--json")
    assert json.loads(last.out)["complete"]
    assert "the run has 5 of 5 blocks: it is complete" in last.err
    verified = dh2sim("runs", "run.zarr", "--verify")
    assert verified.status == 0
    assert "  blocks      5 of 5 done and verified\n" in verified.out
    assert dh2sim("rollout", *SHARED[:-1], "one.zarr", "-q").status == 0
    shared, one = (
        {name: data for name, data in contents(Path(run)).items() if "/c." in name and "record" not in name}
        for run in ("run.zarr", "one.zarr")
    )
    assert shared == one
    chunk = Path("run.zarr/qpos/c.3.0.0")
    chunk.write_bytes(chunk.read_bytes()[:-9] + bytes(9))
    damaged = dh2sim("runs", "run.zarr", "--verify")
    assert (damaged.status, damaged.out) == (1, "")
    assert damaged.err == "dh2sim: 'run.zarr': block 3 is damaged; resume it to compute them again\n"


@pytest.mark.parametrize(
    ("options", "reported"),
    [
        (("--share", "4/3"), "dh2sim: --share must be one of 1/3 to 3/3, got 4/3\n"),
        (("--share", "0/1"), "dh2sim: --share must be 1/1, got 0/1\n"),
        (("--share", "1-3"), "'1-3' is not of the form I/N, as in 3/16"),
        (("--blocks", "a:b"), "'a:b' is not of the form A:B, as in 10:20"),
        (("--blocks", "4:2"), "'4:2' ends before it begins"),
        (("--blocks", "5:9"), "--blocks must be of the run, which has blocks 0 to 4; got 5:9"),
        (("--share", "1/2", "--blocks", "1:2"), "dh2sim: --share must not be given together with --blocks\n"),
        (("--share", "1/2", "--overwrite"), "dh2sim: --overwrite must not be given with a part of the blocks"),
        (("--block-size", "11"), "dh2sim: --block-size must be a whole number from 1 to 10 "),
    ],
)
def test_a_share_that_cannot_be_makes_no_run(folder: Path, options: tuple[str, ...], reported: str) -> None:
    refused = dh2sim("rollout", *SHARED, *options)
    assert (refused.status, refused.out) == (2, "")
    assert reported in refused.err
    assert not Path("run.zarr").exists()
