"""What was chosen, changed or left out, in sentences; things of one kind share a sentence."""

from __future__ import annotations

from dh2sim.robot.words import listed, shown


class Notes:
    """Collects the notes of one file, in the order in which their kinds first come up."""

    def __init__(self) -> None:
        """Start with none."""
        self._names: dict[str, dict[str, None]] = {}

    def add(self, sentence: str) -> None:
        """Note a sentence of its own."""
        self._names.setdefault(sentence, {})

    def group(self, sentence: str, name: str, detail: str = "") -> None:
        """Note one more name for a sentence, which has a ``{}`` where all its names go."""
        self._names.setdefault(sentence, {})[f"{shown(name)}{detail and f' ({detail})'}"] = None

    def sentences(self) -> tuple[str, ...]:
        """Return them all."""
        return tuple(sentence.replace("{}", listed(names), 1) for sentence, names in self._names.items())
