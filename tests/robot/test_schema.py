"""The JSON Schema describes robot files to editors."""

from __future__ import annotations

from typing import Any

import jsonschema
import pytest
from ruamel.yaml import YAML

from dh2sim.errors import RobotFileError
from dh2sim.robot.catalog import builtin_path, builtin_robots
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.robot.schema import json_schema
from tests.robot.files import FULL, MINIMAL, with_joint, with_keys

SCHEMA = json_schema()
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)


def _valid(text: str) -> bool:
    return bool(VALIDATOR.is_valid(YAML(typ="safe", pure=True).load(text)))


def _properties(schema: Any) -> list[tuple[str, Any]]:
    if isinstance(schema, list):
        return [item for value in schema for item in _properties(value)]
    if not isinstance(schema, dict):
        return []
    found = list(schema.get("properties", {}).items())
    return found + [item for value in schema.values() for item in _properties(value)]


def test_the_schema_is_a_schema() -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    assert SCHEMA["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert SCHEMA["title"] == "dh2sim robot file"
    assert SCHEMA["required"] == ["name", "convention", "joints"]


def test_every_key_is_described() -> None:
    properties = _properties(SCHEMA)
    assert len(properties) > 50
    assert [name for name, schema in properties if "description" not in schema] == []


def test_no_key_may_be_null() -> None:
    assert "null" not in str(SCHEMA)
    assert "None" not in str(SCHEMA)


@pytest.mark.parametrize(
    "text",
    [
        MINIMAL,
        FULL,
        with_joint("{type: revolute, convention: hayati, beta: 0.01}"),
        MINIMAL.replace("standard", "hayati"),
        with_joint("{type: fixed, link: {mesh: {file: b.stl, scale: 0.001, xyz: [1, 2, 3], rpy: [0, pi / 2, 0]}}}"),
    ],
)
def test_right_files_are_valid(text: str) -> None:
    assert _valid(text)


@pytest.mark.parametrize(
    ("short", "entry"),
    [
        ("{type: R}", "{type: revolute}"),
        ("{type: r}", "{type: revolute}"),
        ("{type: P}", "{type: prismatic}"),
        ("{type: p}", "{type: prismatic}"),
        ("{type: F}", "{type: fixed}"),
        ("{type: f}", "{type: fixed}"),
        ("{type: revolute, limits: [-1, pi / 2]}", "{type: revolute, limits: {position: [-1, pi / 2]}}"),
    ],
)
def test_short_spellings_are_valid_and_read_as_the_long_ones(short: str, entry: str) -> None:
    assert _valid(with_joint(short))
    (row,), (long,) = parse_robot(with_joint(short)).rows, parse_robot(with_joint(entry)).rows
    assert (row.type, row.limits.position) == (long.type, long.limits.position)


@pytest.mark.parametrize("entry", ["{type: C}", "{type: Revolute}", "{type: R, limits: [1]}", "{type: R, limits: 1}"])
def test_spellings_that_the_reader_refuses_are_not_valid(entry: str) -> None:
    assert not _valid(with_joint(entry))
    with pytest.raises(RobotFileError):
        parse_robot(with_joint(entry))


@pytest.mark.parametrize(
    "text",
    [
        "name: r\nconvention: standard\n",
        with_joint("{a: 1}"),
        with_joint("{type: screw}"),
        with_joint("{type: revolute, alfa: 1}"),
        with_joint("{type: revolute, a: true}"),
        with_joint("{type: revolute, a: null}"),
        with_joint("{type: revolute, name: a b}"),
        with_joint("{type: revolute, limits: {position: [1]}}"),
        with_joint("{type: revolute, limits: {velocity: 0}}"),
        with_joint("{type: revolute, link: {color: [1, 2, 0]}}"),
        with_joint("{type: revolute, link: {inertia: {ixx: 1}}}"),
        with_joint("{type: revolute, link: null}"),
        with_joint("{type: revolute, convention: hyati}"),
        with_joint("{type: revolute, convention: hayati, beta: true}"),
        with_joint("{type: fixed, link: {mesh: {file: b.stl, xyz: [1, 2]}}}"),
        with_joint("{type: fixed, link: {mesh: {file: b.stl, rpy: 3}}}"),
        "name: r\nconvention: standard\njoints: []\n",
        with_keys("parameters: {d-1: 3}\n"),
        with_keys("configurations: {a b: [1]}\n"),
        with_keys("tool: {xyz: [1, 2]}\n"),
    ],
)
def test_wrong_files_are_not_valid(text: str) -> None:
    assert not _valid(text)


def test_each_call_returns_a_schema_of_its_own() -> None:
    json_schema()["title"] = "spoilt"
    assert json_schema()["title"] == "dh2sim robot file"


@pytest.mark.parametrize("name", builtin_robots())
def test_builtin_robot_is_valid_and_loads(name: str) -> None:
    path = builtin_path(name)
    assert path is not None
    assert _valid(path.read_text(encoding="utf-8"))
    assert load_robot(name).name == name
