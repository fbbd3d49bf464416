"""The same robot without what a check must not be spoilt by."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

from dh2sim.model.robot_model import RobotModel
from dh2sim.model.touching import ExcludedPair, Reason


def without_dry_friction(model: RobotModel) -> RobotModel:
    """Return the robot without dry friction, which hides small forces, and which controllers know nothing of."""
    joints = tuple(replace(joint, dynamics=replace(joint.dynamics, friction=0.0)) for joint in model.joints)
    return replace(model, joints=joints)


def frictionless(model: RobotModel) -> RobotModel:
    """Return the robot without dry and viscous friction; rotors keep their inertia."""
    joints = tuple(
        replace(joint, dynamics=replace(joint.dynamics, damping=0.0, friction=0.0)) for joint in model.joints
    )
    return replace(model, joints=joints)


def untouchable(model: RobotModel) -> RobotModel:
    """Return the robot with links that pass through each other."""
    names = [link.name for link in model.all_links]
    pairs = (ExcludedPair(link1=a, link2=b, reason=Reason.DEFAULT) for a, b in combinations(names, 2))
    return replace(model, excluded=tuple(pairs))
