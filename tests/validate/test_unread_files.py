"""Files that no longer hold the robot at all: each is a check that failed, never a traceback."""

from __future__ import annotations

import random
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.program import Outcome, dh2sim
from tests.validate.files import FILE_ENGINES, Change, change, failures, named, remove, validated

MUTATIONS = 40
WORDS = ("nan", "inf", "-inf", "1e400", "1e300", "abc", "0", "-1", "é", "&amp;", "link_2", "one", "tool0", "fixed")
TAGS = ("<body", "<link", "<joint", "</joint", "x:y=", ">", "/>", "name=", "pos=", "&", "\x01", "<!--", "<site", "")


def _delete_joint_urdf(root: ET.Element) -> None:
    named(root, "joint", "five").set("type", "fixed")


def _delete_joint_mjcf(root: ET.Element) -> None:
    remove(root, lambda e: e.get("joint") == "five" or (e.tag == "joint" and e.get("name") == "five"))


def _rename_joint(root: ET.Element) -> None:
    for element in root.iter():
        for attribute in ("name", "joint"):
            if element.get(attribute) == "five":
                element.set(attribute, "fife")


def _free_joint_urdf(root: ET.Element) -> None:
    named(root, "joint", "three").set("type", "continuous")


def _free_joint_mjcf(root: ET.Element) -> None:
    ET.SubElement(named(root, "body", "link_3"), "joint", name="three")


def _delete_tool(root: ET.Element) -> None:
    remove(root, lambda e: "tool0" in (e.get("name"), e.get("objname"), e.get("name", "").split("-")[-1]))


@pytest.mark.parametrize(
    ("file", "how", "reason"),
    [
        ("odd.urdf", _delete_joint_urdf, "moving joint not found: five"),
        ("odd.xml", _delete_joint_mjcf, "moving joint not found: five"),
        ("odd.urdf", _rename_joint, "moving joint not found: five"),
        ("odd.xml", _rename_joint, "moving joint not found: five"),
        ("odd.urdf", _free_joint_urdf, "the joint three moves, but the robot file has no such moving row"),
        ("odd.xml", _free_joint_mjcf, "the joint three moves, but the robot file has no such moving row"),
        ("odd.urdf", _delete_tool, "frame not found: tool0"),
        ("odd.xml", _delete_tool, "frame not found: tool0"),
    ],
)
def test_joints_and_frames_that_are_missing_or_new_are_named(
    exported: Path, file: str, how: Change, reason: str
) -> None:
    path = exported / "made" / "odd" / file
    change(path, how)
    failed = failures(validated(exported / "odd.yaml", exported / "made"))
    assert {key: entry["reason"] for key, entry in failed.items()} == {
        (engine, "file"): f"{path}: {reason}" for engine in FILE_ENGINES[file]
    }


def _cut(path: Path) -> None:
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])


def _replace_by_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


@pytest.mark.parametrize("file", FILE_ENGINES)
@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (_cut, "not well-formed XML: "),
        (lambda path: path.write_bytes(b""), "the file is empty|not well-formed XML: no element found"),
        (lambda path: path.write_bytes(b"name: odd\n"), "not well-formed XML: "),
        (lambda path: path.write_bytes(b"\xff\xfe\x00<"), "not UTF-8: byte 0xff; MuJoCo reads no other encoding"),
        (lambda path: path.write_bytes(b"<html></html>"), "expected <mujoco>, found <html>|refuses the file: "),
        (Path.unlink, "no such file; write it with 'dh2sim export'"),
        (_replace_by_folder, "no such file; write it with 'dh2sim export'"),
    ],
    ids=["cut short", "empty", "YAML", "bytes", "HTML", "missing", "a folder"],
)
def test_a_file_that_cannot_be_read_has_failed(
    exported: Path, file: str, spoil: Callable[[Path], object], reason: str
) -> None:
    path = exported / "made" / "odd" / file
    spoil(path)
    failed = failures(validated(exported / "odd.yaml", exported / "made"))
    assert list(failed) == [(engine, "file") for engine in FILE_ENGINES[file]]
    for entry in failed.values():
        assert entry["reason"].startswith(f"{path}:")
        assert re.search(reason, entry["reason"])


def test_xml_that_only_mujoco_takes_for_well_formed_is_refused(exported: Path) -> None:
    path = exported / "made" / "odd" / "odd.xml"
    path.write_bytes(path.read_bytes() + b"<more />\n")
    failed = failures(validated(exported / "odd.yaml", exported / "made"))
    assert list(failed) == [("mujoco-mjcf", "file")]
    assert failed["mujoco-mjcf", "file"]["reason"].endswith(": not well-formed XML: junk after document element")


def test_every_missing_folder_is_named_before_any_work_is_done(exported: Path) -> None:
    robot, nowhere = exported / "odd.yaml", exported / "nowhere"
    assert dh2sim("validate", robot, "rpr", "--dir", nowhere) == Outcome(
        status=2,
        out="",
        err=f"dh2sim: there is no folder '{nowhere / 'odd'}'; write it with 'dh2sim export {robot} --out {nowhere}'\n"
        f"dh2sim: there is no folder '{nowhere / 'rpr'}'; write it with 'dh2sim export rpr --out {nowhere}'\n",
    )


@pytest.mark.parametrize("attribute", ["pos", "quat"])
def test_a_nan_in_a_file_never_passes(exported: Path, attribute: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(exported)
    path = exported / "made" / "odd" / "odd.xml"
    change(
        path, lambda root: named(root, "body", "link_2").set(attribute, "nan 0 0 1"[: 7 if attribute == "pos" else 9])
    )
    run = dh2sim("validate", exported / "odd.yaml", "--dir", exported / "made", "--samples", "5")
    assert run.status == 1
    assert run.err == ""
    assert "mujoco: An XML file contains NaN, which is not a number." in run.out
    assert not (exported / "MUJOCO_LOG.TXT").exists()
    assert {line.split()[0] for line in run.out.splitlines() if line.endswith("FAILED")} >= {"mujoco-mjcf"}


@pytest.mark.slow
@pytest.mark.parametrize("file", FILE_ENGINES)
def test_no_damage_to_a_file_makes_a_traceback(
    exported: Path, file: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(exported)
    path = exported / "made" / "odd" / file
    text = path.read_text(encoding="utf-8")
    start = text.index("-->")
    tokens = list(re.finditer(r'"[^"]*"|<[/\w]+|\w+=|/?>', text[start:]))
    rng = random.Random(0)
    for _ in range(MUTATIONS):
        token = rng.choice(tokens)
        found = token.group()
        words = found.strip('"').split()
        if found.startswith('"') and words:
            words[rng.randrange(len(words))] = rng.choice(WORDS)
            new = f'"{" ".join(words)}"'
        else:
            new = rng.choice(TAGS)
        path.write_text(text[: start + token.start()] + new + text[start + token.end() :], encoding="utf-8")
        run = dh2sim("validate", exported / "odd.yaml", "--dir", exported / "made", "--samples", "2")
        assert run.status in (0, 1), f"{found} -> {new}"
    assert {path.name for path in exported.iterdir()} == {"odd.yaml", "made"}
    capfd.readouterr()  # what readers written in C++ have to say


@pytest.mark.parametrize("file", ["odd.urdf", "odd.xml", "scene.xml"])
def test_files_of_different_exports_have_failed_even_if_their_numbers_agree(exported: Path, file: str) -> None:
    robot, folder = exported / "odd.yaml", exported / "made" / "odd"
    robot.write_bytes(robot.read_bytes() + b"# another version\n")
    assert dh2sim("export", robot, "--out", exported / "other").status == 0
    assert validated(robot, exported / "made")["ok"], "those of one older version match the table"
    (folder / file).write_bytes((exported / "other" / "odd" / file).read_bytes())
    failed = failures(validated(robot, exported / "made"))
    assert list(failed) == [("files", "file")]
    reason = failed["files", "file"]["reason"]
    assert reason.startswith(f"{folder} contains files of different exports: ")
    assert reason.count("odd.yaml (SHA-256 ") == 2
