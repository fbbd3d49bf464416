"""Whatever is changed of the poses in a file that was written, validation finds it, and where."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from tests.engines.files import PYBULLET
from tests.program import dh2sim
from tests.robot_files import ODD, write
from tests.validate.files import (
    FILE_ENGINES,
    Change,
    change,
    failures,
    frames_from,
    named,
    numbers,
    part,
    remove,
    swap,
    validated,
)


def _negate(i: int) -> Change:
    return lambda root: numbers(part(root, "joint", "two", "origin"), "rpy", lambda v: _negated(v, i))


def _negated(values: list[float], i: int) -> list[float]:
    return [-value if k == i else value for k, value in enumerate(values)]


def _swap_urdf(root: ET.Element) -> None:
    swap(part(root, "joint", "two", "origin"), part(root, "joint", "five", "origin"), "xyz", "rpy")


def _swap_mjcf(root: ET.Element) -> None:
    swap(named(root, "body", "link_2"), named(root, "body", "link_5"), "pos", "quat")


def _shift(values: list[float]) -> list[float]:
    return [values[0] + 1e-9, *values[1:]]


def _stretch_one(values: list[float]) -> list[float]:
    return [values[0] * (1 + 1e-6), *values[1:]]


URDF: dict[str, tuple[Change, set[str]]] = {
    "sign of a twist": (_negate(0), frames_from(2)),
    "sign of a pitch": (_negate(1), frames_from(2)),
    "two rows swapped": (_swap_urdf, frames_from(2)),
    "offset dropped": (lambda root: part(root, "joint", "four", "origin").set("xyz", "0 0 0"), frames_from(4)),
    "turn dropped": (lambda root: part(root, "joint", "three", "origin").set("rpy", "0 0 0"), frames_from(3)),
    "tool dropped": (lambda root: part(root, "joint", "flange-tool0", "origin").set("xyz", "0 0 0"), {"tool0"}),
    "axis turned over": (lambda root: part(root, "joint", "one", "axis").set("xyz", "0 0 -1"), frames_from(1)),
    "flip dropped": (lambda root: part(root, "joint", "two", "axis").set("xyz", "0 0 1"), frames_from(2)),
    "dh frame shifted": (
        lambda root: numbers(part(root, "joint", "link_1-dh_1", "origin"), "xyz", _shift),
        {"dh_1"},
    ),
    "base turned": (
        lambda root: numbers(part(root, "joint", "base_link-dh_0", "origin"), "rpy", _shift),
        {"dh_0"},
    ),
}
MJCF: dict[str, tuple[Change, set[str]]] = {
    "sign of a twist": (
        lambda root: numbers(named(root, "body", "link_2"), "quat", lambda v: _negated(v, 1)),
        frames_from(2),
    ),
    "two rows swapped": (_swap_mjcf, frames_from(2)),
    "offset dropped": (lambda root: named(root, "body", "link_4").set("pos", "0 0 0"), frames_from(4)),
    "turn dropped": (lambda root: named(root, "body", "link_3").set("quat", "1 0 0 0"), frames_from(3)),
    "tool dropped": (lambda root: named(root, "site", "tool0").set("pos", "0 0 0"), {"tool0"}),
    "axis turned over": (lambda root: named(root, "joint", "one").set("axis", "0 0 -1"), frames_from(1)),
    "flip dropped": (lambda root: named(root, "joint", "two").set("axis", "0 0 1"), frames_from(2)),
    "dh frame shifted": (lambda root: numbers(named(root, "site", "dh_1"), "pos", _shift), {"dh_1"}),
    "base turned": (lambda root: numbers(named(root, "site", "dh_0"), "quat", _stretch_one), {"dh_0"}),
    "a quaternion's component": (
        lambda root: numbers(named(root, "body", "link_2"), "quat", _stretch_one),
        frames_from(2),
    ),
}
CASES = [
    pytest.param(file, *case, id=f"{file}, {name}")
    for file, cases in (("odd.urdf", URDF), ("odd.xml", MJCF))
    for name, case in cases.items()
]


def test_what_is_unchanged_matches(exported: Path) -> None:
    report = validated(exported / "odd.yaml", exported / "made")
    assert report["ok"] is True
    assert failures(report) == {}


@pytest.mark.parametrize(("file", "how", "frames"), CASES)
def test_a_changed_pose_is_found_in_its_file_by_every_engine_that_reads_it(
    exported: Path, file: str, how: Change, frames: set[str]
) -> None:
    change(exported / "made" / "odd" / file, how)
    failed = failures(validated(exported / "odd.yaml", exported / "made"))
    assert {engine for engine, quantity in failed if quantity == "pose"} == set(FILE_ENGINES[file])
    for engine in FILE_ENGINES[file]:
        entry = failed[engine, "pose"]
        assert entry["worst"]["where"] in frames
        assert len(entry["worst"]["q"]) == 4
        assert max(entry["max_position_error"] / 3, entry["max_rotation_error"]) > entry["tolerance"] == 1e-12
    assert not {engine for engine, quantity in failed if quantity == "jacobian"} - set(FILE_ENGINES[file])


@pytest.mark.parametrize("name", ["link_2", "link_5"])
def test_a_quaternion_that_mujoco_normalises_in_silence_is_found(exported: Path, name: str) -> None:
    change(
        exported / "made" / "odd" / "odd.xml",
        lambda root: numbers(named(root, "body", name), "quat", lambda v: [x * (1 + 1e-6) for x in v]),
    )
    failed = failures(validated(exported / "odd.yaml", exported / "made"))
    assert list(failed) == [("mjcf-file", "unit quaternions")]
    assert failed["mjcf-file", "unit quaternions"]["worst"]["where"] == f"body {name}"
    assert failed["mjcf-file", "unit quaternions"]["max_error"] == pytest.approx(1e-6, rel=1e-5)


def test_an_axis_that_is_not_of_unit_length_is_found(exported: Path) -> None:
    change(
        exported / "made" / "odd" / "odd.urdf",
        lambda root: part(root, "joint", "two", "axis").set("xyz", "0 0 -1.001"),
    )
    failed = failures(validated(exported / "odd.yaml", exported / "made"))
    assert {quantity for _, quantity in failed} == {"pose"}
    assert {engine for engine, _ in failed} == {"yourdfpy", *(["pybullet"] if PYBULLET else [])}, "both turn by more"


def test_all_dh_frames_may_be_missing_from_a_urdf_but_not_one(exported: Path) -> None:
    urdf = exported / "made" / "odd" / "odd.urdf"

    def without(frames: set[str]) -> Change:
        return lambda root: remove(
            root, lambda e: e.get("name") in frames or (e.get("name", "").split("-")[-1] in frames)
        )

    change(urdf, without({"dh_2"}))
    failed = failures(validated(exported / "odd.yaml", exported / "made"))
    assert {(engine, entry["reason"]) for (engine, _), entry in failed.items()} == {
        (engine, f"{urdf}: frame not found: dh_2") for engine in FILE_ENGINES["odd.urdf"]
    }
    change(urdf, without({f"dh_{i}" for i in range(6)}))
    assert validated(exported / "odd.yaml", exported / "made")["ok"] is True


def test_a_changed_robot_file_is_found_against_old_exports(exported: Path) -> None:
    robot = write(exported, ODD.replace("alpha: 0.651, d: 0.2", "alpha: -0.651, d: 0.2"))
    failed = failures(validated(robot, exported / "made"))
    assert {engine for engine, quantity in failed if quantity == "pose"} == {
        *FILE_ENGINES["odd.urdf"],
        *FILE_ENGINES["odd.xml"],
    }
    assert all(entry["worst"]["where"] in frames_from(1) for key, entry in failed.items() if key[1] == "pose")
    assert not [engine for engine, _ in failed if engine == "dh2sim"], "the library has read the new file"


def test_the_output_names_the_engine_the_frame_and_the_configuration(exported: Path) -> None:
    change(exported / "made" / "odd" / "odd.xml", lambda root: named(root, "site", "dh_3").set("pos", "0 0 0.001"))
    run = dh2sim("validate", exported / "odd.yaml", "--dir", exported / "made", "--samples", "20")
    lines = run.out.splitlines()
    assert (run.status, run.err) == (1, "")
    assert lines[0] == "odd DOES NOT match its table"
    assert [line.split()[0] for line in lines if line.endswith("FAILED")] == ["mujoco-mjcf"]
    reported = " ".join(" ".join(lines).split("mujoco-mjcf, pose: ")[1].split())
    assert reported.startswith("0.001 m, ")
    assert " rad (tolerance 1e-12); worst at dh_3, q = [" in reported
