"""The health of a session: ticks, lateness, screen frames and the hand's recent path in ring buffers, without Qt."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from study_app.haptics.model.layout import LIMITERS as ALL_LIMITERS
from study_app.number_text import THIN_SPACE, duration_text, grouped
from study_app.protocol.model import Protocol

Floats = NDArray[np.float64]
Verdict = Literal["ok", "late", "open"]

_LATENESS_WINDOW_S = 60
_RATE_WINDOW_TICKS = 2000
TRACE_WINDOW_S = 10.0
_TRACE_STEP_S = 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class Vitals:
    """Figures of the tiles; a rate or percentile is None until enough has been measured.

    ``refreshes_missed`` are the refreshes of the participant's screen, out of the total, without a new frame of the
    tank. ``delay_ticks`` is the force delay that the servo currently assumes, ``first_delay_ticks`` that at the start.
    """

    rate_hz: float | None = None
    lateness_p99_s: float | None = None
    overruns: int = 0
    ticks: int = 0
    refreshes: int = 0
    refreshes_missed: int = 0
    frame_rate_hz: float | None = None
    delay_ticks: int = 0
    first_delay_ticks: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Tile:
    """A number with its unit, a verdict, and a line with the reference for the verdict."""

    title: str
    value: str
    unit: str
    verdict: Verdict
    line: str


class ServoHealth:
    """Collects telemetry and painted frames, and provides figures, a histogram and traces.

    Rates are requested rates; ``overruns`` is the servo's own count, set by the caller.
    """

    def __init__(self, rate_hz: float, refresh_hz: float = 60.0) -> None:
        self.rate_hz = rate_hz
        self.refresh_hz = refresh_hz
        self.lateness_ns = np.zeros(int(_LATENESS_WINDOW_S * rate_hz), np.int64)
        self._latenesses = 0
        self._recent = np.zeros((_RATE_WINDOW_TICKS, 2), np.int64)  # tick, time [ns]
        self._ticks = 0
        self.overruns = 0
        self._delay_ticks = self._first_delay_ticks = 0
        self._frame_gaps_ns = np.zeros(240, np.int64)
        self._last_frame_ns = 0
        self._frames = 0
        self._refreshes = 0
        self._missed = 0
        rows = round(TRACE_WINDOW_S / _TRACE_STEP_S) + 2
        self._path = np.full((rows, 4), np.nan)  # t [s], x, y, z [m]
        self._path_rows = 0

    def add_samples(self, samples: Any) -> None:
        """Add new telemetry samples, in order (a recarray of ``layout.SAMPLE``)."""
        count = len(samples)
        if count == 0:
            return
        _write_to_ring(self.lateness_ns, self._latenesses, np.asarray(samples.lateness_ns))
        _write_to_ring(self._recent, self._ticks, np.column_stack((samples.tick, samples.time_ns)))
        if self._ticks == 0:
            self._first_delay_ticks = int(samples.delay_ticks[0])
        self._delay_ticks = int(samples.delay_ticks[-1])
        self._latenesses += count
        self._ticks += count

    def add_hand_position(self, at_s: float, position_m: Any) -> None:
        """Add the hand's position [m, hand frame], unless the last one is less than a trace step ago."""
        if self._path_rows and at_s < self._path[(self._path_rows - 1) % len(self._path), 0] + _TRACE_STEP_S:
            return
        self._path[self._path_rows % len(self._path)] = (at_s, *position_m)
        self._path_rows += 1

    def add_frame(self, painted_ns: int) -> None:
        """Add the time at which a frame of the tank was painted, and count the refreshes missed since the last one.

        The lateness of a frame's content is recorded elsewhere: in the trial's row (``frames_late``).
        """
        if self._last_frame_ns:
            gap = painted_ns - self._last_frame_ns
            self._frame_gaps_ns[self._frames % len(self._frame_gaps_ns)] = gap
            self._frames += 1
            refreshes = max(1, round(gap * 1e-9 * self.refresh_hz))
            self._refreshes += refreshes
            self._missed += refreshes - 1
        self._last_frame_ns = painted_ns

    def pause_frames(self) -> None:
        """Pause the count of missed refreshes while the tank is hidden."""
        self._last_frame_ns = 0

    def vitals(self) -> Vitals:
        gaps = self._frame_gaps_ns[: min(self._frames, len(self._frame_gaps_ns))]
        return Vitals(
            rate_hz=self._rate_hz(),
            lateness_p99_s=float(np.percentile(self._recent_latenesses(), 99)) * 1e-9 if self._latenesses else None,
            overruns=self.overruns,
            ticks=self._ticks,
            refreshes=self._refreshes,
            refreshes_missed=self._missed,
            frame_rate_hz=1e9 / float(np.median(gaps)) if len(gaps) else None,
            delay_ticks=self._delay_ticks,
            first_delay_ticks=self._first_delay_ticks,
        )

    @property
    def latenesses_us(self) -> Floats:
        """The latenesses of the last minute's ticks [µs] (n,)."""
        return self._recent_latenesses().astype(np.float64) * 1e-3

    def trace(self, now_s: float) -> tuple[Floats, Floats]:
        """Return times before now [s] (n,), oldest first, and positions [m] (n, 3) of the last ten seconds."""
        count = min(self._path_rows, len(self._path))
        path = np.roll(self._path, -(self._path_rows % len(self._path)), axis=0)[len(self._path) - count :]
        path = path[path[:, 0] >= now_s - TRACE_WINDOW_S]
        return path[:, 0] - now_s, path[:, 1:]

    def _recent_latenesses(self) -> NDArray[np.int64]:
        return self.lateness_ns[: min(self._latenesses, len(self.lateness_ns))]

    def _rate_hz(self) -> float | None:
        count = min(self._ticks, len(self._recent))
        if count < 2:
            return None
        newest = self._recent[(self._ticks - 1) % len(self._recent)]
        oldest = self._recent[(self._ticks - count) % len(self._recent)]
        ticks, time_ns = newest - oldest
        return float(ticks) * 1e9 / float(time_ns) if time_ns > 0 else None


def _write_to_ring(ring: NDArray[Any], written: int, rows: NDArray[Any]) -> None:
    """Write ``rows`` into ``ring``, over the oldest ones; ``written`` is the number of earlier rows."""
    skipped = max(0, len(rows) - len(ring))
    rows = rows[skipped:]
    start = (written + skipped) % len(ring)
    first = min(len(rows), len(ring) - start)
    ring[start : start + first] = rows[:first]
    ring[: len(rows) - first] = rows[first:]


def health_tiles(vitals: Vitals, rate_hz: float, limit_s: float) -> tuple[Tile, ...]:
    """Return the tiles of the operator's window; ``rate_hz`` is the requested rate, ``limit_s`` the lateness limit."""
    rate = vitals.rate_hz
    p99 = vitals.lateness_p99_s
    p99_value, _, p99_unit = duration_text(p99).partition(" ") if p99 is not None else ("–", "", "")
    screen = f", {vitals.frame_rate_hz:.1f} Hz" if vitals.frame_rate_hz else ""
    return (
        Tile(
            title="Servo rate",
            value="–" if rate is None else f"{rate:.1f}",
            unit="Hz",
            verdict="open" if rate is None else _verdict(abs(rate - rate_hz) <= 0.01 * rate_hz),
            line=f"of {rate_hz:.0f} Hz",
        ),
        Tile(
            title="Lateness, p99",
            value=p99_value,
            unit=p99_unit,
            verdict="open" if p99 is None else _verdict(p99 <= limit_s),
            line=f"limit {duration_text(limit_s)}",
        ),
        Tile(
            title="Overruns",
            value=grouped(vitals.overruns),
            unit="",
            verdict="open" if vitals.ticks == 0 else _verdict(vitals.overruns <= vitals.ticks * 1e-4),
            line=f"of {grouped(vitals.ticks)} ticks",
        ),
        Tile(
            title="Refreshes missed",
            value=grouped(vitals.refreshes_missed),
            unit="",
            verdict="open" if vitals.refreshes == 0 else _verdict(vitals.refreshes_missed <= 0.01 * vitals.refreshes),
            line=f"of {grouped(vitals.refreshes)}{screen}",
        ),
    )


def _verdict(within: bool) -> Verdict:
    return "ok" if within else "late"


_STEP_NS = round(_TRACE_STEP_S * 1e9)
_ROWS = round(TRACE_WINDOW_S / _TRACE_STEP_S) + 2
_LIMITERS = tuple(limiter for limiter in ALL_LIMITERS if not limiter.expected)
"""The limiters that are counted; fading in and the stop are expected, and shown elsewhere."""
FORCE, SIZE = slice(0, 3), 3


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceFigures:
    """The force of the current or last trial relative to its limit (now, maximum), and ticks by limiter.

    ``withheld`` is the fraction of the force that limits, passivity controller and device have withheld so far.
    """

    share: float
    most: float
    limiters: tuple[tuple[str, int], ...]
    withheld: float = 0.0


def force_rows(protocol: Protocol, forces: ForceFigures | None) -> tuple[tuple[str, str], ...]:
    """Return the rows of relative force, limited ticks and withheld force; double-blind, their values are "hidden"."""
    share, limiters = f"Force relative to {protocol.device.force_limit_n:g} N", "Limited ticks"
    withheld = f"Force held back, limit {protocol.limits.withheld_percent:g}{THIN_SPACE}%"
    if protocol.study.blinding == "double":
        return (share, "hidden"), (limiters, "hidden"), (withheld, "hidden")
    if forces is None:
        return (share, "–"), (limiters, "–"), (withheld, "–")
    by_count = sorted(forces.limiters, key=lambda counted: -counted[1])
    return (
        (share, f"{forces.share:.0%}, peak {forces.most:.0%}".replace("%", f"{THIN_SPACE}%")),
        (limiters, ", ".join(f"{name} {grouped(ticks)}" for name, ticks in by_count) or "none"),
        (withheld, f"{forces.withheld:.1%}".replace("%", f"{THIN_SPACE}%")),
    )


class Forces:
    """Collects telemetry; it keeps the strongest force of every 20 ms, so that no peak is missed."""

    def __init__(self, limit_n: float) -> None:
        self.limit_n = limit_n
        self._steps = np.full(_ROWS, -1, np.int64)  # the number of each row's 20 ms on the servo's clock
        self._rows = np.zeros((_ROWS, 4))  # x, y, z, size [N]
        self._written = 0
        self._scene = 0
        self._now_n = self._most_n = 0.0
        self._limited = np.zeros(len(_LIMITERS), np.int64)
        self._sums_n = np.zeros(2)  # permitted, withheld

    def add_samples(self, samples: Any) -> None:
        """Add new samples, in order (a recarray of ``layout.SAMPLE``)."""
        if len(samples) == 0:
            return
        rows = np.empty((len(samples), 4))
        rows[:, FORCE] = samples["device_force_n"]
        rows[:, SIZE] = np.sqrt(np.einsum("ij,ij->i", rows[:, FORCE], rows[:, FORCE]))
        self._keep_rows(samples["time_ns"] // _STEP_NS, rows)
        self._count_samples(samples, rows[:, SIZE])

    def trace(self, now_ns: int) -> tuple[Floats, Floats]:
        """Return times before now [s] (n,), oldest first, and forces [N] (n, 4: x, y, z, size)."""
        count = min(self._written, _ROWS)
        order = np.arange(self._written - count, self._written) % _ROWS
        times_s: Floats = (self._steps[order] * _STEP_NS - now_ns).astype(np.float64) * 1e-9
        recent = times_s >= -TRACE_WINDOW_S
        return times_s[recent], self._rows[order][recent]

    def figures(self) -> ForceFigures:
        counted = tuple(
            (limiter.label.lower(), int(count))
            for limiter, count in zip(_LIMITERS, self._limited, strict=True)
            if count
        )
        permitted_n, withheld_n = self._sums_n
        withheld = float(withheld_n / permitted_n) if permitted_n > 0 else 0.0
        return ForceFigures(
            share=self._now_n / self.limit_n, most=self._most_n / self.limit_n, limiters=counted, withheld=withheld
        )

    def _keep_rows(self, steps: NDArray[np.int64], rows: Floats) -> None:
        starts = np.concatenate(([0], np.flatnonzero(np.diff(steps)) + 1))
        for first, end in zip(starts, (*starts[1:], len(steps)), strict=True):
            strongest = rows[first + int(np.argmax(rows[first:end, SIZE]))]
            newest = (self._written - 1) % _ROWS
            if self._written == 0 or self._steps[newest] != steps[first]:
                newest = self._written % _ROWS
                self._steps[newest], self._rows[newest] = steps[first], strongest
                self._written += 1
            elif strongest[SIZE] > self._rows[newest, SIZE]:
                self._rows[newest] = strongest

    def _count_samples(self, samples: Any, sizes_n: Floats) -> None:
        """Update the counts and the strongest force of the newest scene; rest (scene 0) does not count."""
        scenes = samples["scene"]
        self._now_n = float(sizes_n[-1])
        active = scenes[scenes != 0]
        if len(active) == 0:
            return
        if active[-1] != self._scene:
            self._scene, self._most_n = int(active[-1]), 0.0
            self._limited[:] = 0
            self._sums_n[:] = 0
        is_newest = scenes == self._scene
        self._most_n = max(self._most_n, float(sizes_n[is_newest].max()))
        self._sums_n += samples["permitted_n"][is_newest].sum(), samples["withheld_n"][is_newest].sum()
        limited = samples["limiters"][is_newest]
        if limited.any():
            self._limited += np.count_nonzero(
                limited[:, None] & np.array([limiter.bit for limiter in _LIMITERS]), axis=0
            )
