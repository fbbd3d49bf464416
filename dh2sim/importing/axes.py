"""Joint axes -> frames and a robot file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dh2sim.formats.serial_robot import SerialLink, SerialRobot
from dh2sim.importing.explain import explanation
from dh2sim.importing.result import Imported
from dh2sim.importing.serial import import_serial
from dh2sim.kinematics.frame_assignment.recover import TOLERANCE
from dh2sim.kinematics.serial_chain import SerialChain, SerialJoint
from dh2sim.kinematics.transforms import pose_from_rpy
from dh2sim.messages import member
from dh2sim.robot.axes_file import AxesSpec
from dh2sim.robot.row import Convention
from dh2sim.typing import Array, read_only


def import_axes(
    axes: AxesSpec,
    *,
    convention: Convention | str | None = None,
    tolerance: float = TOLERANCE,
    explain: bool = False,
    folder: Path | None = None,
) -> Imported:
    """Assign frames to joint axes and make a robot file of them.

    Args:
        axes: As read from their file.
        convention: Of the table; by default the file's, or else standard.
        tolerance: Greatest residual, rad, and m for a reach of up to 1 m, then of the reach.
        explain: Whether to explain every step at the top of the robot file.
        folder: Of the robot file, to which paths of meshes are relative.

    Raises:
        MismatchError: The residual is above the tolerance.
    """

    def made(*header: str) -> Imported:
        return import_serial(
            serial_robot(axes),
            convention=member(Convention, convention or axes.convention or Convention.STANDARD, "convention"),
            tolerance=tolerance,
            folder=folder,
            header=header,
            description=axes.description,
        )

    imported = made()
    return made(*explanation(imported)) if explain else imported


def serial_robot(axes: AxesSpec) -> SerialRobot:
    """Return the robot that joint axes describe; every link's frame is on its axis, turned like base_link.

    A sliding joint without a point is where the joint before it is.
    """
    joints = []
    place = np.zeros(3)
    for axis in axes.joints:
        before, place = place, place if axis.point is None else axis.point
        joints.append(
            SerialJoint(
                name=axis.name,
                type=axis.type,
                T_parent_link=_shift(place - before),
                axis=axis.direction,
                point=read_only([0, 0, 0]),
            )
        )
    T_link_tip = np.array(pose_from_rpy(axes.tool.xyz, axes.tool.rpy))
    T_link_tip[:3, 3] -= place
    return SerialRobot(
        name=axes.name,
        description=axes.source or "Joint axes",
        chain=SerialChain(joints=tuple(joints), T_link_tip=read_only(T_link_tip)),
        base=SerialLink(name="base_link"),
        links=tuple(SerialLink(name=f"link_{i}") for i in range(1, len(joints) + 1)),
        limits=tuple(axis.limits for axis in axes.joints),
        dynamics=tuple(axis.dynamics for axis in axes.joints),
        actuators=tuple(axis.actuator for axis in axes.joints),
        gravity=axes.gravity,
        configurations=axes.configurations,
    )


def _shift(offset: Array) -> Array:
    T = np.eye(4)
    T[:3, 3] = offset
    return read_only(T)
