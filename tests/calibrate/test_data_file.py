"""Files of measurements: units, orientations, and everything that is wrong at once."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from dh2sim.calibrate.data_file import read_measurements
from dh2sim.calibrate.measurements import Kind
from dh2sim.errors import MeasurementFileError
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.kinematics.transforms import quaternion_from_rotation, rpy_from_rotation
from tests.calibrate.measured import random_q
from tests.refusals import refusal
from tests.sample_robots import robot

SCARA = robot("scara")
JOINTS = "joint_1 [deg],joint_2 [rad],joint_3 [mm],q4 (deg)"


def joints(q: np.ndarray) -> list[str]:
    return [repr(float(value)) for value in (math.degrees(q[0]), q[1], 1e3 * q[2], math.degrees(q[3]))]


def write(folder: Path, *lines: str) -> Path:
    file = folder / "data.csv"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file


ORIENTATIONS = {
    "qw,qx,qy,qz": lambda T: (2.0 * quaternion_from_rotation(T) / 2.0).tolist(),
    "roll [deg],pitch [deg],yaw [deg]": lambda T: np.degrees(rpy_from_rotation(T)).tolist(),
    ",".join(f"r{i}{k}" for i in "123" for k in "123"): lambda T: T[:3, :3].ravel().tolist(),
}


@pytest.mark.parametrize("header", ORIENTATIONS)
def test_poses_are_read_in_the_units_of_the_header(header: str, tmp_path: Path) -> None:
    q = random_q(SCARA, 5, 0)
    T = table_tool_pose(SCARA, q)
    lines = ["# a comment", f"{JOINTS},x [mm],y [cm],z [m],{header},note"]
    for each, pose in zip(q, T, strict=True):
        x, y, z = pose[:3, 3].tolist()
        lines.append(",".join([*joints(each), *map(repr, (1e3 * x, 1e2 * y, z, *ORIENTATIONS[header](pose))), "any"]))
    found = read_measurements(write(tmp_path, *lines), SCARA)
    assert found.kind is Kind.POSE
    assert found.lines == (3, 4, 5, 6, 7)
    assert found.position is not None
    assert found.rotation is not None
    assert np.abs(found.q - q).max() < 1e-14
    assert np.abs(found.position - T[:, :3, 3]).max() < 1e-14
    assert np.abs(found.rotation - T[:, :3, :3]).max() < 1e-14


def test_transforms_semicolons_and_decimal_commas_are_read(tmp_path: Path) -> None:
    q = random_q(SCARA, 4, 0)
    T = table_tool_pose(SCARA, q)
    heads = [f"t{i}{k}" + (" [m]" if k == 4 else "") for i in (1, 2, 3) for k in (1, 2, 3, 4)]
    lines = [";".join([*JOINTS.split(","), *heads])]
    lines += [
        ";".join([*joints(each), *map(repr, pose[:3].ravel().tolist())]).replace(".", ",")
        for each, pose in zip(q, T, strict=True)
    ]
    found = read_measurements(write(tmp_path, *lines), SCARA)
    assert found.position is not None
    assert np.abs(found.position - T[:, :3, 3]).max() < 1e-14


def test_units_may_stand_behind_names_and_tabs_go_with_decimal_commas(tmp_path: Path) -> None:
    arm = robot("scara")
    header = "x_mm\ty_cm\tz_m\tjoint_1_deg\tq2_rad\tjoint_3_mm\tj4_mrad"
    found = read_measurements(write(tmp_path, header, "1,5\t2,5\t0,5\t90\t0,1\t25\t-7"), arm)
    assert found.position is not None
    assert np.allclose(found.position, [[0.0015, 0.025, 0.5]])
    assert np.allclose(found.q, [[np.pi / 2, 0.1, 0.025, -0.007]])


def test_sockets_have_placements_and_distances(tmp_path: Path) -> None:
    lines = [f"{JOINTS},placement,socket,distance [mm]"]
    lines += [
        f"{20 * k},0.{k},10,{k},{place},{socket},{'50' if k == 1 else ''}"
        for place in "pq"
        for socket in "ab"
        for k in (1, 2)
    ]
    found = read_measurements(write(tmp_path, *lines), SCARA)
    assert found.kind is Kind.SOCKET
    assert found.socket_names() == tuple(f"{p}/{s}" for p in "pq" for s in "ab" for _ in range(2))
    assert found.group_name == "placement"
    assert found.distance is not None
    assert np.nanmax(found.distance) == 0.05
    by_hand = read_measurements(write(tmp_path, *lines), SCARA, groups="socket")
    assert set(by_hand.groups or ()) == {"a", "b"}


def test_everything_wrong_in_a_file_is_reported_at_once_with_its_place(tmp_path: Path) -> None:
    file = write(
        tmp_path,
        "joint_1 [rad],joint_2,joint_3 [grd],joint_1 [rad],x [m],y [m],distanse [m],qw",
        "1,2,3,4,5,nan,7,1",
        "173.2,2,3,4,5500,six,7,1",
        "1,2",
    )
    lines = refusal(MeasurementFileError, read_measurements, file, SCARA).splitlines()
    assert [line.removeprefix(f"{file}:") for line in lines] == [
        "1:1: missing column joint_4: each joint needs one",
        "1:1: missing column z of --kind pose",
        "1:1: missing columns qx, qy, qz of a quaternion",
        "1:15: joint_2: has no unit: write joint_2 [rad], joint_2 [deg] or joint_2 [mrad]",
        "1:23: joint_3 [grd]: unknown unit 'grd': write joint_3 [m], joint_3 [mm] or joint_3 [cm]",
        "1:37: joint_1 [rad]: column 'joint_1' is there twice",
        *[line for line in lines if "distanse" in line for line in [line.removeprefix(f"{file}:")]],
        "2:11: y [m]: must be finite, found nan",
        "3:1: joint_1 [rad]: found 173.2 rad, which looks like degrees: write [deg]",
        "3:13: x [m]: found 5500 m, which looks like mm: write [mm]",
        "3:18: y [m]: expected a number, found 'six'",
        "4:1: expected 8 cells as in the header, found 2",
    ]
    assert any("1:63: unknown column 'distanse'. Did you mean 'distance'?" in line for line in lines)


EXTRA = f"Nr;{JOINTS.replace(',', ';')};x [mm];y [mm];z [mm];Bemerkung;Temperatur [°C];T1;"


def test_columns_of_other_names_are_left_out_with_a_note(tmp_path: Path) -> None:
    file = write(tmp_path, EXTRA, "1;10,5;1;2;3;4;5;6,25;warm;21,5;x;", "2;20;1;2;3;4;5;6;;22;;")
    found = read_measurements(file, SCARA)
    assert found.notes == (
        "Columns of the file that are left out: 'Nr', 'Bemerkung', 'Temperatur [°C]', 'T1', one without a name.",
    )
    assert found.position is not None
    assert found.position.tolist() == [[0.004, 0.005, 0.00625], [0.004, 0.005, 0.006]]


@pytest.mark.parametrize(
    ("header", "message"),
    [
        (f"{JOINTS},x [m],y [m],z [m],staton", "unknown column 'staton'. Did you mean 'station'?"),
        (f"{JOINTS},x [m],y [m],z [m],q5 [deg]", "unknown column 'q5'."),
        (f"{JOINTS},x [m],y [m],Höhe [m]", "unknown column 'Höhe'."),
        (f"{JOINTS},Abstand [m]", "unknown column 'Abstand'."),
    ],
)
def test_columns_of_other_names_are_errors_where_they_may_be_what_is_needed(
    header: str, message: str, tmp_path: Path
) -> None:
    file = write(tmp_path, header, ",".join("1" * (header.count(",") + 1)))
    assert message in refusal(MeasurementFileError, read_measurements, file, SCARA)


def test_radians_that_are_called_degrees_are_noticed(tmp_path: Path) -> None:
    header = "joint_1 [deg],joint_2 [deg],joint_3 [mm],joint_4 [deg],x [m],y [m],z [m]"
    file = write(tmp_path, header, *(f"0.{k},1.{k},10,-2.{k},0,0,0" for k in range(6)))
    assert "which looks like radians: write [rad]" in refusal(MeasurementFileError, read_measurements, file, SCARA)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([""], ":1:1: the file is empty; the first line must name the columns"),
        (["0.1,0.2"], ":1:1: expected the name of a column, found '0.1': the first line must name the columns"),
        ([f"{JOINTS},x [m],y [m],z [m]"], ":1:1: there are no measurements below the header"),
        (["a"] * 20_002, ":1:1: the file has 20001 measurements; at most 20000 are fitted: choose some"),
        ([f"{JOINTS},socket", "1,1,1,1,a", "1,1,1,1,a", "1,1,1,1,b"], ":4:9: socket: socket 'b' has one row; at"),
        ([f"{JOINTS},distance [mm]", "1,1,1,1,-5"], ":2:9: distance [mm]: a distance must be a positive number"),
        ([f"{JOINTS},x [m],y [m],z [m],qw,qx,qy,qz", "1,1,1,1,0,0,0,1,1,0,0"], "a quaternion must have length 1"),
    ],
)
def test_what_a_file_lacks_is_said(lines: list[str], message: str, tmp_path: Path) -> None:
    assert message in refusal(MeasurementFileError, read_measurements, write(tmp_path, *lines), SCARA)


def test_an_unknown_group_is_refused(tmp_path: Path) -> None:
    file = write(tmp_path, f"{JOINTS},x [m],y [m],z [m],day", "1,1,1,1,0,0,0,monday")
    assert read_measurements(file, SCARA, groups="day").groups == ("monday",)
    assert "there is no column 'dya' to group by. Did you mean 'day'?" in refusal(
        MeasurementFileError, read_measurements, file, SCARA, groups="dya"
    )
