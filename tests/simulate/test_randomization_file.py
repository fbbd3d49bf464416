"""Files that say what is random."""

from __future__ import annotations

from pathlib import Path

import pytest

from dh2sim.errors import Dh2simError, RobotFileError
from dh2sim.simulate.options import RolloutOptions
from dh2sim.simulate.randomization_file import read_randomization
from tests.refusals import refusal

FILE = """\
mass: 0.2
damping: {others: 0.1, joint_3: 0.5}
kp: normal:0.05
push: 20
push_interval: 1
"""
WRONG = f"""\
mas: 0.2
mass: [1, 2]
payload: {{link_1: 1}}
kp:
  joint_1: normal:0.9
  others: true
payload_com: 0.1
damping: {10**399}
"""


def test_a_file_says_what_options_say(tmp_path: Path) -> None:
    path = tmp_path / "random.yaml"
    path.write_text(FILE)
    found = read_randomization(path)
    assert found == {
        "mass": 0.2, "damping": 0.1, "damping[joint_3]": 0.5, "kp": "normal:0.05", "push": 20.0, "push_interval": 1.0
    }  # fmt: skip
    assert RolloutOptions(randomize=found).randomize == found


def test_everything_that_is_wrong_is_reported_with_its_place(tmp_path: Path) -> None:
    path = tmp_path / "random.yaml"
    path.write_text(WRONG)
    lines = refusal(RobotFileError, read_randomization, path).replace(f"{path}:", "").splitlines()
    assert [line.split(" Allowed")[0] for line in lines] == [
        "1:6: mas: must not contain 'mas'. Did you mean 'mass'?",
        "2:7: mass: expected a number or a distribution, found a list",
        "3:19: payload.link_1: must not contain 'payload[link_1]': a rollout has one payload",
        "5:12: kp.joint_1: must be above 0 in all draws, got kp[joint_1]=normal:0.9, which reaches -2.6",
        "6:11: kp.others: expected a number or a distribution, found true",
        "8:10: damping: expected a number or a distribution, found a number of too many digits",
    ]
    path.write_text("payload_com: 0.1\n")
    assert refusal(RobotFileError, read_randomization, path).endswith(
        "1:1: must not contain 'payload_com' without 'payload'"
    )
    path.write_text("- mass\n")
    assert "expected a mapping of quantities" in refusal(RobotFileError, read_randomization, path)
    with pytest.raises(Dh2simError, match="cannot be read"):
        read_randomization(tmp_path / "none.yaml")
