"""Buttons that files are uploaded with; viser's own intake, which knows no bounds, is put aside."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

from dh2sim.errors import Dh2simError
from dh2sim.view.events import Tell
from dh2sim.view.panel.bound import Send
from dh2sim.view.uploads import Intake, Uploaded

if TYPE_CHECKING:
    import viser

Use: TypeAlias = Callable[[bytes, str], None]
"""What is done with a file's content, and its name."""

_ACCEPTED = ".yaml,.yml"


class UploadButtons:
    """All upload buttons of a page: they share one bound on what the page makes the server keep.

    One file is on its way at most, and one waits at most, both of the size of a robot file at most.
    """

    def __init__(self, client: viser.ClientHandle, send: Send) -> None:
        """Take over from viser, which would keep parts of as many files as it is sent, however large.

        Args:
            client: The page's viser client.
            send: Where what is to be done goes.
        """
        from viser import _messages

        self._gui = client.gui
        self._wire = client.gui._websock_interface
        self._send = send
        self._uses: dict[str, Use] = {}
        self._intake = Intake()
        self._waiting: deque[Uploaded] = deque(maxlen=1)
        self._acknowledgement = _messages.FileTransferPartAck
        self._removal = _messages.RemoveNotificationMessage
        for message, handler in (
            (_messages.FileTransferStartUpload, self._announced),
            (_messages.FileTransferPart, self._came),
        ):
            self._wire.unregister_handler(message)
            self._wire.register_handler(message, handler)

    def add(self, label: str, use: Use) -> None:
        """Add a button to viser's current container."""
        button = self._gui.add_upload_button(label, mime_type=_ACCEPTED)
        self._uses[button._impl.uuid] = use

    def _announced(self, _client: int, message: Any) -> None:  # both run on viser's own loop, in the order sent
        button, transfer = message.source_component_uuid, message.transfer_uuid
        if not (isinstance(transfer, str) and isinstance(button, str) and button in self._uses):
            return
        if self._intake.awaited is not None:
            self._close(*self._intake.awaited)
        self._do(
            partial(
                self._intake.announce,
                transfer=transfer,
                button=button,
                name=message.filename,
                size=message.size_bytes,
                count=message.part_count,
            ),
            button,
            transfer,
        )

    def _came(self, _client: int, message: Any) -> None:
        if self._intake.awaited is None:
            return
        take = partial(
            self._intake.take,
            transfer=message.transfer_uuid,
            index=message.part_index,
            content=message.content,
        )
        self._do(take, *self._intake.awaited)

    def _do(self, step: Callable[[], Uploaded | None], button: str, transfer: str) -> None:
        """Take a step of a file's way; at its end, in one way or the other, the button is free again."""
        file = None
        try:
            file = step()
        except Dh2simError as error:
            self._send(Tell(notice=str(error)))
        if file is not None:
            self._waiting.append(file)
            self._send(self._use)
        if self._intake.awaited is None:
            self._close(button, transfer, file)

    def _close(self, button: str, transfer: str, file: Uploaded | None = None) -> None:
        """Free the browser's button; what it says of a file that is not taken, as if all went well, is taken back."""
        size = 0 if file is None else len(file.data)
        if file is None:
            self._wire.queue_message(self._removal(uuid=f"upload-{transfer}"))
        self._wire.queue_message(
            self._acknowledgement(
                source_component_uuid=button, transfer_uuid=transfer, transferred_bytes=size, total_bytes=size
            )
        )

    def _use(self) -> None:
        """Do what the newest file was uploaded for; one that a newer one has replaced is left out."""
        try:
            file = self._waiting.popleft()
        except IndexError:
            return
        self._uses[file.button](file.data, file.name)
