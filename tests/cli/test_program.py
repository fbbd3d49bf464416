"""What holds for every command."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import jsonschema
import pytest

from dh2sim.robot.catalog import builtin_groups, builtin_mechanisms, builtin_robots
from tests.program import Outcome, dh2sim, dh2sim_process, environment, shell
from tests.robot_files import small, write

ROOT = Path(__file__).resolve().parents[2]
COMMANDS = (
    "new",
    "export",
    "validate",
    "check",
    "fk",
    "jacobian",
    "ik",
    "trajectory",
    "workspace",
    "symbolic",
    "mobility",
    "info",
    "view",
    "import",
    "convert",
    "diff",
    "grade",
    "exercise",
    "frames",
    "calibrate",
    "rollout",
    "sweep",
    "render",
    "draw",
    "plot",
    "runs",
    "list",
    "schema",
)


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("option", ["--help", "-h"])
def test_the_help_of_every_command_has_an_example(command: str, option: str) -> None:
    run = dh2sim(command, option)
    assert (run.status, run.err) == (0, "")
    assert run.out.startswith(f"Usage: dh2sim {command} ")
    examples = run.out.split("\n  Examples:\n")[1]
    assert examples.startswith(f"    dh2sim {command}")
    assert max(len(line) for line in run.out.splitlines()) <= 81


def test_the_help_of_the_program_lists_every_command_whole() -> None:
    run = dh2sim("--help")
    assert (run.status, run.err) == (0, "")
    listed = run.out.split("Commands:\n")[1].splitlines()
    assert [line.split()[0] for line in listed] == list(COMMANDS)
    assert all(line.endswith(".") and not line.endswith("...") for line in listed)
    assert "Exit status: 0 done, 1 a check failed, 2 bad input or usage, 130" in run.out


@pytest.mark.slow
def test_every_example_of_the_programs_help_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copy(ROOT / "generated" / "scara" / "scara.urdf", "arm.urdf")
    shutil.copy(ROOT / "docs" / "puma560_axes.yaml", "axes.yaml")
    talkative = {"import", "convert", "frames"}  # what they say is not to be mixed with the robot file
    lines = dh2sim("--help").out.split("Examples:\n")[1].split("\n\n")[0].splitlines()
    for line in lines:
        command = line.split("  ")[2].removeprefix("dh2sim ").split()
        quicker = {"validate": ["--samples", "10"], "rollout": ["--rollouts", "2", "--steps", "50"]}
        run = dh2sim(*command, *quicker.get(command[0], []))
        assert run.status == 0, line
        assert run.err == "" or command[0] in talkative, line
    assert len(lines) == 25
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "arm.urdf",
        "arm.yaml",
        "arms.csv",
        "arms.csv.journal",
        "axes.yaml",
        "configurations.csv",
        "generated",
        "motion.csv",
        "my_arm.yaml",
        "reach.svg",
        "run-0-joints.png",
        "run-0.mp4",
        "run.zarr",
        "stanford.html",
        "stanford.svg",
    ]


def test_without_arguments_the_help_is_shown() -> None:
    run = dh2sim()
    assert run.status == 2
    assert "Usage: dh2sim [OPTIONS] COMMAND [ARGS]..." in run.out + run.err


def test_the_version_is_that_of_the_package() -> None:
    assert dh2sim("--version") == Outcome(status=0, out=f"dh2sim {version('dh2sim')}\n", err="")


def test_the_package_runs_as_a_module() -> None:
    assert dh2sim_process("--version") == dh2sim("--version")
    assert dh2sim_process("fk", "stanford", "zero") == dh2sim("fk", "stanford", "zero")
    run = dh2sim_process("fk", "stanfrd")
    assert (run.status, run.out) == (2, "")
    assert run.err == dh2sim("fk", "stanfrd").err


@pytest.mark.parametrize(
    "arguments",
    [
        ["nonsense"],
        ["--nonsense"],
        ["fk"],
        ["info"],
        ["export"],
        ["validate"],
        ["info", "stanford", "rpr"],
        ["info", "stanford", "--degrees"],
        ["list", "stanford"],
        ["fk", "stanford", "--frame"],
        ["ik", "stanford", "--xyz", "1", "2"],
        ["ik", "stanford", "--at"],
        ["validate", "stanford", "--samples", "0"],
        ["validate", "stanford", "--samples", "many"],
        ["validate", "stanford", "--samples", "1000000000000"],
        ["validate", "stanford", "--seed", "-1"],
        ["validate", "stanford", "--tolerance", "nan"],
        ["validate", "stanford", "--tolerance", "0"],
        ["validate", "stanford", "--tolerance", "1"],
        ["export", "stanford", "--format", "sdf"],
    ],
    ids=" ".join,
)
def test_wrong_usage_is_reported_on_standard_error_and_exits_with_2(arguments: list[str]) -> None:
    run = dh2sim(*arguments)
    assert (run.status, run.out) == (2, "")
    assert run.err.startswith("dh2sim: ")
    assert run.err.count("\n") == 1
    assert "Traceback" not in run.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["validate", "stanford", "--samples", "0"], "--samples must be at least 1, got 0"),
        (["validate", "stanford", "--samples", "many"], "--samples must be a whole number, got 'many'"),
        (["rollout", "stanford", "--out", "r", "--duration", "long"], "--duration must be a number, got 'long'"),
        (["view", "stanford", "--port", "99999"], "--port must be at most 65535, got 99999"),
    ],
    ids=lambda value: value[2] if isinstance(value, list) else "",
)
@pytest.mark.skipif(find_spec("typer._coercion") is None, reason="this version of typer words them itself")
def test_wrong_numbers_are_reported_in_plain_words(arguments: list[str], message: str) -> None:
    assert dh2sim(*arguments).err.splitlines()[-1] == f"dh2sim: {message}"


@pytest.mark.parametrize(
    ("arguments", "option", "allowed", "meant"),
    [
        (["convert", "stanford", "--to", "craig"], "--to", "standard, modified, compact", "modified"),
        (["new", "arm", "--convention", "MDH"], "--convention", "standard, modified, hayati", "modified"),
        (["import", "a.md", "--convention", "spong"], "--convention", "standard, modified", "standard"),
        (["frames", "a.yaml", "--convention", "dh"], "--convention", "standard, modified", "standard"),
    ],
)
def test_other_names_of_the_conventions_are_translated(
    arguments: list[str], option: str, allowed: str, meant: str
) -> None:
    run = dh2sim(*arguments)
    assert (run.status, run.out) == (2, "")
    assert run.err.splitlines()[-1] == (
        f"dh2sim: {option}: '{arguments[-1]}' is not one of {allowed}. It is called '{meant}' here"
    )


def test_list_names_every_robot_with_its_joints_below_its_kind() -> None:
    run = dh2sim("list")
    assert (run.status, run.err) == (0, "")
    groups = [block.splitlines() for block in run.out.split("\n\n")]
    assert [group[0] for group in groups] == [f"{group.capitalize()}s" for group in (*builtin_groups(), "mechanism")]
    names = [[line.split()[0] for line in lines if line[2] != " "] for _, *lines in groups]
    assert [tuple(group) for group in names] == [*builtin_groups().values(), builtin_mechanisms()]
    assert "  ur5e          RRRRRR   Universal Robots UR5e, six turning joints\n" in run.out
    assert max(len(line) for line in run.out.splitlines()) <= 80


def test_list_prints_json_alone() -> None:
    run = dh2sim("list", "--json")
    assert (run.status, run.err) == (0, "")
    robots = json.loads(run.out)
    assert sorted(robot["name"] for robot in robots) == sorted([*builtin_robots(), *builtin_mechanisms()])
    [stanford] = [robot for robot in robots if robot["name"] == "stanford"]
    assert stanford.pop("source").startswith("Table and d1, d2, d6: course slides")
    assert stanford == {
        "name": "stanford",
        "group": "course robot",
        "joints": "RRPRRR",
        "conventions": ["standard"],
        "description": "Stanford arm, six joints, the third one slides",
    }


def test_an_unknown_command_is_reported_with_the_one_that_may_be_meant() -> None:
    run = dh2sim("exprot", "stanford")
    assert (run.status, run.out) == (2, "")
    assert run.err == "dh2sim: unknown command 'exprot'. Did you mean 'export'? 'dh2sim --help' lists them all\n"
    assert dh2sim("xyzzy").err == "dh2sim: unknown command 'xyzzy'. 'dh2sim --help' lists them all\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("info", "argument ROBOT is missing. 'dh2sim info --help' has examples"),
        ("info rpr scara", "unexpected argument 'scara'. 'dh2sim info --help' shows how to call it"),
        ("info rpr --jsn", "unknown option '--jsn'. Did you mean '--json'? 'dh2sim info --help' lists them all"),
        ("info rpr -z", "unknown option '-z'. 'dh2sim info --help' lists them all"),
        ("fk rpr --frame", "option '--frame' requires an argument. 'dh2sim fk --help' shows how to call it"),
        ("fk rpr 1 2 --deg=1", "unknown option '--deg'. Did you mean '--degrees'? 'dh2sim fk --help' lists them all"),
        (
            "jacobian rpr --jsn",
            "unknown option '--jsn'. Did you mean '--json'? 'dh2sim jacobian --help' lists them all",
        ),
        (
            "trajectory rpr home --fre",
            "unknown option '--fre'. Did you mean '--free'? 'dh2sim trajectory --help' lists",
        ),
        ("--foo", "unknown option '--foo'. 'dh2sim --help' lists them all"),
        ("check --only file,drift", "--only: 'file' is not one of files, drift, poses. Did you mean 'files'?"),
        ("sweep rpr --vary=", "there is nothing to vary: give --vary or --designs"),
    ],
)
def test_wrong_usage_is_one_line_that_says_what_to_do(arguments: str, message: str) -> None:
    run = dh2sim(*arguments.split())
    assert (run.status, run.out) == (2, "")
    assert run.err.startswith(f"dh2sim: {message}")
    assert run.err.count("\n") == 1


def test_only_the_module_of_the_called_command_is_imported() -> None:
    code = (
        "import sys\nfrom dh2sim.cli.app import app\ntry:\n    app(['list'])\nexcept SystemExit:\n    pass\n"
        "print(*sorted(name for name in sys.modules if name.startswith('dh2sim.cli.')))"
    )
    done = subprocess.run([sys.executable, "-c", code], env=environment(), capture_output=True, text=True, check=True)
    modules = ("app", "common", "output", "robots", "values")
    assert done.stdout.split()[-len(modules) :] == [f"dh2sim.cli.{module}" for module in modules]
    assert done.stdout.count("dh2sim.cli.") == len(modules)


def _completions(words: str, folder: Path) -> list[str]:
    """What bash is offered for the last word."""
    run = dh2sim_process(
        cwd=folder,
        variables={
            "_DH2SIM_COMPLETE": "complete_bash",
            "COMP_WORDS": words,
            "COMP_CWORD": str(len(words.split(" ")) - 1),
        },
    )
    assert run.err == ""
    return run.out.split()


@pytest.mark.slow
def test_shells_complete_commands_options_robots_and_robot_files(tmp_path: Path) -> None:
    (tmp_path / "stall.yaml").touch()
    (tmp_path / "stall.stl").touch()
    (tmp_path / "stock").mkdir()
    (tmp_path / "stock" / "arm.yml").touch()
    assert _completions("dh2sim exp", tmp_path) == ["export"]
    assert _completions("dh2sim fk --ra", tmp_path) == ["--radians"]
    robots = ["stanford", "stanford_shoulder_origin", "staubli_tx2_60"]
    assert _completions("dh2sim fk sta", tmp_path) == [*robots, "stall.yaml"]
    mechanisms = ["stewart", "stretched_four_bar"]
    assert _completions("dh2sim export rpr st", tmp_path) == [*robots, *mechanisms, "stall.yaml", "stock/"]
    assert _completions("dh2sim info stock/", tmp_path) == ["stock/arm.yml"]
    assert _completions("dh2sim info missing/", tmp_path) == []
    assert _completions("dh2sim new arm --from sca", tmp_path) == ["scara"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_is_shown_for_a_shell(shell: str) -> None:
    run = dh2sim_process("--show-completion", shell, variables={"_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"})
    assert (run.status, run.err) == (0, "")
    assert "_DH2SIM_COMPLETE=complete_" in run.out


def test_completion_is_installed(tmp_path: Path) -> None:
    variables = {"HOME": str(tmp_path), "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}
    run = dh2sim_process("--install-completion", "bash", variables=variables)
    assert (run.status, run.err) == (0, "")
    assert "dh2sim.sh" in (tmp_path / ".bashrc").read_text(encoding="utf-8")


def test_schema_prints_a_json_schema_that_any_editor_can_read() -> None:
    run = dh2sim("schema")
    assert (run.status, run.err) == (0, "")
    assert run.out.isascii()
    schema = json.loads(run.out)
    jsonschema.Draft202012Validator.check_schema(schema)
    assert set(schema["required"]) == {"name", "convention", "joints"}


@pytest.mark.slow
@pytest.mark.parametrize("command", ["schema", "info stanford", "fk stanford --json"])
def test_a_reader_that_closes_the_output_is_not_an_error(command: str) -> None:
    run = shell(f"{{ $DH2SIM {command}; echo $? >&2; }} | head -c 1")
    assert (run.status, len(run.out)) == (0, 1)
    assert run.err == "0\n"
    assert shell(f"{{ sleep 0.2; $DH2SIM {command}; echo $? >&2; }} | true").err == "0\n"


@pytest.mark.slow
@pytest.mark.parametrize("command", ["list", "schema", "fk stanford", "info stanford", "export rpr --check"])
def test_a_program_without_standard_output_or_error_does_its_work(command: str, tmp_path: Path) -> None:
    expected = 1 if command.startswith("export") else 0
    for closed in (">&-", "2>&-", ">&- 2>&-"):
        run = shell(f"cd {tmp_path} && $DH2SIM {command} {closed}")
        assert run.status == expected
        assert "Traceback" not in run.err


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_results_that_cannot_be_written_are_an_error() -> None:
    run = shell("$DH2SIM list >/dev/full")
    assert run == Outcome(status=2, out="", err="dh2sim: No space left on device\n")


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_a_terminal_that_knows_few_characters_is_written_to_all_the_same(tmp_path: Path, encoding: str) -> None:
    robot = write(tmp_path, small() + "description: été θ 臂\n")
    for options in ([], ["--json"]):
        run = dh2sim_process("info", robot, *options, variables={"PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"})
        assert (run.status, run.err) == (0, "")
    assert json.loads(dh2sim_process("info", robot, "--json").out)["description"] == "été θ 臂"


@pytest.mark.slow
@pytest.mark.parametrize("command", [("export", "rpr"), ("validate", "rpr"), ("rollout", "rpr", "--out", "run.zarr")])
def test_a_missing_drawing_library_is_named(command: tuple[str, ...], tmp_path: Path) -> None:
    run = dh2sim_process(*command, cwd=tmp_path, variables={"MUJOCO_GL": "nonsense"})
    assert (run.status, run.out) == (2, "")
    assert run.err == (
        "dh2sim: MuJoCo cannot be imported with MUJOCO_GL=nonsense: invalid value for environment variable "
        "MUJOCO_GL: nonsense. Unset that variable\n"
    )
    assert not list(tmp_path.iterdir())


SIGNALLED = """
import atexit, os, signal, sys, time, types

async def never_awaited():
    pass

def kill():
    os.kill(os.getpid(), int(sys.argv[1]))

class Late:
    kill, number, pid = os.kill, int(sys.argv[1]), os.getpid()

    def __del__(self):
        self.kill(self.pid, self.number)

def run(prog_name):
    print("done")
    match sys.argv[2]:
        case "at work":
            kept = never_awaited()  # as libraries have them when they are interrupted
            kill()
        case "in the code of a string":  # as namedtuple makes them
            exec("kill()")
        case "at the end":
            atexit.register(kill)
            sys.exit(0)
        case "after the end":
            sys.modules["late"] = Late()
            sys.exit(0)
    time.sleep(20)

sys.modules["dh2sim.cli.app"] = types.SimpleNamespace(app=run)
from dh2sim.cli.main import main
main()
"""
ENDS = [
    (signal.SIGINT, "at work", 130, "dh2sim: interrupted\n"),
    (signal.SIGTERM, "at work", 143, ""),
    (signal.SIGINT, "in the code of a string", 130, "dh2sim: interrupted\n"),
    (signal.SIGINT, "at the end", 130, "dh2sim: interrupted\n"),
    (signal.SIGTERM, "at the end", 143, ""),
    (signal.SIGINT, "after the end", 0, ""),
]


@pytest.mark.parametrize(("kill", "when", "status", "printed"), ENDS)
def test_a_signal_ends_the_program_with_the_status_of_shells(
    kill: signal.Signals, when: str, status: int, printed: str, tmp_path: Path
) -> None:
    (tmp_path / "signalled.py").write_text(SIGNALLED)
    command = [sys.executable, "-m", "signalled", str(int(kill)), when]
    done = subprocess.run(
        command, env=environment(), cwd=tmp_path, capture_output=True, text=True, timeout=180, check=False
    )
    assert (done.returncode, done.stderr) == (status, printed)


THREADS = """
import os, sys
import dh2sim.__main__
import numpy
numpy.linalg.lstsq(numpy.ones((2000, 60)), numpy.ones(2000))
print(len(os.listdir("/proc/self/task")))
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="threads are counted as Linux shows them")
def test_the_program_leaves_processors_to_others() -> None:
    variables = {name: value for name, value in environment().items() if not name.endswith("_NUM_THREADS")}
    command = [sys.executable, "-c", THREADS]
    done = subprocess.run(command, env=variables, capture_output=True, text=True, timeout=180, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "1\n", "")


def test_lists_are_given_with_commas_or_by_repeating_the_option() -> None:
    sweep = ("sweep", "rpr", "--count", "2", "--samples", "20", "--json", "-q")
    commas = dh2sim(*sweep, "--vary", "L2=0.1,a1=normal:0.02", "--measure", "reach,workspace")
    repeated = dh2sim(
        *sweep, "--vary", "L2=0.1", "--vary", "a1=normal:0.02", "--measure", "reach", "--measure", "workspace"
    )
    assert commas.status == 0
    assert commas == repeated
    code = ("symbolic", "rpr", "--as", "python")
    assert dh2sim(*code, "--what", "pose,jacobian") == dh2sim(*code, "--what", "pose", "--what", "jacobian")


@pytest.mark.parametrize(
    "arguments",
    [
        ("check", "{robot}", "--only"),
        ("symbolic", "rpr", "--what"),
        ("export", "rpr", "--format", "urdf", "--format"),
        ("trajectory", "rpr", "0,0,0", "0.1,0.1,0.1", "--limits"),
        ("ik", "rpr", "--xyz", "0.1", "0.2", "0.3", "--lock"),
        ("calibrate", "rpr", "data.csv", "--prior"),
        ("calibrate", "rpr", "data.csv", "--unknown"),
        ("view", "rpr", "--no-browser", "--allow-host"),
    ],
    ids=" ".join,
)
@pytest.mark.parametrize("empty", ["", " , "])
def test_an_empty_list_does_not_mean_the_default(arguments: tuple[str, ...], empty: str, tmp_path: Path) -> None:
    robot = write(tmp_path, small())
    run = dh2sim(*(each.format(robot=robot) for each in arguments), empty)
    assert (run.status, run.out) == (2, "")
    assert run.err == f"dh2sim: {arguments[-1]} must not be empty; leave it out for the default\n"
