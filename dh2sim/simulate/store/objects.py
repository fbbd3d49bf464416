"""A run in an object store: whole objects, written in an order that leaves no half of anything, and no locks.

Of several processes that make the same run at the same time the one whose root metadata come first decides; all of
them write the rest, which follows from these and from the settings.
"""

from __future__ import annotations

import errno
import os
import re
import socket
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from datetime import timedelta
from typing import Any, Final

from dh2sim.errors import RunError, RunExistsError, RunOutputError, RunUnreachableError
from dh2sim.extras import require_extra
from dh2sim.simulate.dataset_layout import Layout
from dh2sim.simulate.store.directory import check_replaceable
from dh2sim.simulate.store.manifest import BLOCKS, COORDINATES, METADATA, read_node
from dh2sim.simulate.store.metadata import make_metadata
from dh2sim.simulate.store.storage import run_all

_WHOLE: Final = 2**28
"""Bytes of objects that are sent in one request; larger ones in several, at whose end they appear."""
_PATIENCE: Final = timedelta(seconds=60)
"""After which a request that failed is not sent again."""
_PAUSE: Final = timedelta(seconds=5)
"""Longest one before a request is sent again."""
_CREDENTIALS: Final = (
    "AWS_ACCESS_KEY_ID",
    "AWS_WEB_IDENTITY_TOKEN_FILE",
    "AWS_CONTAINER_CREDENTIALS_RELATIVE_URI",
    "AWS_CONTAINER_CREDENTIALS_FULL_URI",
    "AWS_METADATA_ENDPOINT",
    "AWS_SKIP_SIGNATURE",
)
"""Variables of which one says how requests are signed; without any, the cloud's machine itself is asked."""
_METADATA: Final = "169.254.169.254"
"""Where machines of a cloud are asked for credentials."""
_NO_CREDENTIALS: Final = "no credentials were found: set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY"
_TIMEOUT: Final = timedelta(seconds=60)
"""For a single request, its data included; not less than ``_PATIENCE``, so that a silent server is asked once."""
_CONNECTING: Final = timedelta(seconds=5)
"""For a server to accept a connection."""
_NO_ANSWER: Final = "the server does not answer; see AWS_ENDPOINT_URL, AWS_REGION and the network"
_CAUSES: Final = {
    (f"//{_METADATA}/",): _NO_CREDENTIALS,
    ("NoSuchBucket",): "there is no such bucket",
    ("error sending request", "error decoding response body", "operation timed out"): _NO_ANSWER,
    ("RequestTimeTooSkewed",): "the clock of this machine is too far from the server's: set it",
    ("ExpiredToken", "TokenRefreshRequired"): "the credentials have expired",
    ("ETag Header missing",): "what answers is no object store; see AWS_ENDPOINT_URL",
    ("InvalidAccessKeyId", "SignatureDoesNotMatch", "AccessDenied", "403 Forbidden"): "access is denied; see "
    "AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, and what they may do",
    ("PermanentRedirect", "AuthorizationHeaderMalformed"): "the bucket is in another region; set AWS_REGION",
}
"""What parts of obstore's messages mean for who has typed a place."""
_TOLD: Final = re.compile(r"<Code>([^<]*)</Code>\s*<Message>([^<]*)</Message>")
"""What a server says of an error."""
_MANIFEST: Final = f"{BLOCKS}/{METADATA}"
"""The object of a new run that is written last."""


class ObjectStore:
    """The objects of a bucket whose names begin with a prefix; see ``Store``.

    Once its server has not answered a request in time, no other is sent.
    """

    def __init__(self, url: str) -> None:
        """Use ``s3://BUCKET/PREFIX``, with credentials, region and endpoint of the variables ``AWS_…``.

        Raises:
            RunError: The URL names no bucket, or no prefix.
            MissingExtraError: obstore is not installed.
        """
        require_extra("s3", "obstore", what="a run in an object store")
        from obstore.store import S3Store

        bucket, _, prefix = url.partition("://")[2].partition("/")
        if not bucket or not prefix.strip("/"):
            raise RunError(f"'{url}' names no run: write s3://BUCKET/NAME, as in s3://rollouts/run.zarr")
        endpoint = os.environ.get("AWS_ENDPOINT_URL_S3") or os.environ.get("AWS_ENDPOINT_URL")
        more: dict[str, Any] = {"endpoint": endpoint} if endpoint else {}
        self.name = url
        self._lost = False
        if not any(os.environ.get(name) for name in _CREDENTIALS) and not _reaches_metadata():
            raise RunError(f"cannot use '{url}': {_NO_CREDENTIALS}")
        try:
            self._objects = S3Store(
                bucket,
                prefix=prefix.strip("/"),
                client_options={
                    "allow_http": bool(endpoint and endpoint.startswith("http://")),
                    "timeout": _TIMEOUT,
                    "connect_timeout": _CONNECTING,
                },
                retry_config={
                    "max_retries": 10,
                    "retry_timeout": _PATIENCE,
                    "backoff": {"init_backoff": timedelta(milliseconds=100), "max_backoff": _PAUSE, "base": 2},
                },
                **more,
            )
        except Exception as error:
            raise RunError(f"cannot use '{url}': {_cause(error)}") from error

    @property
    def zarr(self) -> Any:
        """A store of zarr's, read only."""
        from zarr.storage import ObjectStore as ZarrStore

        return ZarrStore(self._objects, read_only=True)

    def file(self, key: str = "") -> str:
        """Return the URL of an object of the run."""
        return f"{self.name.rstrip('/')}/{key}" if key else self.name

    def exists(self) -> bool:
        """Return whether there is any object of this prefix."""
        import obstore

        with self._reading():
            return next((True for some in obstore.list(self._objects, chunk_size=1) if some), False)

    def put(self, files: Mapping[str, tuple[bytes, ...]]) -> None:
        """Write objects, the last one when all others are there."""
        import obstore

        def send(key: str) -> None:
            data = b"".join(files[key])
            with self._writing():
                obstore.put(self._objects, key, data, use_multipart=len(data) > _WHOLE)

        *others, last = files
        run_all(send, others)
        send(last)

    def put_new(self, key: str, data: bytes) -> bool:
        """Write an object unless there is one, and return whether it was written."""
        import obstore
        from obstore.exceptions import AlreadyExistsError

        try:
            with self._writing():
                obstore.put(self._objects, key, data, mode="create", use_multipart=False)
        except FileExistsError:
            return False
        except OSError as error:
            if isinstance(error.__cause__, AlreadyExistsError):
                return False
            raise
        return True

    def get(self, key: str, *, most: int, last: int | None = None) -> bytes:
        """Return an object, or its ``last`` bytes."""
        import obstore

        with self._reading():
            found = obstore.get(self._objects, key, options={} if last is None else {"range": {"suffix": last}})
            if last is None and found.meta["size"] > most:
                raise OSError(errno.EFBIG, f"is larger than {most} bytes", self.file(key))
            return bytes(found.bytes())

    def pieces(self, key: str) -> Iterator[bytes]:
        """Yield an object in pieces."""
        import obstore

        with self._reading():
            for piece in obstore.get(self._objects, key).stream():
                yield bytes(piece)

    def list(self, folder: str) -> dict[str, int]:
        """Return the names below a prefix with their sizes; none where there is no such prefix."""
        import obstore

        with self._reading():
            found = obstore.list_with_delimiter(self._objects, folder or None)
            return {each["path"].rpartition("/")[2]: each["size"] for each in found["objects"]}

    def delete(self, key: str) -> None:
        """Remove an object, if it is there."""
        import obstore

        with self._writing():
            obstore.delete(self._objects, key)

    def clear(self) -> None:
        """Remove all objects of this prefix, the root metadata last: until then it is known for a run."""
        import obstore

        with self._reading():
            keys = [each["path"] for some in obstore.list(self._objects) for each in some]
        with self._writing():
            obstore.delete(self._objects, [key for key in keys if key != METADATA])
            obstore.delete(self._objects, METADATA)

    @contextmanager
    def _reading(self) -> Iterator[None]:
        """Turn obstore's errors into those of a missing file, or into one for users.

        Raises:
            FileNotFoundError: There is no such object.
            RunUnreachableError: Its server does not answer.
            RunError: The store cannot be read otherwise.
        """
        from obstore.exceptions import BaseError, NotFoundError

        if self._lost:
            raise RunUnreachableError(f"cannot read '{self.name}': {_NO_ANSWER}")
        try:
            yield
        except (NotFoundError, FileNotFoundError) as error:
            if "NoSuchBucket" in str(error):
                raise RunError(f"cannot read '{self.name}': there is no such bucket") from error
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT)) from error
        except BaseError as error:
            told = reading_error(self.name, error)
            assert told is not None
            self._lost |= isinstance(told, RunUnreachableError)
            raise told from error

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Turn obstore's errors into an ``OSError``."""
        from obstore.exceptions import BaseError

        if self._lost:
            raise OSError(errno.ETIMEDOUT, _NO_ANSWER)
        try:
            yield
        except BaseError as error:
            cause = _cause(error)
            self._lost |= cause == _NO_ANSWER
            raise OSError(errno.EIO, cause) from error


def reading_error(place: str, error: BaseException) -> RunError | None:
    """Return the error for users that stands for one of obstore's; None for any other error."""
    if "obstore" not in sys.modules:
        return None
    from obstore.exceptions import BaseError

    if not isinstance(error, BaseError):
        return None
    cause = _cause(error)
    kind = RunUnreachableError if cause == _NO_ANSWER else RunError
    return kind(f"cannot read '{place}': {cause}")


def create_objects(store: ObjectStore, files: Mapping[str, bytes], *, overwrite: bool) -> None:
    """Make a new run.

    Args:
        store: Its place.
        files: Its contents, by key.
        overwrite: Whether the objects of a run that is there are removed first.

    Raises:
        RunExistsError: There is something.
        RunOutputError: The run cannot be written.
    """
    try:
        if store.exists():
            check_replaceable(store, overwrite=overwrite)
            store.clear()
        if not store.put_new(METADATA, files[METADATA]):
            raise RunExistsError(f"'{store.name}' was made by another process meanwhile; resume it, or overwrite it")
        _put_rest(store, files)
    except OSError as error:
        raise RunOutputError(f"cannot write to '{store.name}': {error.strerror or error}") from error


def complete_objects(store: ObjectStore, layout: Layout) -> None:
    """Write the rest of a run that another process is making, or has died while it made it.

    Raises:
        RunOutputError: It cannot be written.
    """
    root = read_node(store, METADATA)
    if root is None or read_node(store, _MANIFEST) is not None or not isinstance(root.get("attributes"), dict):
        return
    attributes = {name: value for name, value in root["attributes"].items() if name != COORDINATES}
    files = make_metadata(replace(layout, attributes=attributes))
    try:
        if store.get(METADATA, most=len(files[METADATA])) == files[METADATA]:  # else it has other settings
            _put_rest(store, files)
    except OSError as error:
        raise RunOutputError(f"cannot write to '{store.name}': {error.strerror or error}") from error


def _put_rest(store: ObjectStore, files: Mapping[str, bytes]) -> None:
    run_all(lambda key: store.put_new(key, files[key]), [key for key in files if key not in (METADATA, _MANIFEST)])
    store.put_new(_MANIFEST, files[_MANIFEST])


def _cause(error: BaseException) -> str:
    """Return what obstore says, in words for users where it is one of the usual causes."""
    text = str(error)
    for parts, words in _CAUSES.items():
        if any(part in text for part in parts):
            return words
    if told := _TOLD.search(text):
        return f"the server reports {told[1]}: {told[2].rstrip(' .')}"
    return text.partition("\n")[0].rstrip(" .")


def _reaches_metadata() -> bool:
    """Whether this may be a machine of a cloud, which has credentials of its own; obstore would ask for a minute."""
    try:
        socket.create_connection((_METADATA, 80), timeout=1).close()
    except OSError:
        return False
    return True
