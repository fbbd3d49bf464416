"""A robot made in code is checked as a robot file is: nothing wrong reaches a writer."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from dh2sim import (
    ActuatorSpec,
    Continuous,
    Dynamics,
    Fixed,
    Limits,
    LinkSpec,
    Pose,
    Prismatic,
    Revolute,
    Robot,
    RobotSpec,
    Row,
    ShapeSpec,
    ToolSpec,
)
from dh2sim.errors import Dh2simError, MeshError, RobotError
from dh2sim.robot.links import BaseSpec, MeshSpec
from dh2sim.robot.magnitudes import (
    ACCELERATION,
    ANGLE,
    ARMATURE,
    DAMPING,
    DENSITY,
    EFFORT,
    FRICTION,
    LENGTH,
    MASS,
    POSITION_GAIN,
    VELOCITY_GAIN,
    Magnitude,
)

NAN, INF = math.nan, math.inf
NAME = "is made of letters, digits, '_' and '-', starting with a letter; found"
XYZ = "expected a list of 3 numbers (x, y, z), found"
POSE = "expected a Pose, a position of shape (3,) or a transform of shape (4, 4), found shape"
NOT_RIGID = "the matrix is not a rigid transform: a rotation and a position above 0, 0, 0, 1"
CONVENTIONS = "Allowed: standard, modified, hayati"
KEYS = "name, type, convention, a, alpha, d, theta, beta, flip, limits, dynamics, link, actuator"


def row(**fields: Any) -> Robot:
    return Robot([Revolute(**fields)])


def link(**fields: Any) -> Robot:
    return Robot([Revolute(link=LinkSpec(**fields))])


def robot(**fields: Any) -> Robot:
    return Robot([Revolute(), Prismatic()], **fields)


def rows(*given: Any) -> Robot:
    return Robot(given)


def spec(**fields: Any) -> RobotSpec:
    return RobotSpec(**{"name": "arm", "rows": [Row(type="revolute")], **fields})  # type: ignore[arg-type]


WRONG: list[tuple[Callable[[], object], str]] = [
    # numbers of the table
    (lambda: row(alpha=NAN), "joints[0].alpha: expected a finite number, found nan"),
    (lambda: row(a=-INF), "joints[0].a: expected a finite number, found -inf"),
    (lambda: row(d=np.float64("inf")), "joints[0].d: expected a finite number, found inf"),
    (lambda: row(a=10**400), "joints[0].a: expected a finite number, found a number of too many digits"),
    (lambda: row(theta="pi/2"), "joints[0].theta: expected a number, found 'pi/2'"),
    (lambda: row(a=None), "joints[0].a: expected a number, found nothing"),
    (lambda: row(a=True), "joints[0].a: expected a number, found true"),
    (lambda: row(a=1j), "joints[0].a: expected a number, found a complex"),
    (lambda: row(a=np.zeros(2)), "joints[0].a: expected a number, found a list"),
    (
        lambda: row(beta=0.1),
        "joints[0].beta: a standard row takes no 'beta', the second twist of a row of 'convention: hayati'",
    ),
    (
        lambda: row(convention="hayati", d=0.1),
        "joints[0].d: a revolute Hayati row takes no 'd', which nearly parallel axes leave free; use 'a' and 'beta', "
        "or another convention for this row",
    ),
    # names
    (lambda: row(name="1st"), f"joints[0].name: a name {NAME} '1st'"),
    (lambda: row(name=""), f"joints[0].name: a name {NAME} ''"),
    (lambda: row(name='x"/><joint'), f"joints[0].name: a name {NAME} 'x\"/><joint'"),
    (lambda: row(name=7), f"joints[0].name: a name {NAME} 7"),
    (lambda: row(name="a" * 101), "joints[0].name: a name has at most 100 characters, found 101"),
    (
        lambda: row(name="base_link-base"),
        "joints[0].name: 'base_link-base' is the name of a fixed joint in the exports; choose another",
    ),
    (
        lambda: rows(Revolute(name="x"), Revolute(name="x")),
        "joints[1].name: duplicate joint name 'x'; joints[0] has it already",
    ),
    (
        lambda: rows(Revolute(name="joint_2"), Revolute()),
        "joints[1]: duplicate default joint name 'joint_2'; joints[0] has it already",
    ),
    (lambda: robot(name="my arm"), f"name: a name {NAME} 'my arm'"),
    (lambda: robot(name="../arm"), f"name: a name {NAME} '../arm'"),
    (lambda: robot(name=None), f"name: a name {NAME} nothing"),
    # words
    (
        lambda: row(convention="modfied"),
        f"joints[0].convention: found 'modfied'. Did you mean 'modified'? {CONVENTIONS}",
    ),
    (
        lambda: robot(convention="craig"),
        f"convention: found 'craig', which is called 'modified' here. {CONVENTIONS}",
    ),
    (lambda: robot(convention=None), f"convention: found nothing. {CONVENTIONS}"),
    (
        lambda: rows(Row(type="rotary")),  # type: ignore[arg-type]
        "joints[0].type: found 'rotary'. Allowed: revolute, continuous, prismatic, fixed",
    ),
    (lambda: row(flip="yes"), "joints[0].flip: expected true or false, found 'yes'"),
    (lambda: row(flip=1), "joints[0].flip: expected true or false, found 1"),
    (lambda: robot(description=3), "description: expected text, found 3"),
    # limits and dynamics
    (lambda: row(limits=(1, -1)), "joints[0].limits.position: the lower limit 1.0 is not below the upper limit -1.0"),
    (
        lambda: row(limits=(1, 2, 3)),
        "joints[0].limits.position: expected a list of 2 numbers (lower, upper), found a list of 3",
    ),
    (lambda: row(limits=(0, INF)), "joints[0].limits.position[1]: expected a finite number, found inf"),
    (lambda: row(limits="wide"), "joints[0].limits: expected a Limits, found 'wide'"),
    (lambda: row(limits=Limits(velocity=0)), "joints[0].limits.velocity: must be greater than 0, found 0"),
    (lambda: row(limits=Limits(effort=-5)), "joints[0].limits.effort: must be greater than 0, found -5"),
    (
        lambda: rows(Continuous(limits=(-1, 1))),
        "joints[0].limits.position: a continuous joint has no position limits; make it revolute or remove them",
    ),
    (lambda: rows(Fixed(limits=(-1, 1))), "joints[0].limits: a fixed row does not move: it takes no 'limits'"),
    (lambda: rows(Fixed(flip=True)), "joints[0].flip: a fixed row does not move: it takes no 'flip'"),
    (lambda: row(dynamics=Dynamics(damping=-1)), "joints[0].dynamics.damping: must not be negative, found -1"),
    (
        lambda: row(dynamics=Dynamics(armature=NAN)),
        "joints[0].dynamics.armature: expected a finite number, found nan",
    ),
    (lambda: row(dynamics=Limits()), "joints[0].dynamics: expected a Dynamics, found a Limits"),
    # links
    (lambda: link(mass=-1), "joints[0].link.mass: must not be negative, found -1"),
    (
        lambda: link(mass=0),
        "joints[0].link.mass: joint_1 would move nothing that has mass; 0 is for links between others, or before a "
        "tool that has a mass",
    ),
    # tools and payloads
    (lambda: robot(tool=ToolSpec(mass=-1)), "tool.mass: must not be negative, found -1"),
    (
        lambda: robot(tool=ToolSpec(com=np.zeros(3))),
        "tool.com: a tool that has a 'com' needs a 'mass', or a 'shape' to estimate it from",
    ),
    (
        lambda: robot(tool=ToolSpec(shape=ShapeSpec(type="cylinder", radius=1.0))),  # type: ignore[arg-type]
        "tool.shape: missing key 'length', of a cylinder",
    ),
    (lambda: robot(payload="heavy"), "payload.mass: expected a number, found 'heavy'"),
    (lambda: robot(payload=[1.0]), "payload: expected a PayloadSpec, found a list"),
    (lambda: link(mass="heavy"), "joints[0].link.mass: expected a number, found 'heavy'"),
    (lambda: link(com=[0, 0]), f"joints[0].link.com: {XYZ} a list of 2"),
    (lambda: link(com=[0, 0, NAN]), "joints[0].link.com[2]: expected a finite number, found nan"),
    (
        lambda: link(inertia=np.diag([1.0, 1.0, 3.0])),
        "joints[0].link.inertia: no body has the principal moments 1, 1, 3: two make less than the third",
    ),
    (
        lambda: link(inertia=np.diag([1.0, 1.0, -1.0])),
        "joints[0].link.inertia: not positive definite: the principal moments are -1, 1, 1",
    ),
    (lambda: link(inertia=np.tri(3)), "joints[0].link.inertia: the matrix is not symmetric"),
    (lambda: link(inertia=[1, 2, 3]), "joints[0].link.inertia: expected a 3 × 3 matrix, found a list"),
    (lambda: link(radius=-0.1), "joints[0].link.radius: must be greater than 0, found -0.1"),
    (lambda: link(color=(1, 0, 0, 2)), "joints[0].link.color[3]: must be from 0 to 1, found 2"),
    (
        lambda: link(color="red"),
        "joints[0].link.color: expected a list of 3 or 4 numbers (red, green, blue, alpha), found 'red'",
    ),
    (lambda: link(mesh="a.stl"), "joints[0].link.mesh: expected a MeshSpec, found 'a.stl'"),
    (
        lambda: link(mesh=MeshSpec(file=Path("a.step"))),
        "joints[0].link.mesh.file: 'a.step' is not a mesh file that can be read; "
        "allowed: .stl, .obj, .ply, .glb, .dae",
    ),
    (lambda: row(link="steel"), "joints[0].link: expected a LinkSpec, found 'steel'"),
    # actuators
    (
        lambda: row(actuator=ActuatorSpec(type="servo")),  # type: ignore[arg-type]
        "joints[0].actuator.type: found 'servo'. Allowed: position, velocity, motor, none",
    ),
    (
        lambda: row(actuator=ActuatorSpec(type="motor", kp=3)),  # type: ignore[arg-type]
        "joints[0].actuator.kp: an actuator of type 'motor' takes no kp; kp is for position",
    ),
    (lambda: row(actuator="motor"), "joints[0].actuator: expected an ActuatorSpec, found 'motor'"),
    # the robot as a whole
    (lambda: robot(gravity=(0, 0, NAN)), "gravity[2]: expected a finite number, found nan"),
    (lambda: robot(gravity=9.81), f"gravity: {XYZ} 9.81"),
    (lambda: robot(base="floor"), f"base.xyz: {XYZ} 'floor'"),
    (
        lambda: robot(base=Pose(rpy=np.zeros(2))),
        "base.rpy: expected a list of 3 numbers (roll, pitch, yaw), found a list of 2",
    ),
    (lambda: robot(tool=(0, 0, INF)), "tool.xyz[2]: expected a finite number, found inf"),
    (lambda: robot(tool=np.eye(3)), f"tool: {POSE} (3, 3)"),
    (lambda: robot(tool=np.diag([1.0, 1.0, -1.0, 1.0])), f"tool: {NOT_RIGID}"),
    (lambda: robot(base=np.full((4, 4), NAN)), f"base: {NOT_RIGID}"),
    (
        lambda: robot(configurations={"home": [0]}),
        "configurations.home: expected 2 numbers, one for each moving row (joint_1, joint_2), found a list of 1",
    ),
    (lambda: robot(configurations={"home": [0, NAN]}), "configurations.home[1]: expected a finite number, found nan"),
    (
        lambda: robot(configurations={"my home": [0, 0]}),
        f"configurations: the name of a configuration {NAME} 'my home'",
    ),
    (lambda: robot(configurations=[0, 0]), "configurations: expected a mapping, found a list"),
    (
        lambda: Robot([Revolute(limits=(-1, 1))], configurations={"home": [2]}),
        "configurations.home[0]: 2.0 is outside the limits of joint_1: -1.0 to 1.0",
    ),
    # rows
    (lambda: rows(), "joints: the list is empty; at least one entry is needed"),
    (lambda: Robot(None), "joints: expected a list, found nothing"),  # type: ignore[arg-type]
    (
        lambda: Robot("stanford"),  # type: ignore[arg-type]
        "joints: expected a list of rows, found 'stanford'; Robot.load reads a robot file",
    ),
    (lambda: rows(Revolute(), None), "joints[1]: expected a Row, found nothing"),
    (lambda: rows([0, 0, 0.4, 0]), "joints[0]: expected a Row, found a list"),
    (
        lambda: rows({"type": "revolute", "alfa": 1}),
        f"joints[0]: unknown key 'alfa'. Did you mean 'alpha'? Allowed keys: {KEYS}",
    ),
    # specifications without the facade
    (lambda: spec(rows=()), "joints: the list is empty; at least one entry is needed"),
    (lambda: spec(base=Pose()), "base: expected a BaseSpec, found a Pose"),
    (lambda: spec(base=BaseSpec(color=(2, 0, 0, 1))), "base.color[0]: must be from 0 to 1, found 2"),
    (lambda: spec(units="deg"), "units: expected a Units, found 'deg'"),
    (lambda: spec(parameters={"x": NAN}), "parameters.x: expected a finite number, found nan"),
    # magnitudes
    (lambda: rows(Revolute(a=1e7)), "joints[0].a: must be from -1e6 to 1e6 m, found 10000000.0"),
    (
        lambda: rows(Revolute(), Revolute(alpha=-2e6)),
        "joints[1].alpha: must be from -1e6 to 1e6 rad, found -2000000.0",
    ),
    (lambda: link(mass=1e-16), "joints[0].link.mass: must be 0, or from 1e-12 to 1e30 kg, found 1e-16"),
    (lambda: link(radius=1e-161), "joints[0].link.radius: must be from 1e-6 to 1e6 m, found 1e-161"),
    (
        lambda: rows(Revolute(dynamics=Dynamics(armature=1e305))),
        "joints[0].dynamics.armature: must be at most 1e50 kg·m² or kg, found 1e+305",
    ),
    (
        lambda: rows(Prismatic(limits=Limits(velocity=1e9))),
        "joints[0].limits.velocity: must be from 1e-6 to 1e6 m/s, found 1000000000.0",
    ),
    (lambda: robot(gravity=(0, 0, 1e307)), "gravity[2]: must be from -1e6 to 1e6 m/s², found 1e+307"),
    (
        lambda: robot(configurations={"home": [1e7, 0]}),
        "configurations.home[0]: must be from -1e6 to 1e6 rad, found 10000000.0",
    ),
]


@pytest.mark.parametrize(("make", "message"), WRONG, ids=[message.partition(";")[0][:70] for _, message in WRONG])
def test_a_wrong_robot_is_refused_when_it_is_made(make: Callable[[], object], message: str) -> None:
    with pytest.raises(RobotError) as caught:
        make()
    assert str(caught.value) == message
    assert isinstance(caught.value, Dh2simError)
    assert isinstance(caught.value, ValueError)


@pytest.mark.parametrize("large", [True, False])
def test_a_robot_of_the_largest_and_smallest_numbers_has_a_model_of_finite_numbers(large: bool) -> None:
    def size(of: Magnitude) -> float:
        return of.most if large else of.least or 1e-59

    length, angle = (size(of) if large else 1e-59 for of in (LENGTH, ANGLE))
    part = length / 4  # the lengths of all rows are bounded together
    shape = LinkSpec(density=size(DENSITY), radius=size(LENGTH))
    friction = Dynamics(damping=size(DAMPING), friction=size(FRICTION), armature=size(ARMATURE))
    arm = Robot(
        [
            Revolute(a=part, alpha=angle, d=part, theta=angle, link=shape),
            Revolute(dynamics=friction, link=LinkSpec(mass=size(MASS), com=np.array([length, 0.0, length]))),
            Prismatic(d=part, actuator=ActuatorSpec(kp=size(POSITION_GAIN), kv=size(VELOCITY_GAIN))),
            Revolute(a=part, limits=Limits(velocity=size(ANGLE), effort=size(EFFORT))),
        ],
        gravity=(0.0, 0.0, -(size(ACCELERATION) or 1e-59)),
    )
    for text in (arm.urdf(), arm.mjcf()):
        assert not re.search(r"\b(nan|inf)\b", text, re.IGNORECASE)
        assert mujoco.MjModel.from_xml_string(text).nq == 4


def test_a_mesh_that_there_is_not_is_named_with_its_link(tmp_path: Path) -> None:
    arm = link(mesh=MeshSpec(file=tmp_path / "a.stl"))
    with pytest.raises(MeshError) as caught:
        arm.urdf()
    assert str(caught.value) == f"link_1: cannot read the mesh '{tmp_path / 'a.stl'}': No such file or directory"


def test_everything_that_is_wrong_is_said_at_once() -> None:
    with pytest.raises(RobotError) as caught:
        Robot([Revolute(a=NAN, name="a b"), Prismatic(limits=(1, 0))], gravity=[0, 0])
    assert [problem.path for problem in caught.value.problems] == [
        "gravity",
        "joints[0].name",
        "joints[0].a",
        "joints[1].limits.position",
    ]
    assert str(caught.value).count("\n") == 3


def test_what_is_given_is_copied_and_cannot_be_written_to() -> None:
    com, home = np.zeros(3), np.zeros(1)
    arm = Robot([Revolute(link=LinkSpec(com=com))], configurations={"home": home})
    com[0] = home[0] = NAN
    kept = (arm.spec.rows[0].link.com, arm.spec.configurations["home"], arm.spec.gravity)
    for array in kept:
        assert array is not None
        assert np.isfinite(array).all()
        assert not array.flags.writeable
