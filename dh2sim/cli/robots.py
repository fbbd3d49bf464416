"""``dh2sim list`` and ``dh2sim schema``."""

from __future__ import annotations

import json
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
    from dh2sim.robot.read import builtin_robots, load_robot

    robots = [load_robot(name) for name in builtin_robots()]
    kinds = ["".join("R" if row.type.turns else "P" for row in spec.moving_rows) for spec in robots]
    if as_json:
        entries = [
            {
                "name": spec.name,
                "joints": joints,
                "conventions": list(dict.fromkeys(row.convention.value for row in spec.rows)),
                "description": " ".join(spec.description.split()),
                "source": " ".join(spec.source.split()),
            }
            for spec, joints in zip(robots, kinds, strict=True)
        ]
        print(json.dumps(entries, indent=2))
        return
    width = max((len(spec.name) for spec in robots), default=0)
    for spec, joints in zip(robots, kinds, strict=True):
        print(f"{spec.name:{width}}  {joints:8}  {' '.join(spec.description.split())}")


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
