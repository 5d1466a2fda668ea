"""Frames of a video, and their statistics in a trial: how many were shown, late or lost, and their age."""

from dataclasses import dataclass, field
from typing import Any, Protocol

from study_app.errors import VideoError


def stopped_error(reason: str) -> VideoError:
    """Return the error for a source that failed in a trial, without its name, since that would reveal the condition."""
    return VideoError(f"one of the study's videos stopped ({reason}): check the camera and the files")


@dataclass(frozen=True, slots=True, kw_only=True)
class VideoFrame:
    """A decoded frame.

    Attributes
    ----------
    number : int
        Its number in the source, from 0; lost frames are counted, too.
    width, height, stride : int
        Its size [px], and the number of bytes in a row.
    pixels : buffer
        Rows of 32-bit pixels: blue, green, red, unused.
    due_ns : int
        Display time without a delay [ns, servo's clock]: the time when it was ready, or its time in the footage.
    age_ns : int or None
        Age of the picture at that time, from the source's time stamps; None if unknown, 0 for footage.
    period_ns : int
        Time from one frame of the source to the next.
    """

    number: int
    width: int
    height: int
    stride: int
    pixels: Any = field(repr=False, compare=False)
    due_ns: int
    age_ns: int | None
    period_ns: int


class VideoSource(Protocol):
    """A source of frames; every method returns at once."""

    def rewind(self) -> None: ...

    def begin(self, at_ns: int) -> None:
        """Set the start of the trial [ns, servo's clock], from which footage runs."""

    def frame_at(self, moment_ns: int) -> VideoFrame | None:
        """Return the frame of a time [ns, servo's clock]; None if there is none yet.

        Raises
        ------
        VideoError
            The source failed.
        """

    def fit(self, width: int, height: int) -> None: ...


class VideoStatistics:
    """Statistics of the frames of a video that were painted."""

    def __init__(self) -> None:
        self._number: int | None = None
        self._frames = self._late = self._lost = 0
        self._max_error_ns: int | None = None
        self._ages_ns: list[int] = []

    def frame(self, painted_ns: int, video: VideoFrame, delay_s: float) -> None:
        """Add a video frame that was painted at ``painted_ns``, with the delay requested at that time."""
        if video.number == self._number:
            return
        error_ns = painted_ns - video.due_ns - round(delay_s * 1e9)
        self._max_error_ns = error_ns if self._max_error_ns is None else max(self._max_error_ns, error_ns)
        self._late += error_ns > video.period_ns
        self._lost += 0 if self._number is None else max(0, video.number - self._number - 1)
        self._number = video.number
        self._frames += 1
        if video.age_ns is not None:
            self._ages_ns.append(video.age_ns)

    def columns(self) -> dict[str, Any]:
        seen = self._frames > 0
        ages_ns = self._ages_ns
        return {
            "video_frames": self._frames if seen else None,
            "video_frames_late": self._late if seen else None,
            "video_frames_lost": self._lost if seen else None,
            "video_delay_error_max_ms": None if self._max_error_ns is None else self._max_error_ns * 1e-6,
            "video_age_mean_ms": sum(ages_ns) / len(ages_ns) * 1e-6 if ages_ns else None,
        }
