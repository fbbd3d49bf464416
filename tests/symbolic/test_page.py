"""docs/symbolic.md: what it shows is what is printed."""

from __future__ import annotations

import re
import shlex
import time
from pathlib import Path

import pytest

from dh2sim.robot.read import load_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.symbolic.expression import operation_count
from dh2sim.symbolic.request import symbolic_form
from tests.program import dh2sim
from tests.sample_robots import NAMES
from tests.sample_robots import robot as spec_of
from tests.symbolic.test_dynamics import ELBOW

PAGE = (Path(__file__).parents[2] / "docs" / "symbolic.md").read_text(encoding="utf-8")
CONSOLE = re.findall(r"```console\n\$ dh2sim ([^\n]+)\n(.*?)```", PAGE, flags=re.DOTALL)
ROBOT = re.findall(r"```yaml\n(name: ([a-z0-9_]+)\n.*?)```", PAGE, flags=re.DOTALL)


@pytest.mark.parametrize(("command", "output"), CONSOLE)
def test_commands_print_what_the_page_shows(
    command: str, output: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for text, name in ROBOT:
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    run = dh2sim(*shlex.split(command))
    assert (run.status, run.err) == (0, "")
    assert run.out == output


def test_the_page_has_the_operations_of_every_robot() -> None:
    rows = re.findall(r"^\| `(\w+)` \| (\d+) \| (\d+) \| (\d+) \|", PAGE, flags=re.MULTILINE)
    assert len(rows) == 22
    for name, *numbers in rows:
        form = symbolic_form(load_robot(name)).form
        assert [*operation_count([*form.named.values(), *form.sums]), len(form.named)] == list(map(int, numbers))


def test_the_puma_takes_no_more_operations_than_the_best_known_nesting() -> None:
    form = symbolic_form(load_robot("puma560")).form
    multiplications, additions = operation_count([*form.named.values(), *form.sums])
    assert multiplications <= 54
    assert additions <= 22


@pytest.mark.slow
def test_forms_of_every_robot_take_the_time_that_is_promised() -> None:
    def least(what: str, robot: RobotSpec, letters: bool = False) -> float:
        times = []
        for _ in range(3):
            start = time.process_time()
            str(symbolic_form(robot, what, letters=letters))
            times.append(time.process_time() - start)
        return min(times)

    for name in NAMES:
        assert least("pose", spec_of(name)) < 0.1
        assert least("jacobian", spec_of(name)) < 0.3
    assert least("dynamics", ELBOW, letters=True) < 0.3
