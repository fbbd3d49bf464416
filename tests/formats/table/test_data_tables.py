"""Lists, matrices and records in programs and files of data are tables too."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dh2sim.robot.magnitudes import MOST_ROWS
from dh2sim.robot.row import Convention
from tests.formats.table.samples import STANDARD, complaints, imported, modified, numbers, tool_poses, types

H = math.pi / 2
EXPECTED = [(0, 0.4, 0, H), (math.pi, 0, 0.3, math.radians(-37.3))]
"""theta, d, a, alpha of two rows."""


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("arm.py", "import numpy as np\na = [0, 0.3]\nalpha = [np.pi/2, np.deg2rad(-37.3)]\nd = np.array([0.4, 0])\n"
                   "theta = [0, np.pi]\n"),
        ("arm.py", "class Arm:\n    def __init__(self):\n        self.dh_a = (0.0, 0.3)  # m\n"
         "        self.dh_alpha = "
                   "np.deg2rad([90, -37.3])\n        self.dh_d = [0.4, 0.0]\n"
                   "        self.theta_offsets = [0, math.pi]\n"),
        ("arm.m", "a = [0 0.3];\nalpha = [90 -37.3]*pi/180;\nd = [0.4, 0];\ntheta = [0 pi]; % rad\n"),
        ("arm.cpp", "const double a[2] = {0.0, 0.3};\nconst double alpha[2] = {M_PI_2, -37.3*deg};\n"
                    "double d[] = {0.4f, 0.f};\nstatic double theta[N] = {0, M_PI};\n"),
        ("arm.yaml", "robot: x\ndh_a: [0, 0.3]\ndh_alpha_deg: [90, -37.3]\ndh_d: [0.4, 0]\ndh_theta_deg: [0, 180]\n"),
        ("arm.json", '{"name": "x", "a": [0, 0.3], "alpha": ["pi/2", "-37.3°"],\n "d": [0.4, 0], '
         '"theta": ["0", "pi"]}'),
        ("arm.py", "# theta, d, a, alpha\nDH = np.array([\n    [0, 0.4, 0, np.pi/2],  # shoulder\n"
                   "    [np.pi, 0, 0.3, np.radians(-37.3)],\n])\n"),
        ("arm.py", "dh_params = [[0, 0.4, 0, pi/2],   # [theta, d, a, alpha]\n             [pi, 0, 0.3, "
         "-37.3*deg]]\n"),
        ("arm.m", "%  theta   d     a     alpha\ndhparams = [0  0.4  0  pi/2;\n  pi 0 0.3 -37.3*deg];\n"),
        ("arm.cpp", "// a alpha d theta\ndouble dh[2][4] = {{0, M_PI/2, 0.4, 0}, {0.3, -37.3*DEG, 0, M_PI}};"),
        ("arm.m", "dhparams = [0 pi/2 0.4 0\n 0.3 -37.3*deg 0 pi];\nsetFixedTransform(jnt1,dhparams(1,:),'dh');\n"),
        ("arm.m", "j1 = rigidBodyJoint('j1','revolute');\nsetFixedTransform(j1,[0 pi/2 0.4 0],'dh');\n"
         "j2 = rigidBodyJoint('j2', 'revolute');\nsetFixedTransform(j2, [0.3, -37.3*deg, 0, pi], \"dh\");\n"),
        ("arm.m", "% DH = [theta d a alpha]\nDH = [q(1) 0.4 0 pi/2; q(2)+pi 0 0.3 -37.3*deg];\n"),
        ("arm.m", "% columns are theta, d, a, alpha\nDH = [q1 0.4 0 pi/2; q2+pi 0 0.3 -37.3*deg];\n"),
        ("arm.cpp", "// SI units: theta, d, a, alpha\nL = {{0, 0.4, 0, M_PI/2}, {M_PI, 0, 0.3, -37.3*deg}};\n"),
        ("arm.py", "# a, alpha, d, theta (standard)\nT = [(0, pi/2, 0.4, q1), (0.3, -37.3*deg, 0, q2 + pi)]\n"),
        ("arm.py", "def fk(q):\n    # theta, d, a, alpha\n    table = [[q[0], 0.4, 0, np.pi/2],\n"
                   "             [self.q[1] + np.pi, 0, 0.3, np.deg2rad(-37.3)]]\n"),
        ("arm.json", '{"links": [{"a": 0, "alpha": "90 deg", "d": 0.4, "theta": 0, "limits": [-1, 1]},\n'
                     '{"a": 0.3, "alpha": "-37.3 deg", "d": 0, "theta": "pi"}]}'),
        ("arm.py", "table = [dict(theta=0, d=0.4, a=0, alpha=math.pi/2),\n    {'theta': np.pi, 'a': 0.3, 'd': None, "
                   "'alpha': np.deg2rad(-37.3)}]\n"),
        ("arm.py", "links = [DHParam(a=0., alpha=pi/2, d=0.4, theta=0), DHParam(a=.3, alpha=-37.3*deg, "
         "d=0, theta=pi)]\n"),
        ("arm.yaml", "joints_dh:\n  - a: 0\n    alpha: pi/2\n    d: 0.4\n    theta: 0\n  - a: 0.3\n"
         "    alpha: -37.3 deg\n"
                     "    d: 0  # m\n    theta: pi\n"),
        ("arm.yaml", "dh:\n  joint1: {a: 0, alpha: pi/2, d: 0.4, theta: 0}\n  joint2: {a: 0.3, "
         "alpha: -37.3°, d: 0, theta: pi}\n"),
        ("arm.yml", "joint1:\n  a: 0\n  alpha: pi/2\n  d: 0.4\n  theta: 0\njoint2:\n  a: 0.3\n"
         "  alpha: -37.3 deg\n  d: 0\n"
                    "  theta: pi\n"),
        ("arm.toml", "[[joint]]\na = 0\nalpha = 'pi/2'\nd = 0.4\ntheta = 0\n\n[[joint]]\na = 0.3\n"
         "alpha = '-37.3 deg'\nd = 0\n"
                     "theta = 'pi'\n"),
        ("README.md", "# Arm\n\n```python\na = [0, 0.3]\nalpha = [pi/2, -37.3*deg]\nd = [0.4, 0]\n"
         "theta = [0, pi]\n```\n"),
    ],
)  # fmt: skip
def test_lists_matrices_and_records_are_read(file: str, text: str) -> None:
    found = numbers(imported(text, file, **STANDARD).spec)
    assert found == [pytest.approx(row, rel=1e-15) for row in EXPECTED]


def test_matlabs_fixed_transforms_say_convention_and_types() -> None:
    text = "t = rigidBodyJoint('t','revolute');\nsetFixedTransform(t,[0 0 0.4 0],'mdh');\n"
    text += "s = rigidBodyJoint('s','prismatic');\nsetFixedTransform(s,[0.3 pi/2 0 pi],'mdh');\n"
    found = imported(text, "arm.m")
    assert (found.spec.convention, types(found.spec)) == (Convention.MODIFIED, "rp")
    assert numbers(found.spec) == [(0, 0.4, 0, 0), (math.pi, 0, 0.3, H)]
    assert any("setFixedTransform ignores theta" in note for note in found.notes)


def test_constructors_of_a_toolbox_in_a_loop_are_no_records() -> None:
    text = "links = []\nfor d, a, alpha in rows:\n    links.append(RevoluteDH(d=d, a=a, alpha=alpha))\n"
    text += "arm = DHRobot(links)\n"
    assert "not read: write them one after the other" in complaints(text, "arm.py")[0]


def test_values_of_a_list_may_be_symbols_and_types_have_a_list_of_their_own() -> None:
    text = "d1 = 0.4\na2 = 0.3\nd = [d1, 0]\na = [0, a2]\nalpha = [pi/2, 0]\n"
    text += "joint_types = ['R', 'P']\nq_min = [-pi, 0]\nq_max = [pi, 1]"
    spec = imported(text, "arm.py", **STANDARD).spec
    assert (types(spec), [row.limits.position for row in spec.rows]) == ("rp", [(-math.pi, math.pi), (0, 1)])
    assert numbers(spec) == [(0, 0.4, 0, H), (0, 0, 0.3, 0)]


KUKA = """\
# Create Modified DH parameters
s = {alpha0:     0, a0:      0, d1:  0.75, q1:           q1,
     # the shoulder
     alpha1: -pi/2, a1:   0.35, d2:     0, q2:      q2-pi/2,
     alpha2:     0, a2:   1.25, d3:     0, q3:           q3,
     alpha3: -pi/2, a3: -0.054, d4:   1.5, q4:           q4,
     alpha4:  pi/2, a4:      0, d5:     0, q5:           q5,
     alpha5: -pi/2, a5:      0, d6:     0, q6:           q6,
     alpha6:     0, a6:      0, d7: 0.303, q7:            0}
"""


def test_a_dictionary_of_numbered_names_is_a_table_of_craigs() -> None:
    found, q = imported(KUKA, "IK_server.py"), (0.3, -0.5, 0.7, 0.2, -0.9, 1.1)
    expected = modified(q[0], 0.75, 0, 0) @ modified(q[1] - H, 0, 0.35, -H) @ modified(q[2], 0, 1.25, 0)
    expected = expected @ modified(q[3], 1.5, -0.054, -H) @ modified(q[4], 0, 0, H) @ modified(q[5], 0, 0, -H)
    np.testing.assert_allclose(tool_poses(found.spec, [q])[0], expected @ modified(0, 0.303, 0, 0), atol=1e-14)
    assert (found.spec.convention, types(found.spec)) == (Convention.MODIFIED, "rrrrrrf")


def test_a_number_that_a_dictionary_leaves_out_is_refused() -> None:
    assert complaints(KUKA.replace("d3:     0, ", ""), "a.py") == ["a.py:2:18: d3 is not given"]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a = [0, 1]\nalpha = [0, pi]\nd = [0.4]\n", ["t.py:3:1: d has 1 values, and other lists 2"]),
        ("DH = [[0, 0.4, 0, 1], [1, 0, 0.3, 0]]\n",
         ["t.py:1:1: this may be a DH table, "
         "and nothing says which column is what; write a comment above it, such as "
          "'# theta d a alpha'"]),
        ("a = [0, 1]\nalpha = [0, 'x']\nd = [0.4, 0]\n",
         ["t.py:2:13: row 2, alpha: the symbol 'x' has no value; write the number, "
         "or give its value in the text around the "
          "table, such as 'x = 0.4 m'"]),
    ],
)  # fmt: skip
def test_what_is_wrong_with_data_has_its_place(text: str, expected: list[str]) -> None:
    assert complaints(text, "t.py", **STANDARD) == expected


def test_three_lists_that_have_other_names_are_no_table() -> None:
    for text in ("a = [1, 2]\nb = [3, 4]\nc = [5, 6]\n", "x = {'a': 1, 'b': 2}\n", "M = [[1,0,0,0],[0,1,0,0]]"):
        assert "no table of Denavit-Hartenberg parameters found" in complaints(text, "t.py")[0]


def test_a_file_of_too_many_records_is_refused() -> None:
    text = "- a: 0\n  alpha: 0\n  d: 0\n  theta: 0\n" * (MOST_ROWS + 1)
    assert complaints(text, "t.yaml", **STANDARD) == [f"t.yaml:1:6: the table has more than {MOST_ROWS} rows"]
