"""``dh2sim list`` and ``dh2sim schema``."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Annotated

import typer


def list_robots(
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON alone: a list with an object for each robot.")
    ] = False,
) -> None:
    """List the robots that come with dh2sim: name, moving joints, and what they are.

    R is a revolute joint, P a prismatic one.

    \b
    Examples:
      dh2sim list
      dh2sim list --json
      dh2sim info scara
    """
    from dh2sim.robot.catalog import summaries

    robots = list(summaries())
    if as_json:
        print(json.dumps([asdict(robot) for robot in robots], indent=2))
        return
    width = max((len(robot.name) for robot in robots), default=0)
    for robot in robots:
        print(f"{robot.name:{width}}  {robot.joints:8}  {robot.description}")


def schema() -> None:
    """Print the JSON Schema of robot files, with which editors complete and check them.

    \b
    Examples:
      dh2sim schema > robot.schema.json
      # then, on the first line of a robot file:
      # yaml-language-server: $schema=robot.schema.json
    """
    from dh2sim.robot.schema import json_schema

    print(json.dumps(json_schema(), indent=2))
