"""Finite but absurd numbers are refused where a file is read, with what is allowed; all that is allowed is taken."""

from __future__ import annotations

import math

import jsonschema
import pytest

from dh2sim.robot import magnitudes
from dh2sim.robot.magnitudes import MAGNITUDES, shown_size
from dh2sim.robot.schema import json_schema
from tests.robot.files import complaints, robot

HEAD = "name: r\nconvention: standard\n"
ARM = HEAD + "joints:\n  - {type: revolute, a: 1}\n"


def joint(text: str, head: str = HEAD) -> str:
    return f"{head}joints:\n  - {{{text}}}\n  - {{type: revolute, a: 1}}\n"


REFUSED = [
    (joint("type: revolute, a: 1e62"), "4:25: joints[0].a: must be from -1e6 to 1e6 m, found 1e+62"),
    (
        joint("type: revolute, a: 1, theta: 1e300"),
        "4:35: joints[0].theta: must be from -1e6 to 1e6 rad, found 1e+300",
    ),
    (
        joint("type: revolute, a: 1, link: {radius: 1e61}"),
        "4:43: joints[0].link.radius: must be from 1e-6 to 1e6 m, found 1e+61",
    ),
    (
        joint("type: revolute, a: 1, link: {radius: 1e-161}"),
        "4:43: joints[0].link.radius: must be from 1e-6 to 1e6 m, found 1e-161",
    ),
    (
        joint("type: revolute, a: 1, link: {mass: 1e-16}"),
        "4:41: joints[0].link.mass: must be 0, or from 1e-12 to 1e30 kg, found 1e-16",
    ),
    (
        joint("type: revolute, a: 1, link: {com: [1e152, 0, 0]}"),
        "4:41: joints[0].link.com[0]: must be from -1e6 to 1e6 m, found 1e+152",
    ),
    (
        joint("type: revolute, a: 1, dynamics: {armature: 1e305}"),
        "4:49: joints[0].dynamics.armature: must be at most 1e50 kg·m² or kg, found 1e+305",
    ),
    (
        joint("type: revolute, a: 1, actuator: {kp: 1e308}"),
        "4:43: joints[0].actuator.kp: must be from 1e-15 to 1e60 N·m/rad or N/m, found 1e+308",
    ),
    (
        joint("type: revolute, a: 1, actuator: {kv: 1e-300}"),
        "4:43: joints[0].actuator.kv: must be 0, or from 1e-15 to 1e60 N·m·s/rad or N·s/m, found 1e-300",
    ),
    (
        joint("type: prismatic, limits: {position: [0, 1e11]}"),
        "4:46: joints[0].limits.position[1]: must be from -1e6 to 1e6 m, found 100000000000.0",
    ),
    (
        joint("type: revolute, a: 1, limits: {position: [0, 1e12]}", HEAD + "units: {angle: deg}\n"),
        "5:51: joints[0].limits.position[1]: must be from -5.73e7 to 5.73e7 deg, found 1000000000000.0",
    ),
    (
        joint("type: prismatic, limits: {velocity: 1e-9}", HEAD + "units: {length: mm}\n"),
        "5:42: joints[0].limits.velocity: must be from 0.001 to 1e9 mm/s, found 1e-09",
    ),
    (
        joint('type: revolute, a: "10 ** 7"'),
        "4:25: joints[0].a: must be from -1e6 to 1e6 m, found '10 ** 7' = 10000000.0",
    ),
    (ARM + "tool: {xyz: [1e300, 0, 0]}\n", "5:14: tool.xyz[0]: must be from -1e6 to 1e6 m, found 1e+300"),
    (ARM + "gravity: [1e155, 0, 0]\n", "5:11: gravity[0]: must be from -1e6 to 1e6 m/s², found 1e+155"),
    (ARM + "payload: 1e31\n", "5:10: payload.mass: must be 0, or from 1e-12 to 1e30 kg, found 1e+31"),
    (
        ARM + "configurations: {home: [1e7]}\n",
        "5:25: configurations.home[0]: must be from -1e6 to 1e6 rad, found 10000000.0",
    ),
]


@pytest.mark.parametrize(("text", "message"), REFUSED, ids=[message.split(": ")[1] for _, message in REFUSED])
def test_a_number_that_is_too_large_or_too_small_is_refused_at_its_place(text: str, message: str) -> None:
    assert complaints(text) == [f"r.yaml:{message}"]


def test_bounds_are_in_the_units_of_the_file() -> None:
    assert complaints(joint("type: revolute, a: 1e9, alpha: 5.7e7", HEAD + "units: {angle: deg, length: mm}\n")) == []
    assert complaints(joint("type: revolute, a: 3.9e7", HEAD + "units: {length: in}\n")) == []
    assert len(complaints(joint("type: revolute, a: 4e7", HEAD + "units: {length: in}\n"))) == 1


def test_what_rounding_leaves_of_nothing_is_nothing() -> None:
    row = robot(joint('type: revolute, a: 1e-300, d: "1e-40 * 1e-40", alpha: 1e-17')).rows[0]
    assert (row.a, row.d, row.alpha) == (0.0, 0.0, 1e-17)


def test_parameters_may_be_of_any_size() -> None:
    text = joint('type: revolute, a: "big / 1e300"', HEAD + "parameters: {big: 1e300}\n")
    assert robot(text).rows[0].a == 1.0


def test_all_bounds_are_within_doubles_with_room_for_products() -> None:
    for of in MAGNITUDES:
        assert 0.0 <= of.least < of.most
        assert math.isfinite(of.most**2 * magnitudes.LENGTH.most**4)


def test_the_schema_has_the_bounds() -> None:
    """Those of numbers in units of the file in the unit that allows the most."""
    schema = json_schema()
    mass = schema["$defs"]["LinkEntry"]["properties"]["mass"]
    assert (mass["minimum"], mass["maximum"]) == (0, 1e30)
    for value, fits in ((1e9, True), (2e9, False), (-2e9, False)):
        file = {"name": "r", "convention": "standard", "joints": [{"type": "revolute", "a": value}]}
        assert jsonschema.Draft202012Validator(schema).is_valid(file) is fits


@pytest.mark.parametrize(("value", "text"), [(1e6, "1e6"), (-1e6, "-1e6"), (1e-15, "1e-15"), (0.001, "0.001")])
def test_bounds_are_written_as_in_robot_files(value: float, text: str) -> None:
    assert shown_size(value) == text


LONG = HEAD + "joints:\n  - {type: revolute, a: 6e5}\n  - {type: fixed, d: 3e5}\n  - {type: revolute, a: %s}\n"


def test_lengths_that_are_too_large_together_are_refused_at_the_row_where_they_are() -> None:
    assert complaints(LONG % "2e5") == [
        "r.yaml:6:5: joints[2]: the lengths up to here add up to 1.1e+06 m; those of a robot may be 1e6 m together"
    ]
    assert complaints("units: {length: mm}\n" + (LONG % "2e5")) == []
    assert complaints(LONG % "1e5") == []
