"""MATLAB scripts for Corke's toolbox, read as text, move as the toolbox's own formulas say."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dh2sim.robot.row import Convention
from dh2sim.robot.units import LengthUnit
from dh2sim.typing import Array
from tests.formats.table.samples import complaints, imported, modified, numbers, standard, tool_poses, types

H = math.pi / 2
LINKS = """\
% Link([theta d a alpha])
L(1) = Link([0 0.615 0   0], 'modified');
L(2) = Link([0 0   0.1 -pi/2], 'modified');
L(3) = Link([0 0   0.705 0], 'modified');
L(2).offset = -pi/2;
R = SerialLink(L, 'name', 'r');
"""
PUMA = """\
clear L
deg = pi/180;   % degrees to radians; don't use L here: L(9) = Link([1 2 3 4])
%{
L(7) = Link([1 2 3 4]);
%}
L(1) = Revolute('d', 0, ...   % link length (Denavit-Hartenberg notation)
    'a', 0, ...               % joint's offset
    'alpha', pi/2, ...        % link twist
    'I', [0, 0.35, 0, 0, 0, 0], 'r', [0, 0, 0], 'm', 0, ...
    'Tc', [0.395 -0.435], ... % friction
    'qlim', [-160 160]*deg ); % minimum and maximum joint angle
L(2) = Revolute('d', 0, 'a', 0.4318, 'alpha', 0, 'qlim', [-45 225]*deg, 'flip');
L(3) = Prismatic('theta', 0.3, 'a', 0.0203, 'alpha', -37.3*deg, 'offset', 0.15005, 'qlim', [0 0.4]);
p560 = SerialLink(L, 'name', 'Puma 560', ...
    'manufacturer', 'Unimation', 'comment', 'viscous friction; params of 8/95');
p560.tool = transl(0,0,0.1)*trotx(90, 'deg');
p560.base = transl([0.1 0.2 0.3])*trotz(deg2rad(20));
qz = [0 0 0];
"""
JACO = """\
function r = mdl_arm()
    deg = pi/180;
    D1 = 0.2755; D2 = 0.4100; D3 = 0.2073; D4 = 0.0743; e2 = 0.0098;
    aa = 30*deg; sa = sin(aa); s2a = sin(2*aa);
    d4b = D3 + sa/s2a * D4;
    robot = SerialLink([
        Revolute('alpha', pi/2,  'a', 0,  'd', D1,   'flip')
        Revolute('alpha', pi,    'a', D2, 'd', 0,    'offset', -pi/2)
        RevoluteMDH('alpha', 2*aa,  'a', 0,  'd', -d4b)
        ], ...
        'name', 'Jaco', 'manufacturer', 'Kinova');
    if nargin == 1
        r = robot;
    end
end
"""


def _turn(axis: str, angle: float) -> Array:
    s, c = math.sin(angle), math.cos(angle)
    T = np.eye(4)
    i, k = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    T[i, i], T[i, k], T[k, i], T[k, k] = c, -s, s, c
    return T


def _shift(x: float, y: float, z: float) -> Array:
    T = np.eye(4)
    T[:3, 3] = (x, y, z)
    return T


def _check(text: str, expected: Array, q: tuple[float, ...], file: str = "arm.m") -> None:
    np.testing.assert_allclose(tool_poses(imported(text, file).spec, [q])[0], expected, atol=1e-14)


def test_links_of_a_vector_and_a_later_offset() -> None:
    q = (0.3, -0.5, 0.7)
    expected = modified(q[0], 0.615, 0, 0) @ modified(q[1] - H, 0, 0.1, -H) @ modified(q[2], 0, 0.705, 0)
    _check(LINKS, expected, q)
    spec = imported(LINKS, "arm.m").spec
    assert (spec.convention, spec.description, spec.source) == (Convention.MODIFIED, "r", "arm.m, line 2")


def test_named_arguments_limits_flips_base_and_tool() -> None:
    q = (0.3, -0.5, 0.2)
    base, tool = _shift(0.1, 0.2, 0.3) @ _turn("z", math.radians(20)), _shift(0, 0, 0.1) @ _turn("x", H)
    rows = standard(q[0], 0, 0, H) @ standard(-q[1], 0, 0.4318, 0)
    rows = rows @ standard(0.3, q[2] + 0.15005, 0.0203, math.radians(-37.3))
    _check(PUMA, base @ rows @ tool, q)
    found = imported(PUMA, "puma.m")
    assert types(found.spec) == "rrp"
    assert [row.limits.position for row in found.spec.rows] == [
        pytest.approx((-math.radians(160), math.radians(160))),
        pytest.approx((-math.radians(45), math.radians(225))),
        (0, 0.4),
    ]
    assert "of the links, I, Tc, m, r were not read" in found.notes


def test_links_in_brackets_on_lines_of_their_own_in_a_function() -> None:
    text = JACO.replace("RevoluteMDH", "Revolute")
    q, d4b = (0.3, -0.5, 0.7), 0.2073 + math.sin(math.pi / 6) / math.sin(math.pi / 3) * 0.0743
    expected = standard(-q[0], 0.2755, 0, H) @ standard(q[1] - H, 0, 0.41, math.pi)
    _check(text, expected @ standard(q[2], -d4b, 0, math.pi / 3), q)


def test_links_of_both_conventions_are_refused() -> None:
    assert complaints(JACO, "arm.m") == [
        "arm.m:9:9: some links are standard and others modified; a robot has only one of them"
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("DH = [0 0.4 0 pi/2; 0 0 0.3 0 ];\nr = SerialLink(DH, 'modified')", [(0.4, 0, H), (0, 0.3, 0)]),
        ("r = SerialLink([0, 0.4, 0, pi/2\n 0, 0, 0.3, 0])", [(0.4, 0, H), (0, 0.3, 0)]),
        ("L{1} = link([ pi/2 0 0 0.4 0], 'standard');\nL{2} = link([0 0.3 0 0]);\nr = robot(L);",
         [(0.4, 0, H), (0, 0.3, 0)]),
        ("d = [0.4 0]; a = [0, 0.3]; alpha = [90; 0]*pi/180;\nL1 = Link('d', d(1), 'a', a(1), 'alpha', alpha(1));\n"
         "L2 = Link('d', d(end), 'a', a(2), 'alpha', alpha(2));\nr = SerialLink([L1 L2]);",
         [(0.4, 0, H), (0, 0.3, 0)]),
        ("L = [Link([0 .4 0 pi/2]), Link([0 0 3e-1 0])];", [(0.4, 0, H), (0, 0.3, 0)]),
        ("L = [Link([0 .4 0 pi/2])\nLink([0 -1+1 .1 - -.2 0])];", [(0.4, 0, H), (0, 0.3, 0)]),
        ("p.d1 = 0.4; p.a2 = 2*0.15;\nL(1) = Link('revolute','d',p.d1,'a',0,'alpha',pi/2,'standard');\n"
         "L(2) = Link('d',0,'a',p.a2,'alpha',0);", [(0.4, 0, H), (0, 0.3, 0)]),
        ("syms q1 q2\nL1 = Link([q1 0.4 0 pi/2]);\nL2 = Link([q2 0 0.3 0]);\nbot = SerialLink([L1, L2]);",
         [(0.4, 0, H), (0, 0.3, 0)]),
        ("L(1) = Link([0 0.4 0 pi/2]); L(end+1) = Link([0 0 0.3 0]);\nfor i = 1:2, disp(i), end\nSerialLink(L)",
         [(0.4, 0, H), (0, 0.3, 0)]),
        ("DH = [0 0.4 0 pi/2; 0 0 0.3 0];\nL(1) = Link(DH(1,:));\n"
         "L(2) = Link('d', DH(2,2), 'a', DH(2,3), 'alpha', 0);",
         [(0.4, 0, H), (0, 0.3, 0)]),
    ],
)  # fmt: skip
def test_links_as_people_write_them(text: str, expected: list[tuple[float, float, float]]) -> None:
    found = [(d, a, alpha) for _, d, a, alpha in numbers(imported(text, "arm.m").spec)]
    assert found == [pytest.approx(row, rel=1e-15) for row in expected]
    assert numbers(imported(f"# Arm\n\n```matlab\n{text}\n```\n").spec) == numbers(imported(text, "arm.m").spec)


LOOPS = [
    "dh = [0 0.4 0 pi/2; 0 0 0.3 0];\nfor i = 1:size(dh, 1)\n    L(i) = Link(dh(i,:), 'standard');\nend",
    "d = [0.4 0]; a = [0 0.3]; alpha = [pi/2 0]; L = [];\nfor k = (1:length(d))\n  L = [L Link('d', d(k), 'a', a(k), "
    "'alpha', alpha(k))];\nend\nr = SerialLink(L);",
    "n = 2; DH = [0.4 0 pi/2; 0 0.3 0];\nfor (i = n:-1:1)\n  for j = 1:3, x(j) = DH(i, j); end\n"
    "  links{i} = Revolute('d', x(1), 'a', x(2), 'alpha', x(3));\nendfor\nr = SerialLink([links{1} links{2}]);",
    "L(1) = Link([0 0 0.3 0]); L(2) = L(1);\nfor i=1:2 if i > 7, disp(i), end, end\nfor s = [0.4 9]\n  t = s\nend\n"
    "for i=1:1 L(1) = Link([0 .4 0 pi/2]); end",
    "for i = 1:1e9, x = i; end\nL(1) = Link([0 .4 0 pi/2]); L(2) = Link([0 0 .3 0]);",
]


@pytest.mark.parametrize("text", LOOPS)
def test_loops_over_numbers_are_followed(text: str) -> None:
    found = [(d, a, alpha) for _, d, a, alpha in numbers(imported(text, "arm.m").spec)]
    assert found == [pytest.approx((0.4, 0, H)), pytest.approx((0, 0.3, 0))]


@pytest.mark.parametrize(
    "loop",
    [
        "for i = 1:n",
        "for i = 1:0.5:2",
        "while i < 3",
        "for i = 1:2, if x, break, end",
        "for i = 1:1000000",
        "for i = 1:2:3:4",
        "for i = 1:0:2",
        "for",
    ],
)
def test_links_in_other_loops_are_refused(loop: str) -> None:
    text = f"{loop}\n  L(i) = Link([0 0.4 0 0]);\nend\nr = SerialLink(L);"
    [complaint] = complaints(text, "arm.m")
    assert complaint == (
        "arm.m:2:3: links that are made or changed in a loop are not read: write them one after the other"
    )


def test_theta_of_a_revolute_link_is_left_out_as_the_toolbox_does_and_noted() -> None:
    found = imported("L(1) = Link([0.5 0.4 0 0]);\nL(2) = Link([0.5 0.4 0 0 1]);", "arm.m")
    assert numbers(found.spec) == [(0, 0.4, 0, 0), (0.5, 0, 0, 0)]
    assert found.notes[:2] == (
        "row 1: theta is the joint's coordinate, and its value 0.5 was left out, as the toolbox does; an offset is "
        "given by offset",
        "row 2: d is the joint's coordinate, and its value 0.4 was left out, as the toolbox does; an offset is "
        "given by offset",
    )


def test_a_script_in_millimetres_asks_for_the_unit_and_its_tool_is_in_the_same() -> None:
    text = "L(1) = Link([0 290 0 pi/2]);\nr = SerialLink(L, 'tool', transl(0, 0, 72));"
    [complaint] = complaints(text, "arm.m")
    assert "'290.0' is a length, and nothing says in which unit" in complaint
    spec = imported(text, "arm.m", length=LengthUnit.MM).spec
    assert (spec.rows[0].d, spec.tool.xyz.tolist()) == (0.29, [0, 0, 0.072])


def test_two_robots_of_a_script_are_two_tables() -> None:
    text = "L = Link([0 0.4 0 0]);\na = SerialLink(L, 'name', 'left');\nb = SerialLink(L, 'name', 'right');\n"
    text += "b.base = transl(0, 0, 1)*rpy2tr(0, 0, pi/4, 'xyz');"
    assert imported(text, "arm.m").spec.description == "left"
    right = imported(text, "arm.m", table=2).spec
    assert right.description == "right"
    np.testing.assert_allclose(
        tool_poses(right, [[0.3]])[0],
        _shift(0, 0, 1) @ _turn("x", math.pi / 4) @ standard(0.3, 0.4, 0, 0),
        atol=1e-15,
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("for i=1:2\n  L(i) = Link([0 d(i) 0 0]);\nend\nr = SerialLink(L);",
         ["arm.m:2:10: d: the function 'd' on line 2 is not known"]),
        ("if x\n  L(1) = Link([0 1 0 0]);\nend\nr = SerialLink(L);",
         ["arm.m:2:3: links that are made or changed in a condition are not read: write them one after the other"]),
        ("L(1) = Link([0 d1 0 0]);\nr = SerialLink(L);",
         ["arm.m:1:8: d: 'd1' has no value; give it one above, such as d1 = 0.4;"]),
        ("d1 = input('d1');\nL(1) = Link([0 d1 0 0]);",
         ["arm.m:2:8: d: the function 'input' on line 1 is not known"]),
        ("d1 = 0.4;\nif x, d1 = 0.5; end\nL(1) = Link([0 d1 0 0]);",
         ["arm.m:3:8: d: 'd1' is set in the condition on line 2, which is not followed"]),
        ("L(1) = Link([0 1 0]);", ["arm.m:1:8: a link has at least four numbers, theta, d, a and alpha; found 3"]),
        ("L(1) = Link([0 1 0 0]);\nr = SerialLink(L, 'tool', tool0());",
         ["arm.m:2:5: tool: the function 'tool0' on line 2 is not known"]),
        ("L(1) = Link([0 1 0 0]);\nr = SerialLink(L);\nr.tool = [1 0 0 0; 0 1 0 0; 0 0 2 0; 0 0 0 1];",
         ["arm.m:3:1: tool: the matrix is not a pose: its first three rows and columns are not a rotation"]),
        ("L(1) = Link([0 1 0 0]);\nr = SerialLink(L);\nr.base = rpy2tr(0, 0, 1);",
         ["arm.m:3:1: roll, pitch and yaw are in an order that differs between toolboxes: write 'zyx' or "
          "'xyz' there"]),
        ("L(1) = Link('d', 1, 'theta', 0, 'a', 0, 'alpha', 0);",
         ["arm.m:1:1: row 1: theta and d are both given: one of them is the joint's coordinate; leave that one out"]),
        ("L(1) = Link([0 1 0 0]);\nL(1).alpha = beta0;",
         ["arm.m:2:1: alpha: 'beta0' has no value; give it one above, such as beta0 = 0.4;"]),
        ("L(2) = Link([0 1 0 0]);\nr = SerialLink(L);",
         ["arm.m:2:5: the links cannot be read: element 1 of 'L' is not given"]),
        ("r = SerialLink(L);",
         ["arm.m:1:5: the links cannot be read: 'L' has no value; give it one above, such as L = 0.4;"]),
        ("L(1) = Link([0 1 0 0], 'alpha');", ["arm.m:1:8: 'alpha' has no value"]),
        ("L(1) = Link([0 1 0 0", ["arm.m:1:20: a bracket is never closed"]),
        ("L(1) = Link('d', 1/0, 'a', 0, 'alpha', 0)", ["arm.m:1:8: d: float division by zero"]),
    ],
)  # fmt: skip
def test_what_cannot_be_read_of_a_robot_is_refused_with_its_place(text: str, expected: list[str]) -> None:
    assert complaints(text, "arm.m") == expected


def test_nothing_of_a_script_is_run() -> None:
    text = "system('touch /tmp/x'); eval('1'); L(1) = Link([0 0.4 0 0]); delete('a'); !rm -r b\nSerialLink(L)"
    assert numbers(imported(text, "arm.m").spec) == [(0, 0.4, 0, 0)]


def test_a_list_of_links_that_holds_itself_is_refused() -> None:
    text = "L(1) = Link([0 1 0 0]);\nL(2) = L;\nr = SerialLink(L);"
    assert complaints(text, "arm.m") == ["arm.m:3:5: expected links, found a list"]
