import os
from pathlib import Path

import pytest

from dh2sim.errors import Dh2simError
from dh2sim.input_files import read_input
from dh2sim.robot.read import load_robot
from dh2sim.simulate.run import rollout


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
def test_a_pipe_with_a_name_is_refused_instead_of_waited_for(tmp_path: Path) -> None:
    pipe = tmp_path / "robot.yaml"
    os.mkfifo(pipe)
    with pytest.raises(OSError, match="is a named pipe, not a file"):
        read_input(pipe, 10)
    with pytest.raises(Dh2simError) as caught:
        load_robot(pipe)
    assert str(caught.value) == f"{pipe}: cannot be read: is a named pipe, not a file"


@pytest.mark.skipif(not os.path.exists("/dev/fd"), reason="the shell has no paths of pipes here")
def test_a_pipe_of_the_shell_is_read_to_its_end() -> None:
    read, write = os.pipe()
    os.write(write, b"content")
    os.close(write)
    try:
        assert read_input(Path(f"/dev/fd/{read}"), 100) == b"content"
    finally:
        os.close(read)


def test_a_file_that_is_larger_is_read_one_byte_further(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(bytes(100))
    assert len(read_input(tmp_path / "file", 10)) == 11


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
@pytest.mark.parametrize("option", ["start", "controller"])
def test_a_rollout_does_not_wait_for_a_pipe_with_a_name(tmp_path: Path, option: str) -> None:
    pipe = tmp_path / "states.csv"
    os.mkfifo(pipe)
    value = str(pipe) if option == "start" else f"replay:{pipe}"
    with pytest.raises(Dh2simError, match="is a named pipe, not a file"):
        rollout("planar_2r", rollouts=1, steps=1, **{option: value})  # type: ignore[arg-type]
