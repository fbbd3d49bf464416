"""Motions as files: videos (.mp4, .gif) by ffmpeg, and single pictures (.png).

ffmpeg comes with imageio-ffmpeg. Its ``write_frames`` is not used: it neither reports that the encoder failed, as on
a full disk, nor keeps the encoder's messages from the terminal.
"""

from __future__ import annotations

import errno
import math
import os
import signal
import subprocess
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dh2sim.draw.motion import Motion
from dh2sim.draw.renderer import MotionRenderer, PictureOptions, open_motion
from dh2sim.errors import PictureError
from dh2sim.extras import require_extra
from dh2sim.files import atomic_file
from dh2sim.messages import shown
from dh2sim.progress import Advance, no_progress

Picture = NDArray[np.uint8]
"""Red, green, blue, shape (height, width, 3)."""
VIDEOS = (".mp4", ".gif")
IMAGES = (".png",)
QUALITY = 20
"""x264's constant rate factor: 0 loses nothing, 51 nearly everything."""
SAMPLES = 8
"""Pictures that the palette of a .gif is made from."""
FASTEST_GIF = 50.0
"""Pictures per second; viewers slow down what is faster."""


def write_mp4(path: Path, pictures: Iterable[Picture], *, width: int, height: int, fps: float) -> None:
    """Encode an H.264 video that every player reads; pictures are not kept.

    Args:
        path: the file; an existing one is replaced.
        pictures: all of the same size.
        width: pixels, even.
        height: pixels, even.
        fps: pictures per second.

    Raises:
        PictureError: there is no ffmpeg, or the size is odd.
        OSError: the file cannot be written.
    """
    if width % 2 or height % 2:
        raise PictureError(
            f"an .mp4 needs an even width and height, got {width}x{height}; use {width + width % 2}x"
            f"{height + height % 2}"
        )
    # the colours of high-definition video, named in the file: otherwise every player guesses
    colors = ("-color_primaries", "bt709", "-color_trc", "bt709", "-colorspace", "bt709", "-color_range", "tv")
    options = [
        *("-vf", "scale=out_color_matrix=bt709:out_range=tv,format=yuv420p", *colors),
        *("-c:v", "libx264", "-preset", "medium", "-crf", str(QUALITY), "-movflags", "+faststart", "-f", "mp4"),
    ]
    _encode(pictures, [*options, str(path)], width=width, height=height, fps=fps)


def write_gif(
    path: Path,
    pictures: Iterable[Picture],
    samples: Sequence[Picture],
    *,
    width: int,
    height: int,
    fps: float,
    count: int,
) -> None:
    """Encode an endless GIF with one palette for all pictures, which are not kept.

    Args:
        path: the file; an existing one is replaced.
        pictures: all of the same size.
        samples: some of them, for the palette.
        width: pixels.
        height: pixels.
        fps: pictures per second; the times at which they are shown are rounded to hundredths of a second.
        count: number of pictures.

    Raises:
        PictureError: there is no ffmpeg, or the GIF would be faster than viewers show it.
        OSError: the file cannot be written.
    """
    require_gif_speed(fps)
    last = round(100 * count / fps) - round(100 * (count - 1) / fps)
    with tempfile.TemporaryDirectory() as folder:
        palette = str(Path(folder) / "palette.png")
        _encode(samples, ["-vf", "palettegen=stats_mode=full", palette], width=width, height=height, fps=fps)
        options = [
            *("-i", palette, "-lavfi", "paletteuse=dither=none:diff_mode=rectangle"),
            *("-loop", "0", "-final_delay", str(last), "-f", "gif"),
        ]
        _encode(pictures, [*options, str(path)], width=width, height=height, fps=fps)


def require_gif_speed(fps: float) -> None:
    """Check that viewers show a GIF as fast as this.

    Raises:
        PictureError: they do not.
    """
    if fps > FASTEST_GIF:
        raise PictureError(
            f"a .gif shows at most {FASTEST_GIF:.0f} pictures per second, got {fps:g}; lower the rate or write .mp4"
        )


def _encode(pictures: Iterable[Picture], options: list[str], *, width: int, height: int, fps: float) -> None:
    """Pipe pictures to ffmpeg; ``options`` say what it makes of them.

    Raises:
        PictureError: there is no ffmpeg.
        OSError: it fails; the text says why.
    """
    command = [
        *(_ffmpeg(), "-y", "-v", "error", "-nostdin"),
        *("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}"),
        *("-r", str(Fraction(fps).limit_denominator(1001)), "-i", "pipe:0", *options),
    ]
    with tempfile.TemporaryFile() as messages:
        encoder = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=messages, start_new_session=True
        )
        assert encoder.stdin is not None
        try:
            with encoder.stdin as pipe:
                for picture in pictures:
                    pipe.write(np.ascontiguousarray(picture).data)
            encoder.wait()
        except BrokenPipeError:
            encoder.wait()  # its messages say why
        finally:
            if encoder.poll() is None:
                encoder.kill()
                encoder.wait()
        if encoder.returncode != 0:
            messages.seek(0)
            raise OSError(_failure(encoder.returncode, messages.read()))


def _failure(status: int, messages: bytes) -> str:
    """Return in one line why ffmpeg failed."""
    if status < 0:
        return f"ffmpeg was ended by a signal: {signal.strsignal(-status)}"
    text = messages.decode(errors="replace").strip()
    if os.strerror(errno.ENOSPC) in text:
        return os.strerror(errno.ENOSPC)
    return f"ffmpeg reports: {text.splitlines()[-1] if text else f'exit status {status}'}"


def _ffmpeg() -> str:
    import imageio_ffmpeg

    try:
        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except RuntimeError as error:
        raise PictureError(f"a video needs ffmpeg: {' '.join(str(error).split())}") from error


@dataclass(frozen=True, slots=True, kw_only=True)
class VideoSpeed:
    """How fast a video is."""

    fps: float
    """Pictures per second of the video."""
    speed: float = 1.0
    """Seconds of the motion that a second of the video shows; below 1 is slow motion."""

    def __post_init__(self) -> None:
        """Check both.

        Raises:
            PictureError: one is out of range.
        """
        if not 1.0 <= self.fps <= 240.0:
            raise PictureError(f"the rate must be from 1 to 240 pictures per second, got {self.fps:g}")
        if not 1e-6 <= self.speed <= 1e6:
            raise PictureError(f"the speed must be from 1e-6 to 1e6, got {self.speed:g}")


def video_positions(motion: Motion, speed: VideoSpeed) -> list[int]:
    """Return the index of the position that each picture of a video shows: the nearest in time."""
    duration = float(motion.time[-1] - motion.time[0])
    count = math.floor(duration * speed.fps / speed.speed * (1.0 + 1e-12)) + 1
    return [motion.nearest(float(motion.time[0]) + k * speed.speed / speed.fps) for k in range(count)]


def require_picture(out: Path) -> None:
    """Check the ending of a file's name, and that what writes it is installed.

    Raises:
        PictureError: the ending is none of those allowed.
        MissingExtraError: Pillow or imageio-ffmpeg is not installed.
    """
    if out.suffix.lower() not in (*VIDEOS, *IMAGES):
        allowed = ", ".join((*VIDEOS, *IMAGES))
        raise PictureError(f"cannot write {shown(out.name)} as a picture; allowed endings: {allowed}")
    require_extra("video", "PIL", "imageio_ffmpeg", what="rendering")


def write_video(
    out: Path,
    motion: Motion,
    options: PictureOptions,
    speed: VideoSpeed,
    advance: Advance = no_progress,
) -> int:
    """Write a video of a motion, whole or not at all.

    Args:
        out: .mp4 or .gif.
        motion: what moves.
        options: size, camera, and what else is shown.
        speed: pictures per second, slow motion.
        advance: called with the number of pictures rendered since the last call.

    Returns:
        The number of pictures.

    Raises:
        PictureError: it cannot be rendered or encoded.
        OutputError: it cannot be written.
    """
    positions = video_positions(motion, speed)
    gif = out.suffix.lower() == ".gif"
    if gif:
        require_gif_speed(speed.fps)
    size = {"width": options.width, "height": options.height}
    with atomic_file(out) as draft, open_motion(motion, options) as renderer:
        pictures = _pictures(renderer, positions, advance)
        if gif:
            chosen = {round(k) for k in np.linspace(0, len(positions) - 1, min(SAMPLES, len(positions)))}
            samples = [renderer.picture(positions[k]) for k in sorted(chosen)]
            write_gif(draft, pictures, samples, **size, fps=speed.fps, count=len(positions))
        else:
            write_mp4(draft, pictures, **size, fps=speed.fps)
    return len(positions)


def write_image(out: Path, motion: Motion, options: PictureOptions, number: int) -> None:
    """Write a picture of one position, whole or not at all.

    Args:
        out: .png.
        motion: what moves.
        options: size, camera, and what else is shown.
        number: index of the position.

    Raises:
        PictureError: it cannot be rendered.
        OutputError: it cannot be written.
    """
    from PIL import Image

    with atomic_file(out) as draft, open_motion(motion, options) as renderer:
        Image.fromarray(renderer.picture(number)).save(draft, format="PNG", optimize=True)


def _pictures(renderer: MotionRenderer, positions: list[int], advance: Advance) -> Iterator[Picture]:
    for number in positions:
        yield renderer.picture(number)
        advance(1)
