"""``dh2sim list``."""

from __future__ import annotations


def list_robots() -> None:
    """List the robots that come with dh2sim: name, moving joints, and what they are.

    \b
    Examples:
      dh2sim list
      dh2sim info scara
    """
    from dh2sim.robot.catalog import builtin_robots
    from dh2sim.robot.load import load_robot

    names = builtin_robots()
    width = max((len(name) for name in names), default=0)
    for name in names:
        spec = load_robot(name)
        kinds = "".join("R" if row.type.turns else "P" for row in spec.moving_rows)
        print(f"{name:{width}}  {kinds:8}  {' '.join(spec.description.split())}")
