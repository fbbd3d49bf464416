"""A robot, still or moving, as one HTML file that opens without a server and without a network."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import PictureError
from dh2sim.export.placing import written_whole
from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.transforms import compose, identity
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.words import listed
from dh2sim.typing import Array
from dh2sim.view.extent import triad_length
from dh2sim.view.items import Item, Label, Placed, Scene, Triad
from dh2sim.view.page_export_extent import extent_of
from dh2sim.view.page_export_html import page_html
from dh2sim.view.solids import orientation_of, position_of, robot_solids

if TYPE_CHECKING:
    from dh2sim.simulate.pictures.selection import RolloutData

RATE = 30.0
"""Pictures a second of an animation, at most."""
MOST_PICTURES = 1800
"""Longer animations have fewer pictures a second."""
_MEASURED = 60
"""Pictures that the extent of an animation is measured in."""
_ROBOT = "/robot"


def export_page(model: RobotModel, q: ArrayLike, path: Path, *, rollout: RolloutData | None = None) -> None:
    """Write a page that shows a robot with its DH frames; the eye can go around it, and parts can be hidden.

    Args:
        model: The robot.
        q: Where it stands, rad and m, shape (n,).
        path: Of the file; one that stands there is replaced.
        rollout: Shown instead of ``q``, again and again, with a time slider, a pause and a choice of speeds.

    Raises:
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite.
        PictureError: Positions were not recorded in the rollout, or it is one of a robot with other joints.
        OutputError: The file cannot be written; what stood there before stands untouched.
    """
    moments = [(0.0, robot_page_scene(model, q))] if rollout is None else list(rollout_moments(model, rollout))
    chosen = {round(k) for k in np.linspace(0, len(moments) - 1, min(len(moments), _MEASURED))}
    extent = extent_of([moments[k][1] for k in sorted(chosen)])
    html = page_html(moments, title=model.name, extent=extent)
    with written_whole(path) as draft:
        draft.write_text(html, encoding="utf-8")


def robot_page_scene(model: RobotModel, q: ArrayLike, base: Placed | None = None) -> Scene:
    """Return a robot with its DH frames and tool0, each below the link that carries it.

    Args:
        model: The robot.
        q: Joint vector, rad and m, shape (n,).
        base: Where base_link is.

    Raises:
        ConfigurationError: ``q`` has the wrong shape or holds something that is not finite.
    """
    items: dict[str, Item] = {**robot_solids(model, q, _ROBOT), _ROBOT: base or Placed()}
    length = triad_length(model)
    for number, (link, frame, text, T) in enumerate(_carried(model.chain)):
        name = f"{_ROBOT}/{link}/{frame}"
        items[name] = Triad(position=position_of(T), orientation=orientation_of(T), length=length)
        # beyond the end of z, where frames with a common origin are apart; neighbours may have z in common too
        height = (1.15 + 0.3 * (number % 2)) * length
        items[f"{name}/name"] = Label(text=text, position=(0.0, 0.0, height))
    return items


def _carried(chain: KinematicChain) -> list[tuple[str, str, str, Array]]:
    """Return the frames that are shown: the link that carries each, its name, its label, and its pose in the link."""
    carried = [("base_link", "dh_0", "dh_0", chain.T_base_link_dh0)]
    carried += [
        (f"link_{i}", f"dh_{i}", f"dh_{i}", joint.T_joint_dh) for i, joint in enumerate(chain.joints, start=1)
    ]
    link, last, _, T = carried[-1]
    if (chain.T_dhn_tool0 == identity()).all():
        return [*carried[:-1], (link, last, f"{last} = tool0", T)]
    return [*carried, (link, "tool0", "tool0", compose(T, chain.T_dhn_tool0))]


def rollout_moments(model: RobotModel, rollout: RolloutData) -> Iterator[tuple[float, Scene]]:
    """Yield times, s, from 0, and scenes of a rollout: some of what was recorded, and nothing in between."""
    rollout.require("qpos", what="a page")
    here, there = [joint.name for joint in model.moving_joints], rollout.names("joint")
    if here != there:
        raise PictureError(
            f"{rollout.label} is of a robot with the joints {listed(there)}; {model.name} has {listed(here)}"
        )
    time, qpos = rollout.values("time"), rollout.values("qpos")
    bases = rollout.values("base_pose") if "base_pose" in rollout.data else None
    for k in shown_records(time):
        base = None if bases is None else _placed(bases[k])
        yield float(time[k] - time[0]), robot_page_scene(model, qpos[k], base)


def shown_records(time: Array) -> list[int]:
    """Return which records are shown, of those at ``time``, s, ascending, shape (count,): first and last at least."""
    duration = float(time[-1] - time[0])
    count = min(math.ceil(duration * RATE) + 1, MOST_PICTURES, len(time))
    places = np.interp(np.linspace(time[0], time[-1], count), time, np.arange(len(time)))
    return sorted({round(place) for place in places.tolist()} | {0, len(time) - 1})


def _placed(pose: Array) -> Placed:
    x, y, z, *quaternion = (float(value) for value in pose)
    qw, qx, qy, qz = quaternion
    return Placed(position=(x, y, z), orientation=(qw, qx, qy, qz))
