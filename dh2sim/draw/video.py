"""Motions as files: films (.mp4, .gif) and stills (.png).

GIF films: one palette for all pictures, and only what changes is stored.

MP4 films: H.264 as every player reads it, by the encoder that comes with imageio-ffmpeg.
"""

from __future__ import annotations

import errno
import math
import os
import signal
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dh2sim.draw.motion import Motion
from dh2sim.draw.renderer import Look, Stage, stage
from dh2sim.errors import PictureError
from dh2sim.extras import require_extra
from dh2sim.files import atomic_file
from dh2sim.messages import shown

if TYPE_CHECKING:
    from PIL.Image import Image

MOST_PIXELS = 500_000_000
"""Of all pictures together, which Pillow keeps until the last one is there, a byte each."""
COLORS = 255
"""One of 256 is left for what does not change."""
SAMPLES = 8
"""Pictures that the palette is made from."""
FASTEST = 50.0
"""Pictures a second; viewers slow down what is faster."""


def check_gif(count: int, *, width: int, height: int, fps: float) -> None:
    """Check that a film may be a GIF.

    Raises:
        PictureError: it is too fast or too long; the text says what to do.
    """
    if fps > FASTEST:
        raise PictureError(
            f"a .gif shows at most {FASTEST:.0f} pictures a second, got {fps:g}; lower --fps or write .mp4"
        )
    if count * width * height > MOST_PIXELS:
        raise PictureError(
            f"{count} pictures of {width}x{height} are too much for a .gif; write .mp4, or lower --size or --fps"
        )


def write_gif(
    path: Path, pictures: Iterable[NDArray[np.uint8]], samples: Sequence[NDArray[np.uint8]], *, fps: float
) -> None:
    """Write a film that is shown again and again.

    Args:
        path: of the file; one that stands there is written over.
        pictures: arrays of shape (height, width, 3).
        samples: some of them, for the palette.
        fps: pictures a second; times are rounded to hundredths of a second, without adding up.

    Raises:
        OSError: the file cannot be written.
    """
    palette = _palette(samples)
    times = _Times(fps)
    first, *rest = _changes(pictures, palette)
    durations = [times.duration(k) for k in range(1 + len(rest))]
    first.save(
        path,
        format="GIF",
        save_all=True,
        append_images=rest,
        duration=durations,
        loop=0,
        optimize=False,
        transparency=COLORS,
        disposal=1,
    )


class _Times:
    """When pictures are shown: GIF counts hundredths of a second."""

    def __init__(self, fps: float) -> None:
        self._fps = fps

    def duration(self, number: int) -> int:
        """Return how long a picture is shown, ms."""
        return 10 * (round(100 * (number + 1) / self._fps) - round(100 * number / self._fps))


def _palette(samples: Sequence[NDArray[np.uint8]]) -> Image:
    """Return an image with a palette in which rare colours count too: those of thin lines and arrows.

    Colours, rounded to 5 bits, are weighted with the square root of how often they occur.
    """
    from PIL import Image

    pixels = np.concatenate([sample.reshape(-1, 3) for sample in samples])
    rounded = pixels >> 3
    codes = (rounded[:, 0].astype(np.intp) << 10) | (rounded[:, 1].astype(np.intp) << 5) | rounded[:, 2]
    counts = np.bincount(codes)
    found = np.flatnonzero(counts)
    means = np.stack([np.bincount(codes, pixels[:, k])[found] / counts[found] for k in range(3)], axis=1)
    weighted = np.repeat(means.round().astype(np.uint8), np.ceil(np.sqrt(counts[found])).astype(int), axis=0)
    return Image.fromarray(weighted[None]).quantize(COLORS, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)


def _changes(pictures: Iterable[NDArray[np.uint8]], palette: Image) -> Iterator[Image]:
    """Reduce pictures to the palette; what is as in the picture before becomes transparent, colour ``COLORS``."""
    from PIL import Image

    colors = (palette.getpalette() or [])[: 3 * COLORS]
    colors += [0] * (3 * 256 - len(colors))
    before: NDArray[np.uint8] | None = None
    for picture in pictures:
        reduced = np.asarray(Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE))
        shown = reduced if before is None else np.where(reduced == before, np.uint8(COLORS), reduced)
        before = reduced
        image = Image.fromarray(shown)
        image.putpalette(colors)
        yield image


QUALITY = 20
"""x264's constant rate factor: 0 loses nothing, 51 nearly everything."""


def write_mp4(path: Path, pictures: Iterable[NDArray[np.uint8]], *, width: int, height: int, fps: float) -> None:
    """Write a film, picture by picture: none of them is kept.

    Args:
        path: of the file; one that stands there is written over.
        pictures: arrays of shape (height, width, 3).
        width: pixels, even.
        height: pixels, even.
        fps: pictures a second.

    Raises:
        PictureError: there is no encoder, or the size is odd.
        OSError: the file cannot be written.
    """
    if width % 2 or height % 2:
        raise PictureError(
            f"an .mp4 needs an even width and height, got {width}x{height}; --size {width + width % 2}x"
            f"{height + height % 2} would do"
        )
    command = [
        *(_encoder(), "-y", "-v", "error", "-nostdin"),
        *("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}"),
        *("-r", str(Fraction(fps).limit_denominator(1001)), "-i", "-", "-an"),
        # the colours of high-definition video, named in the file: otherwise players guess, each in its own way
        *("-vf", "scale=out_color_matrix=bt709:out_range=tv,format=yuv420p"),
        *("-color_primaries", "bt709", "-color_trc", "bt709", "-colorspace", "bt709", "-color_range", "tv"),
        *("-c:v", "libx264", "-preset", "medium", "-crf", str(QUALITY), "-movflags", "+faststart"),
        *("-f", "mp4", str(path)),
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
            encoder.wait()  # it has said why
        finally:
            if encoder.poll() is None:
                encoder.kill()
                encoder.wait()
        if encoder.returncode != 0:
            messages.seek(0)
            raise OSError(_told(encoder.returncode, messages.read()))


def _told(status: int, messages: bytes) -> str:
    """Return in one line why the encoder failed."""
    if status < 0:
        return f"ffmpeg was ended by a signal: {signal.strsignal(-status)}"
    text = messages.decode(errors="replace").strip()
    if os.strerror(errno.ENOSPC) in text:
        return os.strerror(errno.ENOSPC)
    return f"ffmpeg says: {text.splitlines()[-1] if text else 'nothing'}"


def _encoder() -> str:
    import imageio_ffmpeg

    try:
        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except RuntimeError as error:
        raise PictureError(f"an .mp4 needs ffmpeg: {' '.join(str(error).split())}") from error


FILMS = (".mp4", ".gif")
STILLS = (".png",)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tempo:
    """How fast a film is."""

    fps: float
    """Pictures a second of the film."""
    speed: float = 1.0
    """Seconds of the motion that a second of the film shows; below 1 is slow motion."""

    def __post_init__(self) -> None:
        """Check both.

        Raises:
            PictureError: one cannot be.
        """
        if not 1.0 <= self.fps <= 240.0:
            raise PictureError(f"{self.fps:g} pictures a second are not from 1 to 240")
        if not 1e-6 <= self.speed <= 1e6:
            raise PictureError(f"the speed {self.speed:g} is not from 1e-6 to 1e6")


def film_positions(motion: Motion, tempo: Tempo) -> list[int]:
    """Return the number of the position that each picture of a film shows: the one nearest in time."""
    duration = float(motion.time[-1] - motion.time[0])
    count = math.floor(duration * tempo.fps / tempo.speed * (1.0 + 1e-12)) + 1
    return [motion.nearest(float(motion.time[0]) + k * tempo.speed / tempo.fps) for k in range(count)]


def require_ending(out: Path) -> None:
    """Check the ending of a file's name, and that what writes it is installed.

    Raises:
        PictureError: the ending is none of those allowed.
        MissingExtraError: Pillow or imageio-ffmpeg is not installed.
    """
    if out.suffix.lower() not in (*FILMS, *STILLS):
        raise PictureError(f"{shown(out.name)} is no picture that can be written; allowed endings: .mp4, .gif, .png")
    require_extra("video", "PIL", "imageio_ffmpeg", what="rendering")


def write_film(
    out: Path, motion: Motion, look: Look, tempo: Tempo, advance: Callable[[int], None] | None = None
) -> int:
    """Write a film of a motion, whole or not at all.

    Args:
        out: .mp4 or .gif.
        motion: what moves.
        look: size, camera, and what else is shown.
        tempo: pictures a second, slow motion.
        advance: is told how many pictures were drawn since it was told last.

    Returns:
        The number of pictures.

    Raises:
        PictureError: it cannot be drawn or encoded.
        OutputError: it cannot be written.
    """
    numbers = film_positions(motion, tempo)
    gif = out.suffix.lower() == ".gif"
    if gif:
        check_gif(len(numbers), width=look.width, height=look.height, fps=tempo.fps)
    with atomic_file(out) as draft, stage(motion, look) as scene:
        pictures = _pictures(scene, numbers, advance or (lambda _: None))
        if gif:
            spread = {round(k) for k in np.linspace(0, len(numbers) - 1, min(SAMPLES, len(numbers)))}
            samples = [scene.picture(numbers[k]) for k in sorted(spread)]
            write_gif(draft, pictures, samples, fps=tempo.fps)
        else:
            write_mp4(draft, pictures, width=look.width, height=look.height, fps=tempo.fps)
    return len(numbers)


def write_still(out: Path, motion: Motion, look: Look, number: int) -> None:
    """Write a picture of one position, whole or not at all.

    Args:
        out: .png.
        motion: what moves.
        look: size, camera, and what else is shown.
        number: of the position.

    Raises:
        PictureError: it cannot be drawn.
        OutputError: it cannot be written.
    """
    from PIL import Image

    with atomic_file(out) as draft, stage(motion, look) as scene:
        Image.fromarray(scene.picture(number)).save(draft, format="PNG", optimize=True)


def _pictures(scene: Stage, numbers: list[int], advance: Callable[[int], None]) -> Iterator[NDArray[np.uint8]]:
    for number in numbers:
        yield scene.picture(number)
        advance(1)
