"""Files that never end, as those that grow while they are read: every command refuses them in a sentence."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.program import dh2sim

pytestmark = pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="there is no endless file here")


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("info z.yaml", "the file has 1000001 bytes; at most 1000000 are allowed"),
        ("trajectory planar_2r z.yaml", "the file has 1000001 bytes; at most 1000000 are allowed"),
        ("import z.urdf", "more than 50000000 bytes, the most that is read"),
        ("import z.xacro", "more than 50000000 bytes, the most that is read"),
        ("import z.md", "more than 50000000 bytes, the most that is read"),
        ("frames z.yaml", "more than 50000000 bytes, the most that is read"),
        ("diff z.json planar_2r", "more than 50000000 bytes, the most that is read"),
        ("calibrate planar_2r z.csv", "the file has more than 100000000 bytes"),
        ("rollout planar_2r -o r.zarr --start z.npy", "is not a NumPy array: it does not begin as one"),
        ("rollout planar_2r -o r.zarr --designs z.csv", "must be a file of at most 128 MB"),
        ("sweep planar_2r -o z.csv --vary a1=0.4 --count 1 --measure reach", "is a link, not a file"),
        ("runs z.zarr", "is not a run of dh2sim"),
        ("check . --baseline z.json", "is larger than 10 MB, the most that is read of a baseline"),
    ],
)
def test_a_file_without_an_end_is_refused(
    words: str, reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for word in words.replace("-o z.csv", "z.csv.journal").split():
        if word.startswith("z.") and not word.endswith(".zarr"):
            Path(word).symlink_to("/dev/zero")
    Path("z.zarr").mkdir()
    Path("z.zarr/zarr.json").symlink_to("/dev/zero")
    before = sorted(os.listdir())
    run = dh2sim(*words.split())
    assert (run.status, run.out, run.err.count("\n")) == (2, "", 1)
    assert reason in run.err
    assert sorted(os.listdir()) == before


def test_exports_without_an_end_do_not_match(tmp_path: Path) -> None:
    folder = tmp_path / "planar_2r"
    folder.mkdir()
    for name in ("planar_2r.urdf", "planar_2r.xml", "scene.xml"):
        (folder / name).symlink_to("/dev/zero")
    run = dh2sim("export", "planar_2r", "--out", tmp_path, "--check")
    assert run.status == 1
    assert run.out.count("differs from line 1") + run.err.count("differs from line 1") == 3
