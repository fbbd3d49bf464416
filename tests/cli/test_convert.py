"""``dh2sim convert``."""

from __future__ import annotations

import json
from pathlib import Path

from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.robot.write import robot_file_text
from tests.kinematics.test_compaction import calibrated_ur5
from tests.program import dh2sim


def test_the_other_table_is_printed() -> None:
    run = dh2sim("convert", "stanford", "--to", "modified")
    assert run.status == 0
    spec = parse_robot(run.out)
    assert {row.convention.value for row in spec.rows} == {"modified"}
    assert run.err.splitlines() == [
        "dh2sim: note: Parameters are replaced by their values.",
        run.err.splitlines()[1],
    ]
    assert run.err.splitlines()[1].startswith("stanford, 6 rows, modified; tool0 off by at most ")


def test_the_other_table_is_written_and_converts_back(tmp_path: Path) -> None:
    out = tmp_path / "scara_modified.yaml"
    assert dh2sim("convert", "scara", "--to", "modified", "-o", out).status == 0
    run = dh2sim("convert", out, "--to", "standard", "-q")
    assert (run.status, run.err) == (0, "")
    assert [(r.a, r.alpha, r.d) for r in parse_robot(run.out).rows] == [
        (r.a, r.alpha, r.d) for r in load_robot("scara").rows
    ]


def test_a_wrong_convention_is_reported() -> None:
    run = dh2sim("convert", "scara", "--to", "hayati")
    assert (run.status, run.out) == (2, "")
    assert "'hayati' is not one of standard, modified, compact" in run.err


def test_the_convention_wanted_must_be_named() -> None:
    run = dh2sim("convert", "scara")
    assert run.status == 2
    assert run.err == "dh2sim: option --to is missing. 'dh2sim convert --help' has examples\n"


def test_a_mesh_is_found_from_where_the_new_file_stands(tmp_path: Path) -> None:
    (tmp_path / "old").mkdir()
    (tmp_path / "new").mkdir()
    facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    (tmp_path / "old" / "m.stl").write_text(f"solid m\n{facet}endsolid m\n")
    row = "{type: revolute, a: 0.4, alpha: 0.3, link: {mesh: {file: m.stl}}}"
    text = f"name: r\nconvention: standard\njoints:\n  - {row}\n"
    (tmp_path / "old" / "r.yaml").write_text(text)
    out = tmp_path / "new" / "r.yaml"
    assert dh2sim("convert", tmp_path / "old" / "r.yaml", "--to", "modified", "-o", out).status == 0
    mesh_spec = load_robot(out).rows[0].link.mesh
    assert mesh_spec is not None
    assert mesh_spec.file.resolve() == (tmp_path / "old" / "m.stl").resolve()
    assert mesh_spec.pose.xyz.tolist() == [0.4, 0.0, 0.0]


def test_a_calibrated_table_becomes_compact_and_says_why(tmp_path: Path) -> None:
    (tmp_path / "ur5.yaml").write_text(robot_file_text(calibrated_ur5()))
    out = tmp_path / "compact.yaml"
    run = dh2sim("convert", tmp_path / "ur5.yaml", "--to", "compact", "-o", out)
    assert run.status == 0
    assert [row.convention.value for row in load_robot(out).rows].count("hayati") == 2
    assert "joint_2 is a Hayati row now: frame 2 was 574.1 m away from the arm" in run.err.replace("\n ", "")
    assert run.out.startswith(f"{out}: ur5, 6 rows, standard and hayati; tool0 off by at most ")


def test_json_holds_the_robot_file_or_where_it_is(tmp_path: Path) -> None:
    run = dh2sim("convert", "stanford", "--to", "modified", "--json")
    made = json.loads(run.out)
    assert run.err == ""
    assert parse_robot(made["text"]).name == made["robot"] == "stanford"
    assert made["conventions"] == ["modified"]
    assert made["notes"] == ["Parameters are replaced by their values."]
    assert made["residual"]["configurations"] == 1000
    out = tmp_path / "stanford.yaml"
    written = json.loads(dh2sim("convert", "stanford", "--to", "modified", "--json", "-o", out).out)
    assert written == {**{key: value for key, value in made.items() if key != "text"}, "file": str(out)}
    assert out.read_text(encoding="utf-8") == made["text"]
