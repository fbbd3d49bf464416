"""``Robot``: every verb of the library on one noun."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
from collections.abc import Callable, Mapping
from html.parser import HTMLParser
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dh2sim
from dh2sim import Continuous, Fixed, Pose, Prismatic, Revolute, Robot
from dh2sim.draw.diagram.drawing import draw_robot
from dh2sim.errors import ConfigurationError, Dh2simError, OutputError, UnknownFrameError
from dh2sim.kinematics.singularity import manipulability, singular_values
from dh2sim.robot.row import Convention, JointType
from dh2sim.robot.spec import RobotSpec
from dh2sim.validate.report import RobotReport

GENERATED = Path(__file__).parents[1] / "generated"
ROBOTS = ["stanford", "puma560", "scara"]


@pytest.fixture
def arm() -> Robot:
    rows = [Revolute(d=0.4, alpha=-pi / 2), Revolute(d=0.15, alpha=pi / 2), Prismatic(limits=(0.1, 1.2))]
    return Robot(rows, name="my_arm", configurations={"out": [0.0, 1.0, 1.2]})


def test_a_robot_made_in_code_is_the_one_of_a_robot_file(arm: Robot, tmp_path: Path) -> None:
    text = """
name: my_arm
convention: standard
joints:
  - {type: revolute, d: 0.4, alpha: -pi/2}
  - {type: revolute, d: 0.15, alpha: pi/2}
  - {type: prismatic, limits: {position: [0.1, 1.2]}}
configurations: {out: [0, 1, 1.2]}
"""
    written = Robot.from_spec(dh2sim.parse_robot(text))
    assert [row.name for row in arm.spec.rows] == ["joint_1", "joint_2", "joint_3"]
    assert arm.mjcf().splitlines()[5:] == written.mjcf().splitlines()[5:]
    assert arm.urdf().splitlines()[5:] == written.urdf().splitlines()[5:]


def test_a_row_may_be_of_another_convention_and_of_any_type() -> None:
    robot = Robot(
        [Continuous(a=0.1), Fixed(d=0.2, name="flange"), Revolute(convention="standard", flip=True)],
        convention="modified",
    )
    assert [row.convention for row in robot.spec.rows] == [Convention.MODIFIED] * 2 + [Convention.STANDARD]
    assert [row.type for row in robot.spec.rows] == [JointType.CONTINUOUS, JointType.FIXED, JointType.REVOLUTE]
    assert [row.name for row in robot.spec.rows] == ["joint_1", "flange", "joint_3"]
    assert robot.n == 2


def test_base_and_tool_are_poses_positions_or_transforms() -> None:
    T = np.array([[0.0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])
    for tool in (T, Pose(xyz=T[:3, 3], rpy=np.array([0, 0, pi / 2]))):
        robot = Robot([Revolute()], base=(0.0, 0.0, 1.0), tool=tool)
        expected = T + np.array([[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 1], [0, 0, 0, 0]])
        np.testing.assert_allclose(robot.fk([0.0]), expected, atol=1e-15)


@pytest.mark.parametrize("name", ROBOTS)
def test_kinematics_take_any_batch_and_agree_with_the_functions(name: str) -> None:
    robot = Robot.load(name)
    q = robot.random_configurations(6, seed=3).reshape(2, 3, robot.n)
    assert np.array_equal(robot.fk(q), dh2sim.forward_kinematics(robot.chain, q))
    assert np.array_equal(robot.jacobian(q), dh2sim.geometric_jacobian(robot.chain, q))
    assert np.array_equal(robot.singular_values(q), singular_values(robot.jacobian(q)))
    assert np.array_equal(robot.manipulability(q, "dh_2"), manipulability(robot.jacobian(q, "dh_2")))
    assert np.array_equal(robot.jacobian(q, "dh_2"), dh2sim.geometric_jacobian(robot.chain, q, frame="dh_2"))
    for i, frame in enumerate(["dh_0", "dh_1", "dh_2"]):
        assert np.array_equal(robot.fk(q, frame=frame), dh2sim.frame_poses(robot.chain, q)[..., i, :, :])
    assert np.array_equal(robot.fk(q, frame="base_link"), np.broadcast_to(np.eye(4), (2, 3, 4, 4)))
    assert robot.fk(q[0, 0], frame="link_2").shape == (4, 4)


def test_a_configuration_is_given_by_its_name(arm: Robot) -> None:
    assert list(arm.configurations) == ["home", "zero", "out"]
    assert np.array_equal(arm.fk("out"), arm.fk([0.0, 1.0, 1.2]))
    assert np.array_equal(arm.fk("home"), arm.fk([0.0, 0.0, 0.1]))
    with pytest.raises(ConfigurationError) as caught:
        arm.jacobian("hme")
    assert str(caught.value) == (
        "my_arm has no configuration 'hme'. Did you mean 'home'? Configurations: home, zero, out"
    )


def test_an_unknown_frame_and_a_wrong_joint_vector_are_named(arm: Robot) -> None:
    with pytest.raises(UnknownFrameError, match="unknown frame 'dh_4'"):
        arm.fk([0.0, 0.0, 0.2], frame="dh_4")
    with pytest.raises(ConfigurationError, match="expected 3 joint coordinates"):
        arm.fk([0.0, 0.0])


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda arm: arm.fk("zero", frame=2), "unknown frame 2. Frames: base_link, link_1 to link_3, "),
        (lambda arm: arm.fk(0.0, 0.0), "unknown frame 0.0. Frames: "),
        (lambda arm: arm.random_configurations(-1), "the count must be a whole number of at least 0, got -1"),
        (lambda arm: arm.random_configurations(2.5), "the count must be a whole number of at least 0, got 2.5"),
        (lambda arm: arm.validate(samples=0), "samples must be a whole number of at least 1, got 0"),
        (lambda arm: arm.validate(samples="all"), "samples must be a whole number of at least 1, got 'all'"),
    ],
)
def test_a_wrong_argument_is_named(arm: Robot, wrong: Callable[[Robot], object], message: str) -> None:
    with pytest.raises(Dh2simError) as caught:
        wrong(arm)
    assert str(caught.value).startswith(message)


def test_rows_take_named_arguments_only_and_show_the_ones_they_have() -> None:
    with pytest.raises(TypeError) as caught:
        Revolute(0.0, 0.0, 0.4, 0.0)  # type: ignore[call-arg,arg-type]
    assert str(caught.value) == "Revolute takes named arguments only, as in Revolute(d=0.4, alpha=-pi / 2)"
    with pytest.raises(TypeError) as caught:
        Prismatic(theat=0.3)  # type: ignore[call-arg]
    assert str(caught.value) == (
        "Prismatic has no argument 'theat'. Did you mean 'theta'? Arguments: name, a, alpha, d, theta, beta, flip, "
        "limits, dynamics, link, actuator, convention"
    )
    assert "alpha: 'float' = 0.0" in str(inspect.signature(Fixed))


def test_limits_are_those_of_the_table_or_assumed(arm: Robot) -> None:
    lower, upper = arm.limits
    assert lower.tolist() == [-pi, -pi, 0.1]
    assert upper.tolist() == [pi, pi, 1.2]
    lower, upper = Robot([Continuous()]).limits
    assert (lower.tolist(), upper.tolist()) == ([-np.inf], [np.inf])


def test_an_export_is_verified_and_reports_what_was_written(arm: Robot, tmp_path: Path) -> None:
    report = arm.export(tmp_path)
    assert [file.path.relative_to(tmp_path).as_posix() for file in report.files] == [
        "my_arm/my_arm.urdf",
        "my_arm/my_arm.xml",
        "my_arm/scene.xml",
    ]
    assert all(check.position_error < 1e-14 for check in report.verified)
    assert "URDF: configurations (out)" in map(str, report.losses)
    assert (tmp_path / "my_arm" / "my_arm.xml").read_text() == arm.mjcf()
    assert arm.export(tmp_path, formats=["urdf"], verify=False).verified == ()


def test_the_compiled_model_is_that_of_the_exported_file(arm: Robot) -> None:
    model = arm.mjmodel()
    assert (model.nq, model.nbody) == (3, 5)
    assert [model.joint(i).name for i in range(3)] == ["joint_1", "joint_2", "joint_3"]


def test_validation_rollouts_and_conversion_work_on_a_robot_made_in_code(arm: Robot, tmp_path: Path) -> None:
    assert arm.validate(samples=10).ok
    run = arm.rollout(3, controller="hold", seed=7, steps=5, out=tmp_path / "run.zarr")
    assert run.sizes["rollout"] == 3
    assert arm.rollout(rollouts=2, steps=5).sizes["rollout"] == 2
    modified = arm.convert("modified")
    assert {row.convention for row in modified.spec.rows} == {Convention.MODIFIED}
    q = arm.random_configurations(10)
    np.testing.assert_allclose(modified.fk(q), arm.fk(q), atol=1e-14)


def test_a_saved_robot_is_loaded_as_the_same(arm: Robot, tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    arm.convert("modified").save(path)
    q = arm.random_configurations(10)
    np.testing.assert_allclose(Robot.load(path).fk(q), arm.fk(q), atol=1e-14)
    with pytest.raises(OutputError) as caught:
        arm.save(path)
    assert str(caught.value) == f"'{path}' already exists; choose another name, or pass overwrite=True"
    arm.save(str(path), overwrite=True)
    assert Robot.load(path).mjcf().splitlines()[5:] == arm.mjcf().splitlines()[5:]


def test_a_conversion_keeps_its_notes(tmp_path: Path) -> None:
    robot = Robot.load("stanford").convert("modified")
    assert robot.notes[-1] == "Parameters are replaced by their values."
    robot.save(tmp_path / "stanford.yaml")
    assert robot.notes[-1] in (tmp_path / "stanford.yaml").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_is_made_of_a_urdf_and_of_an_mjcf(name: str) -> None:
    original = Robot.load(name)
    q = original.random_configurations(20, seed=5)
    for robot in (
        Robot.from_urdf(GENERATED / name / f"{name}.urdf"),
        Robot.from_mjcf(str(GENERATED / name / f"{name}.xml"), convention="modified"),
    ):
        np.testing.assert_allclose(robot.fk(q), original.fk(q), atol=1e-9)


@pytest.mark.parametrize(
    ("path", "reader"),
    [
        ("scara/scara.urdf", "from_urdf"),
        ("scara/scara.xml", "from_mjcf"),
        ("a.urdf.xacro", "from_urdf"),
        ("table.CSV", "from_table"),
    ],
)
def test_a_file_of_another_format_is_sent_to_its_reader(path: str, reader: str) -> None:
    with pytest.raises(Dh2simError) as caught:
        Robot.load(GENERATED / path)
    assert str(caught.value) == f"{GENERATED / path}: not a robot file; read it with Robot.{reader}"


def test_a_robot_is_made_of_a_table(tmp_path: Path) -> None:
    path = tmp_path / "arm.md"
    path.write_text("| a | alpha | d | theta |\n|---|---|---|---|\n| 0 | -90 | 0.4 | q1 |\n| 0.2 | 0 | 0 | q2 |\n")
    robot = Robot.from_table(path, convention="standard", angle="deg", length="m", name="planar")
    assert (robot.name, robot.n) == ("planar", 2)
    assert robot.spec.rows[0].alpha == -pi / 2


def test_an_unknown_word_is_named_with_those_that_are_allowed(arm: Robot) -> None:
    with pytest.raises(Dh2simError) as caught:
        arm.convert("modfied")
    assert str(caught.value) == (
        "unknown form of a table 'modfied'. Did you mean 'modified'? Allowed: standard, modified, compact"
    )
    with pytest.raises(Dh2simError) as caught:
        arm.convert("hayati")
    assert str(caught.value) == "a table can be converted to standard, modified or compact, not to hayati"
    with pytest.raises(Dh2simError, match="unknown format 'sdf'"):
        arm.export("build", formats=["sdf"])


def test_a_robot_cannot_be_changed(arm: Robot) -> None:
    with pytest.raises(AttributeError):
        arm.spec = Robot.load("stanford").spec  # type: ignore[misc]


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda robot: pickle.loads(pickle.dumps(robot))])
def test_a_robot_can_be_copied_and_sent_to_another_process(copied: Callable[[Robot], Robot]) -> None:
    robot = Robot.load("puma560")
    again = copied(robot)
    assert again.mjcf() == robot.mjcf()
    assert again.spec.parameters == robot.spec.parameters
    assert not again.spec.gravity.flags.writeable


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda spec: pickle.loads(pickle.dumps(spec))])
@pytest.mark.parametrize("name", ["puma560", "four_bar"])
def test_a_copied_specification_is_as_frozen_as_the_original(
    copied: Callable[[RobotSpec], RobotSpec], name: str
) -> None:
    arrays: list[np.ndarray[Any, Any]] = []

    def collect(value: object) -> None:
        if isinstance(value, np.ndarray):
            arrays.append(value)
        elif dataclasses.is_dataclass(value):
            for each in dataclasses.fields(value):
                collect(getattr(value, each.name))
        elif isinstance(value, Mapping | tuple):
            for inner in value.values() if isinstance(value, Mapping) else value:
                collect(inner)

    collect(copied(Robot.load(name).spec))
    assert len(arrays) > 5
    assert not [array for array in arrays if array.flags.writeable]


def test_results_print_a_line_or_few_in_a_python_prompt(arm: Robot) -> None:
    goal = arm.fk(arm.configurations["home"])
    results = [
        arm.spec, arm.model, arm.chain, arm.ik(goal), arm.symbolic(), arm.mobility(), arm.draw(),
        arm.explain_ik(goal), arm.trajectory(["home", [0.1, 0.2, 0.5]]), arm.diff("scara"),
        RobotReport(name='my_arm', samples=1, reach=1.0, checks=()), Robot.load("four_bar").mechanism
    ]  # fmt: skip
    for result in results:
        kind = type(result).__name__
        assert repr(result).startswith(f"<{kind}"), kind
        assert len(repr(result)) < 200
        assert "\n" not in repr(result)
    assert str(arm.ik(goal)).splitlines()[0] == repr(arm.ik(goal))


def test_a_robot_prints_its_table(arm: Robot) -> None:
    assert repr(arm) == "<Robot 'my_arm': RRP, standard>"
    assert str(arm).splitlines() == [
        "my_arm: DH table, standard convention",
        "i  joint    type       a_i  alpha_i   d_i  theta_i       limits",
        "                         m      deg     m      deg",
        "─  ───────  ─────────  ───  ───────  ────  ───────  ───────────",
        "1  joint_1  revolute     0      -90   0.4      θ1*",
        "2  joint_2  revolute     0       90  0.15      θ2*",
        "3  joint_3  prismatic    0        0   d3*        0  0.1 … 1.2 m",
    ]


def test_functions_take_a_robot_in_any_form(arm: Robot) -> None:
    q = arm.random_configurations(4)
    for robot in (arm, arm.spec, arm.model, arm.chain):
        assert np.array_equal(dh2sim.forward_kinematics(robot, q), arm.fk(q))
        assert np.array_equal(dh2sim.geometric_jacobian(robot, q), arm.jacobian(q))
        assert dh2sim.frame_poses(robot, q).shape == (4, 4, 4, 4)
    for robot in (arm, arm.spec, arm.model):
        assert dh2sim.to_mjcf(robot) == arm.mjcf()
        assert dh2sim.to_urdf(robot) == arm.urdf()
        assert dh2sim.to_scene(robot).startswith("<!--")
        assert (
            dh2sim.build_model(robot).name == dh2sim.convert_robot(robot, Convention.MODIFIED).spec.name == "my_arm"
        )


def test_functions_take_a_mechanism_in_any_form(tmp_path: Path) -> None:
    four_bar = Robot.load("four_bar")
    for robot in (four_bar, four_bar.spec, four_bar.mechanism):
        assert np.array_equal(dh2sim.forward_kinematics(robot, "home", frame="dh_1"), four_bar.fk("home", "dh_1"))
        assert np.array_equal(dh2sim.geometric_jacobian(robot, "home"), four_bar.jacobian("home"))
        assert dh2sim.to_mjcf(robot) == four_bar.mjcf()
        assert dh2sim.to_urdf(robot) == four_bar.urdf()
        assert dh2sim.to_scene(robot).startswith("<!--")
        assert dh2sim.plan_trajectory(robot, ["home", [1.5]]).duration > 0.0
        assert len(dh2sim.export_robot(robot, tmp_path, verify=False).files) == 3


def test_functions_take_what_methods_take(arm: Robot, tmp_path: Path) -> None:
    assert np.array_equal(dh2sim.forward_kinematics(arm, "out", frame="dh_2"), arm.fk("out", "dh_2"))
    assert np.array_equal(dh2sim.geometric_jacobian(arm.spec, "out"), arm.jacobian("out"))
    goal = arm.fk("out")
    assert np.array_equal(dh2sim.inverse_kinematics(arm, goal, "out").q, arm.ik(goal, "out").q)
    for robot in (arm, arm.spec, arm.model):
        assert dh2sim.plan_trajectory(robot, ["home", "out"]).duration == arm.trajectory(["home", "out"]).duration
        assert dh2sim.robot_file_text(robot) == dh2sim.robot_file_text(arm.spec)
    assert str(dh2sim.symbolic_form(arm, "dynamics")) == str(arm.symbolic("dynamics"))
    report = dh2sim.export_robot(arm.spec, str(tmp_path), formats="mjcf", verify=False)
    assert [file.path.name for file in report.files] == ["my_arm.xml", "scene.xml"]
    dh2sim.save_robot(arm, tmp_path / "arm.yaml")
    assert Robot.load(tmp_path / "arm.yaml").mjcf().splitlines()[5:] == arm.mjcf().splitlines()[5:]


def test_exported_files_are_validated_where_they_are(arm: Robot, tmp_path: Path) -> None:
    arm.export(tmp_path)
    assert arm.validate(samples=5, folder=str(tmp_path / "my_arm")).ok
    (tmp_path / "my_arm" / "my_arm.urdf").write_text("<robot/>")
    assert not arm.validate(samples=5, folder=tmp_path / "my_arm").ok
    with pytest.raises(Dh2simError, match="base and tip are links of the source, and need it"):
        arm.validate(samples=5, tip="flange")


@pytest.mark.parametrize(
    ("function", "wanted"),
    [
        (lambda robot: dh2sim.forward_kinematics(robot, [0.0]), "a Robot, a RobotSpec or a KinematicChain"),
        (lambda robot: dh2sim.geometric_jacobian(robot, [0.0]), "a Robot, a RobotSpec or a KinematicChain"),
        (dh2sim.build_chain, "a Robot or a RobotSpec"),
        (dh2sim.build_model, "a Robot or a RobotSpec"),
        (dh2sim.to_mjcf, "a Robot or a RobotSpec"),
        (dh2sim.to_urdf, "a Robot or a RobotSpec"),
    ],
)
@pytest.mark.parametrize(
    ("given", "described"),
    [
        ("stanford", "'stanford'; Robot.load reads a file, or a robot that comes with dh2sim"),
        (3.0, "float"),
        (None, "None"),
    ],
)
def test_what_is_no_robot_is_refused_in_words(
    function: Callable[[Any], object], wanted: str, given: object, described: str
) -> None:
    with pytest.raises(TypeError) as caught:
        function(given)
    assert str(caught.value) == f"expected {wanted}, got {described}"


def test_an_import_takes_the_path_as_text() -> None:
    imported = dh2sim.import_robot(str(GENERATED / "scara" / "scara.urdf"))
    assert imported.spec.name == "scara"


MIXED = Robot(
    [
        Revolute(a=0.1, alpha=0.651, theta=pi / 2, flip=True, name="shoulder"),
        Prismatic(theta=-pi / 2, d=-0.25, flip=True, limits=(-0.1, 0.1)),
        Fixed(d=0.2),
        Continuous(convention="hayati", beta=0.5, theta=-0.3),
        Revolute(convention="modified", alpha=-pi / 2),
    ],
    name="mixed",
)


class Cells(HTMLParser):
    """The texts of a table's cells, by row; fails where an element is not closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.rows: list[list[str]] = []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag: str, attrs: object) -> None:  # noqa: ARG002
        if tag != "br":
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if {"td", "th"} & set(self.open):
            self.rows[-1][-1] += data


def test_a_notebook_shows_the_table_with_the_variables_starred() -> None:
    rows = Cells(Robot.load("stanford")._repr_html_()).rows
    assert rows[0] == ["i", "joint", "type", "aim", "αideg", "dim", "θideg", "limits"]
    assert rows[1] == ["1", "joint_1", "revolute", "0", "−90", "0.4", "θ1*", "−170 … 170°"]
    assert rows[3] == ["3", "joint_3", "prismatic", "0", "0", "d3*", "0", "0 … 1.27 m"]
    rows = Cells(MIXED._repr_html_()).rows
    assert {len(row) for row in rows} == {10}
    assert rows[1][3:] == ["standard", "0.1", "37.2996", "", "0", "90 − θ1*", ""]
    assert rows[2][3:] == ["standard", "0", "0", "", "−0.25 − d2*", "−90", "−0.1 … 0.1 m"]
    assert rows[4][3:] == ["hayati", "0", "0", "28.6479", "", "θ4* − 17.1887", ""]


def test_a_notebook_is_offered_the_table_as_latex() -> None:
    assert Robot.load("rpr")._repr_latex_() == "\n".join(
        [
            r"$\displaystyle \begin{array}{c|cccc}",
            r"i & a_{i-1} & \alpha_{i-1} & d_{i} & \theta_{i} \\",
            r" & [\mathrm{m}] & [^\circ] & [\mathrm{m}] & [^\circ] \\ \hline",
            r"1 & 0 & 0 & 0 & \theta_{1}^{*} \\",
            r"2 & 0 & 90 & d_{2}^{*} & 0 \\",
            r"3 & 0 & 0 & 0.2 & \theta_{3}^{*} \\",
            r"\end{array}$",
        ]
    )
    lines = MIXED._repr_latex_().splitlines()[1:-1]
    assert {line.count("&") for line in lines} == {6}
    assert lines[2] == r"1 & \text{standard} & 0.1 & 37.2996 &  & 0 & 90 - \theta_{1}^{*} \\"


def test_a_robot_is_drawn(arm: Robot) -> None:
    drawing = arm.draw("zero", style="stick", workspace=(-1, 1, -1, 1, -1, 1), reach=0.5)
    assert drawing.svg == draw_robot(arm.spec, "zero", style="stick", workspace=(-1, 1, -1, 1, -1, 1), reach=0.5).svg
    assert arm.draw().svg == draw_robot(arm, "home", style="kinematic").svg


def test_a_viewer_is_started_and_returned(arm: Robot) -> None:
    viewer = arm.view(browser=False, port=18090)
    try:
        assert viewer.url.startswith("http://127.0.0.1:180")
    finally:
        viewer.stop()


def test_inverse_kinematics_takes_poses_names_locks_and_what_is_free() -> None:
    puma = Robot.load("puma560")
    T = puma.fk("home")
    found = puma.ik(T, "home")
    assert found.best == pytest.approx(puma.configurations["home"], abs=1e-9)
    batch = puma.ik(np.stack([T, T]), limits=False)
    assert [len(one) for one in batch] == [8, 8]
    assert np.abs(puma.fk(batch[1].q) - T).max() <= 1e-12
    tracked = puma.ik(T, puma.configurations["home"] + 0.01, numeric=True)
    assert np.abs(puma.fk(tracked.best) - T).max() <= 1e-9
    held = puma.ik(T, lock={"joint_6": float(found.best[5])})
    assert set(held.q[:, 5]) == {found.best[5]}
    wrist = puma.ik(T, "home", free="rotation")
    assert np.abs(puma.fk(wrist.q)[:, :3, 3] - T[:3, 3]).max() <= 1e-12
