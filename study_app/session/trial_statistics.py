"""What is measured of one trial while it runs: the servo's timing, the hand, the force, and the age of what was seen.

Nothing here names the requested delay: only the achieved one less the requested is kept.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from study_app.haptics.model.layout import LIMITER_GLITCH, LIMITER_NAMES, SAMPLE
from study_app.haptics.runtime.telemetry import timing
from study_app.video.frames import VideoFrame
from study_app.video.statistics import VideoStatistics

_TIMES = np.dtype([(name, SAMPLE[name]) for name in ("tick", "time_ns", "lateness_ns")])


class TrialStatistics:
    """Adds up samples and frames as they come.

    Parameters
    ----------
    rate_hz : float
        The servo's nominal rate.
    late_s : float
        A frame counts as late if its delay is more than this over the one asked for [s].
    due_ns : int
        When the trial's first frame was due: when its page was asked for [ns].
    paints : bool
        Whether frames come as long as the trial runs; else its first frame may be the only one.
    videos : bool
        Whether a condition of the study shows a video.
    """

    def __init__(
        self, *, rate_hz: float, late_s: float, due_ns: int, paints: bool = True, videos: bool = False
    ) -> None:
        self._video = VideoStatistics() if videos else None
        self._rate_hz = rate_hz
        self._late_s = late_s
        self._fewest = 1 if paints else 2  # frames before the first of them can have stood
        self._times: list[Any] = []
        self._errors_s: list[float] = []
        self._painted_ns = due_ns
        self._first_gap_ns = 0
        self._frame_gap_ns = 0
        self._last_m: NDArray[np.float64] | None = None
        self._path_m = 0.0
        self._force_sum_n = 0.0
        self._force_peak_n = 0.0
        self._limited = np.zeros(len(LIMITER_NAMES), np.int64)
        self._permitted_sum_n = 0.0
        self._withheld_sum_n = 0.0
        self._delay_ticks: int | None = None
        self._most_delay_ticks = 0
        self._delay_changes = 0

    def feed(self, samples: Any) -> None:
        """Take the next samples, in order (recarray of ``layout.SAMPLE``)."""
        if len(samples) == 0:
            return
        times = np.empty(len(samples), _TIMES)
        for name in _TIMES.fields or ():
            times[name] = samples[name]
        self._times.append(times)
        self._move(samples["position_m"][samples["limiters"] & LIMITER_GLITCH == 0])
        force_n = np.sqrt(np.einsum("ij,ij->i", samples["device_force_n"], samples["device_force_n"]))
        self._force_sum_n += float(force_n.sum())
        self._force_peak_n = max(self._force_peak_n, float(force_n.max()))
        self._permitted_sum_n += float(samples["permitted_n"].sum())
        self._withheld_sum_n += float(samples["withheld_n"].sum())
        self._follow_delay(samples["delay_ticks"])
        limiters = samples["limiters"]
        if limiters.any():
            bits = np.arange(len(LIMITER_NAMES))
            self._limited += ((limiters[:, None] >> bits) & 1).sum(axis=0)

    def frame(self, painted_ns: int, shown_ns: int, delay_s: float, video: VideoFrame | None = None) -> None:
        """Take a frame that was painted at one moment and showed another [ns], at the delay then asked for [s].

        ``video`` is the frame of a video in it.
        """
        if self._video is not None and video is not None:
            self._video.frame(painted_ns, video, delay_s)
        gap_ns = painted_ns - self._painted_ns
        if self._errors_s:
            self._frame_gap_ns = max(self._frame_gap_ns, gap_ns)
        else:
            self._first_gap_ns = gap_ns
        self._painted_ns = painted_ns
        self._errors_s.append((painted_ns - shown_ns) * 1e-9 - delay_s)

    def frame_gap_ns(self, until_ns: int) -> int:
        """Return the longest time that a frame stood, the newest one until a moment [ns]; 0 before the first frame."""
        return max(self._frame_gap_ns, until_ns - self._painted_ns) if len(self._errors_s) >= self._fewest else 0

    def summary(self, *, samples_dropped: int, worst_gap_s: float, until_ns: int) -> dict[str, Any]:
        """Return the measured columns of the trial row, to six decimals; None where nothing was measured.

        Parameters
        ----------
        samples_dropped : int
            How many samples of the trial were not read.
        worst_gap_s : float
            The longest time between two ticks, as the servo kept it [s].
        until_ns : int
            When the trial ended: until then the last frame stood [ns].
        """
        return {
            name: round(value, 6) if isinstance(value, float) else value
            for name, value in self._columns(samples_dropped, worst_gap_s, until_ns).items()
        }

    def _columns(self, samples_dropped: int, worst_gap_s: float, until_ns: int) -> dict[str, Any]:
        times = np.concatenate([np.empty(0, _TIMES), *self._times]).view(np.recarray)
        timed = timing(times, self._rate_hz)
        ticks = timed.ticks
        elapsed_s = float(times.time_ns[-1] - times.time_ns[0]) * 1e-9 if ticks else 0.0
        return {
            "ticks": ticks,
            "tick_rate_hz": timed.rate_hz if ticks > 1 else None,
            "lateness_p99_ms": timed.lateness_p99_s * 1e3 if ticks else None,
            "worst_gap_ms": worst_gap_s * 1e3 if ticks else None,
            "overruns": timed.overruns,
            "samples_dropped": samples_dropped,
            "path_length_m": self._path_m,
            "mean_speed_mps": self._path_m / elapsed_s if elapsed_s > 0 else None,
            "force_mean_n": self._force_sum_n / ticks if ticks else None,
            "force_peak_n": self._force_peak_n if ticks else None,
            "withheld_share": self._withheld_sum_n / self._permitted_sum_n if self._permitted_sum_n > 0 else None,
            "loop_delay_ticks": self._most_delay_ticks if ticks else None,
            "loop_delay_changes": self._delay_changes if ticks else None,
            **{f"limiter_{name}": int(count) for name, count in zip(LIMITER_NAMES, self._limited, strict=True)},
            **self._frames(until_ns),
            **({} if self._video is None else self._video.columns()),
        }

    def _move(self, positions: NDArray[np.float64]) -> None:
        """Add the path through ``positions`` (n, 3) [m]; non-finite ones are left out."""
        finite = np.isfinite(positions).all(axis=1)
        places = positions if finite.all() else positions[finite]
        if self._last_m is not None:
            places = np.concatenate((self._last_m, places))
        if len(places) == 0:
            return
        steps = np.diff(places, axis=0)
        self._path_m += float(np.sqrt(np.einsum("ij,ij->i", steps, steps)).sum())
        self._last_m = places[-1:].copy()

    def _follow_delay(self, delay_ticks: NDArray[np.int64]) -> None:
        """Count how often the loop's delay (n,) [ticks] changed, and keep the longest."""
        before = int(delay_ticks[0]) if self._delay_ticks is None else self._delay_ticks
        self._delay_changes += int(np.count_nonzero(np.diff(delay_ticks, prepend=before)))
        self._most_delay_ticks = max(self._most_delay_ticks, int(delay_ticks.max()))
        self._delay_ticks = int(delay_ticks[-1])

    def _frames(self, until_ns: int) -> dict[str, Any]:
        errors_s = np.asarray(self._errors_s, np.float64)
        seen = errors_s.size > 0
        return {
            "frames": int(errors_s.size),
            "frames_late": int((errors_s > self._late_s).sum()),
            "delay_error_mean_ms": float(errors_s.mean()) * 1e3 if seen else None,
            "delay_error_p95_ms": float(np.percentile(errors_s, 95)) * 1e3 if seen else None,
            "delay_error_max_ms": float(errors_s.max()) * 1e3 if seen else None,
            "first_frame_gap_ms": self._first_gap_ns * 1e-6 if seen else None,
            "worst_frame_gap_ms": self.frame_gap_ns(until_ns) * 1e-6 if errors_s.size >= self._fewest else None,
        }
