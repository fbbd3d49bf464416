"""``dh2sim import``."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path

import pytest

from dh2sim.formats.urdf.write import to_urdf
from dh2sim.model.build import build_model
from dh2sim.robot.read import load_robot, parse_robot
from tests.importing.test_calibration import UR5E, calibrated_poses, ur_file
from tests.program import Outcome, contents, dh2sim, dh2sim_process

CSV = "theta,d (m),a (m),alpha (deg)\nq1,0.4,0,-90\nq2,0.15,0,90\n"


@pytest.fixture
def urdf(tmp_path: Path) -> Path:
    path = tmp_path / "arm.urdf"
    path.write_text(to_urdf(build_model(load_robot("stanford"))), encoding="utf-8")
    return path


def test_the_robot_file_is_printed_and_what_there_is_to_say_is_not_mixed_with_it(urdf: Path) -> None:
    run = dh2sim("import", urdf)
    assert run.status == 0
    spec = parse_robot(run.out)
    assert [row.type.value for row in spec.rows].count("prismatic") == 1
    assert run.err.splitlines()[-1].startswith("stanford, 6 rows, standard; off by at most ")
    assert run.err.splitlines()[-1].partition(", its mass matrix by ")[0].endswith(" at 1000 configurations")


def test_the_robot_file_is_written_where_asked_for_and_exports(urdf: Path, tmp_path: Path) -> None:
    out = tmp_path / "again.yaml"
    run = dh2sim("import", urdf, "--convention", "modified", "--name", "again", "-o", out)
    assert run.status == 0
    assert run.out.startswith(f"{out}: again, 6 rows, modified; off by at most ")
    assert dh2sim("validate", out, "--samples", "20").status == 0
    assert dh2sim("export", out, "--out", tmp_path / "generated").status == 0


def test_a_file_that_exists_is_not_overwritten_unless_forced(urdf: Path, tmp_path: Path) -> None:
    out = tmp_path / "arm.yaml"
    out.write_text("mine\n")
    run = dh2sim("import", urdf, "-o", out)
    assert (run.status, run.out) == (2, "")
    assert run.err == f"dh2sim: '{out}' already exists; choose another name, or overwrite it with --force\n"
    assert out.read_text() == "mine\n"
    assert dh2sim("import", urdf, "-o", out, "--force").status == 0
    assert out.read_text() != "mine\n"


def test_quiet_prints_only_the_robot_file(urdf: Path, tmp_path: Path) -> None:
    assert dh2sim("import", urdf, "-q").err == ""
    run = dh2sim("import", urdf, "-q", "-o", tmp_path / "quiet.yaml")
    assert (run.status, run.out, run.err) == (0, "", "")


def test_a_table_is_read_from_standard_input(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(CSV.encode())))
    run = dh2sim("import", "-", "--convention", "standard", "--name", "piped")
    assert run.status == 0
    assert [row.d for row in parse_robot(run.out).rows] == [0.4, 0.15]


def test_a_table_without_a_convention_is_an_error_that_says_what_to_add(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text(CSV)
    run = dh2sim("import", path, "-o", tmp_path / "out.yaml")
    assert (run.status, run.out) == (2, "")
    assert run.err.startswith(f"{path}:")
    assert "--convention standard" in run.err
    assert contents(tmp_path) == {"table.csv": CSV.encode()}


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (["--convention", "hayati"], "'hayati' is not one of standard, modified"),
        (["--convention", "modifed"], "'modifed' is not one of standard, modified. Did you mean 'modified'?"),
        (["--angle", "grad"], "'grad' is not one of rad, deg"),
        (["--length", "km"], "'km' is not one of m, mm, cm, in"),
        (["--tolerance", "0"], "must be above 0 and below 1, got 0.0"),
        (["--tolerance", "nan"], "must be above 0 and below 1, got nan"),
    ],
)
def test_a_wrong_option_is_reported_with_what_is_allowed(urdf: Path, options: list[str], expected: str) -> None:
    run = dh2sim("import", urdf, *options)
    assert (run.status, run.out) == (2, "")
    assert expected in run.err


def test_an_unknown_tip_is_reported_with_its_neighbours(urdf: Path) -> None:
    run = dh2sim("import", urdf, "--tip", "tol0")
    assert (run.status, run.out) == (2, "")
    assert "Did you mean 'tool0'?" in run.err


def test_the_command_line_names_options_where_the_library_names_arguments(tmp_path: Path) -> None:
    path = tmp_path / "fork.urdf"
    links = "".join(f'<link name="{name}"/>' for name in ("base", "left", "right arm"))
    joints = "".join(
        f'<joint name="{name}" type="continuous"><parent link="base"/><child link="{name}"/></joint>'
        for name in ("left", "right arm")
    )
    path.write_text(f"<robot name='two'>{links}{joints}</robot>")
    run = dh2sim("import", path)
    assert (run.status, run.out) == (2, "")
    assert run.err == (
        f"{path}:1:19: the robot forks at 'base'; choose one arm: --tip left (1 joint), --tip 'right arm' (1 joint)\n"
    )
    assert dh2sim("import", path, "--tip", "right arm").status == 0


def test_nothing_is_left_behind_where_the_folder_is_missing(urdf: Path, tmp_path: Path) -> None:
    out = tmp_path / "no" / "arm.yaml"
    run = dh2sim("import", urdf, "-o", out)
    assert run.err == f"dh2sim: cannot write '{out}': there is no folder '{out.parent}'\n"
    assert run.status == 2


def test_a_broken_file_is_reported_with_its_place_and_without_a_traceback(tmp_path: Path) -> None:
    path = tmp_path / "broken.urdf"
    path.write_text('<robot name="r">\n  <link name="a">\n</robot>\n')
    run = dh2sim_process("import", path)
    assert (run.status, run.out) == (2, "")
    assert run.err.startswith(f"{path}:3:")
    assert "Traceback" not in run.err


def test_a_robot_file_and_axes_are_not_imported(tmp_path: Path) -> None:
    robot, axes = tmp_path / "arm.yaml", tmp_path / "axes.yaml"
    robot.write_text("name: arm\nconvention: standard\njoints: [{type: revolute}]\n")
    axes.write_text("name: arm\naxes:\n  - {type: revolute, point: [0, 0, 0], direction: [0, 0, 1]}\n")
    for file, reason in (
        (robot, "this is a robot file already, and needs no import"),
        (axes, "this lists joint axes; 'dh2sim frames' makes a robot file of them"),
    ):
        assert dh2sim("import", file) == Outcome(status=2, out="", err=f"dh2sim: {file}: {reason}\n")


def test_another_table_of_a_file_is_read_by_its_number(tmp_path: Path) -> None:
    text = "DH, standard\n\n|θ|d|a|α|\n|-|-|-|-|\n|q1|0|1|0|\n\nDH, modified\n\n|θ|d|a|α|\n|-|-|-|-|\n|q1|0|2|0|\n"
    path = tmp_path / "two.md"
    path.write_text(text, encoding="utf-8")
    first, second = dh2sim("import", str(path)), dh2sim("import", str(path), "--table", "2")
    assert "The file has 2 tables, of which the first was read; pass --table 2" in first.err
    assert (first.out.count("a: 1,"), second.out.count("a: 2,")) == (1, 1)
    third = dh2sim("import", str(path), "--table", "3")
    assert (third.status, third.out) == (2, "")


XACRO = """\
<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:include filename="../names.xacro"/>
  <link name="base"/><link name="$(arg tip)"/>
  <joint name="j" type="continuous"><parent link="base"/><child link="$(arg tip)"/><axis xyz="0 0 1"/></joint>
</robot>
"""


def test_errors_of_xacro_name_the_options_that_help(tmp_path: Path) -> None:
    pytest.importorskip("xacro", reason="the extra 'xacro' is not installed")
    folder = tmp_path / "urdf"
    folder.mkdir()
    (tmp_path / "names.xacro").write_text('<robot xmlns:xacro="http://www.ros.org/wiki/xacro"/>', encoding="utf-8")
    path = folder / "arm.xacro"
    path.write_text(XACRO, encoding="utf-8")
    run = dh2sim("import", path)
    assert run.status == 2
    assert f"{path}:2:3: xacro: found " in run.err
    assert run.err.endswith(f"allow others with --root {tmp_path}\n")
    run = dh2sim("import", path, "--root", tmp_path)
    assert (run.status, run.out) == (2, "")
    assert run.err == (
        f"{path}:3:22: xacro: argument 'tip' has no value, and no default; give it one: --arg tip:=VALUE\n"
    )
    run = dh2sim("import", path, "--root", tmp_path, "--arg", "tip:=hand")
    assert run.status == 0
    assert parse_robot(run.out).rows[0].name == "j"


def test_an_argument_of_xacro_has_a_name_and_a_value(urdf: Path) -> None:
    run = dh2sim("import", urdf, "--arg", "tip=hand")
    assert run.status == 2
    assert "--arg must be NAME:=VALUE, got 'tip=hand'" in " ".join(run.err.split())
    run = dh2sim("import", urdf, "--arg", "tip:=hand")
    assert (run.status, run.err) == (2, f"dh2sim: {urdf}: arguments are for xacro files; this one needs no xacro\n")


def test_a_calibration_becomes_a_robot_with_the_masses_of_its_nominal_one(tmp_path: Path) -> None:
    (tmp_path / "cal.yaml").write_bytes(ur_file(calibrated_poses(UR5E, 0)))
    run = dh2sim("import", tmp_path / "cal.yaml", "--nominal", "ur5e", "-o", tmp_path / "mine.yaml")
    assert run.status == 0
    assert run.out.startswith(
        f"{tmp_path / 'mine.yaml'}: ur5e_calibrated, 6 rows, standard and hayati; off by at most "
    )
    assert "from the nominal ur5e's" in " ".join(run.err.split())
    made = load_robot(tmp_path / "mine.yaml")
    assert [row.link.mass for row in made.rows] == [row.link.mass for row in load_robot("ur5e").rows]
    as_json = json.loads(dh2sim("import", tmp_path / "cal.yaml", "--nominal", "ur5e", "--json").out)
    assert as_json["conventions"] == ["standard", "hayati"]
    assert as_json["residual"]["position"] < 1e-9


def test_deltas_without_a_nominal_robot_name_the_option(tmp_path: Path) -> None:
    path = tmp_path / "calibration.conf"
    path.write_text("".join(f"delta_{name} = [0, 0]\n" for name in ("theta", "a", "d", "alpha")))
    run = dh2sim("import", path)
    assert run.status == 2
    assert run.err == (
        f"dh2sim: {path}: this holds what is to be added to a nominal table; name the robot, as in --nominal ur5e\n"
    )
    path.write_text("delta_theta = [0, x]\ndelta_a = [0]\n")
    run = dh2sim("import", path, "-o", tmp_path / "arm.yaml")
    assert (run.status, run.out) == (2, "")
    assert not (tmp_path / "arm.yaml").exists()
    assert run.err.splitlines() == [
        f"{path}:1:1: expected as many numbers of each parameter, got 2 of delta_theta, 1 of delta_a",
        f"{path}:1:19: delta_theta[1]: expected a number, got 'x'",
        f"{path}:2:14: missing key 'delta_alpha'",
        f"{path}:2:14: missing key 'delta_d'",
    ]


@pytest.mark.parametrize("words", [["import", "-"], ["diff", "-", "planar_2r"]], ids=["import", "diff"])
def test_standard_input_without_end_is_refused(words: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    with open("/dev/zero", "rb") as endless:
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(endless))
        run = dh2sim(*words)
    assert (run.status, run.err) == (2, "dh2sim: -: more than 50000000 bytes, the most that is read\n")
