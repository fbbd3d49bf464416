"""Base parameters are as few as can be: as many as the torques of pinocchio depend on."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dh2sim import Prismatic, Revolute, Robot
from dh2sim.codegen.generate import generate_code, summarize
from dh2sim.formats.urdf.write import to_urdf
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.links import LinkSpec
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import read_only
from tests.codegen.test_inverse_dynamics import compare_with_mujoco
from tests.sample_robots import ODD_ROBOT, robot

SLIDES = Robot(
    [Prismatic(alpha=0.4), Revolute(a=0.3), Prismatic(a=0.2, alpha=0.7), Prismatic(d=0.1, alpha=1.1), Revolute(a=0.1)]
).spec


def with_general_links(spec: RobotSpec) -> RobotSpec:
    """The same robot, with links of which nothing is symmetric."""
    generator = np.random.default_rng(12)

    def link() -> LinkSpec:
        A = generator.uniform(-1, 1, (3, 3))
        second = A @ A.T + np.eye(3)
        return LinkSpec(
            mass=generator.uniform(1, 5),
            com=read_only(generator.uniform(-0.2, 0.2, 3)),
            inertia=read_only(0.05 * (np.trace(second) * np.eye(3) - second)),
        )

    return replace(spec, rows=tuple(replace(row, link=link()) for row in spec.rows))


def rank_of_the_regressor(built: RobotModel, folder: Path) -> int:
    """On how many combinations of the links' parameters the torques depend."""
    pinocchio = pytest.importorskip("pinocchio", reason="pinocchio is not installed")
    file = folder / "robot.urdf"
    file.write_text(to_urdf(built))
    arm = pinocchio.buildModelFromUrdf(str(file))
    arm.gravity.linear = np.array(built.spec.gravity)
    data, generator = arm.createData(), np.random.default_rng(13)
    rows = [
        pinocchio.computeJointTorqueRegressor(
            arm, data, pinocchio.integrate(arm, pinocchio.neutral(arm), generator.uniform(-3, 3, arm.nv)), *states
        )
        for states in generator.uniform(-2, 2, (40, 2, arm.nv))
    ]
    values = np.linalg.svd(np.vstack(rows), compute_uv=False)
    return int((values > 1e-10 * values[0]).sum())


ARMS = {name: robot(name) for name in ("puma560", "franka_panda", "ur5e", "so101", "scara", "stanford", "rpr")} | {
    "odd": ODD_ROBOT,
    "slides": SLIDES,
}


@pytest.mark.parametrize("name", ARMS)
def test_there_are_no_more_base_parameters_than_the_torques_depend_on(name: str, tmp_path: Path) -> None:
    built = build_model(with_general_links(ARMS[name]))
    names = [constant for constant, _, _ in summarize(built).constants]
    parameters = [constant for constant in names if re.fullmatch(r"(?:XX|XY|XZ|YY|YZ|ZZ|MX|MY|MZ|M)[0-9]+", constant)]
    assert len(parameters) == rank_of_the_regressor(built, tmp_path)


@pytest.mark.parametrize("name", ARMS)
def test_forces_of_general_links_equal_those_of_mujoco(name: str) -> None:
    compare_with_mujoco(with_general_links(ARMS[name]))


def test_links_that_cannot_move_a_joint_are_not_in_its_code() -> None:
    text = generate_code(with_general_links(robot("planar_2r")), "python", "inverse-dynamics")
    # its axes are vertical
    assert set(re.findall(r"^([A-Z]+[0-9]) =", text, flags=re.MULTILINE)) == {"ZZ1", "MX2", "MY2", "ZZ2"}
