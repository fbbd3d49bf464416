#!/usr/bin/env python3
"""Write docs/robot-file.md, the reference of robot files, from their schema.

Called without arguments it writes the page; with ``--check`` it exits with 1 if the page is not what the schema says.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from dh2sim.robot.magnitudes import MAGNITUDES, MOST_ROWS, shown_size
from dh2sim.robot.schema import json_schema

PAGE = Path(__file__).resolve().parent.parent / "docs" / "robot-file.md"

INTRODUCTION = """\
<!-- Written by scripts/robot_file_reference.py from the schema. Do not edit. -->
# The robot file

One YAML file describes a robot: its DH table, and whatever else is known of it. The smallest one that works:

```yaml
name: planar
convention: standard
joints:
  - {type: revolute, a: 1.0}
  - {type: revolute, a: 0.7}
```

Everything that is left out is estimated or assumed, and `dh2sim info` says what. `dh2sim schema > robot.schema.json`
writes the JSON Schema of this page; with `# yaml-language-server: $schema=robot.schema.json` on a robot file's first
line, editors complete and check it while you type.

## Numbers

A number may be an arithmetic expression in a string over `parameters` and `pi`: `+ - * / **`, parentheses, and
`sqrt sin cos tan asin acos atan atan2`. The functions take and return radians, whatever the file's angle unit is: in
a file in degrees write `atan2(3, 4) * 180 / pi`. NaN and infinity are errors. The joint variable is not written: the
joint coordinate adds to `theta` or `d`, whose value is the offset (default 0).

Magnitudes have bounds, so that all that is read can be exported, and read by simulators:

@MAGNITUDES@

What must be positive, or is a mass or a gain that is not 0, is at least the least. Numbers below 1e-60 count as 0.
A table has at most @MOST_ROWS@ rows: MuJoCo reads no longer chain of bodies. A file has at most 1 MB, and 50 000
values.

## Units

Lengths and angles are in the file's units (`units`; m and rad by default): `a`, `alpha`, `d`, `theta`, `beta`, poses,
limits, configurations, `com`, `radius`. Everything else is SI. Every export is in m and rad.

## Conventions

`convention` says how a row's numbers are read: [docs/conventions.md](conventions.md). A Hayati row, for nearly
parallel axes, has a second twist `beta`, and a `d` only if it is prismatic; `beta` in any other row is an error.

## Meshes

A mesh shows a link instead of the shapes made from the table, and has no mass. It is in the link's DH frame, or
where its `xyz` and `rpy` put it from there.

## Tool and payload

`tool` says where tool0 is, the point that works, and may say what is mounted there:

```yaml
tool: {xyz: [0, 0, 0.15], mass: 0.5, com: [0, 0, 0.06], shape: {type: box, size: [0.1, 0.06, 0.1], xyz: [0, 0, 0.05]}}
payload: 2
```

All of it is in DH frame n, as makers give loads in the frame of the flange; `xyz` and `rpy` are the pose of tool0.
The tool is a body of its own, `tool`, fixed to the last link; its frame is DH frame n. Without any of the further
keys there is none. What they leave out is estimated: a mass from the shape, at 1000 kg/m³; a centre of mass from the
shape, or else at tool0; an inertia from the shape, or else that of a solid ball of 1000 kg/m³. A mesh alone weighs
nothing.

`payload` is what the arm is to carry besides its tool: the efforts and gains that a file leaves open are chosen so
that they hold it. It is no body, and in no export; an arm that does carry something has it as its tool. It is a solid
ball of 1000 kg/m³ that touches tool0, beyond it along its z, or has its centre at `com`, in DH frame n. Without a
`payload` it weighs a fifth of the moving links, as the nominal payload of many arms does.

## Branches and closed loops

`joints` is the main chain, which carries tool0. `branches` are more chains, each from any frame of the main chain or
of a branch before it; `closures` are joints between two frames, which close loops. A four-bar linkage:

```yaml
name: four_bar
convention: standard
units: {angle: deg}
joints:                                     # ground A, crank 0.6 to B, coupler 1.8 to C
  - {type: revolute, a: 0.6}
  - {type: revolute, a: 1.8}
branches:
  rocker: {from: base_link, pose: {xyz: [2, 0, 0]}, joints: [{type: revolute, a: 1.4}]}
closures:
  - {name: C, between: [dh_2, rocker/dh_1], type: revolute}
actuated: [joint_1]
assembly: {q: [70, -50, 110]}
```

The frames of a branch are `rocker/dh_0`, `rocker/dh_1` …, `rocker/link_1` …; its joints are `rocker_joint_1` … unless
they have names. `dh_i` is where row i of the table leads, in a standard table the far end of link i; `link_i` moves
with it, and has its origin on the axis of joint i. Joint vectors hold the coordinates of the main chain, then those
of the branches in their order. The axis of a closure is the z axis of both frames;
[what must coincide](mechanisms.md#assembly) depends on its type.
`assembly` is a guess from which the loops are closed, to 1e-12, when the robot is read; where there is none, `home`
is. Where that fails, the error says which closure stays open, and by how much. With `actuated`, all other joints are
passive: they have no actuator. [Mechanisms](mechanisms.md) says what is done with them.

## Links that weigh nothing

`link: {mass: 0}` is for links between joints, such as those of a wrist or of a planar base that are one body: what
comes behind them must have mass. Exports give them 2e-14 kg and kg·m², about the least that simulators read.

## What is filled in

| left out | becomes |
|---|---|
| position limits | ±π for a revolute joint; for a prismatic one ± what the rest of the robot reaches |
| velocity limits | π rad/s, 1 m/s |
| payload | a fifth of the moving mass, before tool0 |
| effort limits | what lifts twice the arm with tool and payload, stretched out, at 10 rad/s² or m/s² |
| shapes | [housings and links](bodies.md) that follow the axes, as thick as suits the robot's own size, or `radius` |
| mass, com, inertia | those of the [shapes](bodies.md), solid, of 1300 kg/m³ or `density`; what is given wins |
| actuator gains | critical damping at 100 rad/s, with the payload, at `home`; and a sag of 0.01 rad at most |

A joint that turns is given at least a fifth of the effort and of the gains of the one before it: a last joint would
get next to nothing, since it turns a round link about its own axis.

Assumed velocity and effort limits are written to the URDF, which must have some, and not to the MJCF; but they are
the control ranges of its velocity actuators and motors.

## Errors

Everything that is wrong in a file is reported at once, one line each: `file:line:column: path: what was found and
what is allowed`. Unknown keys, duplicate names, limits the wrong way round, inertias that no body can have, vectors
of the wrong length, cycles in `parameters` and the like are errors, never warnings. A file may have at most 1 MB.
"""

TITLES = {
    "UnitsEntry": "`units`",
    "ToolEntry": "`tool`",
    "ShapeEntry": "`tool.shape`",
    "PayloadEntry": "`payload`",
    "BaseEntry": "`base`",
    "JointEntry": "`joints`: a row of the table",
    "BranchEntry": "`branches`: a further chain",
    "ClosureEntry": "`closures`: a joint that closes a loop",
    "AssemblyEntry": "`assembly`",
    "LimitsEntry": "`joints[].limits`",
    "DynamicsEntry": "`joints[].dynamics`",
    "LinkEntry": "`joints[].link`",
    "InertiaEntry": "`inertia`, of a link or the tool",
    "MeshEntry": "`mesh`, of a link, the base or the tool",
    "ActuatorEntry": "`actuators`, and `joints[].actuator`",
}


def page() -> str:
    """Return the page."""
    schema = json_schema()
    introduction = INTRODUCTION.replace("@MAGNITUDES@", "\n".join(_magnitudes())).replace(
        "@MOST_ROWS@", str(MOST_ROWS)
    )
    return introduction + "\n".join(["", *_section("Top level", schema, schema), *_sections(schema)])


def _magnitudes() -> Iterator[str]:
    """Yield a table of the bounds; quantities that have the same ones and the same unit share a row."""
    shared: dict[tuple[str, float, float], list[str]] = {}
    for of in MAGNITUDES:
        shared.setdefault((of.unit, of.least, of.most), []).append(of.name)
    yield "| numbers | unit | least | most |"
    yield "|---|---|---|---|"
    for (unit, least, most), names in shared.items():
        yield f"| {', '.join(names)} | {unit} | {shown_size(least) if least else ''} | {shown_size(most)} |"


def _sections(schema: dict[str, Any]) -> Iterator[str]:
    for name, title in TITLES.items():
        yield from _section(title, schema["$defs"][name], schema)


def _section(title: str, entry: dict[str, Any], schema: dict[str, Any]) -> Iterator[str]:
    yield f"## {title}\n"
    yield f"{entry.get('description', '')}\n"
    yield "| key | value | meaning |"
    yield "|---|---|---|"
    for key, value in entry["properties"].items():
        required = " (required)" if key in entry.get("required", ()) else ""
        yield f"| `{key}`{required} | {_kind(value, schema)} | {value.get('description', '').replace('<', '&lt;')} |"
    yield ""


def _kind(value: dict[str, Any], schema: dict[str, Any]) -> str:
    if "anyOf" in value:
        return ", or ".join(_kind(one, schema) for one in value["anyOf"])
    if "$ref" in value:
        target = schema["$defs"][value["$ref"].rsplit("/", 1)[1]]
        if "enum" not in target:
            return "mapping"
        spellings = {name.casefold(): name for name in reversed(target["enum"])}  # one of 'R' and 'r'
        return " \\| ".join(f"`{name}`" for name in target["enum"] if spellings[name.casefold()] == name)
    kind = value.get("type")
    if kind == ["number", "string"]:
        text = "number"
        if value.get("minimum", -1) >= 0:
            text += " > 0" if value["minimum"] else " >= 0"
        return text + _default(value)
    if kind == "array":
        least, most = value.get("minItems"), value.get("maxItems")
        count = f"{least} to {most}" if least != most else f"{least}" if most else ""
        items = value.get("items", {})
        item = "mappings" if "$ref" in items else "names" if items.get("type") == "string" else "numbers"
        return f"list of {count} {item}".replace("  ", " ") + _default(value)
    if kind == "object":
        each = value["additionalProperties"]
        values = "mappings" if "$ref" in each else "lists of numbers" if each.get("type") == "array" else "numbers"
        return f"mapping of names to {values}"
    return {"string": "text", "boolean": "`true` \\| `false`"}[str(kind)] + _default(value)


def _default(value: dict[str, Any]) -> str:
    default = value.get("default")
    if default in (None, "", {}):
        return ""
    if isinstance(default, bool):
        return f", default `{str(default).lower()}`"
    shown = [f"{x:g}" for x in default] if isinstance(default, list) else f"{default:g}"
    return f", default `[{', '.join(shown)}]`" if isinstance(shown, list) else f", default {shown}"


def main() -> int:
    """Write or check the page; return the exit status."""
    text = page()
    if sys.argv[1:] == ["--check"]:
        if not PAGE.exists() or PAGE.read_text(encoding="utf-8") != text:
            print(f"{PAGE}: not what the schema says; run scripts/robot_file_reference.py", file=sys.stderr)
            return 1
        print(f"{PAGE.name}: up to date")
        return 0
    PAGE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
