from __future__ import annotations

from pathlib import Path

import pytest

from dh2sim.errors import ControllerError
from dh2sim.simulate.controllers.protocol import Follows
from tests.simulate.controllers.samples import arm, make, refused
from tests.simulate.controllers.user_code import SWING, line, write


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        (
            "Swung",
            "module 'swinging' (swinging.py) has no class 'Swung'. Did you mean 'Swing'? "
            "It has: Swing, Still, Odd, Neither, Both, Alone",
        ),
        ("number", "'number' of module 'swinging' (swinging.py) is not a class"),
        (
            "Odd",
            "actuation must be 'position', 'velocity', 'motor', 'none', or None for the robot's own actuators, "
            "got 'motors'. Did you mean 'motor'?",
        ),
        ("Alone", "its constructor must take a RolloutBatch as its first argument"),
    ],
)
def test_a_class_that_cannot_be_a_controller_is_refused(folder: Path, name: str, problem: str) -> None:
    write(folder, "swinging.py", SWING)
    assert refused(f"swinging:{name}") == f"controller 'swinging:{name}': {problem}"


@pytest.mark.parametrize("name", ["Neither", "Both"])
def test_a_controller_looks_at_the_state_or_does_not(folder: Path, name: str) -> None:
    write(folder, "swinging.py", SWING)
    assert refused(f"swinging:{name}") == (
        f"controller 'swinging:{name}' must have either control(observation) or controls(first, count), "
        f"got {name.lower()}"
    )


def test_a_failing_constructor_is_reported_with_its_text_and_line(folder: Path) -> None:
    file = write(folder, "swinging.py", SWING)
    where = line(file, "raise ValueError")
    assert refused("swinging:Swing:gain=-1") == (
        f"controller 'swinging:Swing': ValueError: a gain is not negative (swinging.py, line {where})"
    )


def test_a_failing_method_is_reported_with_its_text_and_line(folder: Path) -> None:
    file = write(folder, "swinging.py", SWING)
    controller, _ = make("swinging:Still", arm())
    assert isinstance(controller, Follows)
    with pytest.raises(ControllerError) as caught:
        controller.reference(0, 1)
    where = line(file, "1 / 0")
    assert str(caught.value) == (
        f"controller 'swinging:Still': ZeroDivisionError: division by zero (swinging.py, line {where})"
    )


def test_a_failure_inside_a_library_is_reported_with_the_users_line(folder: Path) -> None:
    text = (
        "import numpy as np\n\n\nclass A:\n    def __init__(self, batch):\n        np.linalg.inv(np.zeros((2, 2)))\n"
    )
    write(folder, "inverting.py", text + "\n    def control(self, observation):\n        pass\n")
    assert refused("inverting:A") == "controller 'inverting:A': LinAlgError: Singular matrix (inverting.py, line 6)"


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("import a_module_that_is_not_there", "ModuleNotFoundError: No module named 'a_module_that_is_not_there'"),
        ("x = (", "SyntaxError: '(' was never closed"),
        ("raise SystemExit(3)", "SystemExit: 3"),
        ("assert False", "AssertionError"),
    ],
)
def test_a_module_that_cannot_be_imported_is_reported_with_the_line(folder: Path, text: str, problem: str) -> None:
    write(folder, "unimportable.py", f"import sys\n{text}\n")
    assert refused("unimportable:A") == f"controller 'unimportable:A': {problem} (unimportable.py, line 2)"


@pytest.mark.parametrize("text", ["no_such_module:A", "no_such_package.part:A", "no_such_package.part:A:gain=3"])
def test_a_module_that_is_not_there_is_an_unknown_controller(folder: Path, text: str) -> None:
    assert refused(text) == (
        f"unknown controller and no module '{text.split(':')[0]}'. Known controllers: passive, hold, "
        "gravity-compensation, pd, computed-torque, sine, random, replay; your own is named MODULE:CLASS"
    )
