"""Statistics of the video in a trial: frames shown, late and lost, and the age of the camera's pictures."""

from typing import Any

from study_app.video.frames import VideoFrame


class VideoStatistics:
    """Counts the frames of a video as they are painted; without a frame there are no statistics."""

    def __init__(self) -> None:
        self._number: int | None = None
        self._frames = self._late = self._lost = 0
        self._most_ns: int | None = None
        self._ages_ns: list[int] = []

    def frame(self, painted_ns: int, video: VideoFrame, delay_s: float) -> None:
        """Add the video frame that was painted at a time [ns], with the delay requested then [s]."""
        if video.number == self._number:
            return
        error_ns = painted_ns - video.due_ns - round(delay_s * 1e9)
        self._most_ns = error_ns if self._most_ns is None else max(self._most_ns, error_ns)
        self._late += error_ns > video.period_ns
        self._lost += 0 if self._number is None else max(0, video.number - self._number - 1)
        self._number = video.number
        self._frames += 1
        if video.age_ns is not None:
            self._ages_ns.append(video.age_ns)

    def columns(self) -> dict[str, Any]:
        """Return the columns of the trial's row, None without a video."""
        seen = self._frames > 0
        ages_ns = self._ages_ns
        return {
            "video_frames": self._frames if seen else None,
            "video_frames_late": self._late if seen else None,
            "video_frames_lost": self._lost if seen else None,
            "video_delay_error_max_ms": None if self._most_ns is None else self._most_ns * 1e-6,
            "video_age_mean_ms": sum(ages_ns) / len(ages_ns) * 1e-6 if ages_ns else None,
        }
