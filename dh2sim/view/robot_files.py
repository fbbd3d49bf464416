"""What a page does with files: opens and compares robots, and hands out what was made of them."""

from __future__ import annotations

from collections.abc import Callable

from dh2sim.export.render import Format
from dh2sim.view.downloads import model_file
from dh2sim.view.events import Compare, Event, OpenText, ReplaceText, Tell
from dh2sim.view.opening import builtin_ghost, is_same_file
from dh2sim.view.state import ViewState
from dh2sim.view.uploads import uploaded_ghost


class RobotFiles:
    """Each call in its turn, on the page's own thread."""

    def __init__(
        self,
        state: Callable[[], ViewState],
        apply: Callable[[Event], None],
        hand_out: Callable[[str, bytes], None],
        exchanged: Callable[[], None],
    ) -> None:
        """Keep what is needed.

        Args:
            state: Returns the page's state; that of now is what can be returned to.
            apply: Lets an event happen now.
            hand_out: Gives the user a file, by its name and its content.
            exchanged: Called when another robot file is shown.
        """
        self._state = state
        self._apply = apply
        self._hand_out = hand_out
        self._exchanged = exchanged
        self._opened = state()

    def save(self) -> None:
        """Hand out the robot file as it is edited."""
        state = self._state()
        self._hand_out(f"{state.spec.name}.yaml", state.text.encode())

    def export(self, wanted: Format) -> None:
        """Hand out a model, compared with the table before.

        Raises:
            Dh2simError: It cannot be made, or does not match.
        """
        made = model_file(self._state().model, wanted)
        self._hand_out(made.name, made.data)
        self._apply(Tell(notice=f"{made.name}: {made.summary}."))

    def open(self, text: bytes, file: str) -> None:
        """Open a robot file that was uploaded, given its content and its name."""
        self._exchange(OpenText(text=text, file=file))

    def back(self) -> None:
        """Return to the robot file that was opened at first."""
        opened = self._opened
        if is_same_file(self._state(), opened):
            self._apply(ReplaceText(text=opened.text))
        else:
            self._exchange(OpenText(text=opened.text, file=opened.file, folder=opened.folder))

    def compare(self, robot: str) -> None:
        """Draw a robot that comes with dh2sim, given its name, beside the one that is shown.

        Raises:
            Dh2simError: There is no such robot.
        """
        self._apply(Compare(ghost=builtin_ghost(robot)))

    def compare_uploaded(self, text: bytes, file: str) -> None:
        """Draw the robot of a file that was uploaded beside the one that is shown.

        Raises:
            Dh2simError: The file is wrong.
        """
        self._apply(Compare(ghost=uploaded_ghost(text, file)))
        self._apply(Tell(notice=""))

    def _exchange(self, event: OpenText) -> None:
        """Show another robot, unless its file is wrong."""
        before = self._state().model
        self._apply(event)
        if self._state().model is not before:
            self._exchanged()
