"""Opening and scaling videos with PyAV, an optional extra that only this module imports."""

import errno
import os
import sys
import threading
from contextlib import suppress
from importlib.util import find_spec
from typing import Any, Final, NamedTuple

from study_app.errors import VideoError

EXTRA: Final = "needs the optional video extra: pip install 'liquid-study[video]'"
_SIZE: Final = (1280, 720)
"""Size of scaled frames until the tank sets its own [px]."""
_NICE_LEVEL: Final = 5
"""Nice level of decoding threads, on systems with a level for each thread. [choice]"""
SECOND_NS: Final = 1_000_000_000
_USUAL_RATE_HZ: Final = 30.0
_RATES_HZ: Final = (1.0, 240.0)
FILE_OPTIONS: Final = {"format_whitelist": "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,avi,mpeg,mpegts,ogg"}
"""Options of a file: FFmpeg's names of the accepted formats. Others, such as ffconcat, may refer to other files."""


class Pixels(NamedTuple):
    """A frame's pixels as in `frames.VideoFrame`."""

    width: int
    height: int
    stride: int
    content: Any


def is_installed() -> bool:
    """Return whether PyAV is installed."""
    return find_spec("av") is not None


def open_video(source: str, *, kind: str | None = None, timeout: Any = None, **options: str) -> Any:
    """Open a source and return its PyAV container; ``kind`` is FFmpeg's name of a type of device, or of a format."""
    try:
        import av  # noqa: PLC0415 - an optional extra
        from av.error import FFmpegError  # noqa: PLC0415
    except ImportError as error:
        raise VideoError(f"a video {EXTRA}") from error
    try:
        container = av.open(source, format=kind, options=options, timeout=timeout)
    except (FFmpegError, OSError, ValueError) as error:
        refused = "format_whitelist" in options and getattr(error, "errno", None) == errno.EINVAL
        raise VideoError("its format is not accepted" if refused else failure_reason(error)) from error
    if not container.streams.video:
        container.close()
        raise VideoError("it does not contain a video")
    if (codec := container.streams.video[0].codec_context) is None:
        container.close()
        raise VideoError("its codec is unknown, or the file is damaged")
    codec.thread_count = 1
    return container


def failure_reason(error: Exception) -> str:
    """Return the reason why a video cannot be read, as reported by the system or FFmpeg."""
    if type(error).__name__ == "ExitError":  # FFmpeg: "Immediate exit requested", after its time limit
        return "no data arrived in time"
    if isinstance(error, UnicodeError):  # PyAV cannot decode a name in it
        return "the file is damaged"
    reason = str(getattr(error, "strerror", None) or error or type(error).__name__)
    if reason.startswith("Error number") and (number := getattr(error, "errno", None)):  # unknown to FFmpeg
        return os.strerror(abs(number))
    return reason


def period_ns(stream: Any) -> int:
    """Return the frame period according to a stream's header [ns]."""
    for rate in (stream.average_rate, stream.guessed_rate):
        if rate is not None and _RATES_HZ[0] <= float(rate) <= _RATES_HZ[1]:
            return round(SECOND_NS / float(rate))
    return round(SECOND_NS / _USUAL_RATE_HZ)


class Scaler:
    """Converts decoded frames to pixels that fit into a size, which another thread may change."""

    def __init__(self) -> None:
        from av.video.reformatter import VideoReformatter  # noqa: PLC0415 - an optional extra

        self._reformatter = VideoReformatter()
        self.size = _SIZE

    def pixels(self, frame: Any) -> Pixels:
        """Return a frame's pixels, scaled to fill the width or the height of the size, with the same aspect ratio."""
        max_width, max_height = self.size
        scale = min(max_width / frame.width, max_height / frame.height)
        width, height = max(2, round(scale * frame.width)), max(2, round(scale * frame.height))
        scaled = self._reformatter.reformat(frame, width, height, "bgra", interpolation="BILINEAR")
        plane = scaled.planes[0]  # keeps its frame
        return Pixels(width=width, height=height, stride=plane.line_size, content=plane)


def make_less_urgent() -> None:
    """Lower the priority of this thread."""
    if sys.platform == "linux":
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICE_LEVEL)
