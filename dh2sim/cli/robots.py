"""``dh2sim list`` and ``dh2sim schema``."""

from __future__ import annotations

from dataclasses import asdict
from enum import StrEnum
from typing import Annotated

import typer

from dh2sim.cli.common import choice
from dh2sim.cli.output import json_text, print_wrapped


def list_robots(
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON alone: a list with an object for each robot.")
    ] = False,
) -> None:
    """List the robots and mechanisms that come with dh2sim, by kind: name, moving joints, and what they are.

    R is a revolute joint, P a prismatic one, 21R are twenty-one.

    \b
    Examples:
      dh2sim list
      dh2sim list --json
      dh2sim info scara
    """
    from dh2sim.robot.catalog import mechanism_summaries, summaries

    robots = [*summaries(), *mechanism_summaries()]
    if as_json:
        print(json_text([asdict(robot) for robot in robots]))
        return
    for group in dict.fromkeys(robot.group for robot in robots):
        members = [robot for robot in robots if robot.group == group]
        width = max(len(robot.name) for robot in members)
        if members[0] is not robots[0]:
            print()
        print(f"{group.capitalize()}s")
        for robot in members:
            start = f"  {robot.name:{width}}  {_joints(robot.joints):7}  "
            print_wrapped(robot.description, first=start, rest=" " * len(start))


def _joints(letters: str) -> str:
    """Return the letters of joints, or how many there are of each where that is shorter."""
    if len(letters) <= 7:
        return letters
    return "".join(f"{letters.count(kind)}{kind}" for kind in "RP" if kind in letters)


class SchemaOf(StrEnum):
    """Kinds of files that have a schema."""

    ROBOT = "robot"
    WAYPOINTS = "waypoints"


def schema(
    of: Annotated[str, typer.Argument(metavar="robot|waypoints", help="What the files describe.")] = "robot",
) -> None:
    """Print the JSON Schema of robot files or waypoint files, with which editors complete and check them.

    \b
    Examples:
      dh2sim schema > robot.schema.json
      dh2sim schema waypoints > waypoints.schema.json
      # then, on the first line of a file:
      # yaml-language-server: $schema=robot.schema.json
    """
    if choice(of, SchemaOf, "robot|waypoints") is SchemaOf.ROBOT:
        from dh2sim.robot.schema import json_schema

        print(json_text(json_schema()))
    else:
        from dh2sim.trajectory.waypoints import waypoint_schema

        print(json_text(waypoint_schema()))
