"""Synthetic footage: each frame says its number by 16 black or white bars, and moves a grey ramp."""

from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

SIZE = (1280, 720)
RATE_HZ = 30
BITS = 16


def picture(number: int, size: tuple[int, int] = SIZE) -> NDArray[np.uint8]:
    """Return the pixels (height, width, 3) of a frame."""
    width, height = size
    ramp = ((np.arange(width)[None, :] + np.arange(height)[:, None] + 7 * number) % 256).astype(np.uint8)
    pixels = np.repeat(ramp[..., None], 3, axis=2)
    bars = np.repeat([255 * (number >> bit & 1) for bit in range(BITS)], width // BITS)
    pixels[: height // 2, : len(bars)] = bars[None, :, None]
    return pixels


def number_in(pixels: Any) -> int:
    """Return the number that the pixels (height, width, 4) of a frame say, at any size."""
    height, width = pixels.shape[0], pixels.shape[1] // (1 if pixels.ndim == 3 else 4)
    row = np.asarray(pixels).reshape(height, width, -1)[height // 4, :, 1]
    pitch = width / BITS
    return sum(int(row[int(pitch * (bit + 0.5))] > 127) << bit for bit in range(BITS))


def write_clip(path: Path, *, frames: int, size: tuple[int, int] = SIZE, rate_hz: int = RATE_HZ) -> None:
    """Write a clip of H.264."""
    import av

    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=rate_hz, options={"preset": "ultrafast", "crf": "20"})
        stream.width, stream.height = size
        stream.pix_fmt = "yuv420p"
        stream.time_base = Fraction(1, rate_hz)
        for number in range(frames):
            frame = av.VideoFrame.from_ndarray(picture(number, size), "rgb24")
            frame.pts, frame.time_base = number, Fraction(1, rate_hz)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
