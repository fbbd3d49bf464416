"""GIF films: one palette for all pictures, and only what changes is stored."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dh2sim.errors import PictureError

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
