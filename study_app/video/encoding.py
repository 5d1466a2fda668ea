"""Writing pictures as a video with PyAV, the optional extra ``video``."""

import io

import numpy as np
from numpy.typing import NDArray

from study_app.errors import VideoError
from study_app.video.decoding import EXTRA

_CODECS = ("libx264", "mpeg4")
"""Codecs in order of preference; the first one in this build of FFmpeg is used."""


class VideoWriter:
    """An MP4 file in memory.

    Parameters
    ----------
    size : tuple of int
        Width and height of its pictures [px]; odd ones lose a row or column.
    rate_hz : int
        Pictures per second.

    Raises
    ------
    VideoError
        PyAV is not installed.
    """

    def __init__(self, size: tuple[int, int], rate_hz: int) -> None:
        try:
            import av  # noqa: PLC0415 - an optional extra
        except ImportError as error:
            raise VideoError(f"a video {EXTRA}") from error
        self._picture = av.VideoFrame
        self._file = io.BytesIO()
        self._container = av.open(self._file, "w", format="mp4")
        codec = next(name for name in _CODECS if name in av.codecs_available)
        self._stream = self._container.add_stream(codec, rate=rate_hz)
        self._stream.width, self._stream.height = (side // 2 * 2 for side in size)
        self._stream.pix_fmt = "yuv420p"

    def add(self, pixels: NDArray[np.uint8]) -> None:
        """Add a picture (height, width, 4): blue, green, red, unused."""
        height, width = self._stream.height, self._stream.width
        frame = self._picture.from_ndarray(np.ascontiguousarray(pixels[:height, :width]), format="bgra")
        self._container.mux(self._stream.encode(frame))

    def finish(self) -> bytes:
        """Finish the file and return its content."""
        self._container.mux(self._stream.encode())
        self._container.close()
        return self._file.getvalue()
