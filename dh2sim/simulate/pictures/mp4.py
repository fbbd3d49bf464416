"""MP4 films: H.264 as every player reads it, by the encoder that comes with imageio-ffmpeg."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import tempfile
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dh2sim.errors import PictureError

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
