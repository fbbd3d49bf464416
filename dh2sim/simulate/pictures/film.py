"""Motions as files: films (.mp4, .gif) and stills (.png)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dh2sim.errors import PictureError
from dh2sim.export.placing import written_whole
from dh2sim.robot.words import shown
from dh2sim.simulate.pictures.gif import SAMPLES, check_gif, write_gif
from dh2sim.simulate.pictures.motion import Motion
from dh2sim.simulate.pictures.mp4 import write_mp4
from dh2sim.simulate.pictures.stage import Look, Stage, stage

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
    """Check that the name of a file says what it shall be.

    Raises:
        PictureError: it does not.
    """
    if out.suffix.lower() not in (*FILMS, *STILLS):
        raise PictureError(f"{shown(out.name)} is no picture that can be written; allowed endings: .mp4, .gif, .png")


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
    with written_whole(out) as draft, stage(motion, look) as scene:
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

    with written_whole(out) as draft, stage(motion, look) as scene:
        Image.fromarray(scene.picture(number)).save(draft, format="PNG", optimize=True)


def _pictures(scene: Stage, numbers: list[int], advance: Callable[[int], None]) -> Iterator[NDArray[np.uint8]]:
    for number in numbers:
        yield scene.picture(number)
        advance(1)
