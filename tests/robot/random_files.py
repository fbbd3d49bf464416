"""Random robot files: whole ones with numbers of all sizes, and such that somebody has damaged."""

from __future__ import annotations

import json
import math
import random
from collections.abc import Callable
from typing import Any

from dh2sim.robot import magnitudes
from dh2sim.robot.magnitudes import Magnitude
from tests.robot_files import ODD, RICH

ODD_VALUES = (
    "", "~", "true", "1", "-1", "0", "-0.0", "1e999", ".nan", "-.inf", "x", "pi", "1 / 0", "9 ** 9 ** 9", "''", "[]",
    "{}", "[1]", "[1, 2]", "[1, 2, 3]", "[[1]]", "{a: 1}", "[~, x, true]", "{1: 2}", "!!set {a}", "&a [1]", "*a",
    "revolute", "fixed", "deg", "none", "'\\0'", '"\\ud800"', "2024-01-01", "{xyz: 3}", "{kp: 1}", "0x1F", "1_000",
    "1e-400", "5e-324", "1" + "0" * 400, "90 deg", "2,5", "atan2(1)", "sqrt(-1)", "1e308 * 10", "<<", "|", "@", "`",
)  # fmt: skip
EXPRESSIONS = (
    "pi / 2", "-pi", "p", "2 * p", "p ** 2 / 3", "sqrt(2)", "atan2(3, 4)", "0.3 * cos(pi / 2)", "sin(1e5)",
    "1e3 ** 2", "1e-200 * 1e-200", "p - p", "tan(pi / 2)", "asin(1)", "1e5", "(((1)))", "1 / 3",
)  # fmt: skip
SPICE = "{}[]:,-?&*!|>'\"%@`#\n\t\r \\0aé\u2028\ufeff~<=.e"


class RandomFiles:
    """Makes the same files from the same seed."""

    def __init__(self, seed: int) -> None:
        """Start with a seed."""
        self._chance = random.Random(seed)
        self._size: Callable[[Magnitude], float] = self._usual
        self._degrees = self._length = 1.0

    def whole(self) -> str:
        """Return a file with numbers of all sizes that are allowed, and few mistakes."""
        self._size = self._chance.choice((self._usual, self._wide, self._wide, self._extreme))
        return self._text(self._robot())

    def any(self) -> str:
        """Return any file: a whole one, one with numbers of any size, or a damaged one."""
        kind = self._chance.random()
        if kind < 0.25:
            return self.whole()
        if kind < 0.5:
            self._size = self._wild
            return self._text(self._robot())
        text = self._chance.choice((ODD, RICH, self.whole()))
        for _ in range(self._chance.randint(1, 3)):
            text = self._damaged(text)
        return text

    # numbers, in SI units

    def _usual(self, of: Magnitude) -> float:
        number = self._chance.choice((0.0, 0.1, 0.5, 1.0, 1.5707963267948966, self._chance.gauss(0, 1)))
        return min(max(abs(number), of.least or 0.0), of.most)

    def _wide(self, of: Magnitude) -> float:
        least = math.log10(of.least or 1e-20)
        return float(10 ** self._chance.uniform(max(least, -12), min(math.log10(of.most), 9)))

    def _extreme(self, of: Magnitude) -> float:
        least = of.least or self._chance.choice((0.0, 1e-9, 1e-17, 1e-60))
        if of is magnitudes.LENGTH:  # several of them may add up to one that is too long to be imported again
            most = of.most * self._chance.choice((1.0, 0.1, 0.02, 0.02))
            return self._chance.choice((of.least, most, self._usual(of), self._usual(of), self._wide(of)))
        ends = (least, of.most, math.nextafter(of.most, 0.0), self._usual(of), self._usual(of), self._wide(of))
        return self._chance.choice(ends)

    def _wild(self, of: Magnitude) -> float:
        kind = self._chance.random()
        if kind < 0.6:
            return self._usual(of)
        if kind < 0.9:
            return float(10 ** self._chance.uniform(-323, 308))
        beyond = (math.nextafter(of.most, math.inf), of.least / 2, math.inf, math.nan, -1.0, 1e308, 5e-324)
        return self._chance.choice(beyond)

    def _number(self, of: Magnitude, unit: float = 1.0) -> float | str:
        if self._chance.random() < 0.02:
            return self._chance.choice(EXPRESSIONS)
        return self._size(of) * unit

    def _signed(self, of: Magnitude, unit: float = 1.0) -> float | str:
        number = self._number(of, unit)
        return -number if isinstance(number, float) and self._chance.random() < 0.5 else number

    def _angle(self) -> float | str:
        if self._chance.random() < 0.5:
            return self._chance.choice((0.0, 90.0, -90.0, 180.0, 30.0)) * math.pi / 180 * self._degrees
        return self._signed(magnitudes.ANGLE, self._degrees)

    def _distance(self) -> float | str:
        kind = self._chance.random()
        if kind < 0.03:  # what rounding may leave of nothing
            return float(10 ** self._chance.uniform(-20, -6))
        return 0.0 if kind < 0.2 else self._signed(magnitudes.LENGTH, self._length)

    def _vector(self) -> list[float | str]:
        return [self._distance() for _ in range(3)]

    def _pose(self) -> dict[str, Any]:
        return self._some(xyz=self._vector, rpy=lambda: [self._angle() for _ in range(3)])

    # parts

    def _some(self, share: float = 0.4, **parts: Callable[[], Any]) -> dict[str, Any]:
        """Return some of these keys."""
        return {key: make() for key, make in parts.items() if self._chance.random() < share}

    def _robot(self) -> dict[str, Any]:
        chance = self._chance
        angle, length = chance.choice(("rad", "rad", "deg")), chance.choice(("m", "m", "mm", "cm", "in"))
        self._degrees = 180 / math.pi if angle == "deg" else 1.0
        self._length = {"m": 1.0, "mm": 1000.0, "cm": 100.0, "in": 1 / 0.0254}[length]
        rows = [self._row() for _ in range(chance.choice((1, 2, 2, 3, 3, 4, 6, 8)))]
        robot: dict[str, Any] = {"name": "r", "convention": chance.choice(("standard", "modified", "hayati"))}
        if angle != "rad" or length != "m":
            robot["units"] = {"angle": angle, "length": length}
        robot["parameters"] = {"p": chance.choice((0.1, 2, 1e-3))}
        for row in rows:
            convention = row.get("convention", robot["convention"])
            if convention != "hayati":
                row.pop("beta", None)
            elif row["type"] != "prismatic":
                row.pop("d", None)
        robot |= self._some(
            0.2,
            base=self._pose,
            tool=self._tool,
            payload=lambda: self._number(magnitudes.MASS),
            gravity=lambda: [self._signed(magnitudes.ACCELERATION) for _ in range(3)],
            actuators=self._actuator,
        )
        robot["joints"] = rows
        if chance.random() < 0.3:
            robot["configurations"] = {"home": [self._coordinate(row) for row in rows if row["type"] != "fixed"]}
        return robot

    def _row(self) -> dict[str, Any]:
        kind = self._chance.choice(("revolute", "revolute", "continuous", "prismatic", "fixed"))
        row: dict[str, Any] = {"type": kind}
        row |= self._some(0.2, convention=lambda: self._chance.choice(("standard", "modified", "hayati")))
        row |= self._some(0.6, a=self._distance, alpha=self._angle, d=self._distance, theta=self._angle)
        row |= self._some(0.3, beta=self._angle, link=self._link)
        if kind != "fixed":
            row |= self._some(
                0.2,
                flip=lambda: self._chance.random() < 0.5,
                limits=lambda: self._limits(kind),
                dynamics=self._dynamics,
                actuator=self._actuator,
            )
        return row

    def _limits(self, kind: str) -> dict[str, Any]:
        of, unit = self._coordinate_of(kind)
        limits = self._some(
            0.5, velocity=lambda: self._number(of, unit), effort=lambda: self._number(magnitudes.EFFORT)
        )
        if kind != "continuous":
            ends = [self._size(of) * unit * self._chance.choice((1, -1)) for _ in range(2)]
            limits["position"] = sorted(ends)
        return limits

    def _coordinate_of(self, kind: str) -> tuple[Magnitude, float]:
        slides = kind == "prismatic"
        return (magnitudes.LENGTH, self._length) if slides else (magnitudes.ANGLE, self._degrees)

    def _coordinate(self, row: dict[str, Any]) -> float | str:
        position = row.get("limits", {}).get("position")
        if position is not None and self._chance.random() < 0.9:
            return float(self._chance.choice(position))
        return self._signed(*self._coordinate_of(row["type"]))

    def _dynamics(self) -> dict[str, Any]:
        return self._some(
            damping=lambda: self._number(magnitudes.DAMPING),
            friction=lambda: self._number(magnitudes.FRICTION),
            armature=lambda: self._number(magnitudes.ARMATURE),
        )

    def _actuator(self) -> dict[str, Any]:
        kind = self._chance.choice(("position", "velocity", "motor", "none"))
        made: dict[str, Any] = {"type": kind}
        if kind == "position":
            made |= self._some(kp=lambda: self._number(magnitudes.POSITION_GAIN))
        if kind in ("position", "velocity"):
            made |= self._some(kv=lambda: self._number(magnitudes.VELOCITY_GAIN))
        return made

    def _link(self) -> dict[str, Any]:
        return self._some(
            mass=lambda: self._number(magnitudes.MASS),
            com=self._vector,
            inertia=self._inertia,
            density=lambda: self._number(magnitudes.DENSITY),
            radius=lambda: self._number(magnitudes.LENGTH, self._length),
        )

    def _inertia(self) -> dict[str, Any]:
        """Return the inertia of three point-like second moments: possible, turned about x by any angle."""
        a, b, c = (self._size(magnitudes.INERTIA) / 2 for _ in range(3))
        xx, yy, zz = b + c, a + c, a + b
        angle = self._chance.choice((0.0, 0.0, self._chance.uniform(-3, 3)))
        s, co = math.sin(angle), math.cos(angle)
        return {
            "ixx": xx,
            "iyy": co * co * yy + s * s * zz,
            "izz": s * s * yy + co * co * zz,
            "iyz": s * co * (yy - zz),
        }

    def _tool(self) -> dict[str, Any]:
        tool = self._pose() | self._some(mass=lambda: self._number(magnitudes.MASS))
        if self._chance.random() < 0.4:
            tool["shape"] = self._shape()
        if "mass" in tool or "shape" in tool:
            tool |= self._some(0.2, com=self._vector, inertia=self._inertia)
        return tool

    def _shape(self) -> dict[str, Any]:
        def side() -> float | str:
            return self._number(magnitudes.LENGTH, self._length)

        kind = self._chance.choice(("box", "cylinder", "sphere"))
        shape: dict[str, Any] = {"type": kind, **self._pose()}
        if kind == "box":
            return shape | {"size": [side(), side(), side()]}
        return shape | {"radius": side()} | ({"length": side()} if kind == "cylinder" else {})

    # texts

    def _text(self, robot: dict[str, Any]) -> str:
        lines = []
        for key, value in robot.items():
            if key == "joints":
                lines += ["joints:", *(f"  - {json.dumps(row)}" for row in value)]
            else:
                lines.append(f"{key}: {json.dumps(value)}")
        return "\n".join([*lines, ""])

    def _damaged(self, text: str) -> str:
        chance = self._chance
        lines = text.split("\n")
        place = chance.randrange(len(lines))
        start = chance.randrange(len(text) + 1)
        match chance.randrange(7):
            case 0:
                del lines[place]
            case 1:
                lines.insert(place, lines[chance.randrange(len(lines))])
            case 2:
                key, _, _ = lines[place].partition(":")
                lines[place] = f"{key}: {chance.choice(ODD_VALUES)}"
            case 3:  # a value inside of braces
                parts = lines[place].split(",")
                part = chance.randrange(len(parts))
                key, colon, rest = parts[part].rpartition(":")
                closing = "".join(c for c in rest if c in "]}")
                parts[part] = f"{key}{colon} {chance.choice(ODD_VALUES)}{closing}"
                lines[place] = ",".join(parts)
            case 4:
                piece = "".join(chance.choice(SPICE) for _ in range(chance.randint(0, 3)))
                return text[:start] + piece + text[start + chance.randint(0, 10) :]
            case 5:
                old = chance.choice(("revolute", "a", "link", "mass", "0", "1", ".", "{", "position", "e"))
                return text.replace(old, chance.choice(("prismatic", "fixed", "b", "0", "9", "-", "{")), 1)
            case _:
                del lines[place : place + chance.randint(1, 3)]
        return "\n".join(lines)
