"""Whatever stands in a URDF, reading it gives a sound robot or an error that names the file and places in it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

import numpy as np
import pytest

from dh2sim.errors import ImportedFileError
from dh2sim.formats.serial_robot import SerialLink, SerialRobot
from dh2sim.formats.urdf.read import read_urdf
from tests.formats.urdf.samples import Rng, anywhere, joint, links, nowhere, random_tree, robot

BATCHES, BATCH = 8, 500
"""10 000 files."""

WORDS = [
    "nan", "inf", "-inf", "1e999", "-1e400", "1e308", "1e-320", "0", "-0", "-1", "x", "", " ", "1,5", "0x10", "1_000",
    "١", "1 2", "1 2 3 4", "0 0 0", "${a}", "$(arg b)", "fixed", "floating", "planar", "mimic", "link_1", "link_0",
    "joint_1", "tool0", "package://a/b.stl", "9" * 400, "\u202e", "é", "&amp;", "&lt;", "&x;", "&#27;",
]  # fmt: skip
TAGS = ["link", "joint", "origin", "axis", "limit", "inertial", "robot", "xacro:if", "mimic", "visual", "a" * 50, "1"]
SPICE = [
    "<", ">", "/>", "</joint>", '"', "<!--", "-->", "<![CDATA[", "]]>", "<?x?>", "<!DOCTYPE a [<!ENTITY x 'y'>]>",
    '<mimic joint="joint_2"/>', '<origin xyz="1 2 3"/>', '<parent link="link_2"/>', "<gazebo/>", "<limit/>",
    "<inertial/>", '<dynamics damping="-1" friction="nan"/>', '<limit lower="3" upper="2" velocity="inf"/>',
    '<visual><geometry><mesh filename="package://a/b.stl" scale="1 1 1"/></geometry></visual>',
    '<visual><geometry><box size="1 1 1"/></geometry><material name="m"><color rgba="1 2 3 4"/></material></visual>',
]  # fmt: skip

Damage = Callable[[str, Rng], str]


def pick(rng: Rng, choices: list[str]) -> str:
    return choices[int(rng.integers(len(choices)))]


def replaced(text: str, pattern: str, new: Callable[[re.Match[str]], str], rng: Rng) -> str:
    """Replace one of the places where a pattern matches."""
    found = list(re.finditer(pattern, text))
    if not found:
        return text
    match = found[int(rng.integers(len(found)))]
    return text[: match.start()] + new(match) + text[match.end() :]


def cut(text: str, rng: Rng) -> str:
    start, stop = sorted(rng.integers(0, len(text) + 1, size=2).tolist())
    return text[:start] if rng.random() < 0.5 else text[:start] + text[stop:]


def a_number_changed(text: str, rng: Rng) -> str:
    return replaced(text, r"-?[0-9][0-9.e-]*", lambda _: pick(rng, WORDS), rng)


def a_value_changed(text: str, rng: Rng) -> str:
    return replaced(text, r'"[^"]*"', lambda _: f'"{pick(rng, WORDS)}"', rng)


def an_attribute_removed(text: str, rng: Rng) -> str:
    return replaced(text, r' \w+="[^"]*"', lambda _: "", rng)


def an_attribute_doubled_or_renamed(text: str, rng: Rng) -> str:
    double = rng.random() < 0.3
    return replaced(text, r' (\w+)(="[^"]*")', lambda m: m[0] + m[0] if double else f" {m[1][:-1]}q{m[2]}", rng)


def a_tag_renamed(text: str, rng: Rng) -> str:
    tag = pick(rng, TAGS)
    return replaced(text, r"<(\w+)([^<>]*)/>", lambda m: f"<{tag}{m[2]}/>", rng)


def an_element_removed_or_doubled(text: str, rng: Rng) -> str:
    times = int(rng.choice([0, 2]))
    return replaced(text, r"<(link|joint|inertial)\b[^/]*?</\1>|<\w+[^<>]*/>", lambda m: m[0] * times, rng)


def lines_shuffled(text: str, rng: Rng) -> str:
    lines = text.split("\n")
    return "\n".join(lines[i] for i in rng.permutation(len(lines))) if rng.random() < 0.2 else text


def something_put_in(text: str, rng: Rng) -> str:
    at = int(rng.integers(0, len(text) + 1))
    if rng.random() < 0.6:  # behind a tag, where it is well-formed
        at = text.find(">", at) + 1
    return text[:at] + pick(rng, SPICE) + text[at:]


def nested_deeply(text: str, rng: Rng) -> str:
    depth = int(rng.choice([3, 300, 600]))
    return replaced(text, r"<\w+[^<>]*/>", lambda m: "<gazebo>" * depth + m[0] + "</gazebo>" * depth, rng)


GENTLE: list[Damage] = [a_number_changed, a_value_changed, an_attribute_removed, something_put_in]
ROUGH: list[Damage] = [
    cut, an_attribute_doubled_or_renamed, a_tag_renamed, an_element_removed_or_doubled, lines_shuffled, nested_deeply,
]  # fmt: skip


def bytes_flipped(data: bytes, rng: Rng) -> bytes:
    changed = bytearray(data)
    for at in rng.integers(0, max(len(data), 1), size=int(rng.integers(1, 4))):
        if changed:
            changed[int(at)] = int(rng.integers(256))
    return bytes(changed)


def broken(rng: Rng, text: str) -> bytes:
    damages = GENTLE if rng.random() < 0.6 else GENTLE + ROUGH
    for _ in range(int(rng.integers(1, 4))):
        text = damages[int(rng.integers(len(damages)))](text, rng)
    data = text.encode(str(rng.choice(["utf-8", "utf-8", "utf-8", "utf-8", "utf-16"])))
    return bytes_flipped(data, rng) if rng.random() < 0.1 else data


def assert_sound(found: SerialRobot) -> None:
    n = found.chain.n
    assert n >= 1
    assert len(found.links) == len(found.limits) == len(found.dynamics) == n
    for T in (*(one.T_parent_link for one in found.chain.joints), found.chain.T_link_tip):
        assert np.isfinite(T).all()
        np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-12)
    for one, limits, dynamics in zip(found.chain.joints, found.limits, found.dynamics, strict=True):
        assert one.type.moves
        assert math.isclose(float(np.linalg.norm(one.axis)), 1.0, rel_tol=1e-15)
        assert limits.position is None or -math.inf < limits.position[0] < limits.position[1] < math.inf
        assert all(value is None or 0.0 < value < math.inf for value in (limits.velocity, limits.effort))
        assert all(0.0 <= value < math.inf for value in (dynamics.damping, dynamics.friction))
    for link in (found.base, *found.links):
        assert_sound_link(link)
    assert np.isfinite(found.gravity).all()
    assert all(note.endswith(".") and len(note) < 10_000 and note.isprintable() for note in found.notes)


def assert_sound_link(link: SerialLink) -> None:
    assert (link.mass is None) == (link.com is None)
    assert link.mass is None or 0.0 < link.mass < math.inf
    assert link.com is None or np.isfinite(link.com).all()
    if link.inertia is not None:
        assert link.mass is not None
        a, b, c = np.linalg.eigvalsh(link.inertia / np.abs(link.inertia).max())
        assert a > 0.0
        assert a + b >= c * (1 - 2e-9)
    assert link.color is None or all(0.0 <= value <= 1.0 for value in link.color)
    assert link.mesh is None or (0.0 < link.mesh.scale < math.inf and np.isfinite(link.mesh.T_link_mesh).all())


def outcome(data: bytes, tip: str | None, rng: Rng) -> str:
    """Read a file and check what comes of it."""
    base = "link_1" if rng.random() < 0.1 else None
    find_mesh = anywhere if rng.random() < 0.5 else nowhere
    try:
        found = read_urdf(data, file="bad.urdf", base=base, tip=tip, find_mesh=find_mesh)
    except ImportedFileError as error:
        refusal = error
    else:
        assert_sound(found)
        return "read"
    lines = len(re.split(b"\r\n|\r|\n", data))
    assert refusal.problems
    assert all(line.startswith("bad.urdf:") for line in str(refusal).split("\n"))
    assert all(1 <= problem.line <= lines and problem.column >= 1 for problem in refusal.problems)
    return "refused"


@pytest.mark.slow
@pytest.mark.parametrize("batch", range(BATCHES))
def test_a_broken_file_is_read_or_refused(batch: int) -> None:
    rng = np.random.default_rng(batch)
    trees = [random_tree(rng, int(size)) for size in rng.integers(2, 9, size=20)]
    outcomes = []
    for i in range(BATCH):
        text, way = trees[i % len(trees)]
        outcomes.append(outcome(broken(rng, text), way[-1] if i % 3 else None, rng))
    # neither is so rare that it goes untested
    assert min(outcomes.count("read"), outcomes.count("refused")) > BATCH // 8


LONG = 20_000
HUGE = {
    "a long chain": robot(
        links(*(f"l{i}" for i in range(3_000))), *(joint(f"j{i}", f"l{i}", f"l{i + 1}") for i in range(2_999))
    ),
    "a broad tree": robot(
        links(*(f"l{i}" for i in range(LONG))), *(joint(f"j{i}", "l0", f"l{i}") for i in range(1, LONG))
    ),
    "a broad tree that does not move": robot(
        links(*(f"l{i}" for i in range(LONG))),
        *(joint(f"j{i}", "l0", f"l{i}", "fixed") for i in range(1, LONG - 1)),
        joint("mover", "l1", f"l{LONG - 1}"),
    ),
    "a long loop": robot(
        links(*(f"l{i}" for i in range(LONG))), *(joint(f"j{i}", f"l{i}", f"l{(i + 1) % LONG}") for i in range(LONG))
    ),
    "unknown links": robot(
        *(joint(f"j{i}", f"left{i}", f"right{i}") for i in range(LONG)), links("l0", "left", "right")
    ),
    "many roots": robot(links(*(f"l{i}" for i in range(LONG)))),
    "a name of many characters": robot(links("l" * 100_000, "m"), joint("j" * 100_000, "l" * 100_000, "m")),
    "a number of many digits": robot(
        links("l", "m"), joint("j", "l", "m", inside=f'<origin xyz="{"1" * 900_000} 0 0"/>')
    ),
    "many numbers": robot(links("l", "m"), joint("j", "l", "m", inside=f'<origin xyz="{"1 " * 400_000}"/>')),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", list(HUGE))
def test_a_huge_file_is_read_or_refused_in_short_words(kind: str) -> None:
    try:
        found = read_urdf(HUGE[kind].encode(), file="huge.urdf", find_mesh=nowhere)
    except ImportedFileError as error:
        words = str(error)
    else:
        assert_sound(found)
        words = "".join(found.notes)
    assert len(words) < 50_000
