"""Reading makers' calibration files: their kinds are told apart, and everything wrong is reported at its place."""

from __future__ import annotations

import math

import pytest

from dh2sim.errors import ImportedFileError
from dh2sim.formats.calibration import JointOrigins, TableDeltas, is_calibration, moving_joints, read_calibration
from tests.refusals import refusal
from tests.sample_robots import ROBOTS_DIR

POSE = "{x: 0, y: 0.1, z: 2e-1, roll: -0, pitch: 1.5, yaw: -2.5}"
UR = "kinematics:\n" + "".join(
    f"  {name}: {POSE}\n" for name in ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
)
FRANKA = "".join(f"joint{i}:\n  kinematic: {POSE}\n\n" for i in range(1, 9))
CONF = """\
# written by the controller
[mounting]
delta_theta = [ -8.2e-05, -0.1, 0.7]   # rad
delta_a = [1e-3,
           0.25, 0]
delta_d = [ 0.0005, 11.5, -92.25]
delta_alpha = [ -0.0003, -0.005, -0.0]
joint_checksum = [ 0x6e0f7bf, 0xa32a713f, 0xf636a50]
calibration_status = 2\t# 0 == notInitialized / 1 == notLinearised / 2 == Linearised
joint_raw_offset = [ 0x31aa98, 0x324a55, 0xd4b163]
"""


def wrong(text: str) -> list[str]:
    return refusal(ImportedFileError, read_calibration, text.encode(), file="f").splitlines()


def test_a_file_of_ur_drivers_gives_six_poses_in_the_order_of_the_arm() -> None:
    lines = UR.splitlines()
    shuffled = "\n".join([lines[0], *reversed(lines[1:]), "  hash: calib_123", ""])
    for text, identifier in ((UR, ""), (shuffled, "calib_123")):
        read = read_calibration(text.encode(), file="f")
        assert isinstance(read, JointOrigins)
        assert read.names == (
            "shoulder_pan_joint",
            "shoulder_lift_joint",
            "elbow_joint",
            "wrist_1_joint",
            "wrist_2_joint",
            "wrist_3_joint",
        )
        assert [pose.xyz.tolist() for pose in read.poses] == [[0.0, 0.1, 0.2]] * 6
        assert [pose.rpy.tolist() for pose in read.poses] == [[0.0, 1.5, -2.5]] * 6
        assert read.identifier == identifier


def test_numbered_joints_are_read_in_the_order_of_their_numbers() -> None:
    blocks = FRANKA.strip().split("\n\n")
    read = read_calibration("\n".join(reversed(blocks)).encode(), file="f")
    assert isinstance(read, JointOrigins)
    assert read.names == tuple(f"joint{i}" for i in range(1, 9))
    assert moving_joints(read, None) == 7
    assert moving_joints(read, 7) == 7
    assert moving_joints(read, 8) == 8


def test_other_names_below_kinematics_are_joints_in_the_order_of_the_file() -> None:
    read = read_calibration(f"kinematics:\n  hip: {POSE}\n  knee: {POSE}\n".encode(), file="f")
    assert isinstance(read, JointOrigins)
    assert read.names == ("hip", "knee")
    assert moving_joints(read, None) == 2


def test_a_file_of_a_ur_controller_gives_deltas() -> None:
    for text in (CONF, CONF.replace("\n", "\r\n"), f"\ufeff{CONF}"):
        read = read_calibration(text.encode(), file="f")
        assert isinstance(read, TableDeltas)
        assert read == TableDeltas(
            theta=(-8.2e-05, -0.1, 0.7),
            a=(1e-3, 0.25, 0.0),
            d=(0.0005, 11.5, -92.25),
            alpha=(-0.0003, -0.005, -0.0),
        )
    assert isinstance(uncalibrated := read_calibration(CONF.replace("= 2", "= 1").encode(), file="f"), TableDeltas)
    assert not uncalibrated.linearised


BARE_UR = UR.replace("kinematics:\n", "").replace("  ", "")
BARE_FRANKA = FRANKA.replace("\n  kinematic:", "")


def test_the_words_around_the_poses_may_be_missing() -> None:
    for bare, whole in ((BARE_UR, UR), (BARE_FRANKA, FRANKA)):
        reads = [read_calibration(text.encode(), file="f") for text in (bare, whole)]
        assert isinstance(reads[0], JointOrigins)
        assert isinstance(reads[1], JointOrigins)
        assert reads[0].names == reads[1].names


@pytest.mark.parametrize("text", [UR, BARE_UR, FRANKA, BARE_FRANKA, CONF, CONF.replace("[mounting]\n", "")])
def test_calibrations_are_recognised_by_their_content(text: str) -> None:
    assert is_calibration(text.encode())


@pytest.mark.parametrize(
    "text",
    [
        "name: arm\nconvention: standard\njoints:\n  - {type: revolute}\n",
        "kinematics: well known\nroll: your own\n",
        "| theta | d | a | alpha |\n|---|---|---|---|\n| q1 | 0 | 0 | 0 |\n",
        "delta_theta = [1]\n",
        f"# My arm\n\n    {CONF}\n    {UR}\n| theta | d | a | alpha |\n|---|---|---|---|\n| q1 | 0 | 0 | 0 |\n",
        "name: a\naxes:\n  - {type: revolute, point: [0, 0, 0], direction: [0, 0, 1]}\n",
    ],
)
def test_other_files_are_no_calibrations(text: str) -> None:
    assert not is_calibration(text.encode())


def test_robot_files_are_no_calibrations() -> None:
    for path in ROBOTS_DIR.glob("*.yaml"):
        assert not is_calibration(path.read_bytes())


def test_everything_wrong_with_poses_is_reported_at_once() -> None:
    text = """\
kinematics:
  shoulder: {x: 0, y: 0, z: one, roll: 0, pitch: 0, yaw: 0}
  upper_arn: {x: 0}
  forearm: {x: 0, y: 0, z: .nan, roll: 0, pitch: true, yaw: 0, jaw: 1}
  wrist_1: [0, 0, 0]
  wrist_2:
    x: 0
  wrist_3: {x: 0, y: 0, z: 0, roll: 0, pitch: 0, yaw: 0}
remarks: none
"""
    keys = "Allowed keys: shoulder, upper_arm, forearm, wrist_1, wrist_2, wrist_3, hash"
    assert wrong(text) == [
        "f:2:3: kinematics: missing key 'upper_arm'",
        "f:2:29: kinematics.shoulder.z: expected a number, got 'one'",
        f"f:3:3: kinematics.upper_arn: unknown key 'upper_arn'. Did you mean 'upper_arm'? {keys}",
        "f:4:28: kinematics.forearm.z: expected a number, got '.nan'",
        "f:4:50: kinematics.forearm.pitch: expected a number, got 'true'",
        "f:4:64: kinematics.forearm.jaw: unknown key 'jaw'. Did you mean 'yaw'? "
        "Allowed keys: x, y, z, roll, pitch, yaw",
        "f:5:12: kinematics.wrist_1: expected x, y, z, roll, pitch, yaw, got a list",
        "f:7:5: kinematics.wrist_2: missing key 'pitch'",
        "f:7:5: kinematics.wrist_2: missing key 'roll'",
        "f:7:5: kinematics.wrist_2: missing key 'y'",
        "f:7:5: kinematics.wrist_2: missing key 'yaw'",
        "f:7:5: kinematics.wrist_2: missing key 'z'",
        "f:9:1: remarks: unknown key 'remarks'. Allowed key: kinematics",
    ]


def test_numbered_joints_must_be_complete() -> None:
    missing = FRANKA.replace("joint3:", "joint9:")
    assert wrong(missing) == ["f:10:1: joint4: expected joint 3 next, got 'joint4'"]
    assert wrong(FRANKA.replace("joint3:", "elbow:")) == [
        "f:7:1: elbow: expected a numbered joint, such as 'joint1', got 'elbow'"
    ]
    assert wrong(f"joint1:\n  kinematic: {POSE}\njoint2: 3\n") == [
        "f:3:9: joint2: expected x, y, z, roll, pitch, yaw, got '3'"
    ]


def test_everything_wrong_with_deltas_is_reported_at_once() -> None:
    text = "delta_theta = [1, x, 0x12]\ndelta_a = 3\ndelta_a = [1, 2, 3]\n\ndelta_d = [1, 2\n"
    assert wrong(text) == [
        "f:1:19: delta_theta[1]: expected a number, got 'x'",
        "f:1:22: delta_theta[2]: expected a number, got '0x12'",
        "f:2:11: delta_a: expected numbers between brackets: [ …, … ]",
        "f:3:1: delta_a: given twice; line 2 has it already",
        "f:5:11: delta_d: expected numbers between brackets: [ …, … ]",
        "f:5:16: missing key 'delta_alpha'",
    ]
    assert wrong(CONF.replace("-92.25", "")) == [
        "f:3:1: expected as many numbers of each parameter, got 3 of delta_theta, 3 of delta_a, 2 of delta_d, "
        "3 of delta_alpha"
    ]


@pytest.mark.parametrize("number", ["1e7", "-1e300", "9" * 400])
def test_absurd_numbers_are_refused_at_their_places(number: str) -> None:
    shown = repr(number if len(number) <= 60 else number[:57] + "...")
    one = POSE.replace("-2.5", number)
    assert wrong(f"joint1: {one}\njoint2: {POSE}\n") == [
        f"f:1:{9 + one.index(number)}: joint1.yaw: must be from -1e6 to 1e6 rad, got {shown}"
    ]
    problem = "must be from -1e6 to 1e6 m" if float(number) != math.inf else "expected a number"
    assert wrong(CONF.replace("11.5", number)) == [f"f:6:21: delta_d[1]: {problem}, got {shown}"]


def test_broken_yaml_is_an_error_at_its_place() -> None:
    assert wrong("kinematics:\n  shoulder: {x: 0, roll: \n")[0].startswith("f:")
    assert wrong("kinematics:\n  [roll]\n") == ["f:2:3: kinematics: expected poses of joints by name, got a list"]
