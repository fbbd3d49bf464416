from __future__ import annotations

from pathlib import Path

import pytest

from dh2sim import build_model, parse_robot
from dh2sim.errors import EngineError, MismatchError
from dh2sim.export import Format, export_robot, verify_files
from dh2sim.formats.urdf.write import to_urdf
from tests.export.broken import shifted_chain
from tests.program import Outcome, contents, dh2sim
from tests.robot_files import small, snake, write

MISMATCH = (
    "small: the URDF differs from the table by 1e-06 m and {rotation} rad (allowed: 1e-12 m and 1e-12 rad); nothing "
    "was written. This is a defect of dh2sim: please report it with the robot file"
)


def _state(folder: Path) -> dict[Path, tuple[int, bytes]]:
    return {p: (p.stat().st_mtime_ns, p.read_bytes() if p.is_file() else b"") for p in folder.rglob("*")}


def test_a_model_whose_poses_differ_from_the_table_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dh2sim.model.build.build_chain", shifted_chain)
    model = build_model(parse_robot(small()))
    with pytest.raises(MismatchError) as caught:
        export_robot(model, tmp_path / "made")
    message = str(caught.value)
    rotation = message.split(" m and ")[1].split(" rad")[0]
    assert message == MISMATCH.format(rotation=rotation)
    assert float(rotation) < 1e-12
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize("name", ["urdf", "mjcf"])
def test_either_format_alone_is_verified(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.setattr("dh2sim.model.build.build_chain", shifted_chain)
    run = dh2sim("export", write(tmp_path, small()), "--out", tmp_path / "made", "--format", name)
    assert (run.status, run.out) == (1, "")
    assert run.err.startswith(f"dh2sim: small: the {name.upper()} differs from the table by 1e-06 m and ")


def test_a_refused_export_leaves_old_files_untouched_and_exits_with_1(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot, out = write(tmp_path, small()), tmp_path / "made"
    assert dh2sim("export", robot, "--out", out).status == 0
    before = _state(out)
    write(tmp_path, small(length=0.5))
    monkeypatch.setattr("dh2sim.model.build.build_chain", shifted_chain)
    run = dh2sim("export", robot, "--out", out)
    assert (run.status, run.out) == (1, "")
    assert run.err.startswith("dh2sim: small: the URDF differs from the table by 1e-06 m and ")
    assert _state(out) == before


def test_without_verification_a_wrong_model_gets_through_so_verification_is_what_stops_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dh2sim.model.build.build_chain", shifted_chain)
    robot = write(tmp_path, small())
    assert dh2sim("export", robot, "--out", tmp_path / "made", "--no-verify").status == 0
    assert dh2sim("validate", robot, "--dir", tmp_path / "made", "--samples", "3").status == 1


def test_more_bodies_than_mujoco_reads_are_refused(tmp_path: Path) -> None:
    robot = write(tmp_path, snake(496))
    run = dh2sim("export", robot, "--out", tmp_path / "made")
    message = f"{robot}:4:3: joints: the list has 496 entries; at most 494 are allowed\n"
    assert run == Outcome(status=2, out="", err=message)
    assert not (tmp_path / "made").exists()


def test_a_robot_whose_name_is_that_of_the_scene_is_refused(tmp_path: Path) -> None:
    run = dh2sim("export", write(tmp_path, small("Scene")), "--out", tmp_path / "made", "--no-verify")
    message = "dh2sim: Scene: its MJCF and its scene would both be scene.xml; rename the robot\n"
    assert run == Outcome(status=2, out="", err=message)
    assert not (tmp_path / "made").exists()


def test_what_mujoco_refuses_is_reported_without_a_temporary_path(tmp_path: Path) -> None:
    model = build_model(parse_robot(small()))
    text = to_urdf(model)
    (tmp_path / "small.urdf").write_text(text.replace('<mass value="', '<mass value="1e-20" was="'))
    with pytest.raises(EngineError) as refusal:
        verify_files(model, tmp_path, [Format.URDF])
    assert str(refusal.value).startswith("small: small.urdf: MuJoCo refuses the file: ")
    assert str(refusal.value).endswith("; nothing was written")
    assert str(tmp_path) not in str(refusal.value)


def test_a_robot_that_fails_keeps_no_other_from_being_written(tmp_path: Path) -> None:
    robots = [
        write(tmp_path, small("left")),
        write(tmp_path, small("scene")),
        write(tmp_path, small("right")),
    ]
    run = dh2sim("export", *robots, "--out", tmp_path / "made")
    assert run.status == 2
    assert [line.split(":")[1] for line in run.err.splitlines()] == [" scene"]
    assert set(contents(tmp_path / "made")) == {
        f"{name}/{file}" for name in ("left", "right") for file in (f"{name}.urdf", f"{name}.xml", "scene.xml")
    }


def test_a_robot_file_that_is_wrong_keeps_all_from_being_written(tmp_path: Path) -> None:
    right, wrong = write(tmp_path, small()), write(tmp_path, small("wrong").replace("alpha", "alfa"))
    run = dh2sim("export", right, wrong, "--out", tmp_path / "made")
    assert (run.status, run.out) == (2, "")
    assert "unknown key 'alfa'. Did you mean 'alpha'?" in run.err
    assert not (tmp_path / "made").exists()
