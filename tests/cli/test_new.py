from __future__ import annotations

from pathlib import Path

import pytest

from dh2sim import build_model, load_robot, parse_robot
from dh2sim.cli.new import TYPES, template
from dh2sim.robot.catalog import builtin_robots
from dh2sim.robot.row import Convention
from tests.program import Outcome, dh2sim

JOINTS = (
    "R",
    "P",
    "F",
    "RCF",
    "RRPRRR",
    *(pytest.param(j, marks=pytest.mark.slow) for j in ("C", "RR", "PP", "PR", "RP", "RPRRRRRRR")),
)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_robot_file_is_written_and_the_next_commands_are_printed() -> None:
    assert dh2sim("new", "my_arm") == Outcome(
        status=0,
        out="""\
my_arm.yaml: my_arm, 6 rows, standard
Next:
  dh2sim view my_arm.yaml      see it in the browser, and edit its table
  dh2sim export my_arm.yaml    write URDF and MJCF to generated/my_arm/
  dh2sim validate my_arm.yaml  check every engine against the table
""",
        err="",
    )
    spec = load_robot("my_arm.yaml")
    assert spec.name == "my_arm"
    assert "".join("R" if row.type.turns else "P" for row in spec.rows) == "RRPRRR"
    assert list(spec.configurations) == ["home", "zero"]


@pytest.mark.parametrize("convention", Convention)
@pytest.mark.parametrize("joints", JOINTS)
def test_every_template_exports_and_validates(joints: str, convention: Convention) -> None:
    run = dh2sim("new", "arm", "--joints", joints.lower(), "--convention", convention)
    assert (run.status, run.err) == (0, "")
    spec = load_robot("arm.yaml")
    assert [row.type for row in spec.rows] == [TYPES[letter] for letter in joints]
    assert {row.convention for row in spec.rows} == {convention}
    assert dh2sim("export", "arm.yaml", "--out", "build").status == 0
    run = dh2sim("validate", "arm.yaml", "--samples", "20", "--dir", "build")
    assert (run.status, run.err) == (0, "")


@pytest.mark.parametrize("convention", Convention)
def test_a_template_is_bent_at_home_and_inside_its_limits(convention: Convention) -> None:
    model = build_model(parse_robot(template("arm", [TYPES[letter] for letter in "RRPRCPFRRRR"], convention)))
    home = model.spec.configurations["home"]
    assert all(home)
    for joint, q in zip(model.moving_joints, home, strict=True):
        assert joint.position_range is None or joint.position_range[0] < q < joint.position_range[1]


@pytest.mark.parametrize("name", builtin_robots())
def test_a_copy_of_a_robot_differs_in_its_name_alone(name: str) -> None:
    assert dh2sim("new", "other.yaml", "--from", name).status == 0
    text = Path("other.yaml").read_text(encoding="utf-8")
    source = load_robot(name).source_file
    assert source is not None
    assert text.replace("name: other", f"name: {name}", 1) == source.text
    assert load_robot("other.yaml").name == "other"


def test_a_file_is_never_overwritten_without_force() -> None:
    Path("arm.yaml").write_text("mine", encoding="utf-8")
    run = dh2sim("new", "arm")
    assert (run.status, run.out) == (2, "")
    assert run.err == "dh2sim: 'arm.yaml' already exists; choose another name, or overwrite it with --force\n"
    assert Path("arm.yaml").read_text(encoding="utf-8") == "mine"
    assert dh2sim("new", "arm", "--force").status == 0
    assert (
        dh2sim("new", "arm", "-o", "other name.yaml")
        .out.splitlines()[2]
        .startswith("  dh2sim view 'other name.yaml'      see")
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["my arm"],
            "NAME is made of letters, digits, '_' and '-', starting with a letter; found 'my arm'",
        ),
        (
            ["arm", "--joints", "RRX"],
            "--joints must not contain the letter 'X'; allowed are R revolute, P prismatic, C continuous, F fixed",
        ),
        (["arm", "--joints", ""], "--joints needs 1 to 100 letters, got 0"),
        (["arm", "--joints", "R" * 101], "--joints needs 1 to 100 letters, got 101"),
        (
            ["arm", "--convention", "craig"],
            "--convention: 'craig' is not one of standard, modified, hayati. It is called 'modified' here",
        ),
        (
            ["arm", "--from", "rpr", "--joints", "RRR"],
            "--joints must not be given together with --from, whose table has its own",
        ),
        (
            ["arm", "--from", "rpr", "--convention", "modified"],
            "--convention must not be given together with --from, whose table has its own",
        ),
    ],
)
def test_wrong_usage_is_reported_and_nothing_is_written(arguments: list[str], message: str, folder: Path) -> None:
    run = dh2sim("new", *arguments)
    assert (run.status, run.out) == (2, "")
    assert run.err.splitlines()[-1] == f"dh2sim: {message}"
    assert not list(folder.iterdir())


def test_a_source_that_is_missing_or_has_no_line_for_its_name_is_refused(folder: Path) -> None:
    assert dh2sim("new", "arm", "--from", "stanfrd").err.startswith(
        "dh2sim: no file or robot named 'stanfrd'. Did you mean 'stanford'?"
    )
    Path("flow.yaml").write_text("{name: flow, convention: standard, joints: [{type: revolute}]}", encoding="utf-8")
    assert dh2sim("new", "arm", "--from", "flow.yaml") == Outcome(
        status=2, out="", err="dh2sim: flow.yaml: has no line 'name: flow' to replace the name in\n"
    )
    assert [path.name for path in folder.iterdir()] == ["flow.yaml"]
