"""A live camera, or any live stream that FFmpeg opens; read in a separate thread from opening to closing.

It is open throughout a session, so that neither its light nor its sound reveals when a condition shows it.
"""

from __future__ import annotations

import re
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final
from urllib.parse import urlsplit

import numpy as np

from study_app.errors import VideoError
from study_app.video.decoding import SECOND_NS, Scaler, make_less_urgent, open_video, period_ns, reason
from study_app.video.frames import VideoFrame, stopped

LIVE: Final = {"fflags": "nobuffer", "flags": "low_delay", "probesize": "65536", "analyzeduration": "0"}
OF_DEVICE: Final = {"video_size": "1280x720", "framerate": "30"}
USUAL: Final = {"linux": "v4l2:/dev/video0", "darwin": "avfoundation:0"}.get(sys.platform, "")
KINDS: Final = ("v4l2", "avfoundation", "dshow")
OPENS_S, STALLS_S, ENDS_S = 8.0, 1.0, 5.0
MOST_AGE_S: Final = 10.0
"""Time stamps that differ more from both system clocks are from another clock. [choice]"""
SPARE_NS: Final = SECOND_NS // 2
HOST: Final = re.compile(r"([\w.-]+|\[[\da-fA-F:.]+\])(:\d{1,5})?")
NOT_SHOWN: Final = "(address not shown)"
COUNTED: Final = 30
"""Number of intervals between frames whose median is the period."""


class Camera:
    """A camera as a source.

    Parameters
    ----------
    source : str
        ``v4l2:/dev/video0``, ``avfoundation:0``, ``dshow:video=NAME``, or an URL.
    holds_s : float
        Greatest age of frames that are requested [s].

    Raises
    ------
    VideoError
        There is no camera, or it sends no frame.
    """

    def __init__(self, source: str, now_ns: Callable[[], int], holds_s: float) -> None:
        self.source = source  # may contain a name and a password: use `without_login` to show or store it
        if not source:
            raise VideoError("no camera is set: set one under This machine, such as dshow:video=NAME")
        self._now_ns = now_ns
        self._holds_ns = round(holds_s * SECOND_NS) + SPARE_NS
        self._changed = threading.Condition()
        self._frames: deque[VideoFrame] = deque()
        self._fitted: tuple[int, int] | None = None
        self._failure = ""
        self._closed = False
        self.size = (0, 0)
        self.thread = threading.Thread(target=self._work, name="camera", daemon=True)
        self.thread.start()
        with self._changed:
            self._changed.wait_for(lambda: self._frames or self._failure, OPENS_S)
            failure = self._failure or ("" if self._frames else f"no picture in {OPENS_S:g} s")
        if failure:
            self.close()
            raise VideoError(f"the camera {without_login(source)} cannot be used: {failure}")

    @property
    def works(self) -> bool:
        """Whether it still receives frames."""
        return self.thread.is_alive() and not self._stalls

    @property
    def _stalls(self) -> bool:
        return self._now_ns() - self.newest.due_ns > STALLS_S * SECOND_NS

    @property
    def newest(self) -> VideoFrame:
        """The last frame received."""
        return self._frames[-1]

    def fit(self, width: int, height: int) -> None:
        """Scale later frames so that they fit into this many pixels."""
        self._fitted = (width, height)

    def rewind(self) -> None:
        """Do nothing: it is live."""

    def begin(self, at_ns: int) -> None:
        """Do nothing: it is live."""

    def frame_at(self, moment_ns: int) -> VideoFrame | None:
        """Return the newest frame that was ready at a time [ns, servo's clock]; None if none was.

        Raises
        ------
        VideoError
            The camera ended, or sent nothing for a second.
        """
        with self._changed:
            failure, held = self._failure, tuple(self._frames)
        if not failure and self._stalls:
            failure = f"no picture for {STALLS_S:g} s"
        if failure:
            raise stopped(failure)
        return next((frame for frame in reversed(held) if frame.due_ns <= moment_ns), None)

    def close(self) -> None:
        """Close the camera; a thread that still waits for its next frame ends by itself."""
        self._closed = True
        self.thread.join(ENDS_S)

    def _work(self) -> None:
        make_less_urgent()
        try:
            self._read()
            failure = "it ended"
        except Exception as error:  # noqa: BLE001 - FFmpeg's errors have no common base but this
            failure = reason(error)
        with self._changed:
            self._failure = failure
            self._changed.notify_all()

    def _read(self) -> None:
        kind, _, place = self.source.partition(":")
        of_device = kind in KINDS
        options = {**LIVE, **OF_DEVICE} if of_device else LIVE
        given = {"kind": kind, **options} if of_device else options
        with open_video(place if of_device else self.source, timeout=(OPENS_S, 2 * STALLS_S), **given) as container:
            stream = container.streams.video[0]
            self.size, scaler = (stream.width, stream.height), Scaler()
            numbers = _Numbers(period_ns(stream))
            for frame in container.decode(stream):
                if self._closed:
                    return
                scaler.size = self._fitted or scaler.size
                self._take(frame, scaler, numbers)

    def _take(self, frame: Any, scaler: Scaler, numbers: _Numbers) -> None:
        number = numbers.of(frame.time)
        width, height, stride, pixels = scaler.pixels(frame)
        ready_ns, age_ns = self._now_ns(), _age_ns(frame.time)
        made = VideoFrame(number, width, height, stride, pixels, ready_ns, age_ns, numbers.period_ns)
        with self._changed:
            self._frames.append(made)
            while self._frames[0].due_ns < ready_ns - self._holds_ns:
                self._frames.popleft()
            self._changed.notify_all()


def without_login(source: str) -> str:
    """Return the name of a device, or scheme and host of an URL, whose other parts may contain name and password."""
    if source.partition(":")[0] in KINDS:
        return source
    with suppress(ValueError):  # of an URL that is not valid
        parts = urlsplit(source)
        host = parts.netloc.rpartition("@")[2]
        no_later = source.count("@") == parts.netloc.count("@")  # else a / in a password may have cut off the host
        if parts.scheme and no_later and HOST.fullmatch(host):
            return f"{parts.scheme}://{host}"
    return NOT_SHOWN


class _Numbers:
    """Counts the frames of a camera, including lost ones."""

    def __init__(self, period_ns: int) -> None:
        self.period_ns = period_ns
        self._number = -1
        self._before_s: float | None = None
        self._gaps_s: deque[float] = deque(maxlen=COUNTED)

    def of(self, stamp_s: float | None) -> int:
        """Return the number of a frame with this time stamp [s]; without one, the number after the last."""
        missed = 0
        if stamp_s is not None and self._before_s is not None and (gap_s := stamp_s - self._before_s) > 0:
            self._gaps_s.append(gap_s)
            if len(self._gaps_s) >= COUNTED // 3:
                self.period_ns = round(float(np.median(self._gaps_s)) * SECOND_NS)
            missed = max(0, round(gap_s * SECOND_NS / self.period_ns) - 1)
        self._before_s = stamp_s
        self._number += 1 + missed
        return self._number


def _age_ns(stamp_s: float | None) -> int | None:
    """Return the present age of a frame with this time stamp [ns], by the system clock that the stamps are from."""
    for clock in (time.monotonic, time.time):
        if stamp_s is not None and -0.001 <= (age_s := clock() - stamp_s) < MOST_AGE_S:
            return max(0, round(age_s * SECOND_NS))
    return None
