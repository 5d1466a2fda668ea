"""Sources of a video: a live camera, or another live stream that FFmpeg can open, and footage from a file.

A camera is open throughout a session, so that neither its light nor its sound reveals which conditions show it.
Footage is played in a loop from the beginning of each trial. Each source is decoded in a separate thread.
"""

from __future__ import annotations

import re
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit

import numpy as np

from study_app.errors import VideoError
from study_app.number_text import counted
from study_app.protocol.model import Protocol
from study_app.protocol.source import file_hash
from study_app.protocol.trials import DELAY, MOST_DELAY_MS
from study_app.video.decoding import (
    EXTRA,
    FILE_OPTIONS,
    SECOND_NS,
    Scaler,
    failure_reason,
    is_installed,
    make_less_urgent,
    open_video,
    period_ns,
)
from study_app.video.frames import VideoFrame, stopped_error

_LIVE_OPTIONS: Final = {"fflags": "nobuffer", "flags": "low_delay", "probesize": "65536", "analyzeduration": "0"}
_DEVICE_OPTIONS: Final = {"video_size": "1280x720", "framerate": "30"}
USUAL: Final = {"linux": "v4l2:/dev/video0", "darwin": "avfoundation:0"}.get(sys.platform, "")
KINDS: Final = ("v4l2", "avfoundation", "dshow")
OPENS_S, STALLS_S, ENDS_S = 8.0, 1.0, 5.0
_MAX_AGE_S: Final = 10.0
"""Maximum difference between a time stamp and a system clock; if larger, the time is from another clock. [choice]"""
_SPARE_NS: Final = SECOND_NS // 2
HOST: Final = re.compile(r"([\w.-]+|\[[\da-fA-F:.]+\])(:\d{1,5})?")
NOT_SHOWN: Final = "(address not shown)"
_COUNTED_GAPS: Final = 30
"""Number of intervals between frames from which the frame period is estimated, by their median."""
_MAX_QUEUED: Final = 15
"""Maximum number of decoded frames in the queue: 0.5 s at 30 Hz, 45 MB at 1152 x 648 pixels. [choice]"""
PATIENCE_S: Final = 5.0
_CAMERA = "camera"


class Camera:
    """A camera as a source.

    Parameters
    ----------
    source : str
        ``v4l2:/dev/video0``, ``avfoundation:0``, ``dshow:video=NAME``, or a URL.
    holds_s : float
        Maximum age of requested frames [s].

    Raises
    ------
    VideoError
        There is no camera, or it does not send a frame.
    """

    def __init__(self, source: str, now_ns: Callable[[], int], holds_s: float) -> None:
        self.source = source  # may contain a name and a password: use `without_login` to show or store it
        if not source:
            raise VideoError("no camera is selected: specify one under This machine, for example as dshow:video=NAME")
        self._now_ns = now_ns
        self._holds_ns = round(holds_s * SECOND_NS) + _SPARE_NS
        self._changed = threading.Condition()
        self._frames: deque[VideoFrame] = deque()
        self._fitted: tuple[int, int] | None = None
        self._failure = ""
        self._closed = False
        self.size = (0, 0)
        self.thread = threading.Thread(target=self._run_camera, name="camera", daemon=True)
        self.thread.start()
        with self._changed:
            self._changed.wait_for(lambda: self._frames or self._failure, OPENS_S)
            failure = self._failure or ("" if self._frames else f"no frame arrived within {OPENS_S:g} s")
        if failure:
            self.close()
            raise VideoError(f"the camera {without_login(source)} cannot be used: {failure}")

    @property
    def works(self) -> bool:
        return self.thread.is_alive() and not self._is_stalled

    @property
    def _is_stalled(self) -> bool:
        return self._now_ns() - self.newest.due_ns > STALLS_S * SECOND_NS

    @property
    def newest(self) -> VideoFrame:
        return self._frames[-1]

    def fit(self, width: int, height: int) -> None:
        self._fitted = (width, height)

    def rewind(self) -> None:
        """Do nothing: a camera is live."""

    def begin(self, at_ns: int) -> None:
        """Do nothing: a camera is live."""

    def frame_at(self, moment_ns: int) -> VideoFrame | None:
        """Return the newest frame that was ready at a time [ns, servo's clock]; None if none was.

        Raises
        ------
        VideoError
            The camera stopped, or did not send a frame for a second.
        """
        with self._changed:
            failure, frames = self._failure, tuple(self._frames)
        if not failure and self._is_stalled:
            failure = f"no frame arrived for {STALLS_S:g} s"
        if failure:
            raise stopped_error(failure)
        return next((frame for frame in reversed(frames) if frame.due_ns <= moment_ns), None)

    def close(self) -> None:
        self._closed = True
        self.thread.join(ENDS_S)

    def _run_camera(self) -> None:
        make_less_urgent()
        try:
            self._read_frames()
            failure = "it ended"
        except Exception as error:  # noqa: BLE001 - FFmpeg's errors have no other common base class
            failure = failure_reason(error)
        with self._changed:
            self._failure = failure
            self._changed.notify_all()

    def _read_frames(self) -> None:
        kind, _, device = self.source.partition(":")
        is_device = kind in KINDS
        options = {"kind": kind, **_LIVE_OPTIONS, **_DEVICE_OPTIONS} if is_device else _LIVE_OPTIONS
        with open_video(device if is_device else self.source, timeout=(OPENS_S, 2 * STALLS_S), **options) as container:
            stream = container.streams.video[0]
            self.size, scaler = (stream.width, stream.height), Scaler()
            numbers = _FrameNumbers(period_ns(stream))
            for frame in container.decode(stream):
                if self._closed:
                    return
                scaler.size = self._fitted or scaler.size
                self._store_frame(frame, scaler, numbers)

    def _store_frame(self, frame: Any, scaler: Scaler, numbers: _FrameNumbers) -> None:
        number = numbers.next_number(frame.time)
        width, height, stride, pixels = scaler.pixels(frame)
        ready_ns, age_ns = self._now_ns(), _age_ns(frame.time)
        video_frame = VideoFrame(
            number=number,
            width=width,
            height=height,
            stride=stride,
            pixels=pixels,
            due_ns=ready_ns,
            age_ns=age_ns,
            period_ns=numbers.period_ns,
        )
        with self._changed:
            self._frames.append(video_frame)
            while self._frames[0].due_ns < ready_ns - self._holds_ns:
                self._frames.popleft()
            self._changed.notify_all()


def without_login(source: str) -> str:
    """Return the name of a device, or only scheme and host of a URL, since its other parts may contain a password."""
    if source.partition(":")[0] in KINDS:
        return source
    with suppress(ValueError):  # the URL is invalid
        parts = urlsplit(source)
        host = parts.netloc.rpartition("@")[2]
        has_host = source.count("@") == parts.netloc.count("@")  # otherwise a / in a password may have cut it off
        if parts.scheme and has_host and HOST.fullmatch(host):
            return f"{parts.scheme}://{host}"
    return NOT_SHOWN


class _FrameNumbers:
    """Numbers the frames of a camera; lost frames are counted, too."""

    def __init__(self, period_ns: int) -> None:
        self.period_ns = period_ns
        self._number = -1
        self._before_s: float | None = None
        self._gaps_s: deque[float] = deque(maxlen=_COUNTED_GAPS)

    def next_number(self, stamp_s: float | None) -> int:
        """Return the number of the next frame by its time stamp; without one, no frame counts as lost."""
        lost = 0
        if stamp_s is not None and self._before_s is not None and (gap_s := stamp_s - self._before_s) > 0:
            self._gaps_s.append(gap_s)
            if len(self._gaps_s) >= _COUNTED_GAPS // 3:
                self.period_ns = round(float(np.median(self._gaps_s)) * SECOND_NS)
            lost = max(0, round(gap_s * SECOND_NS / self.period_ns) - 1)
        self._before_s = stamp_s
        self._number += 1 + lost
        return self._number


def _age_ns(stamp_s: float | None) -> int | None:
    """Return the age of a frame with this time stamp [ns], by the system clock that the stamps are from."""
    for clock in (time.perf_counter, time.time):
        if stamp_s is not None and -0.001 <= (age_s := clock() - stamp_s) < _MAX_AGE_S:
            return max(0, round(age_s * SECOND_NS))
    return None


class Footage:
    """A video file as a source."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            with open_video(str(path), **FILE_OPTIONS) as container:
                stream = container.streams.video[0]
                self._period_ns = period_ns(stream)
                if (first := next(container.decode(stream), None)) is None:
                    raise VideoError("it does not contain any frames")  # noqa: TRY301 - reported with the file's name below
                self._start_s = first.time or 0.0
                self.size = (stream.width, stream.height)
        except Exception as error:
            raise VideoError(
                f"{path} cannot be shown: {failure_reason(error)}; specify a playable video file (MP4, MOV, "
                "Matroska, WebM, AVI, MPEG or Ogg)"
            ) from error
        self._scaler = Scaler()
        self._changed = threading.Condition()
        self._frames: deque[VideoFrame] = deque()
        self._first: VideoFrame | None = None
        self._shown: VideoFrame | None = None
        self._play = 0
        self._began_ns: int | None = None
        self._media_ns = 0
        self._closed = False
        self._failure = ""
        self.thread = threading.Thread(target=self._run_decoder, name="footage", daemon=True)
        self.thread.start()

    @property
    def works(self) -> bool:
        return self.thread.is_alive()

    @property
    def rate_hz(self) -> float:
        return SECOND_NS / self._period_ns

    def fit(self, width: int, height: int) -> None:
        self._scaler.size = (width, height)

    def rewind(self) -> None:
        with self._changed:
            self._play += 1
            self._frames.clear()
            self._shown, self._began_ns, self._media_ns = self._first, None, 0
            self._changed.notify_all()

    def begin(self, at_ns: int) -> None:
        self._began_ns = at_ns

    def frame_at(self, moment_ns: int) -> VideoFrame | None:
        """Return the frame of a time [ns, servo's clock]; None if it is not decoded yet.

        Raises
        ------
        VideoError
            The file cannot be read any further.
        """
        began_ns = moment_ns if self._began_ns is None else self._began_ns
        with self._changed:
            self._media_ns = max(0, moment_ns - began_ns)
            while self._frames and self._frames[0].due_ns <= self._media_ns:
                self._shown = self._frames.popleft()
            if (
                len(self._frames) <= _MAX_QUEUED // 2
            ):  # rarely: the decoder competes with painting for the interpreter lock
                self._changed.notify_all()
            if self._failure and not self._frames:
                raise stopped_error(self._failure)
            shown = self._shown
        return None if shown is None else replace(shown, due_ns=began_ns + shown.due_ns)

    def close(self) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self.thread.join(PATIENCE_S)

    def _run_decoder(self) -> None:
        make_less_urgent()
        try:
            with open_video(str(self.path), **FILE_OPTIONS) as container:
                while not self._closed:
                    play = self._play
                    for frame in self._decode_in_loop(container, play):
                        if not self._queue_frame(frame, play):
                            break
        except Exception as error:  # noqa: BLE001 - FFmpeg's errors have no other common base class
            with self._changed:
                self._failure = failure_reason(error)

    def _decode_in_loop(self, container: Any, play: int) -> Iterator[VideoFrame]:
        """Yield the frames in a loop from the beginning; skip overdue frames, except the very first one."""
        number = offset_ns = 0
        while True:
            container.seek(0)
            end_ns = 0
            for frame in container.decode(video=0):
                media_ns = round(max(0.0, (frame.time or 0.0) - self._start_s) * SECOND_NS)
                end_ns = media_ns + self._period_ns
                if play != self._play or self._closed:
                    return
                if number == 0 or offset_ns + end_ns >= self._media_ns:
                    width, height, stride, pixels = self._scaler.pixels(frame)
                    yield VideoFrame(
                        number=number,
                        width=width,
                        height=height,
                        stride=stride,
                        pixels=pixels,
                        due_ns=offset_ns + media_ns,
                        age_ns=0,
                        period_ns=self._period_ns,
                    )
                number += 1
            if end_ns == 0:
                raise VideoError("it does not contain any frames")
            offset_ns += end_ns

    def _queue_frame(self, frame: VideoFrame, play: int) -> bool:
        """Queue a frame when there is room; return False if the playback has been restarted or ended."""
        with self._changed:
            while len(self._frames) >= _MAX_QUEUED and play == self._play and not self._closed:
                self._changed.wait()
            if play != self._play or self._closed:
                return False
            if frame.number == 0:
                self._first = frame
            self._frames.append(frame)
        return True


@dataclass(frozen=True, slots=True)
class VideosFound:
    """The result of opening a study's videos: a description, and the reason why one cannot be used, or ""."""

    about: str
    fault: str = ""


class Videos:
    """The videos that the conditions of a study show.

    Parameters
    ----------
    folder : Path
        The folder of the study's file; paths of footage are relative to it.
    camera : str
        The camera of this machine, as for `Camera`; "" for the system's default.
    """

    def __init__(self, protocol: Protocol, folder: Path, camera: str, now_ns: Callable[[], int]) -> None:
        shown = [condition for condition in protocol.conditions.values() if condition.shows_video]
        self.views = tuple(sorted({condition.view for condition in shown}))
        self._hashes = {condition.view: condition.footage_sha256 for condition in shown if condition.footage_sha256}
        self._folder, self._camera, self._now_ns = folder, camera or USUAL, now_ns
        varies_delay = any(stimulus.vary == DELAY for stimulus in protocol.stimuli.values())
        self._holds_s = (
            MOST_DELAY_MS / 1000
            if varies_delay
            else max((condition.delay_ms for condition in shown), default=0.0) / 1000
        )
        self._open: dict[str, Camera | Footage] = {}
        self._opening = threading.Lock()
        self._changing = threading.Lock()
        self._closed = False

    def open(self) -> VideosFound:
        """Open the videos that are not yet open or have failed; return the result."""
        with self._opening:
            for view in self.views:
                previous = self._open.get(view)
                if previous is not None and previous.works:
                    continue
                try:
                    if previous is not None:
                        previous.close()
                    self._store_source(view, self._open_source(view))
                except VideoError as error:
                    return VideosFound("every video in the study must be playable", str(error))
        return VideosFound("; ".join(self._descriptions()))

    def reopen(self) -> None:
        """Open the videos that have failed during a session.

        Raises
        ------
        VideoError
            A video cannot be opened; the message omits the name of the source, which would reveal the condition.
        """
        if self.open().fault:
            raise VideoError("one of the study's videos cannot be opened: check the camera and the files")

    def source(self, view: str) -> Camera | Footage:
        return self._open[view]

    def fit(self, width: int, height: int) -> None:
        for source in self._open.values():
            source.fit(width, height)

    def describe(self) -> dict[str, Any]:
        """Return the description for the receipt; it does not reveal which condition shows which video."""
        description: dict[str, Any] = {"footage_sha256": sorted(set(self._hashes.values()))} if self._hashes else {}
        if isinstance(camera := self._open.get(_CAMERA), Camera):
            age_ns = camera.newest.age_ns
            description["camera"] = {
                "source": without_login(camera.source),
                "size": list(camera.size),
                "rate_hz": round(1e9 / camera.newest.period_ns, 3),
                "age": "unknown" if age_ns is None else "from the source's time stamps",
            }
        return description

    def close(self) -> None:
        with self._changing:
            self._closed = True
            sources = tuple(self._open.values())
        for source in sources:
            source.close()

    def _store_source(self, view: str, source: Camera | Footage) -> None:
        """Store an open source; close it if all were closed meanwhile."""
        with self._changing:
            closed = self._closed
            if not closed:
                self._open = {**self._open, view: source}
        if closed:
            source.close()
            raise VideoError("the videos have been closed")

    def _open_source(self, view: str) -> Camera | Footage:
        if view == _CAMERA:
            return Camera(self._camera, self._now_ns, self._holds_s)
        path = self._folder / view
        if file_hash(path) not in (None, self._hashes.get(view)):
            raise VideoError(f"{path} has changed since the study began: restore the original file")
        return Footage(path)

    def _descriptions(self) -> Iterable[str]:
        for view, source in self._open.items():
            if isinstance(source, Camera) and view == _CAMERA:
                age_ns = source.newest.age_ns
                age = "age unknown" if age_ns is None else f"{age_ns / 1e6:.0f} ms old"
                yield f"camera, {source.size[0]} × {source.size[1]}, {1e9 / source.newest.period_ns:.3g} Hz, {age}"
        if count := sum(isinstance(source, Footage) for source in self._open.values()):
            yield f"footage, {counted(count, 'file')}"


def missing_on_computer(protocol: Protocol, folder: Path, camera: str, now_ns: Callable[[], int]) -> str:
    """Return the reason why this computer cannot show the study's videos, or "".

    Raises
    ------
    VideoError
        Footage cannot be shown on any computer; one line gives the reason.
    """
    views = {condition.view for condition in protocol.conditions.values() if condition.shows_video}
    if views and not is_installed():
        return f"a video {EXTRA}"
    for view in sorted(views - {_CAMERA}):
        Footage(folder / view).close()
    try:
        if _CAMERA in views:
            Camera(camera or USUAL, now_ns, holds_s=0.0).close()
    except VideoError as error:
        return str(error)
    return ""
