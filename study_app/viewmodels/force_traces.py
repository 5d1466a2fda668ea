"""Force and wake as the operator of a single-blind study sees them: the last ten seconds, shares and limiters. No Qt.

In a double-blind study nothing of this is made: the bridge then reads no force at all.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from study_app.haptics.model.layout import LIMITER_FADE, LIMITER_STOP
from study_app.lab.limiters import WORDS
from study_app.protocol.model import Protocol
from study_app.viewmodels.number_words import THIN_SPACE, grouped
from study_app.viewmodels.servo_health import TRACE_STEP_S, TRACE_WINDOW_S

Floats = NDArray[np.float64]

STEP_NS = round(TRACE_STEP_S * 1e9)
ROWS = round(TRACE_WINDOW_S / TRACE_STEP_S) + 2
LIMITERS = tuple(bit for bit in WORDS if bit not in {LIMITER_FADE, LIMITER_STOP})
"""Limiters that are counted: fading in and the stop are no sign of anything, and are said elsewhere."""
FORCE, SIZE, WAKE = slice(0, 3), 3, 4


@dataclass(frozen=True, slots=True)
class ForceFigures:
    """Of the trial under way, or the last: the force's share of its limit (now, most), and ticks by limiter.

    ``withheld`` is the share of the force so far that limits, passivity controller and device withheld.
    """

    share: float
    most: float
    limiters: tuple[tuple[str, int], ...]
    withheld: float = 0.0


def force_rows(protocol: Protocol, forces: ForceFigures | None) -> tuple[tuple[str, str], ...]:
    """Return share of the limit, limiters and force withheld, or that they are hidden; as many rows in either case."""
    share, limiters = f"Force, share of {protocol.device.force_limit_n:g} N", "Limiters acted"
    withheld = f"Force withheld, limit {protocol.limits.withheld_percent:g}{THIN_SPACE}%"
    if protocol.study.blinding == "double":
        return (share, "hidden"), (limiters, "hidden"), (withheld, "hidden")
    if forces is None:
        return (share, "–"), (limiters, "–"), (withheld, "–")
    most_first = sorted(forces.limiters, key=lambda counted: -counted[1])
    return (
        (share, f"{forces.share:.0%}, most {forces.most:.0%}".replace("%", f"{THIN_SPACE}%")),
        (limiters, ", ".join(f"{name} {grouped(ticks)}" for name, ticks in most_first) or "none"),
        (withheld, f"{forces.withheld:.1%}".replace("%", f"{THIN_SPACE}%")),
    )


class Forces:
    """Takes telemetry as it comes; of every 20 ms it keeps the strongest force, so that no peak is missed."""

    def __init__(self, limit_n: float) -> None:
        self.limit_n = limit_n
        self._steps = np.full(ROWS, -1, np.int64)  # which 20 ms, on the servo's clock
        self._rows = np.zeros((ROWS, 5))  # x, y, z, size [N], wake [m/s]
        self._written = 0
        self._scene = 0
        self._now_n = self._most_n = 0.0
        self._limited = np.zeros(len(LIMITERS), np.int64)
        self._sums_n = np.zeros(2)  # permitted, withheld

    def take(self, samples: Any) -> None:
        """Take new samples, in order (a recarray of ``layout.SAMPLE``)."""
        if len(samples) == 0:
            return
        rows = np.empty((len(samples), 5))
        rows[:, FORCE] = samples["device_force_n"]
        rows[:, SIZE] = np.sqrt(np.einsum("ij,ij->i", rows[:, FORCE], rows[:, FORCE]))
        rows[:, WAKE] = np.sqrt(np.einsum("ij,ij->i", samples["wake_mps"], samples["wake_mps"]))
        self._keep(samples["time_ns"] // STEP_NS, rows)
        self._count(samples, rows[:, SIZE])

    def trace(self, now_ns: int) -> tuple[Floats, Floats, Floats]:
        """Return times before now [s] (n,), oldest first, forces [N] (n, 4: x, y, z, size) and wake speeds [m/s]."""
        kept = min(self._written, ROWS)
        order = np.arange(self._written - kept, self._written) % ROWS
        times_s: Floats = (self._steps[order] * STEP_NS - now_ns).astype(np.float64) * 1e-9
        recent = times_s >= -TRACE_WINDOW_S
        rows = self._rows[order][recent]
        return times_s[recent], rows[:, : SIZE + 1], rows[:, WAKE]

    def figures(self) -> ForceFigures:
        """Return shares and counts as of now."""
        counted = tuple(
            (WORDS[bit].lower(), int(count)) for bit, count in zip(LIMITERS, self._limited, strict=True) if count
        )
        permitted_n, withheld_n = self._sums_n
        withheld = float(withheld_n / permitted_n) if permitted_n > 0 else 0.0
        return ForceFigures(self._now_n / self.limit_n, self._most_n / self.limit_n, counted, withheld)

    def _keep(self, steps: NDArray[np.int64], rows: Floats) -> None:
        firsts = np.concatenate(([0], np.flatnonzero(np.diff(steps)) + 1))
        for first, end in zip(firsts, (*firsts[1:], len(steps)), strict=True):
            strongest = rows[first + int(np.argmax(rows[first:end, SIZE]))]
            newest = (self._written - 1) % ROWS
            if self._written == 0 or self._steps[newest] != steps[first]:
                newest = self._written % ROWS
                self._steps[newest], self._rows[newest] = steps[first], strongest
                self._written += 1
            elif strongest[SIZE] > self._rows[newest, SIZE]:
                self._rows[newest] = strongest

    def _count(self, samples: Any, sizes_n: Floats) -> None:
        """Count limiters, forces and the strongest one of the newest scene that is none of rest."""
        scenes = samples["scene"]
        self._now_n = float(sizes_n[-1])
        felt = scenes[scenes != 0]
        if len(felt) == 0:
            return
        if felt[-1] != self._scene:
            self._scene, self._most_n = int(felt[-1]), 0.0
            self._limited[:] = 0
            self._sums_n[:] = 0
        here = scenes == self._scene
        self._most_n = max(self._most_n, float(sizes_n[here].max()))
        self._sums_n += samples["permitted_n"][here].sum(), samples["withheld_n"][here].sum()
        acted = samples["limiters"][here]
        if acted.any():
            self._limited += np.count_nonzero(acted[:, None] & np.array(LIMITERS), axis=0)
