"""``dh2sim list``.

``dh2sim schema``.
"""

from __future__ import annotations


def list_robots() -> None:
    """List the robots that come with dh2sim: name, moving joints, and what they are.

    \b
    Examples:
      dh2sim list
      dh2sim info scara
    """
    from dh2sim.robot.read import builtin_robots, load_robot

    names = builtin_robots()
    width = max((len(name) for name in names), default=0)
    for name in names:
        spec = load_robot(name)
        kinds = "".join("R" if row.type.turns else "P" for row in spec.moving_rows)
        print(f"{name:{width}}  {kinds:8}  {' '.join(spec.description.split())}")


def schema() -> None:
    """Print the JSON Schema of robot files, with which editors complete and check them.

    \b
    Examples:
      dh2sim schema > robot.schema.json
      # then, on the first line of a robot file:
      # yaml-language-server: $schema=robot.schema.json
    """
    import json

    from dh2sim.robot.schema import json_schema

    print(json.dumps(json_schema(), indent=2))
