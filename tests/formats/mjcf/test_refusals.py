"""What is refused before MuJoCo sees it, what MuJoCo refuses, and that nothing is left behind."""

from __future__ import annotations

import os
import random
import re
import struct
import sys
import warnings
from functools import partial
from pathlib import Path

import mujoco
import numpy as np
import pytest

from dh2sim import limited_process
from dh2sim.errors import Dh2simError, ImportedFileError
from dh2sim.formats.mjcf import compile as mjcf_compile
from dh2sim.formats.mjcf import includes as mjcf_bytes
from dh2sim.formats.mjcf.read import read_mjcf
from tests.formats.mjcf.reading import BALL, arm_text, model_text, read_text
from tests.refusals import refusal

ARM = f'<body name="base"><body name="one"><joint name="a"/>{BALL}</body></body>'


refused = partial(refusal, ImportedFileError, read_text)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "robot.xml:1:1: not well-formed XML: no element found"),
        ("<mujoco>\n<worldbody></mujoco>", "robot.xml:2:14: not well-formed XML: mismatched tag"),
        ("<robot name='x'/>", "robot.xml:1:1: expected <mujoco>, found <robot>: this is a URDF, not an MJCF"),
        ("<sdf/>", "robot.xml:1:1: expected <mujoco>, found <sdf>"),
        (
            '<!DOCTYPE m [<!ENTITY a "b">]><mujoco/>',
            "robot.xml:1:13: <!DOCTYPE m ...> with declarations is refused: "
            "entities and external files are never read",
        ),
        (
            '<mujoco>\n  <extension><plugin plugin="mujoco.pid"/></extension></mujoco>',
            "robot.xml:2:14: plugin: <plugin> is refused: plugins are never run. Remove it and what needs it, "
            "and import again",
        ),
        (
            '<mujoco>\n<option timestep="x"/><worldbody/></mujoco>',
            "robot.xml:2:1: MuJoCo refuses the file: bad format in attribute 'timestep' (element 'option')",
        ),
        (
            "<mujoco>\n\n<worldbody><body><joint typ='x'/></body></worldbody></mujoco>",
            "robot.xml:3:1: MuJoCo refuses the file: Schema violation: unrecognized attribute: 'typ' "
            "(element 'joint')",
        ),
        (
            "<mujoco><worldbody>\n<body name='x'><joint/></body></worldbody></mujoco>",
            "robot.xml:2:1: MuJoCo refuses the file: mass and inertia of moving bodies must be larger than mjMINVAL "
            "(element 'x')",
        ),
        (
            '<mujoco>\n <include file="gone.xml"/></mujoco>',
            "robot.xml:2:2: include.file: no file 'gone.xml' in FOLDER",
        ),
    ],
)
def test_a_wrong_file_is_reported_with_its_place(text: str, message: str, tmp_path: Path) -> None:
    assert refused(tmp_path, text) == message.replace("FOLDER", str(tmp_path))


@pytest.mark.parametrize("tag", ["include", "model", "flexcomp"])
@pytest.mark.parametrize("path", ["../x.xml", "a/../../x.xml", "/etc/x.xml", "C:\\x.xml", "..\\x.xml", "\\x.xml", ""])
def test_only_files_in_the_models_folder_are_read(tag: str, path: str, tmp_path: Path) -> None:
    folder = tmp_path / "model"
    folder.mkdir()
    shown = path.replace("\\", "\\\\")
    assert refused(folder, f'<mujoco><{tag} file="{path}"/></mujoco>') == (
        f"robot.xml:1:9: {tag}.file: found '{shown}'; only files in the model's folder and those below it are read"
    )


def test_included_files_are_looked_through_too(tmp_path: Path) -> None:
    (tmp_path / "model" / "sub").mkdir(parents=True)
    (tmp_path / "model" / "sub" / "one.xml").write_text('<x><include file="two.xml"/></x>')
    (tmp_path / "model" / "sub" / "two.xml").write_text('<x>\n<include file="../../three.xml"/></x>')
    (tmp_path / "three.xml").write_text("<x/>")
    place = os.path.join("sub", "two.xml")
    assert refused(tmp_path / "model", '<mujoco><include file="sub/one.xml"/></mujoco>') == (
        f"{place}:2:1: include.file: found '../../three.xml'; only files in the model's folder and those below it "
        "are read; allow others with root='..'"
    )


@pytest.mark.parametrize("form", ["../arm.xml", "ABOVE/arm.xml", "sub/../../arm.xml"])
def test_a_wider_root_allows_files_of_a_parent_folder(tmp_path: Path, form: str) -> None:
    folder = tmp_path / "models" / "cell"
    folder.mkdir(parents=True)
    (tmp_path / "models" / "arm.xml").write_text(arm_text())
    (tmp_path / "arm.xml").write_text("<mujoco/>")
    path = folder / "robot.xml"
    path.write_text(
        f'<mujoco model="cell"><include file="{form.replace("ABOVE", str(tmp_path / "models"))}"/></mujoco>'
    )
    assert read_mjcf(path, file="robot.xml", root=tmp_path / "models").chain.n == 2
    with pytest.raises(ImportedFileError, match="only files in the model's folder"):
        read_mjcf(path, file="robot.xml")
    path.write_text('<mujoco model="cell"><include file="../../arm.xml"/></mujoco>')
    with pytest.raises(ImportedFileError) as caught:
        read_mjcf(path, file="cell/robot.xml", root=tmp_path / "models")
    assert str(caught.value) == (
        f"cell/robot.xml:1:22: include.file: found '../../arm.xml'; only files in {tmp_path / 'models'} and those "
        "below it are read; allow others with root='..'"
    )


def test_a_model_above_may_be_attached_where_the_root_allows_it(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "arm.xml").write_text(arm_text())
    folder = tmp_path / "cells" / "one"
    folder.mkdir(parents=True)
    asset = '<asset><model name="arm" file="../../parts/arm.xml"/></asset>'
    attached = '<worldbody><attach model="arm" body="base" prefix="p_"/></worldbody>'
    path = folder / "robot.xml"
    path.write_text(f"<mujoco>{asset}{attached}</mujoco>")
    robot = read_mjcf(path, file="robot.xml", root=tmp_path)
    assert [joint.name for joint in robot.chain.joints] == ["p_joint_a", "p_joint_b"]
    with pytest.raises(ImportedFileError, match=re.escape("allow others with root='../..'")):
        read_mjcf(path, file="robot.xml", root=tmp_path / "cells")


def test_a_file_that_includes_itself_is_refused(tmp_path: Path) -> None:
    assert refused(tmp_path, '<mujoco><include file="robot.xml"/></mujoco>') == (
        "robot.xml:1:9: include: the file 'robot.xml' is included already; MuJoCo includes a file once"
    )


def test_models_that_attach_each_other_are_refused(tmp_path: Path) -> None:
    (tmp_path / "b.xml").write_text('<mujoco><asset><model name="r" file="robot.xml"/></asset></mujoco>')
    assert refused(tmp_path, '<mujoco><asset><model name="b" file="b.xml"/></asset></mujoco>') == (
        "b.xml:1:16: model: 'robot.xml' is refused: a model cannot be attached to itself"
    )


def test_repetitions_that_explode_are_refused(tmp_path: Path) -> None:
    text = model_text('<replicate count="1000"><replicate count="1000"><body/></replicate></replicate>')
    assert refused(tmp_path, text) == (
        "robot.xml:1:35: replicate: this makes more than 10000 elements once it is expanded"
    )
    soft = model_text('<flexcomp name="f" type="grid" count="1000 1000 1000"/>')
    assert "more than 10000 elements" in refused(tmp_path, soft)
    mesh = model_text(ARM, '<asset><mesh name="m" builtin="box" params="1000 1000 1000 1 1 1"/></asset>')
    assert "more than 10000 elements" in refused(tmp_path, mesh)


FIELD = '<asset><hfield name="h" nrow="{0}" ncol="{0}" size="1 1 1 1"/></asset>'
IN_THE_WORLD = '<geom type="hfield" hfield="h"/>'
PIECE = '<geom type="capsule" size=".01"/>'
CABLE = f'<composite type="cable" prefix="c" count="{{}} 1 1" curve="s" size="1">{PIECE}</composite>'
GRID = '<flexcomp name="f" type="grid" count="{0} {0} {0}" dim="3" radius=".01" spacing=".1 .1 .1"/>'


@pytest.mark.parametrize(
    ("before", "inside", "reported"),
    [
        (
            FIELD.format(46341),
            IN_THE_WORLD,
            "hfield: a height field of 2147488281 points; at most 4000000 are read",
        ),
        (FIELD.format(2001), IN_THE_WORLD, "hfield: a height field of 4004001 points; at most 4000000 are read"),
        (
            "".join(FIELD.format(1900).replace('"h"', f'"{name}"') for name in "hgf"),
            IN_THE_WORLD,
            "this makes more than 10000 elements once it is expanded",
        ),
        ("", GRID.format(40), "flexcomp: this makes more than 10000 elements once it is expanded"),
        ("", GRID.format(14), "flexcomp: this makes more than 10000 elements once it is expanded"),
        ("", CABLE.format(1000), "composite: this makes more than 10000 elements once it is expanded"),
        ("", CABLE.format(500), "composite: this makes more than 10000 elements once it is expanded"),
        (
            "",
            '<replicate count="9999"><geom size="1"/></replicate>',
            "replicate: this makes more than 10000 elements",
        ),
        (
            '<asset><mesh name="m" builtin="supersphere" params="500 1 1"/></asset>',
            '<geom type="mesh" mesh="m"/>',
            "mesh: this makes more than 10000 elements once it is expanded",
        ),
    ],
)
def test_what_makes_mujoco_work_without_bound_is_refused_at_its_place(
    before: str, inside: str, reported: str, tmp_path: Path
) -> None:
    text = model_text(ARM + inside, before)
    found = refused(tmp_path, text)
    assert re.match(r"robot\.xml:1:\d+: ", found)
    assert reported in found


@pytest.mark.parametrize(
    ("before", "inside"),
    [
        (FIELD.format(100), IN_THE_WORLD),
        ("", GRID.format(5)),
        ("", CABLE.format(40)),
        ("", '<replicate count="100"><geom size="1"/></replicate>'),
        ('<asset><mesh name="m" builtin="supersphere" params="40 1 1"/></asset>', '<geom type="mesh" mesh="m"/>'),
    ],
)
def test_such_parts_of_moderate_size_are_read(before: str, inside: str, tmp_path: Path) -> None:
    if "<composite" in inside and mujoco.mj_version() >= 4_000_000:
        pytest.skip("MuJoCo has no composites since 4.0")
    assert read_text(tmp_path, model_text(ARM + inside, before), tip="one").chain.n == 1


def test_a_huge_picture_of_a_height_field_is_not_opened(tmp_path: Path) -> None:
    head = b"\x89PNG\r\n\x1a\n" + struct.pack(">I4sII", 13, b"IHDR", 13000, 13000)
    (tmp_path / "h.png").write_bytes(head + bytes(1000))
    field = '<asset><hfield name="h" file="h.png" size="1 1 1 1"/></asset>'
    robot = read_text(tmp_path, model_text(ARM + IN_THE_WORLD, field))
    assert robot.chain.n == 1
    assert not any("MuJoCo cannot use" in note for note in robot.notes)  # as it would, had it opened the file


BOX = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


@pytest.mark.parametrize("how", ["up", "meshdir", "absolute", "link"])
def test_meshes_outside_of_the_models_own_folders_are_used_only_with_root(tmp_path: Path, how: str) -> None:
    folder = tmp_path / "home" / "downloads" / "arm"
    folder.mkdir(parents=True)
    secret = tmp_path / "home" / "secret.obj"
    secret.write_text(BOX)
    name = {"up": "../../secret.obj", "absolute": str(secret)}.get(how, "secret.obj")
    if how == "link":
        (folder / "secret.obj").symlink_to(secret)
    compiler = f'<compiler meshdir="{secret.parent}"/>' if how == "meshdir" else ""
    asset = f'{compiler}<asset><mesh name="m" file="{name}"/></asset>'
    geom = '<geom type="mesh" mesh="m" contype="0" conaffinity="0" mass="0"/>'
    text = model_text(ARM.replace(BALL, BALL + geom), asset)
    robot = read_text(folder, text)
    assert robot.links[0].mesh is None
    noted = "Meshes outside of the file's own folders are used only with root, a folder that holds them: 'one'"
    assert any(note.startswith(noted) for note in robot.notes)
    again = read_mjcf(folder / "robot.xml", file="robot.xml", root=tmp_path / "home")
    assert again.links[0].mesh is not None


@pytest.mark.skipif(os.name == "nt", reason="links need rights there")
def test_a_link_to_another_folder_is_not_included(tmp_path: Path) -> None:
    folder = tmp_path / "model"
    folder.mkdir()
    (tmp_path / "secret.xml").write_text("<x/>")
    (folder / "link.xml").symlink_to(tmp_path / "secret.xml")
    assert "only files in the model's folder and those below it are read" in refused(
        folder, '<mujoco><include file="link.xml"/></mujoco>'
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("request_", "reason"),
    [("loop", "it takes longer than 1 seconds"), ("abort", "it ended the process that read it (signal 6)")],
)
def test_a_model_that_mujoco_cannot_cope_with_is_refused_by_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request_: str, reason: str
) -> None:
    asked = partial(limited_process.ask_worker, "tests.hostile_worker", request_.encode(), seconds=1)
    monkeypatch.setattr(mjcf_compile, "ask_worker", lambda _worker, _request: asked())
    assert refused(tmp_path, model_text(ARM)) == f"robot.xml:1:1: MuJoCo cannot compile the file: {reason}"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux only")
def test_a_model_that_takes_too_much_memory_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = model_text(ARM + IN_THE_WORLD, FIELD.format(1500))
    assert read_text(tmp_path, text).chain.n == 1
    monkeypatch.setattr(limited_process, "MEMORY", 20_000_000)
    found = refused(tmp_path, text)
    assert found == "robot.xml:1:1: MuJoCo cannot compile the file: it needs more than 20 MB of memory"


def test_attachments_that_explode_are_refused(tmp_path: Path) -> None:
    twice = '<attach model="m" body="b" prefix="x"/><attach model="m" body="b" prefix="y"/>'
    for i in range(9):
        asset = f'<asset><model name="m" file="{i + 1}.xml"/></asset>'
        inner = 8 * twice if i < 8 else 8 * "<body/>"
        (tmp_path / f"{i}.xml").write_text(model_text(f'<body name="b">{inner}</body>', asset if i < 8 else ""))
    text = '<mujoco><asset><model file="0.xml"/></asset></mujoco>'
    assert "this makes more than 10000 elements once it is expanded" in refused(tmp_path, text)


def test_elements_are_not_nested_deeper_through_includes(tmp_path: Path) -> None:
    for i in range(6):
        inner = f'<include file="{i + 1}.xml"/>' if i < 5 else ""
        (tmp_path / f"{i}.xml").write_text(f"<x>{'<body>' * 100}{inner}{'</body>' * 100}</x>")
    text = model_text('<include file="0.xml"/>')
    assert "elements are nested more than 510 deep" in refused(tmp_path, text)


def test_a_file_that_is_too_large_is_refused_unread(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mjcf_bytes, "MAX_BYTES", 100)
    assert refused(tmp_path, model_text(ARM)) == (
        "robot.xml:1:1: the file is too large: at most 100 bytes are read, with all that it includes"
    )


def test_a_file_in_another_encoding_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "robot.xml"
    path.write_bytes('<?xml version="1.0" encoding="iso-8859-1"?>\n<mujoco model="Häuser"/>'.encode("latin-1"))
    with pytest.raises(ImportedFileError) as caught:
        read_mjcf(path, file="robot.xml")
    assert str(caught.value) == "robot.xml:2:1: not UTF-8: byte 0xe4; MuJoCo reads no other encoding"


def test_a_file_that_cannot_be_read_is_said_to_be(tmp_path: Path) -> None:
    with pytest.raises(Dh2simError, match=r"^gone\.xml: cannot be read: No such file or directory$"):
        read_mjcf(tmp_path / "gone.xml", file="gone.xml")
    with pytest.raises(Dh2simError, match=r"^folder: not a regular file$"):
        read_mjcf(tmp_path, file="folder")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.xml")
    os.mkfifo(tmp_path / "pipe.stl")
    with pytest.raises(Dh2simError, match=r"^pipe\.xml: not a regular file$"):
        read_text(tmp_path, '<mujoco><include file="pipe.xml"/></mujoco>')
    mesh = '<asset><mesh name="m" file="pipe.stl"/></asset>'
    robot = read_text(tmp_path, model_text(f'{ARM}<geom type="mesh" mesh="m"/>', mesh))
    assert robot.chain.n == 1


def test_a_problem_in_an_included_file_has_no_line_of_the_first(tmp_path: Path) -> None:
    (tmp_path / "x.xml").write_text("<x>\n\n\n<bodi/></x>")
    assert refused(tmp_path, model_text('<include file="x.xml"/>')) == (
        "robot.xml:1:1: MuJoCo refuses the file: Schema violation: unrecognized element (element 'bodi')"
    )


def test_a_line_of_one_of_several_models_is_no_line_of_the_first(tmp_path: Path) -> None:
    (tmp_path / "x.xml").write_text("<mujoco>\n\n\n<bodi/></mujoco>")
    assert refused(tmp_path, '<mujoco><asset><model file="x.xml"/></asset></mujoco>') == (
        "robot.xml:1:1: MuJoCo refuses the file: could not parse model file with error: "
        "XML Error: Schema violation: unrecognized element (element 'bodi') (element 'model') "
        "(line 4, of this model or of one that it attaches)"
    )


def test_huge_sizes_cost_nothing(tmp_path: Path) -> None:
    sizes = '<size nkey="2000000000" memory="1E" nuserdata="2000000000" nuser_body="100000000"/>'
    picture = '<asset><texture name="t" type="2d" builtin="flat" width="40000" height="40000"/></asset>'
    assert read_text(tmp_path, model_text(ARM, sizes + picture)).chain.n == 1


def test_numbers_that_are_no_use_are_refused(tmp_path: Path) -> None:
    text = model_text(
        f'<body name="base"><body name="one" pos="nan 0 0"><joint name="a" pos="1e70 0 0"/>{BALL}</body></body>'
    )
    column = text.index('<body name="one"') + 1
    assert refused(tmp_path, text) == (
        f"robot.xml:1:{column}: body[one]: the body's pose has a number that is not finite, or greater than 1e+60\n"
        f"robot.xml:1:{text.index('<joint') + 1}: joint[a]: the joint has a number that is not finite, "
        "or greater than 1e+60"
    )


def test_mujocos_warnings_become_notes(tmp_path: Path) -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        robot = read_text(tmp_path, model_text(ARM, '<compiler settotalmass="3"/>'))
    assert caught == []
    warned = [note for note in robot.notes if note.startswith("MuJoCo warns: ")]
    assert len(warned) == 1
    assert "settotalmass" in warned[0]


CHANGES = (
    "nan",
    "inf",
    "1e308",
    "1e-320",
    "-5",
    "0",
    "",
    "0 0 0",
    "2147483648",
    "99999999999999999999",
    "true",
    "one",
    "joint_a",
    "world",
    "tool0",
)
TAGS = (
    "body",
    "joint",
    "geom",
    "site",
    "frame",
    "replicate",
    "freejoint",
    "flexcomp",
    "composite",
    "tendon",
    "attach",
)
ATTRIBUTES = ("name", "pos", "quat", "range", "type", "axis", "euler", "joint", "class", "ref", "mass", "file")
SAMPLE = arm_text(
    4,
    '<body name="f1"><joint name="f1" type="slide"/><geom size="0.1"/></body><site name="tool0" pos="0 0 1"/>'
    '<body name="f2"><joint name="f2" type="slide"/><geom size="0.1"/></body>',
    '<compiler angle="degree" eulerseq="ZYX"/><default><joint damping="1"/><default class="c"><geom mass="2"/>'
    '</default></default><asset><mesh name="m" file="gone.stl"/><material name="red" rgba="1 0 0 1"/></asset>',
    '<equality><joint name="e" joint1="f1" joint2="f2"/></equality><tendon><fixed name="t"><joint joint="f1" '
    'coef="1"/></fixed></tendon><actuator><position joint="joint_a" kp="5" kv="1"/><motor joint="joint_b" gear="2"/>'
    '</actuator><keyframe><key name="home" qpos="0 0 0 0 0 0"/></keyframe>',
    'range="-90 90" ref="5" pos="0 0 0.1"',
)


def broken(rng: random.Random) -> str:
    """The sample with a few things wrong."""
    text = SAMPLE
    for _ in range(rng.randint(1, 2)):
        kind, change = rng.choice((0, 1, 2, 2, 2, 3, 4, 5, 5, 5)), rng.choice(CHANGES)
        at = rng.randrange(len(text))
        spots = {
            1: [match.span(1) for match in re.finditer(r'"([^"]*)"', text)],
            2: [match.span() for match in re.finditer(r"-?\d+\.?\d*", text)],
            3: [match.span(1) for match in re.finditer(r"<(\w+)", text)],
            4: [match.span() for match in re.finditer(r'[a-z]+(?==")', text)],
            5: [match.span() for match in re.finditer(r"<[^<>]+/>", text)],
        }.get(kind, [(at, at + rng.randint(0, 20))])
        start, stop = rng.choice(spots)
        change = {0: rng.choice('<>"&\0é ='), 3: rng.choice(TAGS), 4: rng.choice(ATTRIBUTES)}.get(kind, change)
        if kind == 5:
            change = "" if rng.random() < 0.5 else 2 * text[start:stop]
        text = text[:start] + change + text[stop:]
    return text


@pytest.mark.slow
def test_what_is_broken_is_refused_or_read_and_nothing_is_left_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    handler = mujoco.get_mju_user_warning()
    rng = random.Random(20240607)
    counts = {"read": 0, "refused": 0}
    messages = []
    for _ in range(500):
        text = broken(rng)
        try:
            robot = read_text(tmp_path, text)
        except ImportedFileError as error:
            counts["refused"] += 1
            messages.append(str(error))
            continue
        counts["read"] += 1
        assert robot.chain.n >= 1
        for joint in robot.chain.joints:
            assert np.isfinite(joint.T_parent_link).all()
            assert abs(np.linalg.norm(joint.axis) - 1.0) < 1e-9
    assert all(re.match(r"robot\.xml:\d+:\d+: .*[^:;,. ]$", line) for text in messages for line in text.splitlines())
    assert min(counts.values()) > 50
    assert os.listdir(tmp_path) == ["robot.xml"]
    assert mujoco.get_mju_user_warning() is handler
    assert capfd.readouterr() == ("", "")
