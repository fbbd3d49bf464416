"""Files are read by the reader that their content needs, with the options that apply to them."""

from __future__ import annotations

import hashlib
import math
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from dh2sim.errors import Dh2simError, ImportedFileError, MismatchError
from dh2sim.importing import serial
from dh2sim.importing.serial import assemble
from dh2sim.importing.sources import ImportOptions, import_data, import_robot
from dh2sim.importing.table import import_table
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.magnitudes import MOST_ROWS
from dh2sim.robot.row import Convention
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import AngleUnit, LengthUnit
from tests.kinematics.test_compaction import UR5
from tests.refusals import refusal

ARM = """\
<?xml version="1.0"?>
<!-- a <mujoco> in a comment is none -->
<robot name="two arm">
  <link name="ground"/>
  <link name="upper"><inertial>
    <origin xyz="0.2 0 0" rpy="0 0 1.5707963267948966"/><mass value="2"/>
    <inertia ixx="0.01" iyy="0.02" izz="0.025" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="fore"/>
  <link name="hand"/>
  <joint name="shoulder" type="revolute">
    <parent link="ground"/><child link="upper"/><origin xyz="0 0 0.3" rpy="1.5707963267948966 0 0"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="2" velocity="3" effort="40"/>
  </joint>
  <joint name="fore arm" type="continuous">
    <parent link="upper"/><child link="fore"/><origin xyz="0.4 0 0"/><axis xyz="0 0 -1"/>
  </joint>
  <joint name="wrist" type="fixed"><parent link="fore"/><child link="hand"/><origin xyz="0.2 0 0"/></joint>
</robot>
"""


def _refused(data: str | bytes, options: ImportOptions = ImportOptions(), file: str = "arm.urdf") -> str:  # noqa: B008
    raw = data.encode() if isinstance(data, str) else data
    return refusal(Dh2simError, import_data, raw, file, options)


def test_a_urdf_becomes_a_robot_file_that_says_where_it_is_from() -> None:
    imported = import_data(ARM.encode(), "arm.urdf", ImportOptions())
    spec, residual = imported.spec, imported.residual
    assert spec.name == "two_arm"
    assert [(row.name, row.type.value, row.a) for row in spec.rows] == [
        ("shoulder", "revolute", 0.4),
        ("fore_arm", "continuous", 0.2),
    ]
    assert residual is not None
    assert residual.largest < 1e-15
    assert residual.configurations == 1000
    assert spec.source == (
        f"URDF arm.urdf, from ground to hand (SHA-256 {hashlib.sha256(ARM.encode()).hexdigest()[:16]}…). Made by "
        "dh2sim; at 1000 random configurations all joint axes and the tip differ from the source's by at most "
        f"{residual.position:.1e} m and {residual.rotation:.1e} rad."
    )
    assert "Joint 'fore arm' is named fore_arm here, as a robot file does not allow its name." in imported.notes
    assert "# Note: Joint 'fore arm' is named fore_arm" in imported.text


def test_limits_mass_and_inertia_are_those_of_the_file_in_the_dh_frame() -> None:
    row = import_data(ARM.encode(), "arm.urdf", ImportOptions()).spec.rows[0]
    assert row.limits.position == pytest.approx((-1.0, 2.0), abs=1e-15)
    assert row.limits.velocity == pytest.approx(3.0)
    assert row.limits.effort == 40.0
    link = row.link
    assert link.mass == 2.0
    assert link.com is not None
    assert link.inertia is not None
    # DH frame 1 is at the elbow, turned by half a turn about x: the next axis points the other way
    assert link.com == pytest.approx([-0.2, 0.0, 0.0])
    assert link.inertia.diagonal() == pytest.approx([0.02, 0.01, 0.025])


def test_by_hand_the_tip_is_where_the_file_says() -> None:
    """At (0, 0) the arm lies along x at a height of 0.3 m."""
    spec = import_data(ARM.encode(), "arm.urdf", ImportOptions()).spec
    assert table_tool_pose(spec, [0.0, 0.0])[:3, 3] == pytest.approx([0.6, 0.0, 0.3])
    assert table_tool_pose(spec, [1.5707963267948966, 0.0])[:3, 3] == pytest.approx([0.0, 0.0, 0.9])


def test_base_tip_name_and_convention_are_what_is_asked_for() -> None:
    options = ImportOptions(base="upper", tip="fore", convention=Convention.MODIFIED, name="elbow")
    spec = import_data(ARM.encode(), "arm.urdf", options).spec
    assert (spec.name, spec.convention, len(spec.rows)) == ("elbow", Convention.MODIFIED, 1)
    assert spec.base.pose.xyz.any() or spec.rows[0].a == 0.4


def test_the_content_says_what_a_file_is_not_its_ending(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    path.write_text(ARM)
    assert import_robot(path).spec.name == "two_arm"


def test_a_table_is_a_table(tmp_path: Path) -> None:
    path = tmp_path / "planar.csv"
    path.write_text("theta,d (m),a (m),alpha (deg)\nq1,0,0.5,0\nq2,0,0.3,90\n")
    spec = import_robot(path, ImportOptions(convention=Convention.STANDARD)).spec
    assert (spec.name, [row.a for row in spec.rows]) == ("planar", [0.5, 0.3])


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (
            "<sdf version='1.9'/>",
            "arm.urdf: a file of <sdf> cannot be imported. Allowed: URDF (<robot>), MJCF (<mujoco>), and tables in "
            "Markdown, CSV or TSV. Convert it to URDF first.",
        ),
        (
            "<html><body/></html>",
            "arm.urdf: a file of <html> cannot be imported. Allowed: URDF (<robot>), MJCF (<mujoco>), and tables in "
            "Markdown, CSV or TSV.",
        ),
    ],
    ids=["sdf", "html"],
)
def test_other_formats_are_refused(data: str, expected: str) -> None:
    assert _refused(data) == expected


def test_what_is_for_tables_is_refused_for_a_urdf_and_the_other_way_round() -> None:
    assert _refused(ARM, ImportOptions(angle=AngleUnit.DEG)) == (
        "arm.urdf: angle and length are units of tables; this is URDF, which has its own units"
    )
    assert _refused("theta,d,a,alpha\n", ImportOptions(tip="hand"), "t.csv") == (
        "t.csv: base and tip are links of a URDF or an MJCF; this is read as a table, without links"
    )


def test_an_mjcf_is_not_read_from_standard_input() -> None:
    assert _refused("<mujoco/>", file="-") == (
        "an MJCF is read from a file, not from standard input: it may include others"
    )


def test_a_missing_file_and_a_folder_are_reported(tmp_path: Path) -> None:
    for path, why in ((tmp_path / "no.urdf", "No such file or directory"), (tmp_path, "Is a directory")):
        with pytest.raises(Dh2simError) as caught:
            import_robot(path)
        assert str(caught.value) == f"{path}: cannot be read: {why}"


def test_an_entity_bomb_is_refused() -> None:
    bomb = '<?xml version="1.0"?><!DOCTYPE r [<!ENTITY a "x"><!ENTITY b "&a;&a;">]><robot name="&b;"/>'
    with pytest.raises(ImportedFileError):
        import_data(bomb.encode(), "bomb.urdf", ImportOptions())


def test_a_file_in_another_encoding_is_read_or_refused_as_what_it_is() -> None:
    utf16 = ARM.replace('version="1.0"', 'version="1.0" encoding="utf-16"').encode("utf-16")
    try:
        assert import_data(utf16, "arm.urdf", ImportOptions()).spec.name == "two_arm"
    except ImportedFileError as error:
        assert str(error).startswith("arm.urdf:1:1: ")  # noqa: PT017


def test_options_may_be_strings_and_unknown_ones_are_refused() -> None:
    options = ImportOptions(convention="modified", tip="fore")
    assert import_data(ARM.encode(), "arm.urdf", options).spec.convention is Convention.MODIFIED
    with pytest.raises(Dh2simError) as caught:
        import_data(b"theta,d,a,alpha\nq1,0,1,0\n", "t.csv", ImportOptions(convention="standrad", length="m"))
    assert str(caught.value) == (
        "unknown convention 'standrad'. Did you mean 'standard'? Allowed: standard, modified, hayati"
    )


def test_a_residual_above_the_tolerance_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """A table that is off by a millimetre: what is compared is the text, so a wrong number anywhere is found."""

    def wrong(*args: Any, **options: Any) -> RobotSpec:
        spec = assemble(*args, **options)
        return replace(spec, rows=(replace(spec.rows[0], a=spec.rows[0].a + 0.001), *spec.rows[1:]))

    monkeypatch.setattr(serial, "assemble", wrong)
    with pytest.raises(MismatchError) as caught:
        import_data(ARM.encode(), "arm.urdf", ImportOptions())
    assert str(caught.value).startswith("URDF arm.urdf, from ground to hand: the table is off by 1.0e-03 m and ")
    assert "at the tip; allowed is 1e-09. Nothing was written." in str(caught.value)


TWO = "## Standard DH\n\n|θ|d|a|α|\n|-|-|-|-|\n|q1|0|1|0|\n\n## Modified DH\n\n|θ|d|a|α|\n|-|-|-|-|\n|q1|0|2|0|\n"


def test_a_table_of_several_is_read_by_its_number() -> None:
    a = [import_data(TWO.encode(), "t.md", ImportOptions(table=number)).spec.rows[0].a for number in (1, 2)]
    assert a == [1, 2]
    listing = "1 on line 3 (θ, d, a, α); 2 on line 9 (θ, d, a, α)"
    assert import_data(TWO.encode(), "t.md", ImportOptions()).notes[0] == (
        f"The file has 2 tables, of which the first was read; pass table=2 for the second. They are: {listing}."
    )
    assert _refused(TWO, ImportOptions(table=3), "t.md") == (
        f"t.md: there is no table 3; the file has 2 tables: {listing}"
    )
    assert _refused(TWO, ImportOptions(table="2"), "t.md") == (  # type: ignore[arg-type]
        "table must be the number of a table, from 1, got '2'"
    )
    assert _refused(ARM, ImportOptions(table=1)) == "arm.urdf: table is the number of a table in a text; this is URDF"


def test_options_may_be_plain_strings() -> None:
    options = ImportOptions(convention="modified", angle="deg", length="mm", package_paths="meshes")
    assert (options.convention, options.angle, options.length, options.package_paths) == (
        Convention.MODIFIED, AngleUnit.DEG, LengthUnit.MM, (Path("meshes"),),
    )  # fmt: skip
    text = b"theta,d,a,alpha\nq1,100,0,90\n"
    for spec in (
        import_table(text, file="t.csv", convention="modified", angle="deg", length="mm").spec,
        import_data(text, "t.csv", options).spec,
    ):
        assert (spec.convention, spec.rows[0].d, spec.rows[0].alpha) == (Convention.MODIFIED, 0.1, math.pi / 2)
    craig = b"theta_i,d_i,a_{i-1},alpha_{i-1}\nq1,0,0,90\n"
    assert import_table(craig, file="t.csv", convention="modified", angle="deg").spec.convention == "modified"


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"convention": "craig"}, "unknown convention 'craig'. Allowed: standard, modified, hayati"),
        ({"angle": "degree"}, "unknown angle 'degree'. Did you mean 'deg'? Allowed: rad, deg"),
        ({"tolerance": "1e-4"}, "tolerance must be a number, got '1e-4'"),
        ({"tolerance": -1e-4}, "tolerance must be a positive number, got -0.0001"),
        ({"tolerance": math.nan}, "tolerance must be a positive number, got nan"),
        ({"package_paths": [3]}, "package_paths must be a path or several, got [3]"),
        ({"root": 3}, "root must be a path, got 3"),
        ({"arguments": [1]}, "arguments must be a mapping of names to values, got [1]"),
        ({"tip": 3}, "tip must be a string, got 3"),
    ],
)
def test_an_option_of_the_wrong_kind_is_refused_by_its_name(options: dict[str, Any], expected: str) -> None:
    assert refusal(Dh2simError, ImportOptions, **options) == expected


README = """\
{first}

# Arm

Modified DH

| i | alpha_{{i-1}} (deg) | a_{{i-1}} (mm) | d_i (mm) | theta_i |
|---|---|---|---|---|
| 1 | 0 | 0 | 100 | θ1 |
| 2 | 90 | 20 | 0 | θ2 |

The model is `<robot name="arm">`.
"""


@pytest.mark.parametrize(
    "first",
    [
        '<p align="center"><img src="arm.png"></p>', "<!-- a logo -->", "<!-- a\nlogo -->\n<div>\n</div>",
        "<h1>Arm</h1>", "<!DOCTYPE html>\n<center>", "<https://example.org>", "<Badge kind='x' />", "< 3 joints",
        "<picture>",
    ],
)  # fmt: skip
def test_a_text_that_begins_with_html_is_searched_for_a_table(first: str) -> None:
    spec = import_data(README.format(first=first).encode(), "README.md", ImportOptions()).spec
    assert [(row.a, row.alpha, row.d) for row in spec.rows] == [(0, 0, 0.1), (0.02, math.pi / 2, 0)]


def test_an_element_that_nobody_knows_is_refused_by_its_name_where_the_file_is_xml() -> None:
    assert _refused("<part/>", file="part.xml").startswith("part.xml: a file of <part> cannot be imported.")
    assert _refused("<?xml version='1.0'?><part/>", file="part").startswith("part: a file of <part> cannot be ")
    assert _refused("<part/>", file="part").startswith("part:1:1: no table of Denavit-Hartenberg parameters found")


def test_what_is_no_options_and_a_convention_that_is_not_made_are_refused() -> None:
    assert (
        refusal(Dh2simError, import_robot, "arm.urdf", "modified")
        == "options must be of type ImportOptions, got 'modified'"
    )
    assert _refused(ARM, ImportOptions(convention="hayati")) == (
        "a table is made in the standard or the modified convention; Hayati rows are used where they are needed"
    )


def test_a_calibrated_table_says_that_it_can_be_compact() -> None:
    rows = "\n".join(f"| {theta} | {a} | {d} | {alpha} |" for theta, a, d, alpha in UR5)
    data = f"| theta (rad) | a (m) | d (m) | alpha (rad) |\n|---|---|---|---|\n{rows}\n".encode()
    imported = import_data(data, "ur5.md", ImportOptions(convention="standard"))
    assert imported.notes[-1] == (
        "DH frames 2 and 3 are 574.1 and 66.77 m away from the arm, which is 1.19 m long. "
        "'dh2sim convert ur5.yaml --to compact' rewrites the table without them."
    )


@pytest.mark.parametrize(
    "before", ["", "\ufeff", "\n\ufeff", "\ufeff \n", "<!-- a -- b -->\n", "\n<!-- <mujoco> -->\n", "<?pi?>"]
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_a_urdf_is_known_behind_marks_blanks_and_comments(before: str, encoding: str) -> None:
    text = before + ARM.partition("\n")[2]
    assert import_data(text.encode(encoding), "arm.txt", ImportOptions()).spec.name == "two_arm"


def _too_long(kind: str) -> str:
    n = MOST_ROWS + 1
    match kind:
        case "urdf":
            joint = '<joint name="j{0}" type="continuous"><parent link="l{0}"/><child link="l{1}"/></joint>'
            links = "".join(f'<link name="l{i}"/>' for i in range(n + 1))
            return f'<robot name="r">{links}{"".join(joint.format(i, i + 1) for i in range(n))}</robot>'
        case "md":
            return "| a [m] | alpha [deg] | d [m] | theta [deg] |\n|---|---|---|---|\n" + "| 1 | 2 | 3 | q |\n" * n
        case _:
            pose = "{x: 0, y: 0, z: 0.1, roll: 0, pitch: 0, yaw: 0}"
            return "kinematics:\n" + "".join(f"  joint_{i}: {pose}\n" for i in range(n))


@pytest.mark.parametrize(
    ("kind", "reported"),
    [
        ("urdf", "1:{at}: the arm has {n} joints; at most {most} are read"),
        ("md", "1:3: the table has more than {most} rows"),
        ("yaml", "2:3: kinematics: there are {n} joints; at most {most} are read"),
    ],
)
def test_a_robot_of_too_many_joints_is_refused_before_it_is_made(tmp_path: Path, kind: str, reported: str) -> None:
    path = tmp_path / f"long.{kind}"
    text = _too_long(kind)
    path.write_text(text)
    at = text.find(f'<link name="l{MOST_ROWS + 1}"') + 1
    message = reported.format(at=at, n=MOST_ROWS + 1, most=MOST_ROWS)
    started = time.process_time()
    assert refusal(ImportedFileError, import_robot, path) == f"{path}:{message}"
    assert time.process_time() - started < 2.0
