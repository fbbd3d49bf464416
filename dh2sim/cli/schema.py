"""``dh2sim schema``."""

from __future__ import annotations


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
