"""Python scripts for Corke's toolbox, read as text, move as the toolbox's own formulas say."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dh2sim.robot.row import Convention
from tests.formats.table.samples import complaints, imported, modified, numbers, standard, tool_poses, types
from tests.formats.table.test_matlab_script import _shift, _turn

H = math.pi / 2
MODEL = '''\
import numpy as np
from roboticstoolbox import DHRobot, RevoluteDH
from spatialmath import SE3


class Puma560(DHRobot):
    """
    A model: RevoluteDH(d=9, alpha=0)
    """

    def __init__(self, symbolic=False):
        if symbolic:
            import spatialmath.base.symbolic as sym
            zero = sym.zero()
            pi = sym.pi()
        else:
            from math import pi
            zero = 0.0
        deg = pi / 180
        base = 26.45 * 0.0254  # from mounting surface to shoulder axis
        L = [
            RevoluteDH(d=base, a=0, alpha=pi / 2, I=[0, 0.35, 0, 0, 0, 0], qlim=[-160 * deg, 160 * deg]),
            RevoluteDH(d=0, a=0.4318, alpha=zero, qlim=[-110 * deg, 110 * deg], flip=True, offset=np.deg2rad(30)),
            RevoluteDH(d=0.15005, a=0.0203, alpha=-pi / 2, qlim=np.array([-135, 135]) * deg),
        ]
        super().__init__(
            L, name="Puma 560", manufacturer="Unimation", tool=SE3(0, 0, 0.1) * SE3.Rx(90, "deg"), symbolic=symbolic
        )
        self.qr = np.array([0, pi / 2, -pi / 2])
        self.addconfiguration("qr", np.array([0, pi / 3, -pi / 2]))
        self.addconfiguration("far", [0, 9, 0])


if __name__ == "__main__":
    puma = Puma560(symbolic=False)
    print(puma)
'''
SCRIPT = """\
import roboticstoolbox as rtb
from math import pi, radians as rad
import numpy as np
d1, a2 = 0.4, 0.3
robot = rtb.DHRobot([
    rtb.RevoluteMDH(d=d1, alpha=np.pi/2),
    rtb.PrismaticMDH(theta=0.1, a=a2, alpha=rad(37.3), qlim=[0, 1]),
], name="x")
robot.tool = SE3.Trans(0, 0, 0.2) @ SE3.RPY([10, 20, 30], unit="deg", order="xyz")
robot.base = np.array([[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])
robot.links[0].offset = pi/2
"""


def test_a_model_in_the_toolboxs_own_style() -> None:
    found, q = imported(MODEL, "puma.py"), (0.3, -0.5, 0.7)
    expected = (
        standard(q[0], 26.45 * 0.0254, 0, H)
        @ standard(-q[1] + math.radians(30), 0, 0.4318, 0)
        @ standard(q[2], 0.15005, 0.0203, -H)
        @ _shift(0, 0, 0.1)
        @ _turn("x", H)
    )
    np.testing.assert_allclose(tool_poses(found.spec, [q])[0], expected, atol=1e-14)
    assert found.spec.description == "Puma 560"
    assert found.spec.rows[2].limits.position == (-135 * (math.pi / 180), 135 * (math.pi / 180))
    assert {name: q.tolist() for name, q in found.spec.configurations.items()} == {"qr": [0, math.pi / 3, -H]}
    assert "of the links, I was not read" in found.notes
    assert "the configuration 'far' was left out: it is outside the limits of joint_2" in found.notes


def test_a_script_with_poses_set_afterwards() -> None:
    found, q = imported(SCRIPT, "arm.py"), (0.3, 0.6)
    tool = _turn("x", math.radians(30)) @ _turn("y", math.radians(20)) @ _turn("z", math.radians(10))
    expected = (
        _shift(1, 2, 3)
        @ modified(q[0] + H, 0.4, 0, H)
        @ modified(0.1, q[1], 0.3, math.radians(37.3))
        @ _shift(0, 0, 0.2)
        @ tool
    )
    np.testing.assert_allclose(tool_poses(found.spec, [q])[0], expected, atol=1e-14)
    assert (types(found.spec), found.spec.convention) == ("rp", Convention.MODIFIED)


@pytest.mark.parametrize(
    "text",
    [
        "robot = DHRobot([RevoluteDH(d=0.4, alpha=pi/2), RevoluteDH(a=0.3)])",
        "L = [RevoluteDH(0.4, 0, pi/2), RevoluteDH(0, 0.3)]",
        "L = []\nL.append(RevoluteDH(d=0.4, alpha=math.radians(90)))\nL += [RevoluteDH(a=0.3)]\nr = DHRobot(L)",
        "l1 = RevoluteDH(d=.4, alpha=np.deg2rad(90))\nl2 = RevoluteDH(a=30e-2)\nr = DHRobot([l1, l2], name='x')",
        "a = np.array([0, 300]) / 1000\nr = DHRobot([DHLink(0.4, pi/2), DHLink(a=a[-1], sigma=0)])",
        "class R:\n    def make(self, a2=0.3):\n"
        "        return DHRobot([RevoluteDH(d=0.4, alpha=pi/2), RevoluteDH(a=a2)])",
        "%matplotlib inline\n!pip install roboticstoolbox-python\nprint 'x'\n"
        "r = DHRobot([RevoluteDH(d=0.4, alpha=pi/2), RevoluteDH(a=0.3)])",
        "links = [RevoluteDH(d=0.4, alpha=pi/2)] + [RevoluteDH(a=0.3)]\nfor q in links: print(q)\nr = DHRobot(links)",
        "d = [0.4, 0]\na = [0, .3]\nalpha = np.radians([90, 0])\n"
        "r = DHRobot([RevoluteDH(d=d[i], a=a[i], alpha=alpha[i]) for i in range(len(d))])",
        "L = []\nfor d, a, alpha in np.array([[0.4, 0, 90], [0, .3, 0]]):\n"
        "    L.append(RevoluteDH(d=d, a=a, alpha=np.deg2rad(alpha)))\nr = DHRobot(L)",
        "L = []\nfor i, (d, a) in enumerate(zip([0.4, 0], [0, .3])):\n    L += [RevoluteDH(d, a, (1 - i) * pi / 2)]\n"
        "r = DHRobot(L)",
        "L = []\nfor d, a, alpha in [(0.4, 0, pi/2), (0, .3, 0)]:\n    L.extend([RevoluteDH(d, a, alpha)])\n"
        "r = DHRobot(L)",
        "L = [RevoluteDH(a=0.3)]\nL.insert(0, RevoluteDH(d=0.4, alpha=pi/2))\nr = DHRobot(L)",
        "L = [RevoluteDH(a=0.3), RevoluteDH(d=0.4, alpha=pi/2)]\nL.reverse()\nr = DHRobot(L)",
        "def f(n):\n    return [0.0] * n\nd = [0.4, 0]; d[1] = 0.0\n"
        "r = DHRobot([RevoluteDH(d[0], 0, pi/2), RevoluteDH(d[1], .3)])",
    ],
)
def test_links_as_people_write_them(text: str) -> None:
    expected = [(0, 0.4, 0, H), (0, 0, 0.3, 0)]
    assert numbers(imported(text, "arm.py").spec) == expected
    assert numbers(imported(f"# Arm\n\n```python\n{text}\n```\n\nThe end.\n").spec) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("L = [RevoluteDH(d=d) for d in read()]\nr = DHRobot(L)",
         ["arm.py:1:5: links that are made in a loop are not read: write them one after the other"]),
        ("L = []\nfor d in read():\n    L.append(RevoluteDH(d=d))\nr = DHRobot(L)",
         ["arm.py:3:14: links that are made or changed in a loop are not read: write them one after the other",
          "arm.py:4:5: there are no links"]),
        ("r = DHRobot([RevoluteDH(d=d1)])",
         ["arm.py:1:14: d: 'd1' has no value; give it one above, such as d1 = 0.4"]),
        ("def f(d1):\n    return DHRobot([RevoluteDH(d=d1)])",
         ["arm.py:2:21: d: 'd1' is an argument without a value"]),
        ("r = DHRobot([RevoluteDH(d=1)])\nr.tool = make_tool()",
         ["arm.py:2:1: tool: the function 'make_tool' on line 2 is not known"]),
        ("r = DHRobot([RevoluteDH(d=1), PrismaticMDH()])",
         ["arm.py:1:31: some links are standard and others modified; a robot has only one of them"]),
        ("r = DHRobot([RevoluteDH(d=1)\n", ["arm.py:1:13: this cannot be read as Python: '[' was never closed"]),
        ("L = [RevoluteDH(), RevoluteDH()]\nL.pop()\nr = DHRobot(L)",
         ["arm.py:2:1: what 'pop' does to a list of links is not read"]),
        ("r = DHRobot([RevoluteDH(**p)])", ["arm.py:1:14: arguments behind ** cannot be read"]),
        ("r = DHRobot([RevoluteDH(d=9**9**9)])", ["arm.py:1:14: d: the number is too large"]),
        ("r = DHRobot([RevoluteDH(d=[1] * (1e308 * 10))])", ["arm.py:1:14: d: a list times something is not read"]),
        ("r = DHRobot([RevoluteDH(qlim=[1])])", ["arm.py:1:14: qlim: expected two numbers, found 1"]),
        ("r = DHRobot([RevoluteDH(d=sqrt(1, 2))])",
         ["arm.py:1:14: d: math.sqrt() takes exactly one argument (2 given)"]),
        ("r = DHRobot([])", ["arm.py:1:5: there are no links"]),
    ],
)  # fmt: skip
def test_what_cannot_be_read_of_a_robot_is_refused_with_its_place(text: str, expected: list[str]) -> None:
    assert complaints(text, "arm.py") == expected


def test_loops_in_loops_are_followed_only_so_far() -> None:
    text = "L = []\nfor i in range(100):\n    for j in range(100):\n        L.append(RevoluteDH(d=i))\nr = DHRobot(L)"
    assert any("are not read: write them one after the other" in found for found in complaints(text, "arm.py"))
    assert "not read" in complaints("L = [RevoluteDH() for i in range(10**15)]\nr = DHRobot(L)", "arm.py")[0]


def test_a_script_nested_without_end_is_refused() -> None:
    for inside in ("(" * 5000, "-" * 50_000 + "1)", "1+" * 20_000 + "1)"):
        assert len(complaints(f"L = [RevoluteDH(d={inside}", "arm.py")) == 1


def test_nothing_of_a_script_is_run() -> None:
    text = (
        "import os\nos.remove('x')\n__import__('os')\nL = [RevoluteDH(d=0.4)]\nexec('1')\nr = DHRobot(L)\nr.plot(q)\n"
    )
    assert numbers(imported(text, "arm.py").spec) == [(0, 0.4, 0, 0)]
