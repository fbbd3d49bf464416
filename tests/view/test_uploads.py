"""Robot files that come from a browser: checked as any other, and nothing that they name is looked at."""

from __future__ import annotations

import builtins
import math
import time
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from dh2sim.errors import Dh2simError
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.catalog import builtin_path
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.view import events
from dh2sim.view.initial_state import MAX_PROBLEMS, builtin_ghost, file_name, open_state, uploaded_ghost
from dh2sim.view.panel import markup
from dh2sim.view.state import Mode, Part
from tests.view.states import STANFORD, after

HEAD = "name: mine\nconvention: standard\njoints:\n"
ROW = "  - {type: revolute, a: 0.5, limits: {position: [-1, 1]}}\n"
MINE = f"{HEAD}{ROW}  - {{type: prismatic, theta: 0.3, limits: {{position: [0, 0.4]}}}}\n"


def upload(text: str | bytes, file: str = "mine.yaml") -> events.OpenText:
    return events.OpenText(text=text.encode() if isinstance(text, str) else text, file=file)


def assert_refused(text: str | bytes, *lines: str) -> None:
    """Nothing but the notice changes."""
    before = after(STANFORD, events.Nudge(joint=0, direction=1))
    state = after(before, upload(text))
    assert state.notice.split("\n") == ["Robot unchanged.", *lines]
    assert after(state, events.Notify(notice="")) == before


def test_an_uploaded_robot_is_at_home_where_its_table_has_it() -> None:
    puma = builtin_path("puma560")
    assert puma is not None
    text, spec = puma.read_bytes(), load_robot("puma560")
    state = after(STANFORD, upload(text, "my puma.yaml"))
    assert (state.file, state.folder) == ("my puma.yaml", None)
    assert state.text == text.decode()
    assert state.notice == "Opened my puma.yaml: puma560, 6 joints."
    assert [row.name for row in state.table.rows] == [row.name for row in spec.rows]
    assert state.q == tuple(state.model.home.tolist())
    assert np.array_equal(table_tool_pose(state.spec, state.q), table_tool_pose(spec, state.q))


def test_nothing_refers_to_the_robot_that_was_shown_before() -> None:
    eye = tuple(tuple(row) for row in np.eye(4).tolist())
    before = after(
        STANFORD,
        events.SelectRow(row=5),
        events.ChooseFrame(name="dh_6"),
        events.Show(part=Part.TRACE, on=True),
        events.Show(part=Part.GRID, on=False),
        events.MoveJoint(joint=0, value=0.5),
        events.EditCell(row=0, column="a", text="oh"),
        events.MoveTool(T_base_link_tool0=eye, q=None, reached=False),
        events.SetMode(mode=Mode.PHYSICS),
        events.Pause(on=True),
    )
    state = after(before, upload(MINE))
    assert (state.selected_row, state.frame, state.goal, state.trace) == (0, "tool0", None, ())
    assert (state.mode, state.paused, state.steps, state.target, state.drag) == (Mode.MANUAL, False, 0, None, None)
    assert state.table.errors == ()
    assert state.shown == before.shown
    assert state.notice == "Opened mine.yaml: mine, 2 joints."


def test_an_uploaded_robot_is_edited_as_any_other() -> None:
    state = after(STANFORD, upload(MINE), events.EditCell(row=0, column="a", text="0.7"))
    assert state.text == MINE.replace("a: 0.5", "a: 0.7")
    assert state.spec.rows[0].a == 0.7
    converted = after(state, events.SetUnits(angle=state.table.units.angle, length=state.table.units.length))
    assert np.array_equal(table_tool_pose(converted.spec, (0.1, 0.2)), table_tool_pose(state.spec, (0.1, 0.2)))


def test_the_ghost_stays_unless_it_is_the_misread_robot() -> None:
    scara = builtin_ghost("scara")
    assert after(STANFORD, events.Compare(ghost=scara), upload(MINE)).ghost == scara
    ghost = after(STANFORD, events.CompareMisread(), upload(MINE)).ghost
    assert ghost is not None
    assert ghost.misread
    assert ghost.model.spec.name == "mine_misread"


@pytest.fixture
def robot_with_mesh(tmp_path: Path) -> Path:
    trimesh.creation.box((0.1, 0.1, 0.1)).export(tmp_path / "box.stl")
    path = tmp_path / "boxed.yaml"
    path.write_text(f"{HEAD}  - {{type: revolute, a: 0.5, link: {{mesh: {{file: box.stl}}}}}}\n")
    return path


def test_going_back_to_the_opened_file_restores_its_name_and_its_folder(robot_with_mesh: Path) -> None:
    first = open_state(load_robot(robot_with_mesh), robot_with_mesh.parent)
    uploaded = after(first, upload(MINE))
    assert (uploaded.file, uploaded.folder) == ("mine.yaml", None)
    back = after(uploaded, events.OpenText(text=first.text, file=first.file, folder=first.folder))
    assert (back.file, back.folder, back.text) == (str(robot_with_mesh), robot_with_mesh.parent, first.text)
    assert back.model.links[0].mesh is not None
    edited = after(back, events.EditCell(row=0, column="a", text="-1"))
    assert edited.spec.rows[0].a == -1.0, edited.notice


def test_an_uploaded_file_names_no_mesh_and_no_path_of_it_is_followed(
    robot_with_mesh: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mesh = robot_with_mesh.parent / "box.stl"
    monkeypatch.chdir(mesh.parent)
    why = "found '{}'; a robot file that was uploaded cannot name mesh files"

    def followed(path: object, *_arguments: object, **_options: object) -> NoReturn:
        raise AssertionError(f"{path} is looked at")

    for path in ("box.stl", str(mesh), "../../none.stl", "/dev/stdin", "a\\u0000b.stl"):
        text = f'{HEAD}  - {{type: revolute, link: {{mesh: {{file: "{path}"}}}}}}\n'
        with monkeypatch.context() as patched:
            for owner, name in ((Path, "is_file"), (Path, "stat"), (Path, "open"), (builtins, "open")):
                patched.setattr(owner, name, followed)
            state = after(STANFORD, upload(text))
        assert state.model is STANFORD.model
        assert "\n" in state.notice
        if "\\" not in path:
            assert state.notice.split("\n")[1].endswith(why.format(path if len(path) <= 60 else f"{path[:57]}..."))
    with pytest.raises(Dh2simError, match="a robot file that was uploaded cannot name mesh files"):
        uploaded_ghost(robot_with_mesh.read_bytes(), "boxed.yaml")
    assert parse_robot(robot_with_mesh.read_text(), directory=mesh.parent).rows[0].link.mesh is not None


def test_existing_and_missing_meshes_are_refused_alike(robot_with_mesh: Path) -> None:
    for file in (robot_with_mesh.parent / "box.stl", robot_with_mesh.parent / "none.stl"):
        name = str(file) if len(str(file)) <= 60 else f"{str(file)[:57]}..."
        text = f"{HEAD}  - {{type: revolute, link: {{mesh: {{file: {file}}}}}}}\n"
        column = text.split("\n")[3].index(str(file)) + 1
        assert_refused(
            text,
            f"mine.yaml:4:{column}: joints[0].link.mesh.file: found '{name}'; a robot file that was uploaded cannot "
            "name mesh files",
        )


def test_all_errors_are_reported_as_for_any_robot_file() -> None:
    assert_refused(
        "name: 3d\nconvention: standrad\njoints:\n  - {type: revolute, a: __import__, alpha: 1/0}\n",
        "mine.yaml:1:7: name: a name is made of letters, digits, '_' and '-', starting with a letter; found '3d'",
        "mine.yaml:2:13: convention: found 'standrad'. Did you mean 'standard'? Allowed: standard, modified, hayati",
        "mine.yaml:4:25: joints[0].a: unknown name '__import__'. Known names: pi",
        "mine.yaml:4:44: joints[0].alpha: in '1/0': division by zero",
    )


def test_of_many_problems_the_first_and_the_number_of_others_are_reported() -> None:
    state = after(STANFORD, upload(HEAD + "  - {type: revolute, a: x}\n" * 40))
    lines = state.notice.split("\n")
    assert len(lines) == 1 + MAX_PROBLEMS + 1
    assert lines[1].startswith("mine.yaml:4:25: joints[0].a: ")
    assert lines[-1] == f"… and {40 - MAX_PROBLEMS} more."


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"", "1:1: the file is empty; a robot needs at least name, convention and joints"),
        (b"name: \x00", "1:7: control character U+0000 is not allowed"),
        (b'name: "\\0"', "1:7: name: control character U+0000 is not allowed"),
        (b"\x89PNG\r\n\x1a\n", "1:1: not UTF-8: byte 0x89"),
        (b"name: caf\xe9", "1:10: not UTF-8: byte 0xe9"),
        ("name: x".encode("utf-16"), "1:1: not UTF-8: byte 0xff"),
        (b"a" * 1_000_001, "1:1: the file has 1000001 bytes; at most 1000000 are allowed"),
        (b"name: !!python/object:os.system x", "1:7: name: tag '!!python/object:os.system' is not allowed; "),
        (b"[" * 500_000, "nested deeper than 32 levels"),
        (b"\xff" * 10, "1:1: not UTF-8: byte 0xff"),
    ],
    ids=["empty", "NUL", "escaped NUL", "a picture", "latin 1", "UTF-16", "large", "tag", "deep", "no text"],
)
def test_something_that_is_not_a_robot_file_is_refused(text: bytes, message: str) -> None:
    state = after(STANFORD, upload(text))
    assert state.model is STANFORD.model
    first = state.notice.split("\n")[1]
    assert first.startswith("mine.yaml:")
    assert message in first or (len(text) > 100_000 and "the line has" in first)


def test_an_entity_bomb_is_refused_at_once() -> None:
    bomb = "a0: &a0 [x, x]\n" + "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 20))
    started = time.thread_time()
    state = after(STANFORD, upload(bomb))
    assert time.thread_time() - started < 20.0
    assert state.model is STANFORD.model
    assert "more than 50000 values (aliases counted each time)" in state.notice


def test_values_that_an_anchor_shares_are_written_out_for_the_table() -> None:
    state = after(STANFORD, upload(f"{HEAD}  - {{type: revolute, a: &l 0.3}}\n  - {{type: revolute, a: *l}}\n"))
    assert [row.a for row in state.spec.rows] == [0.3, 0.3]
    edited = after(state, events.EditCell(row=0, column="a", text="0.5"))
    assert [row.a for row in edited.spec.rows] == [0.5, 0.3]


def test_a_robot_that_would_keep_this_machine_busy_for_long_is_not_built() -> None:
    started = time.thread_time()
    assert_refused(
        HEAD + "  - {type: revolute}\n" * 3000,
        "mine.yaml:4:3: joints: the list has 3000 entries; at most 494 are allowed",
    )
    assert_refused(
        HEAD + "  - {type: revolute}\n" * 300,
        "mine.yaml: the robot has 300 joints; at most 200 are allowed in an uploaded file",
    )
    assert time.thread_time() - started < 30.0
    many = "".join(f"  c{i}: [0]\n" for i in range(201))
    assert_refused(
        f"{HEAD}{ROW}configurations:\n{many}",
        "mine.yaml: the robot has 201 configurations; at most 200 are allowed in an uploaded file",
    )


def test_an_uploaded_robot_too_large_to_be_drawn_is_refused() -> None:
    row = "  - {type: revolute, a: 1e6}\n"
    message = "joints[1]: the lengths up to here add up to 2e+06 m; those of a robot may be 1e6 m together"
    assert_refused(HEAD + row + row, f"mine.yaml:5:5: {message}")


@settings(max_examples=min(60, settings().max_examples), deadline=None)
@given(st.binary(max_size=80) | st.text(max_size=80).map(lambda text: (HEAD + text).encode("utf-8", "replace")))
def test_no_bytes_bring_a_page_down(data: bytes) -> None:
    state = after(STANFORD, upload(data))
    assert state.model is STANFORD.model or state.spec == parse_robot(data)
    assert all(math.isfinite(value) for value in state.q)


def test_an_uploaded_ghost_has_the_name_of_its_robot() -> None:
    ghost = uploaded_ghost(MINE.encode(), "some file.yaml")
    assert (ghost.model.name, ghost.label, ghost.misread) == ("mine", "mine (uploaded)", False)
    with pytest.raises(Dh2simError) as caught:
        uploaded_ghost(b"name: x\n", "x.yaml")
    assert str(caught.value).split("\n") == [
        "Ghost unchanged.",
        "x.yaml:1:1: missing key 'convention'",
        "x.yaml:1:1: missing key 'joints'",
    ]


def test_a_ghost_with_an_unknown_name_opens_no_file(robot_with_mesh: Path) -> None:
    for name in (str(robot_with_mesh), "../robots/scara", "/etc/passwd", ""):
        with pytest.raises(Dh2simError, match=r"^unknown robot '"):
            builtin_ghost(name)


@pytest.mark.parametrize(
    ("given", "called"),
    [
        ("arm.yaml", "arm.yaml"),
        ("../../etc/arm.yaml", "arm.yaml"),
        ("C:\\robots\\arm.yaml", "arm.yaml"),
        ("", "robot.yaml"),
        ("   ", "robot.yaml"),
        ("folder/", "robot.yaml"),
        ("a\nb\x00c\u202egnp.yaml", "a_b_c_gnp.yaml"),
        ("ro\u0308bot é.yaml", "ro\u0308bot é.yaml"),
        ("x" * 1_000_000 + ".yaml", "x" * 54 + "….yaml"),
    ],
    ids=["plain", "folders", "Windows", "none", "blanks", "folder", "unprintable", "accents", "long"],
)
def test_the_name_of_an_uploaded_file_is_fit_to_be_shown(given: str, called: str) -> None:
    assert file_name(given) == called


def test_names_are_shown_as_text_and_not_as_html() -> None:
    name = file_name("<img src=x onerror=alert(1)>.yaml")
    state = after(STANFORD, upload("name: <b>x</b>\n", name))
    shown = markup.lines_of_text(state.notice)
    assert "<img" not in shown
    assert "&lt;img src=x onerror=alert(1)&gt;.yaml:1:7: name: a name is made of" in shown
    assert "&lt;b&gt;x&lt;/b&gt;" in shown
    assert shown.count("<br>") == state.notice.count("\n")
