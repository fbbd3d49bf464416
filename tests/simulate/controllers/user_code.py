"""Controllers as users write them, in files of theirs."""

from __future__ import annotations

import textwrap
from pathlib import Path

SWING = '''
    """Controllers of a user."""

    from __future__ import annotations

    from typing import TYPE_CHECKING

    if TYPE_CHECKING:
        from dh2sim.simulate import RolloutBatch, Observation


    class Swing:
        actuation = "motor"

        def __init__(self, batch: RolloutBatch, *, gain: float = 3.0):
            if gain < 0:
                raise ValueError("a gain is not negative")
            self.gain = gain

        def control(self, observation: Observation):
            return -self.gain * observation.v


    class Still:
        def __init__(self, batch):
            self.batch = batch

        def controls(self, first, count):
            return self.batch.q0[:, None]

        def reference(self, first, count):
            return None, 1 / 0


    class Odd:
        actuation = "motors"

        def __init__(self, batch): ...

        def control(self, observation): ...


    class Neither:
        def __init__(self, batch): ...


    class Both:
        def __init__(self, batch): ...

        def control(self, observation): ...

        def controls(self, first, count): ...


    class Alone:
        def control(self, observation): ...


    number = 3
'''


def write(folder: Path, name: str, text: str) -> Path:
    (folder / name).parent.mkdir(exist_ok=True)
    (folder / name).write_text(textwrap.dedent(text).lstrip(), encoding="utf-8")
    return folder / name


def line(file: Path, text: str) -> int:
    return 1 + next(i for i, found in enumerate(file.read_text(encoding="utf-8").splitlines()) if text in found)
