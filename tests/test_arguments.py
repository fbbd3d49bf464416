"""Whatever a method of Robot is given, what is wrong is said in the package's own words."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dh2sim import Robot, check_files, grade, parse_robot, read_measurements, recover_table, robot_file_text
from dh2sim.arguments import (
    below_one,
    file_path,
    file_paths,
    flag,
    instance,
    mapping,
    names,
    number,
    real_array,
    text,
    whole_number,
    whole_numbers,
)
from dh2sim.errors import ArgumentError, Dh2simError
from tests.refusals import refusal

ARM, LOOP = Robot.load("rpr"), Robot.load("four_bar")
Q = (0.1, 0.2, 0.3)
T = ARM.fk(Q)
WRONG: dict[str, Any] = {
    "object": object(),
    "array of NaN": np.full(3, np.nan),
    "array of objects": np.array([object()] * 3, object),
    "complex array": np.array([1j, 2.0, 3.0]),
    "texts": [["a"] * 3],
    "list of NaN": [np.nan],
    "NaN": np.nan,
    "negative": -1.5,
}
CALLS: dict[str, Callable[[Any], object]] = {
    "fk(q)": ARM.fk,
    "fk(frame)": lambda x: ARM.fk(Q, frame=x),
    "jacobian(q)": ARM.jacobian,
    "jacobian(frame)": lambda x: ARM.jacobian(Q, frame=x),
    "manipulability(q)": ARM.manipulability,
    "singular_values(q)": ARM.singular_values,
    "fk(q) of a mechanism": LOOP.fk,
    "jacobian(q) of a mechanism": LOOP.jacobian,
    "ik(T)": ARM.ik,
    "ik(q0)": lambda x: ARM.ik(T, q0=x),
    "ik(free)": lambda x: ARM.ik(T, free=x),
    "ik(lock)": lambda x: ARM.ik(T, lock=x),
    "ik(limits)": lambda x: ARM.ik(T, limits=x),
    "ik(numeric)": lambda x: ARM.ik(T, numeric=x),
    "explain_ik(T)": ARM.explain_ik,
    "random_configurations(count)": ARM.random_configurations,
    "random_configurations(seed)": lambda x: ARM.random_configurations(2, seed=x),
    "workspace(frame)": lambda x: ARM.workspace(frame=x),
    "workspace(samples)": lambda x: ARM.workspace(samples=x),
    "workspace(size)": lambda x: ARM.workspace(size=x),
    "workspace(seed)": lambda x: ARM.workspace(seed=x),
    "symbolic(what)": ARM.symbolic,
    "symbolic(style)": lambda x: ARM.symbolic(style=x),
    "symbolic(source)": lambda x: ARM.symbolic(source=x),
    "symbolic(joint_names)": lambda x: ARM.symbolic(joint_names=x),
    "code(language)": ARM.code,
    "code(what)": lambda x: ARM.code("c", what=x),
    "code(name)": lambda x: ARM.code(name=x),
    "trajectory(waypoints)": ARM.trajectory,
    "trajectory(kind)": lambda x: ARM.trajectory([Q, (0, 0, 0)], kind=x),
    "trajectory(duration)": lambda x: ARM.trajectory([Q, (0, 0, 0)], duration=x),
    "trajectory(limits)": lambda x: ARM.trajectory([Q, (0, 0, 0)], limits=x),
    "plan_measurements(count)": ARM.plan_measurements,
    "plan_measurements(kind)": lambda x: ARM.plan_measurements(10, kind=x),
    "plan_measurements(noise)": lambda x: ARM.plan_measurements(10, noise=x),
    "plan_measurements(seed)": lambda x: ARM.plan_measurements(10, seed=x),
    "calibrate(data)": ARM.calibrate,
    "draw(q)": ARM.draw,
    "draw(style)": lambda x: ARM.draw(style=x),
    "draw(workspace)": lambda x: ARM.draw(style="stick", workspace=x),
    "draw(reach)": lambda x: ARM.draw(style="stick", reach=x),
    "draw().save(path)": ARM.draw().save,
    "convert(to)": ARM.convert,
    "export(out)": ARM.export,
    "export(formats)": lambda x: ARM.export("build", formats=x),
    "validate(samples)": lambda x: ARM.validate(samples=x),
    "validate(seed)": lambda x: ARM.validate(samples=1, seed=x),
    "validate(tolerance)": lambda x: ARM.validate(samples=1, tolerance=x),
    "validate(tolerance) of a mechanism": lambda x: LOOP.validate(samples=1, tolerance=x),
    "validate(source)": lambda x: ARM.validate(samples=1, source=x),
    "diff(tolerance)": lambda x: ARM.diff(ARM, tolerance=x),
    "sweep(vary)": lambda x: ARM.sweep(vary=x),
    "sweep(count)": lambda x: ARM.sweep(vary={"L2": 0.1}, count=x),
    "sweep(measure)": lambda x: ARM.sweep(vary={"L2": 0.1}, measure=x),
    "sweep(voxel)": lambda x: ARM.sweep(vary={"L2": 0.1}, voxel=x),
    "rollout(rollouts)": lambda x: ARM.rollout(x, steps=2),
    "rollout(steps)": lambda x: ARM.rollout(1, steps=x),
    "rollout(controller)": lambda x: ARM.rollout(1, steps=2, controller=x),
    "rollout(record)": lambda x: ARM.rollout(1, steps=2, record=x),
    "rollout(threads)": lambda x: ARM.rollout(1, steps=2, threads=x),
    "rollout(out)": lambda x: ARM.rollout(1, steps=2, out=x),
    "rollout(blocks)": lambda x: ARM.rollout(1, steps=2, out="run.zarr", blocks=x),
    "rollout(share)": lambda x: ARM.rollout(1, steps=2, out="run.zarr", share=x),
    "load": Robot.load,
    "from_urdf": Robot.from_urdf,
    "from_table": Robot.from_table,
    "save(path)": ARM.save,
    "view(port)": lambda x: ARM.view(port=x, browser=False),
    "view(allow_hosts)": lambda x: ARM.view(allow_hosts=[x], browser=False),
    "robot_file_text(angle)": lambda x: robot_file_text(ARM, angle=x),
    "check_files(paths)": check_files,
    "check_files(exports)": lambda x: check_files(exports=x),
    "check_files(parts)": lambda x: check_files(parts=x),
    "check_files(samples)": lambda x: check_files(samples=x),
    "check_files(tolerance)": lambda x: check_files(tolerance=x),
    "check_files(baseline)": lambda x: check_files(baseline=x),
    "grade(submissions)": lambda x: grade(ARM, x),
    "grade(rubric)": lambda x: grade(ARM, [], rubric=x),
    "grade(tolerance)": lambda x: grade(ARM, [], tolerance=x),
    "grade(options)": lambda x: grade(ARM, [], options=x),
    "parse_robot(text)": parse_robot,
    "read_measurements(path)": lambda x: read_measurements(x, ARM),
    "recover_table(chain)": recover_table,
}


@pytest.mark.parametrize("call", CALLS)
def test_a_wrong_argument_is_reported_in_the_packages_own_words(
    call: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for kind, value in WRONG.items():
        with pytest.raises(Exception) as caught:  # noqa: PT011
            CALLS[call](value)
        assert isinstance(caught.value, Dh2simError), f"{kind}: {caught.value!r}"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: Robot.from_urdf("arm.urdf", arguments=[1]),  # type: ignore[arg-type]
            "arguments must be a mapping of names to values, got [1]",
        ),
        (
            lambda: Robot.from_urdf("arm.urdf", package_paths=3),  # type: ignore[arg-type]
            "package_paths must be a path or several, got 3",
        ),
        (lambda: check_files(parts=["x"]), "unknown part 'x'. Allowed: files, drift, poses"),
        (lambda: check_files(3), "paths must be a path or several, got 3"),  # type: ignore[arg-type]
        (lambda: grade(ARM, 3), "submissions must be a path or several, got 3"),  # type: ignore[arg-type]
        (
            lambda: ARM.rollout(1, steps=2, out="run.zarr", blocks=9),  # type: ignore[arg-type]
            "blocks must be whole numbers, got 9",
        ),
        (
            lambda: ARM.rollout(1, steps=2, out="run.zarr", share=3),  # type: ignore[arg-type]
            "share must be 2 whole numbers, got 3",
        ),
        (lambda: ARM.plan_measurements(10, noise="x"), "noise must be real numbers, got 'x'"),  # type: ignore[arg-type]
        (
            lambda: ARM.plan_measurements(10, noise=-1),
            "noise must be a positive number, m, or two, m and rad; got -1.0",
        ),
        (lambda: recover_table(3), "chain must be of type SerialChain, got 3"),  # type: ignore[arg-type]
        (lambda: parse_robot(3), "text must be a string or bytes, got int"),  # type: ignore[arg-type]
        (lambda: read_measurements(3, ARM), "path must be a path, got 3"),  # type: ignore[arg-type]
        (lambda: ARM.validate(source=3), "source must be a path, got 3"),  # type: ignore[arg-type]
        (lambda: ARM.code(name=3), "name must be a string, got 3"),  # type: ignore[arg-type]
        (lambda: ARM.draw().save(3), "path must be a path, got 3"),  # type: ignore[arg-type]
        (lambda: ARM.symbolic(joint_names="x"), "unknown joint_names 'x'. Allowed: theta, q"),
        (lambda: ARM.export(formats=[]), "formats must be at least one of urdf, mjcf"),
        (lambda: ARM.ik(T, limits="yes"), "limits must be True or False, got 'yes'"),  # type: ignore[arg-type]
        (lambda: ARM.save("a.yaml", overwrite="no"), "overwrite must be True or False, got 'no'"),  # type: ignore[arg-type]
        (lambda: ARM.rollout(out="a", overwrite="no"), "overwrite must be True or False, got 'no'"),  # type: ignore[arg-type]
    ],
)
def test_what_an_argument_may_be_is_said_with_its_name(
    call: Callable[[], object], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert refusal(Dh2simError, call) == message
    assert not list(tmp_path.iterdir())


def test_a_port_that_does_not_exist_is_refused() -> None:
    assert refusal(ArgumentError, ARM.view, port=65536, browser=False) == "port must be at most 65535, got 65536"


def test_the_checks_take_what_is_right() -> None:
    assert whole_number("n", np.int64(3), least=3) == 3
    assert whole_numbers("blocks", range(2)) == [0, 1]
    assert number("x", np.float32(0.5)) == 0.5
    assert below_one("tolerance", 0.5) == 0.5
    assert flag("limits", np.False_) is False
    assert real_array("q", [[1, 2]]).tolist() == [[1.0, 2.0]]
    assert mapping("lock", {"a": 1}) == {"a": 1}
    assert names("what", "pose") == ["pose"]
    assert names("what", ("pose", "jacobian")) == ["pose", "jacobian"]
    assert text("frame", "tool0") == "tool0"
    assert file_paths("paths", "ab") == file_paths("paths", [Path("ab")]) == [Path("ab")]
    assert instance("robot", ARM, Robot) is ARM
    assert file_path("out", "a") == file_path("out", Path("a")) == Path("a")


@pytest.mark.parametrize(
    ("check", "value", "message"),
    [
        (whole_number, 2.5, "n must be a whole number of at least 0, got 2.5"),
        (whole_number, -1, "n must be a whole number of at least 0, got -1"),
        (whole_numbers, [1.5], "n must be whole numbers, got [1.5]"),
        (number, "1", "n must be a number, got '1'"),
        (number, True, "n must be a number, got True"),
        (below_one, 1, "n must be above 0 and below 1, got 1"),
        (flag, 1, "n must be True or False, got 1"),
        (real_array, [[1], [2, 3]], "n must be real numbers, got [[1], [2, 3]]"),
        (real_array, np.array([1j]), "n must be real numbers, got an array of complex128 of shape (1,)"),
        (mapping, [1], "n must be a mapping of names to values, got [1]"),
        (names, [1], "n must be a name or several, got [1]"),
        (text, None, "n must be a string, got None"),
        (file_paths, ["a", 1], "n must be a path or several, got ['a', 1]"),
        (file_path, ["x" * 99], "n must be a path, got a value of type list"),
    ],
)
def test_the_checks_name_the_argument_and_what_it_must_be(
    check: Callable[[str, object], object], value: object, message: str
) -> None:
    assert refusal(ArgumentError, check, "n", value) == message
