"""xacro files: what is replaced, where problems are, and what they cannot reach."""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path

import numpy as np
import pytest

from dh2sim.errors import Dh2simError, MissingExtraError
from dh2sim.formats import xacro as xacro_module
from dh2sim.formats.xacro_worker import checked_eval
from dh2sim.importing.result import Imported
from dh2sim.importing.sources import ImportOptions, import_data, import_robot
from dh2sim.kinematics.table_oracle import table_tool_pose
from tests.refusals import refusal

pytest.importorskip("xacro", reason="the extra 'xacro' is not installed")

XMLNS = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
ARM = f"""\
<?xml version="1.0"?>
<robot name="made" {XMLNS}>
  <xacro:arg name="speed" default="1"/>
  <xacro:arg name="long" default="false"/>
  <xacro:include filename="$(find my_arm)/urdf/parts.xacro"/>
  <xacro:property name="sizes" value="${{xacro.load_yaml('$(find my_arm)/config/sizes.yaml')}}"/>
  <link name="base"/>
  <xacro:segment name="one" parent="base" z="${{sizes['height']}}" axis="0 0 1"/>
  <xacro:segment name="two" parent="one" z="0.1" axis="0 1 0"/>
  <xacro:if value="$(arg long)">
    <xacro:segment name="three" parent="two" z="${{2*sizes.reach}}" axis="1 0 0"/>
  </xacro:if>
</robot>
"""
PARTS = f"""\
<robot {XMLNS}>
  <xacro:property name="turn" value="${{pi/4}}"/>
  <xacro:macro name="segment" params="name parent z axis">
    <link name="${{name}}"/>
    <joint name="${{name}}_joint" type="revolute">
      <parent link="${{parent}}"/><child link="${{name}}"/>
      <origin xyz="0.2 0 ${{z}}" rpy="0 0 ${{turn}}"/><axis xyz="${{axis}}"/>
      <limit lower="${{-pi}}" upper="${{pi}}" velocity="$(arg speed)" effort="2"/>
    </joint>
  </xacro:macro>
</robot>
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package of ROS in a workspace, with a secret beside it."""
    folder = tmp_path / "workspace" / "folder_of_another_name"
    for name, text in {
        "package.xml": "<package><name>my_arm</name></package>",
        "urdf/arm.urdf.xacro": ARM,
        "urdf/parts.xacro": PARTS,
        "config/sizes.yaml": "height: 0.5\nreach: !degrees 90\n",
        "../../secret.yaml": "key: 12345",
    }.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return folder


def _imported(package: Path, **options: object) -> Imported:
    chosen = ImportOptions(root=package, **options)  # type: ignore[arg-type]
    return import_robot(package / "urdf" / "arm.urdf.xacro", chosen)


def _refused(package: Path, text: str, **options: object) -> str:
    """Return the message on an arm with a text in it, on line 2, without the folder."""
    (package / "urdf" / "arm.urdf.xacro").write_text(f"<robot name='r' {XMLNS}>\n{text}</robot>", encoding="utf-8")
    message = refusal(Dh2simError, _imported, package, **options)
    return message.replace(f"{package / 'urdf'}{os.sep}", "").replace(str(package), "ROOT")


def test_properties_macros_includes_yaml_and_arguments_are_replaced(package: Path) -> None:
    found = _imported(package, arguments={"long": True, "speed": 2.5})
    assert [row.limits.velocity for row in found.spec.rows] == [2.5, 2.5, 2.5]
    assert [row.name for row in found.spec.rows] == ["one_joint", "two_joint", "three_joint"]
    q = np.array([[0.3, -0.5, 0.7]])
    T = np.eye(4)
    for z, axis, angle in ((0.5, 2, q[0, 0]), (0.1, 1, q[0, 1]), (math.pi, 0, q[0, 2])):  # 2 * 90 degrees in rad
        c, s = math.cos(math.pi / 4), math.sin(math.pi / 4)
        place = np.array([[c, -s, 0, 0.2], [s, c, 0, 0], [0, 0, 1, z], [0, 0, 0, 1]])
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(4)
        turn[i, i] = turn[j, j] = math.cos(angle)
        turn[j, i], turn[i, j] = math.sin(angle), -math.sin(angle)
        T = T @ place @ turn
    assert table_tool_pose(found.spec, q)[0] == pytest.approx(T, abs=1e-12)
    assert ", expanded by xacro with long:=True, speed:=2.5 (SHA-256 " in found.spec.source


def test_without_arguments_their_defaults_count(package: Path) -> None:
    assert [row.name for row in _imported(package).spec.rows] == ["one_joint", "two_joint"]


def test_a_problem_is_reported_where_it_was_written(package: Path) -> None:
    parts = package / "urdf" / "parts.xacro"
    parts.write_text(PARTS.replace("$(arg speed)", "fast"), encoding="utf-8")
    message = refusal(Dh2simError, _imported, package).splitlines()
    assert message == [
        f"{parts}:8:7: joint[one_joint].limit.velocity: expected a number, found 'fast'",
        f"{parts}:8:7: joint[two_joint].limit.velocity: expected a number, found 'fast'",
    ]


def test_what_xacro_refuses_is_reported_where_it_was_written(package: Path) -> None:
    parts = package / "urdf" / "parts.xacro"
    parts.write_text(PARTS.replace("${turn}", "${turns}"), encoding="utf-8")
    assert refusal(Dh2simError, _imported, package) == (
        f"{parts}:7:7: xacro: name 'turns' is not defined, evaluating expression 'turns', in macro 'segment'"
    )
    parts.write_text(PARTS.replace("</xacro:macro>", ""), encoding="utf-8")
    assert refusal(Dh2simError, _imported, package) == f"{parts}:11:3: not well-formed XML: mismatched tag"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('<xacro:nothing/>', "arm.urdf.xacro:2:1: xacro: unknown macro name: xacro:nothing"),
        ('<link name="${1 +}"/>', "arm.urdf.xacro:2:1: xacro: invalid syntax, evaluating expression '1 +'"),
        ('\n<xacro:include filename="gone.xacro"/>', "arm.urdf.xacro:3:1: xacro: gone.xacro: no such file"),
        (
            '<link name="$(arg size)"/>',
            "arm.urdf.xacro:2:1: xacro: argument 'size' has no value, and no default; give it one: "
            "arguments={'size': ...}",
        ),
        (
            '<link name="$(find other)"/>',
            "arm.urdf.xacro:2:1: xacro: no package 'other' in ROOT and those below it",
        ),
        (
            '<xacro:macro name="a"><xacro:a/></xacro:macro><xacro:a/>',
            "arm.urdf.xacro:2:23: xacro: macros or properties call themselves without end",
        ),
        ('<xacro:macro name="a"/>${1}', "arm.urdf.xacro:1:1: the file has no <link>, only definitions"),
        ('<link name="$(env HOME)"/>', "arm.urdf.xacro:2:1: xacro: the environment variable 'HOME' is not read"),
        ("<!DOCTYPE a [<!ENTITY b 'c'>]>", "arm.urdf.xacro:2:"),
    ],
)  # fmt: skip
def test_what_cannot_be_replaced_is_an_error_with_its_place(package: Path, text: str, message: str) -> None:
    assert _refused(package, text).startswith(message)


def test_an_argument_that_the_file_does_not_have_is_an_error(package: Path) -> None:
    assert refusal(Dh2simError, _imported, package, arguments={"sped": "x"}).endswith(
        "arguments: the file has no argument 'sped'. Did you mean 'speed'? It has: long, speed"
    )
    urdf = b'<robot name="r"><link name="a"/></robot>'
    assert refusal(Dh2simError, import_data, urdf, "a.urdf", ImportOptions(arguments={"a": 1})) == (
        "a.urdf: arguments are for xacro files; this one needs no xacro"
    )


def test_only_files_below_the_root_are_read(package: Path) -> None:
    secret = package.parent.parent / "secret.yaml"
    (package / "link.yaml").symlink_to(secret)
    (package / "folder").symlink_to(secret.parent)
    only = "only files in ROOT and those below it are read"
    for path in ("../../../secret.yaml", str(secret), "../link.yaml", "../folder/secret.yaml", "/etc/passwd"):
        assert only in _refused(package, f"<link name=\"${{xacro.load_yaml('{path}')}}\"/>")
    for include in ('"../link.yaml"', '"../../../secret.yaml" optional="true"', '"/etc/*"', '"../folder/*"'):
        assert only in _refused(package, f"<xacro:include filename={include}/>")


def test_the_root_is_the_files_folder_by_default_and_the_error_says_how_to_widen_it(package: Path) -> None:
    path = package / "urdf" / "arm.urdf.xacro"
    assert refusal(Dh2simError, import_robot, path) == (
        f"{path}:5:3: xacro: no package 'my_arm' in the file's folder and those below it; "
        f"allow others with root='{package}'"
    )
    assert refusal(Dh2simError, import_robot, path, ImportOptions(root=package / "config")).startswith(f"{path}: not")
    assert refusal(Dh2simError, import_robot, path, ImportOptions(root=package / "no")) == (
        f"{package / 'no'}: no such folder, to read files in and below it"
    )


@pytest.mark.parametrize(
    "expression",
    [
        "().__class__.__base__.__subclasses__()",
        "[x.__class__ for x in [1]]",
        "(lambda: ().__class__)()",
        "(x for x in [1]).gi_frame.f_back.f_globals",
        "xacro.load_yaml.__globals__['os'].system('touch FILE')",
        "[f.__globals__ for f in [xacro.load_yaml]][0]['os'].system('touch FILE')",
        "'{0.__globals__}'.format(xacro.load_yaml)",
        "'{0._x}'.format(1)",
        "('{0.__glob' + 'als__}').format(xacro.load_yaml)",
        "str.format('{0.__globals__}', xacro.load_yaml)",
        "'{a.b}'.format_map({})",
        "f'{xacro.load_yaml.__globals__}'",
        "__import__('os').system('touch FILE')",
        "open('FILE', 'w')",
        "(a := 1)",
    ],
)
def test_no_expression_reaches_python(expression: str, tmp_path: Path) -> None:
    import xacro

    made = tmp_path / "made"
    with pytest.raises(Exception, match=r"allowed|not defined|python"):
        checked_eval(expression.replace("FILE", str(made)), dict(xacro._global_symbols))
    assert not made.exists()


@pytest.mark.parametrize(
    "expression", ["[f.__globals__ for f in [xacro.load_yaml]]", "python.vars(xacro)", "open('FILE', 'w')"]
)
@pytest.mark.parametrize("form", ["${%s}", "$(eval %s)"])
def test_no_expression_of_a_file_reaches_python(package: Path, tmp_path: Path, expression: str, form: str) -> None:
    made = tmp_path / "made"
    text = form % expression.replace("FILE", str(made))
    message = _refused(package, f'<link name="{text}"/>'.replace("'", "&apos;"))
    assert message.startswith("arm.urdf.xacro:2:1: xacro: ")
    assert not made.exists()


def test_expressions_of_everyday_files_are_evaluated(package: Path) -> None:
    expressions = {
        "sum([x*x for x in [1, 2]]) if False else 'x' + str(len([1, 2]))": "x2",
        "'%s%d' % ('y', 3)": "y3",
        "round(math.sin(radians(90)) + cos(0), 3)": "2.0",
        "' '.join(map(str, [1, 2]))": "1 2",
        "dict(a='b')['a'].upper()": "B",
        "python.sorted([2, 1])[0]": "1",
        "not True or None is None": "True",
    }
    links = "".join(f'<link name="p{i}${{{text}}}"/>' for i, text in enumerate(expressions))
    (package / "urdf" / "arm.urdf.xacro").write_text(f"<robot name='r' {XMLNS}>{links}</robot>", encoding="utf-8")
    path = package / "urdf" / "arm.urdf.xacro"
    found = xacro_module.expand(path.read_bytes(), file="a", path=path, root=None, arguments={}).robot
    assert [link.attributes["name"][2:] for link in found.all("link")] == list(expressions.values())


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("'{}_{:.1f}'.format('a', 0.5)", "a_0.5"),
        ("'{x!r:>{n}}'.format(x='a', n=4)", " 'a'"),
        ("f'{1 + 1:03d}'", "002"),
    ],
)
def test_texts_are_formatted(expression: str, value: str) -> None:
    assert checked_eval(expression, {}) == value


@pytest.mark.parametrize(
    "expression",
    [
        "'{0.__globals__}'.format(f)",
        "'{0.gi_frame}'.format(f)",
        "'{0[__x]}'.format(f)",
        "'{:{0.__class__}}'.format(f)",
        "text.format(f)",
        "str.format('{0.__globals__}', f)",
        "'{a}'.format_map({})",
        "f'{f.__globals__}'",
    ],
)
def test_formatting_looks_into_nothing(expression: str) -> None:
    message = refusal(Exception, checked_eval, expression, {"f": len, "str": str, "text": "{0.__class__}"})
    assert "allowed" in message


def test_what_xacro_warns_of_is_noted(package: Path) -> None:
    path = package / "urdf" / "arm.urdf.xacro"
    path.write_text(ARM.replace("<link", "${xacro.warning('old', 'file')}<link"), encoding="utf-8")
    assert _imported(package).notes[0] == "xacro says: old file"


def test_environment_variables_count_as_not_set(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SECRET", "12345")
    path = package / "urdf" / "arm.urdf.xacro"
    text = f'<robot {XMLNS}><link name="$(optenv SECRET none)"/></robot>'.encode()
    found = xacro_module.expand(text, file="a", path=path, root=None, arguments={}).robot
    assert [link.attributes["name"] for link in found.children] == ["none"]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="memory is limited on Linux only")
def test_a_file_that_grows_without_bound_is_stopped(package: Path) -> None:
    assert "too much memory" in _refused(package, "<link name=\"${'a' * 10**10}\"/>")


def test_very_many_joints_are_refused_before_all_of_them_are_expanded(package: Path) -> None:
    joints = "".join(f'<joint name="j{number}"/>' for number in range(1501))
    told = _refused(package, f'<xacro:macro name="all">{joints}</xacro:macro><xacro:all/>')
    assert "xacro: there are more than 1500 joints; expand the file with xacro itself" in told


@pytest.mark.slow
def test_a_file_that_never_ends_is_stopped(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(xacro_module, "TIME_LIMIT", 2)
    assert _refused(package, '<link name="${[0 for i in python.range(10**12) if i &lt; 0]}"/>') == (
        "arm.urdf.xacro:1:1: xacro cannot expand the file: it takes longer than 2 seconds"
    )


def test_without_xacro_the_error_says_where_it_is_needed_and_how_to_get_it(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dh2sim.extras._installed", lambda module: module != "xacro")
    path = package / "urdf" / "arm.urdf.xacro"
    assert refusal(MissingExtraError, _imported, package) == (
        f"{path}:5:3: found <xacro:include>: xacro needs the extra 'xacro': pip install 'dh2sim[xacro]'"
    )
