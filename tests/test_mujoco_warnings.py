"""MuJoCo's warnings become sentences, and nothing is printed or left in the current folder."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import mujoco
import pytest

from dh2sim import Robot, load_robot
from dh2sim.model.build import build_model
from dh2sim.mujoco_warnings import mujoco_warnings, warning_sentences
from dh2sim.simulate.dataset_layout import STATUS
from dh2sim.validate.run import validate_robot
from tests.program import dh2sim
from tests.robot_files import write

LOST = """\
name: lost
convention: standard
joints:
  - {type: revolute, link: {mass: 1.0e-12, com: [0, 0, 0], inertia: {ixx: 1.0e-13, iyy: 1.0e-13, izz: 1.0e-13}}}
  - {type: revolute, a: 1, link: {mass: 1.0e+9, com: [1000, 0, 0]}}
"""
"""A link on the same axis as one that has 1e28 times its inertia: beside that it is nothing to a double."""
SENTENCE = (
    "What joint_1 moves is lost in rounding beside the rest: its mass or inertia is too small, or that of other "
    "links too large, to be simulated."
)
RAW = "Inertia matrix is too close to singular"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with the robot in it."""
    write(tmp_path, LOST)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_export_and_validate_say_what_mujoco_warns_of(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    exported = dh2sim("export", "lost.yaml", "--out", "made")
    assert exported.status == 0
    assert f"MuJoCo: {SENTENCE}" in " ".join(exported.out.split())
    validated = dh2sim("validate", "lost.yaml", "--dir", "made", "--samples", "20")
    assert validated.status == 0
    assert f"mujoco: {SENTENCE}" in " ".join(validated.out.split())
    assert RAW not in exported.out + exported.err + validated.out + validated.err
    assert sorted(os.listdir(folder)) == ["lost.yaml", "made"]
    assert RAW not in "".join(capfd.readouterr())


def test_the_library_warns_and_reports(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    arm = Robot.load("lost.yaml")
    with pytest.warns(RuntimeWarning) as caught:
        arm.mjmodel()
    assert [str(warning.message) for warning in caught] == [f"lost: {SENTENCE}"]
    report = validate_robot(build_model(load_robot("lost.yaml")), samples=5)
    assert report.warnings == (SENTENCE,)
    assert report.to_json()["warnings"] == [SENTENCE]
    assert os.listdir(folder) == ["lost.yaml"]
    assert capfd.readouterr() == ("", "")


def test_a_rollout_that_becomes_unstable_leaves_nothing_behind(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    run = Robot.load("lost.yaml").rollout(2, steps=5)
    assert set(run["status"].values.tolist()) == {STATUS["warning_inertia"]}
    assert os.listdir(folder) == ["lost.yaml"]
    assert capfd.readouterr() == ("", "")


def test_an_import_notes_what_mujoco_warns_of(folder: Path) -> None:
    dh2sim("export", "lost.yaml", "--out", "made")
    imported = dh2sim("import", "made/lost/lost.xml", "--out", "back.yaml")
    assert imported.status == 0
    said = " ".join(imported.err.split())
    assert "note: What degree of freedom 0 moves is lost in rounding" in said
    assert RAW not in said
    assert sorted(os.listdir(folder)) == ["back.yaml", "lost.yaml", "made"]


def test_warnings_are_collected_once_and_the_latest_context_takes_them() -> None:
    def own(_text: str) -> None:
        raise AssertionError("called")

    text = "<mujoco><worldbody><body><joint/><geom size='1' mass='nan'/></body></worldbody></mujoco>"
    mujoco.set_mju_user_warning(own)
    try:
        with mujoco_warnings() as outer, mujoco_warnings() as inner:
            for _ in range(2):
                mujoco.MjModel.from_xml_string(text)
        assert outer == []
        assert warning_sentences(inner) == ("An XML file contains NaN, which is not a number.",)
        assert mujoco.get_mju_user_warning() is own
    finally:
        mujoco.set_mju_user_warning(None)


def test_warnings_are_worded_with_the_names_of_joints() -> None:
    unstable = "Nan, Inf or huge value in QACC at DOF 1. The simulation is unstable. Time = 0.0020."
    other = "Too many contacts. Either the arena memory is full.\n"
    assert warning_sentences([unstable, unstable, other], ["a", "b"]) == (
        "A simulation became unstable at 0.002 s: acceleration of b.",
        "MuJoCo warns: Too many contacts. Either the arena memory is full.",
    )
    assert warning_sentences([unstable]) == (
        "A simulation became unstable at 0.002 s: acceleration of degree of freedom 1.",
    )


def test_a_robot_that_mujoco_likes_has_no_warnings() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Robot.load("scara").mjmodel()
    assert validate_robot("scara", samples=5).warnings == ()
