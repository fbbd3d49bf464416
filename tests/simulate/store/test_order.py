"""What is on the disk at each moment, should the power fail."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from dh2sim.files import partial_path
from dh2sim.simulate.store.writer import RunWriter
from tests.simulate.store.runs import SECONDS, block_of, layout

pytestmark = pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="needs /proc")


@pytest.fixture
def events(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, Path]]:
    """Files and folders brought to the disk, and files that got their names, in their order."""
    noted: list[tuple[str, Path]] = []
    fsync, replace, link = os.fsync, os.replace, os.link

    def noted_fsync(handle: int) -> None:
        fsync(handle)
        noted.append(("sync", _without_owner(Path(os.readlink(f"/proc/self/fd/{handle}")))))

    def noted_replace(old: Path, new: Path) -> None:
        replace(old, new)
        noted.append(("rename", new))

    def noted_link(old: Path, new: Path) -> None:
        link(old, new)
        noted.append(("link", new))

    monkeypatch.setattr(os, "fsync", noted_fsync)
    monkeypatch.setattr(os, "replace", noted_replace)
    monkeypatch.setattr(os, "link", noted_link)
    return noted


def _without_owner(path: Path) -> Path:
    """Return the path of a partial file without host, process and random number."""
    return path.with_name(re.sub(r"^(\..+?)-[A-Za-z0-9-]+-\d+-[0-9a-f]{8}\.partial$", r"\1.partial", path.name))


def test_a_record_is_begun_only_when_every_chunk_is_on_the_disk(
    tmp_path: Path, events: list[tuple[str, Path]]
) -> None:
    of, path = layout(), (tmp_path / "run.zarr").resolve()
    with RunWriter.create(path, of) as writer:
        events.clear()
        writer.write(1, block_of(of, 1), SECONDS)
    record = path / "blocks" / "record" / "c.1"
    assert events[-3:] == [("sync", partial_path(record)), ("link", record), ("sync", record.parent)]
    written, done = {}, {}
    for variable in of.variables:
        chunk = path / variable.name / ".".join(["c", "1", *["0"] * (len(variable.dimensions) - 1)])
        steps = [("sync", partial_path(chunk)), ("rename", chunk), ("sync", chunk.parent)]
        assert [event for event in events if event in steps] == steps
        written[variable.name], done[variable.name] = (events.index(step) for step in (steps[0], steps[-1]))
    first = min(i for i, (what, _) in enumerate(events) if what == "rename")
    assert max(written.values()) < first  # what cannot be written whole leaves nothing
    status = events.index(("rename", path / "status" / "c.1"))
    assert status > max(end for name, end in done.items() if name != "status")


def test_a_new_run_is_on_the_disk_before_it_is_renamed_into_place(
    tmp_path: Path, events: list[tuple[str, Path]], monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[set[Path]] = []
    rename = os.rename

    def noted_rename(old: Path, new: Path) -> None:
        synced.append({item.relative_to(old) for _, item in events if item.is_relative_to(old)})
        rename(old, new)

    monkeypatch.setattr(os, "rename", noted_rename)
    path = (tmp_path / "run.zarr").resolve()
    RunWriter.create(path, layout()).close()
    assert synced == [{item.relative_to(path) for item in (path, *path.rglob("*"))}]
    assert events[-1] == ("sync", path.parent)
