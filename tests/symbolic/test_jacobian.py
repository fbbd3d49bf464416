"""The Jacobian in symbols, its determinant in factors and the singular configurations it names."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.errors import Dh2simError
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.forward import frame_pose, geometric_jacobian
from dh2sim.robot.row import JointType
from dh2sim.robot.spec import RobotSpec
from dh2sim.symbolic.check import SampledConfigurations, check_form
from dh2sim.symbolic.expression import evaluated
from dh2sim.symbolic.request import symbolic_form
from dh2sim.symbolic.table import Fold
from dh2sim.typing import Array
from tests.sample_robots import NAMES, row
from tests.sample_robots import robot as spec_of
from tests.strategies import robot_specs


@given(robot_specs(max_rows=4), st.sampled_from(Fold))
def test_jacobian_equals_that_of_the_chain(spec: RobotSpec, fold: Fold) -> None:
    form = symbolic_form(spec, "jacobian", fold=fold).form
    configurations = SampledConfigurations(form.table, seed=3)
    J = geometric_jacobian(build_chain(spec), configurations.q)
    only_J = replace(form, equations=form.equations[:1])
    scale = np.array([[configurations.length]] * 3 + [[1.0]] * 3)
    assert check_form(only_J, {"J": J}, configurations, scales={"J": scale}) <= 1e-13


@pytest.mark.parametrize("name", [name for name in NAMES if len(spec_of(name).rows) == 6])
def test_determinant_of_every_six_axis_arm_has_factors_equal_to_that_of_the_chain(name: str) -> None:
    form = symbolic_form(spec_of(name), "jacobian").form
    _, determinant = form.equations
    configurations = SampledConfigurations(form.table, seed=4)
    expected = np.linalg.det(geometric_jacobian(build_chain(spec_of(name)), configurations.q))
    only = replace(form, equations=(determinant,))
    size = max(float(np.abs(expected).max()), configurations.length**3)
    check_form(only, {"det J": expected[:, None, None]}, configurations, scales={"det J": size})
    assert len(determinant.flat[0].terms) == 1


def lines(spec: RobotSpec, source: str = "base_link", target: str = "tool0") -> list[str]:
    text = str(symbolic_form(spec, "jacobian", source=source, target=target))
    return [" ".join(line.split()) for line in text.splitlines()]


def test_determinant_of_the_puma_is_elbow_shoulder_and_wrist() -> None:
    text = lines(spec_of("puma560"))
    assert "det J = -a2*s5*(a3*s3 + d4*c3)*(a2*c2 + a3*c23 - d4*s23)" in text
    assert "s5 = 0 (wrist): theta_5 = 0° or 180°" in text
    assert "a3*s3 + d4*c3 = 0 (elbow): theta_3 = -87.3084° or 92.6916°" in text
    assert "a2*c2 + a3*c23 - d4*s23 = 0 (shoulder)" in text


def test_determinant_of_part_of_an_arm_is_that_of_its_own_joints() -> None:
    text = lines(spec_of("stanford"), source="dh_0", target="dh_3")
    assert "det J(vx, vy, vz) = -d3^2*s2" in text
    assert "The determinant is that of the joints between dh_0 and dh_3." in text
    assert "det J(wx, wy, wz) = -s5" in lines(spec_of("puma560"), source="dh_3", target="dh_6")


@pytest.mark.parametrize("name", ["puma560", "stanford", "cylindrical_wrist"])
def test_jacobian_between_any_two_frames_equals_the_table(name: str) -> None:
    frames = ["base_link", "dh_1", "dh_2", "dh_4", "tool0"]
    for source, target in itertools.product(frames, frames):
        assert symbolic_form(spec_of(name), "jacobian", source=source, target=target).form.error <= 1e-13


def test_six_of_seven_joints_have_a_determinant_forwards_and_backwards() -> None:
    spec = spec_of("franka_panda")
    configurations = SampledConfigurations(symbolic_form(spec, "jacobian").form.table, seed=5)
    numbers = np.abs(np.linalg.det(configurations.jacobian("dh_0", "dh_6")[:, :, :6]))
    for frames in (("dh_0", "dh_6"), ("dh_6", "dh_0")):
        form = symbolic_form(spec, "jacobian", source=frames[0], target=frames[1]).form
        values = configurations.values(form.atoms)
        [found] = evaluated(form.equations[1].flat, form.named, values)
        np.testing.assert_allclose(np.abs(found), numbers, atol=1e-13)


def test_robot_without_a_joint_that_moves_has_no_jacobian() -> None:
    with pytest.raises(Dh2simError, match="has no joint that moves, and so no Jacobian"):
        symbolic_form(RobotSpec(name="post", rows=(row("a", JointType.FIXED, a=1.0),)), "jacobian")


def test_the_angles_of_a_singular_configuration_are_singular() -> None:
    chain = build_chain(spec_of("puma560"))
    for q3 in (-87.3084, 92.6916):
        q = np.array([0.3, -0.7, math.radians(q3), 1.1, 0.6, -0.4])
        assert abs(np.linalg.det(geometric_jacobian(chain, q))) < 1e-7


def test_determinant_of_the_stanford_arm() -> None:
    assert "det J = d3^2*s2*s5" in lines(spec_of("stanford"))


def test_a_planar_arm_has_the_determinant_of_its_linear_rows_and_a_wrist_that_of_its_angular_ones() -> None:
    assert "det J(vx, vy) = a1*a2*s2" in lines(spec_of("planar_2r"))
    assert "det J(wx, wy, wz) = -s2" in lines(spec_of("spherical_wrist"))
    assert "det J(vx, vy, vz, wz) = a1*a2*s2" in lines(spec_of("scara"))


def test_a_redundant_arm_has_no_determinant() -> None:
    assert not any("det" in line for line in lines(spec_of("kuka_iiwa14")))


def test_an_arm_that_is_singular_everywhere_says_so() -> None:
    rows = tuple(row(f"j{i}", a=0.1) for i in range(6))
    text = lines(RobotSpec(name="flat", rows=rows))
    assert "det J" not in " ".join(text)  # six joints, three rows that are not zero


def test_an_arm_of_odd_twists_prints_its_jacobian_without_a_determinant() -> None:
    rows = tuple(row(f"j{i}", a=0.1 + 0.01 * i, d=0.2 - 0.01 * i, alpha=0.3 + 0.1 * i) for i in range(6))
    text = " ".join(lines(RobotSpec(name="general", rows=rows)))
    assert "The determinant has no factors that its structure shows; it is left out." in text


@pytest.mark.parametrize(("source", "target"), [("dh_2", "dh_5"), ("tool0", "base_link"), ("dh_4", "link_2")])
def test_jacobian_of_any_frame_in_any_other_is_that_of_differences(source: str, target: str) -> None:
    spec = spec_of("stanford")
    form = symbolic_form(spec, "jacobian", source=source, target=target).form
    chain = build_chain(spec)
    q = SampledConfigurations(form.table, seed=5).q

    def pose(q: Array) -> Array:
        result: Array = np.linalg.inv(frame_pose(chain, source, q)) @ frame_pose(chain, target, q)
        return result

    J, step = np.empty((len(q), 6, 6)), 1e-6
    for k in range(6):
        ahead, behind = pose(q + step * np.eye(6)[k]), pose(q - step * np.eye(6)[k])
        J[:, :3, k] = (ahead - behind)[:, :3, 3] / (2 * step)
        turn = (ahead - behind)[:, :3, :3] @ pose(q)[:, :3, :3].transpose(0, 2, 1) / (2 * step)
        J[:, 3:, k] = np.stack([turn[:, 2, 1], turn[:, 0, 2], turn[:, 1, 0]], axis=1)
    atoms = SampledConfigurations(form.table, q=q).values(form.atoms)
    found = np.stack(
        [np.broadcast_to(v, len(q)) for v in evaluated(form.equations[0].flat, form.named, atoms)], axis=1
    )
    assert found.reshape(-1, 6, 6) == pytest.approx(J, abs=1e-8)
