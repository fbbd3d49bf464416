from __future__ import annotations

import re

import numpy as np
import pytest

from dh2sim.importing.explain import explanation
from dh2sim.importing.result import Imported
from dh2sim.importing.sources import ImportOptions, import_data
from dh2sim.kinematics.serial_chain import serial_link_poses
from dh2sim.robot.row import Convention
from dh2sim.robot.units import AngleUnit, LengthUnit
from dh2sim.typing import Array
from tests.importing.axes_samples import MODIFIED, SLIDE, STANDARD, TURN, Axis, made_of, random_axes

UP, DOWN, X, Y = (0, 0, 1), (0, 0, -1), (1, 0, 0), (0, 1, 0)
LEANING = (0.0, -np.sin(np.radians(37.3)), np.cos(np.radians(37.3)))
OPTIONS = ImportOptions(convention=STANDARD, angle=AngleUnit.DEG, length=LengthUnit.M)
COLUMN: Axis = (TURN, (0, 0, 0), UP)


def explained(imported: Imported) -> dict[str, str]:
    """The paragraphs by their labels, each on one line; sliding joints' sentences together."""
    found: dict[str, str] = {"": ""}
    label = ""
    for line in explanation(imported):
        if len(line) > 10 and line[9] == " " and re.match(r"(z axes|sliding|frame \d+|residual) ", line):
            label = line[:10].strip()
        text = line[10:] if label else line
        found[label] = f"{found.get(label, '')} {text.strip()}".strip()
    return found


@pytest.mark.parametrize(
    ("axis", "expected"),
    [
        (
            (TURN, (0, 0, 0.4), LEANING),
            "z0 and z1 intersect at 37.3 degrees, at o1 = (0, 0, 0.4). x1, +x, is normal to both. theta1 = 0, d1 "
            "= 0.4, a1 = 0, alpha1 = 37.3.",
        ),
        (
            (TURN, (0, 0, 0.2), X),
            "z0 and z1 intersect at right angles, at o1 = (0, 0, 0.2). x1, +y, is normal to both. Either way "
            "theta1 is a quarter turn; +90 is taken. theta1 = 90, d1 = 0.2, a1 = 0, alpha1 = 90.",
        ),
        (
            (TURN, (0.1, 0, 0.2), LEANING),
            "z0 and z1 are skew, at 37.3 degrees, 0.1 apart. x1, +x, lies along their common normal, from (0, 0, "
            "0.2) on z0 to o1 = (0.1, 0, 0.2) on z1. theta1 = 0, d1 = 0.2, a1 = 0.1, alpha1 = 37.3.",
        ),
        (
            (TURN, (0, -0.3, 0), X),
            "z0 and z1 are skew, at right angles, 0.3 apart. x1, -y, lies along their common normal, from (0, 0, "
            "0) on z0 to o1 = (0, -0.3, 0) on z1. Either way theta1 is a quarter turn; x1 points towards the next "
            "axis. theta1 = -90, d1 = 0, a1 = 0.3, alpha1 = -90.",
        ),
        (
            (TURN, (0.3, 0, 0.2), UP),
            "z0 and z1 are parallel, 0.3 apart, so that any common normal would do. x1, +x, lies along the one at "
            "the height of joint 2, which d1 then holds. On z1: o1 = (0.3, 0, 0.2). theta1 = 0, d1 = 0.2, a1 = "
            "0.3, alpha1 = 0.",
        ),
        (
            (TURN, (0.3, 0, 0.2), DOWN),
            "z0 and z1 are antiparallel, 0.3 apart, so that any common normal would do. x1, +x, lies along the "
            "one at the height of joint 2, which d1 then holds. On z1: o1 = (0.3, 0, 0.2). theta1 = 0, d1 = 0.2, "
            "a1 = 0.3, alpha1 = 180.",
        ),
        (
            (TURN, (0, 0, 0.2), UP),
            "z0 and z1 are one line: frame 1 may be anywhere on it, turned any way about it. o1 = (0, 0, 0.2) "
            "is at the height of joint 2, which d1 then holds; x1, +x, stays as x0 is, so that theta1 is zero. "
            "theta1 = 0, d1 = 0.2, a1 = 0, alpha1 = 0.",
        ),
        (
            (TURN, (0, 0, 0.2), DOWN),
            "z0 and z1 are one line, pointing opposite ways: frame 1 may be anywhere on it, turned any way "
            "about it. o1 = (0, 0, 0.2) is at the height of joint 2, which d1 then holds; x1, +x, stays as x0 is, "
            "so that theta1 is zero. theta1 = 0, d1 = 0.2, a1 = 0, alpha1 = 180.",
        ),
        (
            (TURN, (0.4, 0, 0), (1e-7, 0, 1)),
            "z0 and z1 are nearly parallel, 5.73e-06 degrees apart. That is below 1e-06 rad, so that noise would "
            "decide where their common normal is. So row 1 is Hayati's: x1, +x, leads, normal to z0, from o0 to "
            "z1, 0.4 away; alpha and beta turn z0 onto z1. On z1: o1 = (0.4, 0, 0). theta1 = 0, a1 = 0.4, alpha1 "
            "= 0, beta1 = 5.72958e-06.",
        ),
        (
            (TURN, (0, 0, 0), (0, 1e-7, -1)),
            "z0 and z1 are nearly antiparallel, 5.73e-06 degrees apart. That is below 1e-06 rad, so that noise "
            "would decide where their common normal is. So row 1 is Hayati's: z1 crosses z0 at o0; x1, +x, is "
            "normal to z0; alpha and beta turn z0 onto z1. On z1: o1 = (0, 0, 0). x1 stays as x0 is, so that "
            "theta1 is zero. theta1 = 0, a1 = 0, alpha1 = -180, beta1 = 0.",
        ),
        (
            (TURN, (0.4, 0, 0), (1e-2, 0, 1)),
            "z0 and z1 are nearly parallel, 0.573 degrees apart. Their common normal is 40.002 away, far from the "
            "arm, whose reach is 0.5. So row 1 is Hayati's: x1, +x, leads, normal to z0, from o0 to z1, 0.4 away; "
            "alpha and beta turn z0 onto z1. On z1: o1 = (0.4, 0, 0). theta1 = 0, a1 = 0.4, alpha1 = 0, beta1 = "
            "0.572939.",
        ),
    ],
)
def test_every_case_is_explained_with_its_numbers(axis: Axis, expected: str) -> None:
    x, y, z = axis[1]
    tip = (x, y, z + 0.1)
    assert explained(made_of(COLUMN, axis, tip=tip))["frame 1"] == expected


@pytest.mark.parametrize(
    ("axis", "expected"),
    [
        (
            (TURN, (0.1, 0, 0.2), LEANING),
            "z1 and z2 are skew, at 37.3 degrees, 0.1 apart. x1, +x, lies along their common normal, between o1 = "
            "(0, 0, 0.2) on z1 and (0.1, 0, 0.2) on z2. theta1 = 0, d1 = 0.2, a1 = 0.1, alpha1 = 37.3.",
        ),
        (
            (TURN, (0.3, 0, 0.2), UP),
            "z1 and z2 are parallel, 0.3 apart, so that any common normal would do. x1, +x, lies along the one at "
            "the height of joint 2, which d1 then holds. On z1: o1 = (0, 0, 0.2). theta1 = 0, d1 = 0.2, a1 = 0.3, "
            "alpha1 = 0.",
        ),
    ],
)
def test_modified_frames_are_at_the_near_end(axis: Axis, expected: str) -> None:
    imported = made_of(COLUMN, axis, tip=axis[1], convention=MODIFIED)
    assert explained(imported)["frame 1"] == expected


@pytest.mark.parametrize(
    ("convention", "expected"),
    [
        (
            STANDARD,
            "z1 and z2 are parallel, 0.2 apart, so that any common normal would do. x2, +x, lies along the one at "
            "o1, so that d2 is zero. On z2: o2 = (0.3, 0, 0.4). theta2 = 0, d2 = 0, a2 = 0.2, alpha2 = 0.",
        ),
        (
            MODIFIED,
            "z2 and z3 are parallel, 0.2 apart, so that any common normal would do. x2, +x, lies along the one "
            "where x1 meets z2, so that d2 is zero. On z2: o2 = (0.1, 0, 0.4). theta2 = 0, d2 = 0, a2 = 0.2, "
            "alpha2 = 0.",
        ),
    ],
)
def test_a_free_normal_is_the_one_without_an_offset(convention: Convention, expected: str) -> None:
    elbow, wrist = (TURN, (0.1, 0, 0.4), UP), (TURN, (0.3, 0, 0.7), UP)
    imported = made_of(COLUMN, elbow, wrist, tip=(0.3, 0, 0.7), convention=convention)
    assert explained(imported)["frame 2"] == expected


@pytest.mark.parametrize(
    ("first", "second", "convention", "expected"),
    [
        (
            (TURN, (0.1, 0.2, 0), UP),
            None,
            STANDARD,
            "o0 = (0.1, 0.2, 0) is the point of z0 nearest to the origin of base_link; x0 is the base's, +x. Left "
            "to base: xyz (0.1, 0.2, 0).",
        ),
        (
            (TURN, (0.1, 0.2, 0), UP),
            None,
            MODIFIED,
            "o0 = (0.1, 0.2, 0) is the point of z0, which lies on z1, nearest to the origin of base_link; x0 is "
            "the base's, +x. Left to base: xyz (0.1, 0.2, 0).",
        ),
        (
            (TURN, (0.1, 0.2, 0.3), (1, 1, 1)),
            None,
            STANDARD,
            "o0 = (-0.1, 0, 0.1) is the point of z0 nearest to the origin of base_link; x0, (0.816497, -0.408248, "
            "-0.408248), is as near to the base's x as z0 lets it. Left to base: xyz (-0.1, 0, 0.1), rpy "
            "(-50.7685, 24.0948, -26.5651).",
        ),
        (
            (TURN, (0, 0.1, 0), X),
            None,
            STANDARD,
            "o0 = (0, 0.1, 0) is the point of z0 nearest to the origin of base_link; x0 is the base's y, +y, for "
            "z0 is its x. Left to base: xyz (0, 0.1, 0), rpy (90, 0, 90).",
        ),
        (
            (TURN, (0, 0, 0), (0, 1, 1)),
            (TURN, (0, 0, 0.5), X),
            STANDARD,
            "o0 = (0, 0, 0) is the point of z0 nearest to the origin of base_link; x0, (0, 0.707107, -0.707107), "
            "lies along the common normal of the first two axes, for z0 is oblique. Left to base: rpy (0, 45, "
            "90).",
        ),
        (
            (TURN, (0.2, 0, 0), (0, -1, 1)),
            None,
            MODIFIED,
            "It is base_link, for x0 meets z1 at a right angle: a0 = 0.2 and alpha0 = 45 in row 1 lead there. "
            "Nothing is left to base.",
        ),
    ],
)
def test_the_first_frame_is_explained(
    first: Axis, second: Axis | None, convention: Convention, expected: str
) -> None:
    axes = [first] if second is None else [first, second]
    assert explained(made_of(*axes, tip=axes[-1][1], convention=convention))["frame 0"] == expected


@pytest.mark.parametrize(
    ("tip", "rpy", "convention", "expected"),
    [
        (
            (0, 0, 0.2),
            (0, 0, 30),
            STANDARD,
            "tool0 is on z0, turned about it: frame 1 is tool0. Nothing is left to tool. theta1 = 30, d1 = "
            "0.2, a1 = 0, alpha1 = 0.",
        ),
        (
            (0.1, 0, 0.2),
            (90, 0, 0),
            STANDARD,
            "x of tool0 meets z0 at a right angle, as x1 has to: frame 1 is tool0. Nothing is left to tool. "
            "theta1 = 0, d1 = 0.2, a1 = 0.1, alpha1 = 90.",
        ),
        (
            (0.1, 0, 0.2),
            (0, 0, 90),
            STANDARD,
            "tool0 is beside z0, its z parallel to it: frame 1 has its axes, and its height on z0. Left to "
            "tool: xyz (0, -0.1, 0). theta1 = 90, d1 = 0.2, a1 = 0, alpha1 = 0.",
        ),
        (
            (0.1, 0, 0.2),
            (180, 0, 90),
            STANDARD,
            "tool0 is beside z0, its z antiparallel to it: frame 1 has its axes, and its height on z0. Left "
            "to tool: xyz (0, 0.1, 0). theta1 = 90, d1 = 0.2, a1 = 0, alpha1 = 180.",
        ),
        (
            (0, 0, 0.2),
            (0, 30, 0),
            STANDARD,
            "tool0 is on z0, and not just turned about it: frame 1 has its origin, theta1 is zero. Left to "
            "tool: rpy (0, 30, 0). theta1 = 0, d1 = 0.2, a1 = 0, alpha1 = 0.",
        ),
        (
            (0.3, 0.4, 0.2),
            (0, 30, 0),
            STANDARD,
            "tool0 is 0.5 away from z0, and no row leads there: frame 1 stays where row 1 begins. Left to tool: "
            "xyz (0.3, 0.4, 0.2), rpy (0, 30, 0). theta1 = 0, d1 = 0, a1 = 0, alpha1 = 0.",
        ),
        (
            (0, 0, 0.2),
            (180, 0, 0),
            MODIFIED,
            "tool0 is on z1, and not just turned about it: frame 1 has its origin, theta1 is zero. Left to "
            "tool: rpy (180, 0, 0). theta1 = 0, d1 = 0.2.",
        ),
    ],
)
def test_the_last_frame_of_a_robot_of_one_joint_is_explained(
    tip: tuple[float, ...], rpy: tuple[float, ...], convention: Convention, expected: str
) -> None:
    assert explained(made_of(COLUMN, tip=tip, rpy=rpy, convention=convention))["frame 1"] == expected


def test_where_the_axes_of_sliding_joints_were_put_is_explained() -> None:
    first = made_of(
        (SLIDE, (0.1, 0.2, 0), X),
        (TURN, (0.1, 0.2, 0), X),
        (SLIDE, (0.9, 0.9, 0), X),
        (TURN, (0.1, 0.2, 0), UP),
        tip=(0.3, 0.2, 0.1),
    )
    second = made_of(
        (SLIDE, (0.5, 0.5, 0), UP),
        (TURN, (0.1, 0.2, 0), X),
        (SLIDE, (0.9, 0.9, 0), Y),
        (TURN, (0.1, 0.8, 0.5), UP),
        (SLIDE, (0.9, 0.9, 0), (1, 0, 1)),
        (SLIDE, (0.9, 0.9, 0), (0, 1, 1)),
        tip=(0.3, 0.2, 0.1),
        convention=MODIFIED,
    )
    assert explained(first)["sliding"] == (
        "Of z0, joint 1 needs the direction only. It is put on z1, which is parallel to it. Of z2, joint 3 needs "
        "the direction only. It is put on z1, which is parallel to it."
    )
    assert explained(second)["sliding"] == (
        "Of z1, joint 1 needs the direction only. It is put through the origin of base_link. Of z3, joint 3 needs "
        "the direction only. It is put where it meets both z2 and z4: a2 and a3 are zero. Of z5, joint 5 needs "
        "the direction only. It is put where it meets both z4 and z6: a4 and a5 are zero. Of z6, joint 6 needs "
        "the direction only. It is put through tool0, so that the row can lead there."
    )


def test_axes_are_explained_with_telling_names_and_with_how_they_miss_an_axis() -> None:
    imported = made_of(
        COLUMN,
        (SLIDE, (0, 0, 0), (0, 1e-3, -1)),
        (TURN, (0.4, 0, 0), (0.6, 0.8, 0)),
        tip=(0, 0, 0),
        names=("joint_1", "lift", "wrist_roll"),
    )
    assert explained(imported)["z axes"] == (
        "z0 along +z, z1 along -z but for 0.057 degrees (lift, sliding), z2 along (0.6, 0.8, 0) (wrist_roll)."
    )


def test_a_modified_table_with_a_hayati_row_explains_both_conventions() -> None:
    imported = made_of(
        COLUMN,
        (TURN, (0.4, 0, 0.1), (1e-7, 0, 1)),
        (TURN, (0.4, 0, 0.3), Y),
        tip=(0.4, 0.2, 0.3),
        convention=MODIFIED,
    )
    text = explained(imported)
    assert text[""] == (
        "Frames of sample. Row 1 ends with the link part, as Hayati's row 1 has to: z(i-1) is the axis of joint "
        "i, x(i) lies along the common normal from z(i-1) to z(i). The rows behind are modified ones: z(i) is the "
        "axis of joint i, x(i) lies along the common normal from z(i) to z(i+1); a(i) and alpha(i) are in row "
        "i+1. Points and directions are in base_link at joint coordinates zero, in m and degrees to six digits. "
        "x(i) can point two ways; unless stated otherwise, the one with the smaller theta is taken."
    )
    assert text["z axes"] == "z0 along +z, z1 and z2 along +z, z3 along +y."
    assert text["frame 2"] == (
        "z2 and z3 intersect at right angles (but for 2e-08), at o2 = (0.4, 0, 0.3). x2, +x, is normal to both. "
        "theta2 = 0, d2 = 0.3, a2 = -2e-08, alpha2 = -90."
    )


def test_the_residual_is_explained() -> None:
    imported = made_of(COLUMN, tip=(0, 0, 0.1))
    assert imported.residual is not None
    assert explained(imported)["residual"] == (
        "At 1000 random configurations all joint axes and tool0 differ from the source's by at most "
        f"{imported.residual.position:.1e} m and {imported.residual.rotation:.1e} rad."
    )


@pytest.mark.slow
@pytest.mark.parametrize("convention", [STANDARD, MODIFIED])
@pytest.mark.parametrize("seed", range(40))
def test_what_is_explained_of_any_robot_is_true_of_its_axes_and_rows(seed: int, convention: Convention) -> None:
    imported = made_of(*random_axes(seed), tip=(0.3, -0.2, 0.7), convention=convention)
    lines = explanation(imported)
    assert all(len(line) <= 98 and line.isascii() and line == line.rstrip() for line in lines)
    text = explained(imported)
    axes = _axes(imported)
    distal = sum(row.convention is not MODIFIED for row in imported.spec.rows)
    n = len(axes)
    for joint, (point, direction) in enumerate(axes[:-1], start=1):
        words = text[f"frame {joint}"]
        next_point, next_direction = axes[joint]
        origin, x = _vector(words, rf"o{joint} = "), _vector(words, rf"x{joint}, ")
        own_turns, next_turns = (imported.spec.rows[i].type.turns for i in (joint - 1, joint))
        own = joint - 1 if joint <= distal else joint  # the index of the joint's z
        assert words.startswith(f"z{own} and z{own + 1} ")
        assert abs(x @ direction) < 1e-5
        assert abs(x @ next_direction) < 1e-5 or imported.spec.rows[joint - 1].convention is Convention.HAYATI
        if "intersect" in words or joint > distal:
            assert not own_turns or _beside(origin, point, direction) < 1e-5
        if "intersect" in words or joint <= distal:
            assert not next_turns or _beside(origin, next_point, next_direction) < 1e-5
        if own_turns and next_turns and (apart := re.search(r" ([0-9.e-]+) apart", words)):
            assert float(apart[1]) == pytest.approx(_distance(axes[joint - 1], axes[joint]), rel=1e-5)
        if angle := re.search(r" at ([0-9.e-]+) degrees", words):
            cosine = float(direction @ next_direction)
            assert np.cos(np.radians(float(angle[1]))) == pytest.approx(cosine, abs=1e-6)
        if "right angles" in words:
            assert abs(direction @ next_direction) < 1e-5
    _check_numbers(imported, text, n)


def _check_numbers(imported: Imported, text: dict[str, str], n: int) -> None:
    rows = imported.spec.rows
    for i in range(1, n + 1):
        link = i - 1 if rows[i - 1].convention is not MODIFIED else i
        expected = {f"theta{i}": np.degrees(rows[i - 1].theta)}
        if rows[i - 1].convention is Convention.HAYATI:
            expected |= {f"beta{i}": np.degrees(rows[i - 1].beta)}
        else:
            expected |= {f"d{i}": rows[i - 1].d}
        if link < n:
            expected |= {f"a{i}": rows[link].a, f"alpha{i}": np.degrees(rows[link].alpha)}
        stated = {
            name: float(value) for name, value in re.findall(r"([a-z]+\d+) = ([-0-9.e]+)[,.]", text[f"frame {i}"])
        }
        assert stated == pytest.approx(expected, rel=1e-5, abs=1e-12)
        for name in re.findall(r"so that (\w+) is zero", text[f"frame {i}"]):
            assert expected[name] == 0.0


def _axes(imported: Imported) -> list[tuple[Array, Array]]:
    """Points and directions at coordinates zero, from the source's own transforms."""
    chain = imported.chain
    assert chain is not None
    links = serial_link_poses(chain, np.zeros(chain.n))
    return [
        (T[:3, :3] @ joint.point + T[:3, 3], T[:3, :3] @ joint.axis)
        for T, joint in zip(links, chain.joints, strict=False)
    ]


def _vector(words: str, before: str) -> Array:
    found = re.search(rf"{before}(?:\(([^)]*)\)|([+-])([xyz]))", words)
    assert found is not None, words
    if found[1]:
        return np.array([float(value) for value in found[1].split(",")])
    return np.asarray(np.eye(3)["xyz".index(found[3])] * (1 if found[2] == "+" else -1))


def _beside(point: Array, on: Array, direction: Array) -> float:
    return float(np.linalg.norm(np.cross(point - on, direction)))


def _distance(first: tuple[Array, Array], second: tuple[Array, Array]) -> float:
    normal = np.cross(first[1], second[1])
    if np.linalg.norm(normal) < 1e-6:
        return _beside(second[0], *first)
    return abs(float((second[0] - first[0]) @ normal)) / float(np.linalg.norm(normal))


def test_a_robot_made_of_a_table_has_nothing_to_explain() -> None:
    imported = import_data(b"| theta | d | a | alpha |\n|---|---|---|---|\n| q1 | 0 | 0.3 | 90 |\n", "t.md", OPTIONS)
    with pytest.raises(ValueError, match=r"^frames were not assigned: the source is a table$"):
        explanation(imported)


def test_the_random_robots_meet_every_case() -> None:
    words = " ".join(
        " ".join(explained(made_of(*random_axes(seed), tip=(0.3, -0.2, 0.7))).values()) for seed in range(40)
    )
    cases = ("are one line", "opposite ways", " parallel, ", " antiparallel, ", "intersect at", "skew, at")
    for case in (*cases, "are nearly parallel"):
        assert case in words
