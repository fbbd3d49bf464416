"""Runs in an object store, a real server on this machine."""

from __future__ import annotations

import re
import socket
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager, suppress
from datetime import timedelta
from importlib.util import find_spec
from pathlib import Path, PurePath, PurePosixPath, PureWindowsPath
from typing import Any

import pytest

from dh2sim.errors import RunDiffersError, RunError, RunExistsError, RunOutputError
from dh2sim.simulate.description import describe
from dh2sim.simulate.run import rollout
from dh2sim.simulate.store import objects as objects_module
from dh2sim.simulate.store.codec import encode_text
from dh2sim.simulate.store.metadata import make_metadata
from dh2sim.simulate.store.objects import ObjectStore
from dh2sim.simulate.store.places import open_store
from dh2sim.simulate.store.reader import damaged_blocks, open_dataset
from dh2sim.simulate.store.writer import RunWriter
from tests.program import contents, dh2sim
from tests.simulate.store.runs import SECONDS, block_of, finish, layout, make

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("obstore") is None, reason="needs the extra 's3'"),
    pytest.mark.skipif(find_spec("moto") is None, reason="needs moto and flask"),
    pytest.mark.filterwarnings("ignore"),  # of the server's libraries
]

OF = layout(rollouts=8, block=2)
RUN = "s3://rollouts/tests/run.zarr"


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    from moto.server import ThreadedMotoServer

    started = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    started.start()
    host, port = started.get_host_and_port()
    yield f"http://{host}:{port}"
    started.stop()


@pytest.fixture(autouse=True)
def _bucket(server: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """An empty bucket."""
    import boto3

    for name, value in (("ACCESS_KEY_ID", "test"), ("SECRET_ACCESS_KEY", "test"), ("REGION", "us-east-1")):
        monkeypatch.setenv(f"AWS_{name}", value)
    monkeypatch.setenv("AWS_ENDPOINT_URL", server)
    client = boto3.client("s3", endpoint_url=server, region_name="us-east-1")
    if "rollouts" in [bucket["Name"] for bucket in client.list_buckets()["Buckets"]]:
        if listed := client.list_objects_v2(Bucket="rollouts").get("Contents"):
            client.delete_objects(Bucket="rollouts", Delete={"Objects": [{"Key": each["Key"]} for each in listed]})
    else:
        client.create_bucket(Bucket="rollouts")


def test_without_credentials_the_error_says_what_to_set(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("AWS_ACCESS_KEY_ID")
    monkeypatch.setattr(objects_module, "_METADATA", "127.0.0.1")  # where nothing serves credentials
    with pytest.raises(RunError, match="no credentials were found: set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY"):
        ObjectStore(RUN)


def objects(url: str = RUN) -> dict[str, bytes]:
    """What is in the store, by key."""
    import obstore

    store = ObjectStore(url)._objects
    return {
        each["path"]: bytes(obstore.get(store, each["path"]).bytes()) for some in obstore.list(store) for each in some
    }


def test_two_workers_on_one_block_make_the_run_of_one_process_byte_for_byte(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with RunWriter.join(RUN, OF) as first, RunWriter.join(RUN, OF) as second:
        monkeypatch.setattr(second, "pending", lambda blocks: blocks)  # it looked before the other one committed
        for writer, block in ((first, 0), (second, 0), (second, 3), (first, 3), (first, 1), (second, 2)):
            writer.write(block, block_of(OF, block), SECONDS)
    assert objects() == contents(make(tmp_path / "one.zarr", OF))
    assert damaged_blocks(RUN) == []


def test_xarray_opens_it_directly() -> None:
    import xarray as xr
    from obstore.store import S3Store
    from zarr.storage import ObjectStore as ZarrStore

    with RunWriter.create(RUN, OF) as writer:
        finish(writer)
    bucket = S3Store("rollouts", prefix="tests/run.zarr", client_options={"allow_http": True})
    run = xr.open_zarr(ZarrStore(bucket, read_only=True))
    assert run.equals(open_dataset(RUN))
    assert run.status.to_numpy().tolist() == open_dataset(RUN).status.to_numpy().tolist()


def test_it_is_described_verified_and_damage_is_mended() -> None:
    with RunWriter.join(RUN, OF) as writer:
        writer.write(1, block_of(OF, 1), SECONDS)
        writer.write(2, block_of(OF, 2), SECONDS)
    assert describe(RUN).blocks_missing == (0, 3)
    store, sound = ObjectStore(RUN), objects()
    chunk = sound["qpos/c.1.0.0"]
    store.put({"qpos/c.1.0.0": (chunk[:-9] + bytes(9),)})
    store.put({"blocks/record/c.2": (encode_text("{}"),)})
    assert damaged_blocks(RUN) == [1, 2]
    shown = dh2sim("runs", RUN, "--verify")
    assert (shown.status, shown.err) == (
        1,
        f"dh2sim: '{RUN}': blocks 1 to 2 are damaged; resume it to compute them again\n",
    )
    with RunWriter.resume(RUN, OF) as writer:
        assert finish(writer) == (0, 1, 2, 3)
    assert {name: objects()[name] for name in sound} == sound
    assert describe(RUN).complete


def test_a_run_that_was_half_made_is_completed_by_who_joins_it() -> None:
    store, files = ObjectStore(RUN), make_metadata(OF)
    assert store.put_new("zarr.json", files["zarr.json"])
    with pytest.raises(RunError, match="is missing or damaged"):
        open_dataset(RUN)
    later = layout(rollouts=8, block=2, created="2027-01-01T00:00:00+00:00", command="dh2sim rollout --share 2/2")
    RunWriter.join(RUN, later).close()
    assert objects() == files


def test_only_a_run_is_replaced_and_only_if_asked_to() -> None:
    with RunWriter.create(RUN, OF) as writer:
        finish(writer)
    before = objects()
    with pytest.raises(RunExistsError, match="already exists; resume it, overwrite it"):
        RunWriter.create(RUN, OF)
    with pytest.raises(RunDiffersError, match="seed was 0 and is now 1"):
        RunWriter.join(RUN, layout(rollouts=8, block=2, settings={"seed": 1}))
    with RunWriter.join(RUN, OF) as old:
        old._committed.clear()
        assert objects() == before
        RunWriter.create(RUN, layout(rollouts=8, block=4), overwrite=True).close()
        with pytest.raises(RunDiffersError, match="was replaced or removed while it was written to"):
            old.write(0, block_of(OF, 0), SECONDS)
    assert objects() == make_metadata(layout(rollouts=8, block=4))
    ObjectStore("s3://rollouts/tests/other").put({"thesis.txt": (b"years of work",)})
    with pytest.raises(RunExistsError, match="is not a run of dh2sim"):
        RunWriter.create("s3://rollouts/tests/other", OF, overwrite=True)


def test_the_command_writes_it_and_reads_it() -> None:
    made = dh2sim("rollout", "planar_2r", "--rollouts", "6", "--steps", "4", "--block-size", "2", "--out", RUN)
    assert (made.status, made.err) == (0, "")
    assert dh2sim("runs", RUN).out.startswith(f"{RUN}  complete\n")
    assert dh2sim("runs", RUN, "--verify").status == 0


@pytest.mark.parametrize(
    ("place", "reported"),
    [
        ("s3://rollouts/none.zarr", "there is no 's3://rollouts/none.zarr'"),
        ("s3://no-such-bucket/run.zarr", "cannot read 's3://no-such-bucket/run.zarr': there is no such bucket"),
        ("s3://rollouts", "'s3://rollouts' names no run: write s3://BUCKET/NAME, as in s3://rollouts/run.zarr"),
        ("ftp://host/run.zarr", "'ftp://host/run.zarr' cannot be opened: runs are in folders, or in object stores"),
    ],
)
def test_where_there_is_no_run_the_place_is_named(place: str, reported: str) -> None:
    shown = dh2sim("runs", place)
    assert (shown.status, shown.out) == (2, "")
    assert shown.err.startswith(f"dh2sim: {reported}")


@pytest.mark.parametrize("kind", [PurePosixPath, PureWindowsPath])
def test_a_path_that_has_lost_a_slash_is_the_same_place(kind: type[PurePath]) -> None:
    assert open_store(kind(RUN)).name == RUN


def test_commands_read_a_run_where_it_is(tmp_path: Path) -> None:
    made = "rollout planar_2r --rollouts 2 --steps 4 --record qpos,qvel,ctrl,tool_pose --out"
    assert dh2sim(*made.split(), RUN).status == 0
    drawn = dh2sim("plot", RUN, "--what", "joints", "--out", tmp_path / "joints.png")
    assert (drawn.status, drawn.err) == (0, "")
    assert (tmp_path / "joints.png").stat().st_size > 1000
    page = dh2sim("view", "planar_2r", RUN, "--export", tmp_path / "page.html")
    assert (page.status, page.err) == (0, "")
    refused = dh2sim("rollout", "planar_2r", "--controller", f"replay:file={RUN}", "--out", tmp_path / "new.zarr")
    assert (refused.status, refused.err) == (
        2,
        f"dh2sim: controller 'replay': '{RUN}' cannot be replayed from an object store: copy the run into a folder "
        "first\n",
    )


@pytest.mark.parametrize("command", ["runs {}", "plot {}", "rollout planar_2r --rollouts 2 --steps 4 --out {}"])
def test_a_server_that_does_not_answer_is_reported_within_seconds(
    command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    shown = dh2sim(*command.format(RUN).split())
    told = "the server does not answer; see AWS_ENDPOINT_URL, AWS_REGION and the network"
    assert (shown.status, shown.err) == (2, f"dh2sim: cannot read '{RUN}': {told}\n")


class Proxy:
    """Passes requests on to a server, until it answers none any more."""

    def __init__(self, server: str) -> None:
        self.answered = 0
        self.most = 10**9
        """Requests that are answered."""
        self.hangs = True
        """Whether it says nothing then; else it closes connections."""
        self._server = server.removeprefix("http://").rpartition(":")
        self._listening = socket.create_server(("127.0.0.1", 0), backlog=128)
        self._open: list[socket.socket] = [self._listening]
        self.url = f"http://127.0.0.1:{self._listening.getsockname()[1]}"
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                client = self._listening.accept()[0]
                server = socket.create_connection((self._server[0], int(self._server[2])))
                self._open += [client, server]
                threading.Thread(target=self._pass, args=(client, server), daemon=True).start()
                threading.Thread(target=self._pass, args=(server, client), daemon=True).start()

    def _pass(self, source: socket.socket, target: socket.socket) -> None:
        with suppress(OSError):
            while data := source.recv(2**16):
                begun = len(re.findall(rb"(?m)^[A-Z]+ /\S* HTTP/1.1\r$", data))
                if begun and self.answered + begun > self.most:
                    if self.hangs:
                        continue
                    break
                self.answered += begun
                target.sendall(data)
        for end in (source, target):
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Close all connections."""
        for each in self._open:
            with suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
            each.close()


@pytest.fixture
def proxy(server: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[Proxy]:
    """A server that may fail."""
    proxy = Proxy(server)
    monkeypatch.setenv("AWS_ENDPOINT_URL", proxy.url)
    yield proxy
    proxy.close()


PATIENCE = 2.0
"""s; the server is in this process, too, which may not get a processor for a second."""


@contextmanager
def soon() -> Iterator[None]:
    """Little patience with a server, and an end within the time of a few requests that are not answered."""
    start = time.monotonic()
    with pytest.MonkeyPatch.context() as patch:
        for name in ("_TIMEOUT", "_PATIENCE"):
            patch.setattr(objects_module, name, timedelta(seconds=PATIENCE))
        patch.setattr(objects_module, "_PAUSE", timedelta(seconds=0.2))
        yield
    assert time.monotonic() - start < 10 * PATIENCE


MADE = "rollout planar_2r --rollouts 12 --steps 4 --block-size 2 -q --out"
NO_ANSWER = "the server does not answer; see AWS_ENDPOINT_URL, AWS_REGION and the network"


@pytest.mark.parametrize(("hangs", "most"), [(True, 20), (True, 110), (False, 110)])  # 40 make a run, some 15 a block
def test_a_server_that_stops_ends_the_command_and_the_run_is_resumed(
    proxy: Proxy, tmp_path: Path, *, hangs: bool, most: int
) -> None:
    proxy.hangs, proxy.most = hangs, most
    with soon():
        stopped = dh2sim(*MADE.split(), RUN)
    assert (stopped.status, stopped.out, stopped.err.count("\n")) == (2, "", 1)
    told = re.fullmatch(rf"dh2sim: cannot (?:read|write to) '{RUN}': {NO_ANSWER}(.*)\n", stopped.err)
    assert told is not None, stopped.err
    proxy.most = 10**9
    if most > 100:
        safe = re.fullmatch(r"; at least (\d+) of 12 rollouts are safe\. Resume when it answers", told[1])
        assert safe is not None
        assert 12 > 12 - describe(RUN).not_run >= int(safe[1]) > 0
    assert dh2sim(*MADE.split(), RUN, "--resume").status == 0
    assert dh2sim(*MADE.split(), tmp_path / "run.zarr").status == 0
    assert open_dataset(RUN).drop_attrs().equals(open_dataset(tmp_path / "run.zarr").drop_attrs())


class Hasty(Executor):
    """Does each task when it is submitted, as a worker that has been given all of them; the server stops before."""

    def __init__(self, proxy: Proxy) -> None:
        self._proxy = proxy

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **keywords: Any) -> Future[Any]:
        """Call a function."""
        self._proxy.most = 0
        future: Future[Any] = Future()
        try:
            future.set_result(function(*arguments, **keywords))
        except RunOutputError as error:
            future.set_exception(error)
        return future


def test_a_worker_waits_once_for_a_server_that_stops(proxy: Proxy) -> None:
    told = f"cannot read '{RUN}': {NO_ANSWER}; what was committed is safe. Resume when it answers"
    with soon(), pytest.raises(RunOutputError, match=re.escape(told)):  # for forty blocks
        rollout("planar_2r", rollouts=80, steps=4, block_size=2, out=RUN, executor=Hasty(proxy))


@pytest.mark.parametrize(
    ("command", "most"), [("runs", 20), ("plot", 43), ("runs --verify", 43), (f"{MADE[:-6]} --resume --out", 35)]
)
def test_a_server_that_stops_while_a_run_is_read_ends_the_command(proxy: Proxy, command: str, most: int) -> None:
    assert dh2sim(*MADE.split(), RUN).status == 0
    proxy.most = proxy.answered + most
    with soon():
        stopped = dh2sim(*command.split(), RUN)
    assert stopped.status == 2, "it needs fewer requests"
    assert stopped.err.startswith(f"dh2sim: cannot read '{RUN}': {NO_ANSWER}")
    assert stopped.err.count("\n") == 1
