"""What goes into a trial's recording: every tick from shortly before its first frame until its tank is left.

The ticks before it make the recording complete in itself: they hold whatever the force was still fading from, so that
every force of the trial can be computed again from the recording alone.
"""

from collections import deque
from typing import Any

from study_app.session.ports import RecorderPort
from study_app.video.frames import VideoFrame

LEAD_S = 0.6  # longer than the slowest fade


class Recording:
    """Hands the samples of trials, and the frames shown in them, to the recorder; without one it does nothing.

    Parameters
    ----------
    recorder : RecorderPort or None
        Where they go.
    rate_hz : float
        The servo's nominal rate.
    """

    def __init__(self, recorder: RecorderPort | None, rate_hz: float) -> None:
        self._recorder = recorder
        self._rate_hz = rate_hz
        self._lead = round(LEAD_S * rate_hz)
        self._before: deque[Any] = deque()
        self._held = 0
        self._running = False

    def take(self, samples: Any) -> None:
        """Take the newest samples, in order (array of ``layout.SAMPLE``), which are not changed afterwards."""
        if self._recorder is None or len(samples) == 0:
            return
        if self._running:
            self._recorder.append(samples)
        self._before.append(samples)
        self._held += len(samples)
        while self._held - len(self._before[0]) >= self._lead:
            self._held -= len(self._before.popleft())

    def forget(self) -> None:
        """Drop what came before: the servo was started again, so nothing felt from here on goes on from it."""
        self._before.clear()
        self._held = 0

    def start(self, trial: int, attempt: int, interval: int | None = None) -> None:
        """Begin the recording of a trial or of one of its intervals, with what came just before it."""
        if self._recorder is None:
            return
        self._recorder.start(trial, attempt, self._rate_hz, interval)
        self._running = True
        spare = max(self._held - self._lead, 0)
        for index, samples in enumerate(self._before):
            self._recorder.append(samples[spare:] if index == 0 else samples)

    def frame(self, painted_ns: int, sample_ns: int, video: VideoFrame | None = None) -> None:
        """Take a frame that was painted at one moment and showed another [ns], and the frame of a video in it."""
        if self._recorder is not None and self._running:
            self._recorder.frame(painted_ns, sample_ns, video)

    def stop(self) -> None:
        """End the recording."""
        if self._recorder is not None and self._running:
            self._recorder.stop()
        self._running = False
