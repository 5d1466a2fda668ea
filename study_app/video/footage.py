"""Footage: a file played in a loop from the beginning of each trial; decoded in a separate thread."""

import threading
from collections import deque
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from study_app.errors import VideoError
from study_app.video.decoding import SECOND_NS, Scaler, make_less_urgent, open_video, period_ns, reason
from study_app.video.frames import VideoFrame, stopped

AHEAD: Final = 15
"""Capacity for decoded frames: half a second at 30 Hz, 45 MB at 1152 x 648 pixels. [choice]"""
PATIENCE_S: Final = 5.0


class Footage:
    """A video file as a source.

    Raises
    ------
    VideoError
        It cannot be read as a video.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            with open_video(str(path)) as container:
                stream = container.streams.video[0]
                self._period_ns = period_ns(stream)
                if (first := next(container.decode(stream), None)) is None:
                    raise VideoError("it holds no frame")  # noqa: TRY301 - said with the file's name below
                self._start_s = first.time or 0.0
                self.size = (stream.width, stream.height)
        except Exception as error:
            raise VideoError(f"{path} cannot be shown: {reason(error)}") from error
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
        self.thread = threading.Thread(target=self._work, name="footage", daemon=True)
        self.thread.start()

    @property
    def works(self) -> bool:
        """Whether it can still be read."""
        return self.thread.is_alive()

    @property
    def rate_hz(self) -> float:
        """Frames per second."""
        return SECOND_NS / self._period_ns

    def fit(self, width: int, height: int) -> None:
        """Scale later frames so that they fit into this many pixels."""
        self._scaler.size = (width, height)

    def rewind(self) -> None:
        """Restart the footage; its first frame is stored, so that a trial need not wait for the decoder."""
        with self._changed:
            self._play += 1
            self._frames.clear()
            self._shown, self._began_ns, self._media_ns = self._first, None, 0
            self._changed.notify_all()

    def begin(self, at_ns: int) -> None:
        """Run from this time on [ns, servo's clock]; until then the first frame is shown."""
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
            if len(self._frames) <= AHEAD // 2:  # rarely: the decoder competes with painting for the interpreter lock
                self._changed.notify_all()
            if self._failure and not self._frames:
                raise stopped(self._failure)
            shown = self._shown
        return None if shown is None else replace(shown, due_ns=began_ns + shown.due_ns)

    def close(self) -> None:
        """Close the file."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self.thread.join(PATIENCE_S)

    def _work(self) -> None:
        make_less_urgent()
        try:
            with open_video(str(self.path)) as container:
                while not self._closed:
                    play = self._play
                    for frame in self._decoded(container, play):
                        if not self._put(frame, play):
                            break
        except Exception as error:  # noqa: BLE001 - FFmpeg's errors have no common base but this
            with self._changed:
                self._failure = reason(error)

    def _decoded(self, container: Any, play: int) -> Iterator[VideoFrame]:
        """Yield the frames in a loop from the beginning; overdue ones except the first are not scaled."""
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
                    yield VideoFrame(number, width, height, stride, pixels, offset_ns + media_ns, 0, self._period_ns)
                number += 1
            if end_ns == 0:
                raise VideoError("it holds no frame")
            offset_ns += end_ns

    def _put(self, frame: VideoFrame, play: int) -> bool:
        """Queue a frame when there is room; return whether it is still needed."""
        with self._changed:
            while len(self._frames) >= AHEAD and play == self._play and not self._closed:
                self._changed.wait()
            if play != self._play or self._closed:
                return False
            if frame.number == 0:
                self._first = frame
            self._frames.append(frame)
        return True
