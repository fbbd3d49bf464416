"""docs/controllers.md tells the truth."""

from __future__ import annotations

import inspect
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from dh2sim.errors import ControllerError
from dh2sim.simulate.controllers.options import options_of
from dh2sim.simulate.controllers.protocol import ClosedLoop, Observation, RolloutBatch
from dh2sim.simulate.controllers.registry import BUILT_IN, choose
from dh2sim.simulate.plant import Plant
from tests.simulate.controllers.samples import arm, make, observe

PAGE = (Path(__file__).parents[3] / "docs" / "controllers.md").read_text(encoding="utf-8")
ROWS = {
    row[0].strip("`"): row for row in (re.split(r" *\| *", line)[1:-1] for line in PAGE.splitlines() if "|" in line)
}


@pytest.mark.parametrize("name", list(BUILT_IN))
def test_the_page_lists_every_option_with_its_default(name: str) -> None:
    found = BUILT_IN[name]
    prepare = getattr(found, "prepare", None)  # of those that read files
    constructor, skip = (found, 1) if prepare is None else (prepare, 0)
    options = options_of(constructor, found.__module__, skip=skip)
    assert re.findall(r"`([^`]*)`", ROWS[name][3]) == [str(option) for option in options]


@pytest.mark.parametrize("name", [name for name in BUILT_IN if name != "replay"])
def test_the_page_says_which_actuators_are_used(name: str) -> None:
    actuation = choose(name).actuation
    words = {None: "the robot's own", "position": "position", "motor": "motors", "none": "none"}
    assert ROWS[name][2] == words[actuation]


def test_the_page_names_everything_that_a_controller_is_given() -> None:
    named = set(re.findall(r"`(?:observation|batch)?\.?(\w+)`", PAGE))
    for given in (Observation, RolloutBatch, Plant):
        names = [name for name in (*vars(given), *inspect.get_annotations(given)) if not name.startswith("_")]
        hidden = {"floating", "turns", "driven", "loops", "gaps", "helpers", "independent", "controlled", "size"}
        hidden |= {"positions", "velocities", "spec", "following", "may_touch"}
        assert set(names) - hidden <= named


def test_commands_on_the_page_choose_controllers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    commands = re.findall(r"--controller (\S+?)`? ", PAGE)
    assert len(commands) == 3
    for text in commands:
        if text.startswith("damped"):
            with pytest.raises(ControllerError, match=r"^unknown controller"):
                choose(text)
        else:
            assert choose(text).text == text


def test_the_class_on_the_page_drives_an_arm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    (tmp_path / "damped.py").write_text(code, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    try:
        controller, group = make("damped:Damped:damping=8", arm())
        q, v = np.random.default_rng(1).normal(size=(2, 7, 3))
        seen = observe(group.plant, 0, q, v)
        assert isinstance(controller, ClosedLoop)
        assert np.array_equal(controller.control(seen), 0.5 * seen.gravity - 8.0 * v)
    finally:
        sys.modules.pop("damped", None)


def test_a_package_is_offered_as_the_page_says() -> None:
    from dh2sim.simulate.controllers.user_code import ENTRY_POINTS

    assert f'[project.entry-points."{ENTRY_POINTS}"]' in PAGE
