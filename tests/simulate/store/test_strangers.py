"""Runs that a stranger wrote: opening one executes nothing, reads no other file, and takes little memory and time."""

from __future__ import annotations

import copy
import gzip
import hashlib
import io
import json
import os
import pickle
import random
import signal
import tracemalloc
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from numcodecs.blosc import Blosc  # type: ignore[import-untyped]
from numcodecs.zstd import Zstd  # type: ignore[import-untyped]

from dh2sim.errors import ControllerError, PictureError, RunError
from dh2sim.simulate.controllers.recording import read_recording
from dh2sim.simulate.description import describe
from dh2sim.simulate.store.codec import chunk_problem, decode_text, encode_text
from dh2sim.simulate.store.reader import open_dataset
from tests.program import dh2sim
from tests.simulate.store.runs import layout, make

SMALL = layout(rollouts=5, block=2)
Change = Callable[[dict[str, Any]], object]


@pytest.fixture(autouse=True)
def _soon() -> Iterator[None]:
    """Interrupt a test that waits for ever."""
    if not hasattr(signal, "SIGALRM"):
        pytest.skip("there is no SIGALRM on this system")
    signal.alarm(60)
    yield
    signal.alarm(0)


def forge(path: Path, change: Change) -> None:
    """Change the metadata of a run as somebody would who knows how its digest is made."""
    root = json.loads((path / "zarr.json").read_text())
    blocks = json.loads((path / "blocks/zarr.json").read_text())
    change(root)
    names = blocks["attributes"]
    nodes = root.get("consolidated_metadata", {}).get("metadata", {})
    arrays = (*names["coordinates"], *names["variables"], "blocks/record", "blocks")
    own = {name: nodes[name] for name in arrays if name in nodes}
    own["blocks"] = {**own.get("blocks", {}), "attributes": {}}
    attributes = {name: root["attributes"][name] for name in names["attributes"] if name in root["attributes"]}
    names["attributes"] = list(attributes)
    whole = {**root, "attributes": attributes}
    whole["consolidated_metadata"] = {**root.get("consolidated_metadata", {}), "metadata": own}
    names["digest"] = hashlib.sha256(json.dumps(whole, sort_keys=True).encode()).hexdigest()
    (path / "zarr.json").write_text(json.dumps(root))
    (path / "blocks/zarr.json").write_text(json.dumps(blocks))


def node(root: dict[str, Any], name: str) -> dict[str, Any]:
    found: dict[str, Any] = root["consolidated_metadata"]["metadata"][name]
    return found


def resized(size: int) -> Change:
    """Give a run another number of rollouts."""

    def change(root: dict[str, Any]) -> None:
        for each in root["consolidated_metadata"]["metadata"].values():
            if each.get("dimension_names", [""])[0] == "rollout":
                each["shape"][0] = size
        node(root, "rollout")["chunk_grid"]["configuration"]["chunk_shape"] = [size]

    return change


def with_codec(codec: dict[str, Any]) -> Change:
    return lambda root: node(root, "status")["codecs"].insert(1, codec)


def setting(path: str, value: object) -> Change:
    def change(root: dict[str, Any]) -> None:
        *folders, name = path.split(".")
        place = root["attributes"]
        for folder in folders:
            place = place[folder]
        place[name] = value

    return change


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "reported"),
    [
        (resized(10**12), "array 'rollout': its chunks are too large"),
        (resized(10**8), "its rollouts do not make up a possible number of blocks"),
        (resized(-1), "array 'rollout': no shape"),
        (with_codec({"name": "numcodecs.pickle"}), "array 'status': other types or codecs"),
        (
            with_codec({"name": "zstd", "configuration": {"level": 0, "checksum": False}}),
            "array 'status': other types",
        ),
        (lambda root: node(root, "qpos").update(data_type="object"), "array 'qpos': its type is 'object'"),
        (lambda root: node(root, "qpos")["shape"].__setitem__(1, 10**9), "'qpos' has other sizes than"),
        (lambda root: node(root, "qpos").update(storage_transformers=[{"name": "x"}]), "are stored in another"),
        (
            lambda root: node(root, "status")["chunk_key_encoding"]["configuration"].update(separator="/"),
            "array 'status': its files are named in another way",
        ),
        (
            lambda root: root["consolidated_metadata"]["metadata"].update(more=node(root, "status")),
            "it has arrays that do not belong to it ('more')",
        ),
        (setting("settings", 3), "its attribute 'settings' is 3"),
        (setting("settings.steps", "many"), "its attribute 'settings.steps' is 'many'"),
        (setting("settings.steps", -4), "its time steps are impossible"),
        (setting("settings.steps", 10**400), "its time steps are impossible"),
        (setting("timestep", None), "its attribute 'timestep' is nothing"),
        (setting("timestep", float("nan")), "its time steps are impossible"),
        (setting("versions", {"mujoco": [1]}), "its attribute 'versions' does not hold text"),
        (setting("randomize", {"mass": [1]}), "its attribute 'randomize' does not hold numbers and texts"),
        (setting("robot", ["stanford"]), "its attribute 'robot' is a list"),
    ],
)
def test_metadata_that_dh2sim_never_writes_are_refused(tmp_path: Path, change: Change, reported: str) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    forge(path, change)
    for read in (describe, open_dataset):
        with pytest.raises(RunError) as caught:
            read(path)
        assert str(caught.value).startswith(f"'{path}' is not a run as dh2sim writes it: ")
        assert reported in str(caught.value)
    shown = dh2sim("runs", path)
    assert (shown.status, shown.out) == (2, "")
    assert reported in shown.err


def test_sizes_are_believed_only_with_the_files_that_they_ask_for(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    forge(path, resized(100_000))
    tracemalloc.start()
    with pytest.raises(RunError, match=r"rollout/c\.0' is missing or damaged"):
        describe(path)
    assert tracemalloc.get_traced_memory()[1] < 5e6
    tracemalloc.stop()


class Canary:
    """Makes a file when it is unpickled."""

    def __init__(self, path: str) -> None:
        self.path = path

    def __reduce__(self) -> tuple[Any, ...]:
        return os.mkdir, (self.path,)


def test_metadata_of_very_many_values_are_refused_before_they_take_memory(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    (path / "zarr.json").write_text('{"attributes": [' + ",".join(["[]"] * 2_000_000) + "]}")
    with pytest.raises(RunError, match=r"zarr\.json' has more than 2000000 values$"):
        describe(path)


def test_a_chunk_that_is_larger_than_it_can_be_is_not_read(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    chunk = next((path / "qpos").glob("c.*"))
    with chunk.open("r+b") as stream:
        stream.truncate(50 * 10**9)  # with holes, which take no room
    for read in (describe, lambda path: open_dataset(path).load()):
        with pytest.raises(RunError, match=r"run\.zarr' is damaged"):
            read(path)
    with pytest.raises(ControllerError, match=r"qpos/c.*cannot be read: it is larger than a chunk"):
        read_recording(str(path), "reference")


@pytest.mark.parametrize(
    ("codec", "encode"),
    [
        ("gzip", gzip.compress),
        ("gzip", lambda data: gzip.compress(data[: len(data) // 2]) * 2),
        ("zstd", Zstd().encode),
        ("blosc", Blosc().encode),
    ],
    ids=["gzip", "gzip twice", "zstd", "blosc"],
)
def test_a_chunk_that_would_become_larger_than_it_can_be_is_not_decompressed(
    codec: str, encode: Callable[[bytes], bytes]
) -> None:
    def problem(data: bytes, most: int, *more: str) -> str | None:
        return chunk_problem(data[:32], io.BytesIO(data), ["bytes", codec, *more, "crc32c"], most)

    for size in (1_000_000, 1000, 300, 256, 200):
        data = encode(bytes(size))
        assert problem(data, size - 1) == "it becomes larger than a chunk"
        if data.count(b"\x1f\x8b\x08") < 2:  # zarr writes one stream
            assert problem(data, size) is None
    assert problem(encode(bytes(1000)), 1000, "zstd", "gzip") == "it is compressed more than once"
    assert problem(b"", 1000) in (None, "it becomes larger than a chunk")


def test_a_pickle_in_metadata_of_the_old_format_is_never_executed(tmp_path: Path) -> None:
    path, canary = make(tmp_path / "run.zarr", SMALL), tmp_path / "executed"
    old = {
        "zarr_format": 2,
        "shape": [5],
        "chunks": [5],
        "dtype": "|O",
        "compressor": None,
        "filters": [{"id": "pickle", "protocol": 5}],
        "fill_value": None,
        "order": "C",
    }
    for name in ("status", "joint", "qpos"):
        (path / name / ".zarray").write_text(json.dumps(old))
        (path / name / "0").write_bytes(pickle.dumps([Canary(str(canary))]))
    (path / ".zgroup").write_text('{"zarr_format": 2}')
    assert describe(path).rollouts == 5
    assert open_dataset(path).load().sizes["rollout"] == 5
    for name in ("zarr.json", *(f"{name}/zarr.json" for name in ("status", "joint", "qpos"))):
        (path / name).unlink()  # only the old format is left
    with pytest.raises(RunError):
        describe(path)
    run = dh2sim(
        "rollout", "planar_2r", "--rollouts", "1", "--controller", f"replay:file={path}", "--out", tmp_path / "x"
    )
    assert run.status == 2
    assert not canary.exists()


@pytest.mark.slow
@pytest.mark.parametrize("file", ["zarr.json", "blocks/zarr.json", "rollout/c.0", "status/c.0", "blocks/record/c.0"])
@pytest.mark.parametrize("kind", ["pipe", "link", "folder"])
def test_what_is_not_a_plain_file_is_not_opened(tmp_path: Path, file: str, kind: str) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    place, secret = path / file, tmp_path / "secret"
    secret.write_bytes(place.read_bytes())
    place.unlink()
    if kind == "pipe":
        os.mkfifo(place)
    elif kind == "link":
        place.symlink_to(secret)
    else:
        place.mkdir()
    if file.endswith("record/c.0"):
        assert describe(path).blocks_done == 2  # as if it were not committed
    else:
        for read in (describe, open_dataset):
            with pytest.raises(RunError):
                read(path)


def test_folders_that_are_links_are_not_followed(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    (path / "qpos").rename(tmp_path / "elsewhere")
    (path / "qpos").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(RunError, match=r"qpos/zarr\.json' is missing or damaged"):
        open_dataset(path)


def test_records_of_any_form_commit_nothing_and_raise_nothing(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    record = json.loads(decode_text((path / "blocks/record/c.0").read_bytes()) or "")
    wrong: list[object] = [
        {**record, "checksums": {"nothing": 3}},
        {**record, "checksums": [1, 2]},
        {**record, "checksums": dict.fromkeys(record["checksums"], "x")},
        {**record, "seconds": None},
        {**record, "seconds": -1.0},
        {**record, "block": "0"},
        {**record, "more": 1},
        [],
        "text",
    ]
    for each in wrong:
        (path / "blocks/record/c.0").write_bytes(encode_text(json.dumps(each)))
        assert describe(path).blocks_done == 2
    (path / "blocks/record/c.0").write_bytes(b"\0" * 2_000_000)
    assert describe(path).blocks_done == 2


def test_control_characters_in_attributes_do_not_reach_the_terminal(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    forge(path, setting("robot", "\x1b]0;owned\x07\x9b2J arm \u202e"))
    run = dh2sim("runs", path)
    assert run.status == 0
    assert not any(c in run.out for c in "\x1b\x07\x9b\u202e")
    assert r"\x1b]0;owned\x07\x9b2J arm \u202e" in run.out


MJCF = '<mujoco model="small"><worldbody><body><joint/><geom size="1"/></body></worldbody></mujoco>'


@pytest.mark.parametrize(
    ("mjcf", "reported"),
    [
        ('<mujoco><include file="/etc/passwd"/></mujoco>', "an attribute 'file' of include"),
        ('<mujoco><asset><texture file="/secret.png"/></asset></mujoco>', "an attribute 'file' of texture"),
        ('<mujoco><asset><hfield nrow="46341" ncol="46341" size="1 1 1 1"/></asset></mujoco>', "an element 'hfield'"),
        ('<mujoco><extension><plugin plugin="x"/></extension></mujoco>', "an element 'extension'"),
        ('<mujoco><worldbody><replicate count="1000000"/></worldbody></mujoco>', "an element 'replicate'"),
        ('<mujoco><asset><texture builtin="flat" width="100000" height="8"/></asset></mujoco>', "texture 'width'"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><mujoco/>', "declares entities"),
        ("<mujoco", "is not XML"),
    ],
)
def test_models_of_strangers_do_not_reach_mujoco(mjcf: str, reported: str) -> None:
    from dh2sim.simulate.recorded_model import recorded_model

    scene = '<mujoco><include file="small.xml"/></mujoco>'
    assert recorded_model({"robot": "small", "mjcf": MJCF, "scene": scene}, scene=True).nbody == 2
    for name in ("mjcf", "scene"):
        with pytest.raises(RunError) as caught:
            recorded_model({"robot": "small", "mjcf": MJCF, "scene": scene, name: mjcf}, scene=name == "scene")
        assert reported in str(caught.value)


def test_a_model_of_a_stranger_is_not_drawn(tmp_path: Path) -> None:
    from dh2sim.draw.motion import motion_of_run
    from dh2sim.draw.rollout_data import open_rollout

    path = make(tmp_path / "run.zarr", SMALL)
    forge(path, setting("mjcf", '<mujoco><include file="/etc/passwd"/></mujoco>'))
    with pytest.raises(PictureError, match="is not one that dh2sim wrote"):
        motion_of_run(open_rollout(path, 0))


def damaged(value: Any, chance: random.Random) -> Any:
    """Return JSON in which one value, key or item differs."""
    odd: tuple[Any, ...] = (
        None,
        True,
        -1,
        0,
        1,
        2**63,
        10**30,
        1e308,
        float("nan"),
        "",
        "x" * 1000,
        "\x1b[31m",
        [],
        {},
        [[]],
        {"a": 1},
    )
    if not isinstance(value, dict | list) or not value or chance.random() < 0.15:
        return chance.choice(odd)
    changed = copy.copy(value)
    key = chance.choice(list(changed) if isinstance(changed, dict) else range(len(changed)))
    if chance.random() < 0.1:
        del changed[key]
    else:
        changed[key] = damaged(changed[key], chance)
    return changed


@pytest.mark.parametrize("count", [50, pytest.param(600, marks=pytest.mark.slow)])
def test_of_forged_runs_every_one_is_read_or_refused_in_words(tmp_path: Path, count: int) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    kept = {name: (path / name).read_text() for name in ("zarr.json", "blocks/zarr.json")}
    chance = random.Random(7)
    outcomes = {"read": 0, "refused": 0}

    def change(root: dict[str, Any]) -> None:
        part = chance.choice(("attributes", "metadata", "metadata", "all"))
        if part == "metadata":
            nodes = root["consolidated_metadata"]["metadata"]
            name = chance.choice(list(nodes))
            nodes[name] = damaged(nodes[name], chance)
        elif part == "attributes":
            root["attributes"] = damaged(root["attributes"], chance)
        else:
            new = damaged(root, chance)
            root.clear()
            root.update(new if isinstance(new, dict) else {})

    for _ in range(count):
        for name, text in kept.items():
            (path / name).write_text(text)
        try:
            forge(path, change)
        except (AttributeError, KeyError, TypeError):
            continue  # nothing that has a digest
        try:
            describe(path).to_json()
            open_dataset(path).load()
            outcomes["read"] += 1
        except RunError:
            outcomes["refused"] += 1
    assert outcomes["read"] >= count // 30
    assert outcomes["refused"] >= count // 3
