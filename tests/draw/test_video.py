"""Videos and pictures as files, read back by other programs."""

from __future__ import annotations

import subprocess
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, ImageSequence

from dh2sim.draw.renderer import PictureOptions, open_motion
from dh2sim.draw.video import (
    VideoSpeed,
    require_picture,
    video_positions,
    write_gif,
    write_image,
    write_mp4,
    write_video,
)
from dh2sim.errors import PictureError
from tests.draw.drawing import moving, require_gl

OPTIONS = PictureOptions(width=160, height=120)


def decoded(path: Path) -> tuple[str, NDArray[np.uint8]]:
    """What ffmpeg reports of a video of 160x120, and its pictures."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(command, capture_output=True, check=True, timeout=180)
    [about] = [line for line in done.stderr.decode().split("Output")[0].splitlines() if "Video:" in line]
    return about, np.frombuffer(done.stdout, dtype=np.uint8).reshape(-1, 120, 160, 3)


@pytest.mark.slow
def test_an_mp4_is_h264_of_the_right_size_speed_and_length_and_shows_what_was_drawn(tmp_path: Path) -> None:
    require_gl()
    out = tmp_path / "video.mp4"
    reported: list[int] = []
    motion, speed = moving(), VideoSpeed(fps=30.0, speed=0.25)
    count = write_video(out, motion, OPTIONS, speed, reported.append)
    about, pictures = decoded(out)
    assert count == len(pictures) == 15, "0.12 s at a quarter of the speed"
    assert reported == [1] * 15
    for part in ("h264", "yuv420p(tv, bt709", "160x120", "30 fps"):
        assert part in about
    with open_motion(motion, OPTIONS) as renderer:
        for number in (0, 14):
            drawn = renderer.picture(video_positions(motion, speed)[number]).astype(float)
            assert np.abs(pictures[number] - drawn).mean() < 4.0
    assert [path.name for path in tmp_path.iterdir()] == ["video.mp4"]


@pytest.mark.slow
def test_a_gif_has_the_right_size_times_and_colours(tmp_path: Path) -> None:
    require_gl()
    out = tmp_path / "video.gif"
    motion, speed = moving(), VideoSpeed(fps=30.0, speed=0.25)
    assert write_video(out, motion, OPTIONS, speed) == 15
    with Image.open(out) as video, open_motion(motion, OPTIONS) as renderer:
        assert (video.size, video.info["loop"]) == ((160, 120), 0)
        shown = 0
        for _ in ImageSequence.Iterator(video):
            drawn = renderer.picture(video_positions(motion, speed)[round(shown * 30 / 1000)]).astype(float)
            assert np.abs(np.asarray(video.convert("RGB")) - drawn).mean() < 6.0
            shown += video.info["duration"]
        assert shown == 500, "thirtieths of a second do not add up to something else"


def test_pictures_of_a_gif_that_are_alike_take_next_to_no_room(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    picture = rng.integers(0, 255, (100, 120, 3), dtype=np.uint8)
    sizes = []
    for count in (1, 10):
        pictures = [picture.copy() for _ in range(count)]
        for k, copy in enumerate(pictures):
            copy[10:14, 5 * k : 5 * k + 4] = 0
        write_gif(tmp_path / "a.gif", pictures, pictures[:1], width=120, height=100, fps=10.0, count=count)
        sizes.append((tmp_path / "a.gif").stat().st_size)
    assert sizes[1] < 1.6 * sizes[0]


def test_rare_colours_are_kept_in_a_gif(tmp_path: Path) -> None:
    grey = np.linspace(0, 255, 200 * 300).reshape(200, 300)
    picture = np.stack([grey, grey, grey], axis=2).astype(np.uint8)
    picture[50, 60:80] = (224, 36, 30)
    write_gif(tmp_path / "a.gif", [picture], [picture], width=300, height=200, fps=10.0, count=1)
    with Image.open(tmp_path / "a.gif") as read:
        assert np.abs(np.asarray(read.convert("RGB"))[50, 70].astype(int) - (224, 36, 30)).max() < 12


def test_a_still_is_the_picture_that_was_drawn(tmp_path: Path) -> None:
    require_gl()
    motion = moving()
    write_image(tmp_path / "a.png", motion, OPTIONS, 5)
    with Image.open(tmp_path / "a.png") as read, open_motion(motion, OPTIONS) as renderer:
        assert np.array_equal(np.asarray(read), renderer.picture(5))


def test_pictures_follow_real_time() -> None:
    motion = moving()
    # a record every 4 ms: 250 a second
    assert video_positions(motion, VideoSpeed(fps=125.0, speed=0.5)) == list(range(31))
    assert video_positions(motion, VideoSpeed(fps=125.0, speed=1.5)) == list(range(0, 31, 3))
    assert video_positions(motion, VideoSpeed(fps=125.0, speed=0.25))[::2] == list(range(31))
    assert video_positions(motion, VideoSpeed(fps=1.0)) == [0]


@pytest.mark.parametrize(
    ("speed", "message"),
    [
        ({"fps": 0.0}, "the rate must be from 1 to 240 pictures per second, got 0"),
        ({"fps": float("nan")}, "the rate must be from 1 to 240 pictures per second, got nan"),
        ({"fps": 30.0, "speed": 0.0}, "the speed must be from 1e-6 to 1e6, got 0"),
    ],
)
def test_rates_and_speeds_out_of_range_are_refused(speed: dict[str, float], message: str) -> None:
    with pytest.raises(PictureError) as caught:
        VideoSpeed(**speed)
    assert str(caught.value) == message


def test_unknown_endings_are_refused() -> None:
    require_picture(Path("RUN.MP4"))
    for name in ("run.avi", "run"):
        with pytest.raises(PictureError) as caught:
            require_picture(Path(name))
        assert str(caught.value) == f"cannot write '{name}' as a picture; allowed endings: .mp4, .gif, .png"


def test_an_mp4_of_odd_size_is_refused_with_an_even_one(tmp_path: Path) -> None:
    with pytest.raises(PictureError) as caught:
        write_mp4(tmp_path / "a.mp4", [], width=161, height=120, fps=30.0)
    assert str(caught.value) == "an .mp4 needs an even width and height, got 161x120; use 162x120"


def test_a_gif_that_is_too_fast_is_refused(tmp_path: Path) -> None:
    with pytest.raises(PictureError) as caught:
        write_video(tmp_path / "a.gif", moving(), OPTIONS, VideoSpeed(fps=60.0))
    assert str(caught.value) == "a .gif shows at most 50 pictures per second, got 60; lower the rate or write .mp4"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("ending", ["mp4", "gif"])
def test_an_interrupted_video_leaves_nothing_but_what_was_there_before(tmp_path: Path, ending: str) -> None:
    require_gl()
    out = tmp_path / f"video.{ending}"
    out.write_bytes(b"older")

    def interrupt(_: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_video(out, moving(), OPTIONS, VideoSpeed(fps=25.0), interrupt)
    assert [path.name for path in tmp_path.iterdir()] == [out.name]
    assert out.read_bytes() == b"older"
