"""Estimates parameters of a liquid from a stream of measured force, or gives the reason without an estimate.

The drag coefficient alone follows each batch of rows by recursive least squares (`fits.RecursiveDrag`). With length and
scaling of the wake the newest rows are searched every 2 s of the stream (``wake_fit``). A value counts only if
the motion identifies it (``information``).
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from study_app.errors import StudyError
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.scene import Scene
from study_app.lab.estimation.fits import (
    DRAG,
    NAMES,
    NEEDED,
    LiquidModel,
    RecursiveDrag,
    WakeFit,
    WakeSearch,
    information,
    interval,
    refusal,
    values_of,
)
from study_app.lab.estimation.sources import GAP_S, Rows, joined, no_rows

MEMORY_S: Final = 10.0
LEAST_S: Final = 1.0
"""Least measured time for an estimate."""
SEARCH_S: Final = 2.0
"""Interval of stream time between two searches for the wake."""
KEPT_S: Final = 15.0
MISFIT: Final = 0.2
"""Share of the measured force: if the residual without noise exceeds it, the model does not fit the liquid. [choice]"""
_SURE: Final = 0.02
"""Likewise: if the residual exceeds it, the next search covers a wider range."""
_RATE_ROWS: Final = 20
_SLOWEST_HZ: Final = 50.0
_MOST_DRAG: Final = 10.0
"""Drag coefficients that the scene's model permits."""
WORDS: Final = {"drag_coefficient": "the drag coefficient", "length": "the length", "scaling": "the scaling"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """Values by name with their 95 % intervals, empty before the first estimate.

    ``identified`` tells whether the motion identifies them: only then may they be used. ``reason`` is why not, in a
    sentence. ``smallest`` is the smallest eigenvalue of the information matrix, of `NEEDED`. ``rms_n`` is that of the
    residual, ``force_rms_n`` that of the measured force [N]; ``seconds`` is the measured time.
    """

    values: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    identified: bool
    reason: str
    smallest: float = 0.0
    rms_n: float = 0.0
    force_rms_n: float = 0.0
    seconds: float = 0.0


NOTHING: Final = Estimate(values={}, intervals={}, identified=False, reason="nothing was measured yet")


class OnlineEstimator:
    """An online estimator that receives rows in batches.

    Parameters
    ----------
    scene : Scene
        With one liquid; the search starts from its values.
    names : tuple of str
        ``("drag_coefficient",)``, or with ``"length"``, ``"scaling"`` or both.
    memory_s : float
        Age at which a row has the weight 1/e [s].

    Raises
    ------
    StudyError
        A parameter that the liquid does not have, or that its force does not depend on.
    """

    def __init__(self, scene: Scene, names: tuple[str, ...] = (DRAG,), *, memory_s: float = MEMORY_S) -> None:
        if unknown := [name for name in names if name not in NAMES]:
            raise StudyError(f"{unknown[0]!r} cannot be estimated online: choose among {', '.join(NAMES)}")
        if DRAG not in names:
            raise StudyError(f"the drag coefficient is estimated with the wake: add {DRAG}")
        if why := refusal(scene, names):
            raise StudyError(why)
        self.names = names
        self._scene, self._memory_s = resolve(scene), memory_s
        self.restart()

    def restart(self) -> None:
        """Discard all rows: the next one is the first of a liquid at rest."""
        self._rate_hz: float | None = None
        self._waiting = no_rows()
        self._kept: list[Rows] = []
        self._last_s = math.nan
        self._seconds = 0.0
        self._model: LiquidModel | None = None
        self._drag = RecursiveDrag(self._memory_s)
        self._dropped = False
        self._searched_s = -math.inf
        self._known: dict[str, float] | None = None
        self.estimate = NOTHING

    def take(self, rows: Rows) -> None:
        """Process the next rows; a gap in time restarts the estimation.

        Raises
        ------
        StudyError
            The rate of rows is too low.
        """
        if len(rows) == 0:
            return
        gaps_s = np.diff(rows.t_s, prepend=self._last_s)
        if len(gaps := np.flatnonzero(gaps_s > GAP_S)):
            self.restart()
            rows = rows.part(int(gaps[-1]))
            missing = f"no force was measured for {gaps_s[gaps[-1]]:.2g} s, at most {GAP_S:g} s are permitted"
            self.estimate = replace(NOTHING, reason=f"{missing}: the estimation restarted")
        self._last_s = float(rows.t_s[-1])
        if self._rate_hz is None:
            self._waiting = joined(self._waiting, rows)
            if len(self._waiting) < _RATE_ROWS:
                return
            rows = self._waiting
            self._rate_hz = rate_of(rows)
        self._seconds += float(np.count_nonzero(rows.usable)) / self._rate_hz
        if self.names == (DRAG,):
            self._recur(rows)
        else:
            self._search(rows)

    def _recur(self, rows: Rows) -> None:
        """Update the estimate with rows by recursive least squares."""
        assert self._rate_hz is not None  # noqa: S101 - known before
        if self._model is None:
            self._model = LiquidModel(self._scene, self._rate_hz)
        g_n, h_n = self._model.follow(rows)
        self._drag.take(rows.t_s, g_n, rows.force_n - h_n, rows.usable)
        value = self._drag.value
        if self._seconds < LEAST_S or not math.isfinite(value):
            self.estimate = _waits(self._seconds)
            return
        variance_n2, following = self._drag.residual
        found = information(np.array([[value**2 * self._drag.normal_n2]]), variance_n2, following)
        fit = WakeFit(
            values={DRAG: value},
            information=found,
            following=following,
            rms_n=math.sqrt(3 * variance_n2),
            force_rms_n=self._drag.force_rms_n,
        )
        self.estimate = self._judged(fit)

    def _search(self, rows: Rows) -> None:
        assert self._rate_hz is not None  # noqa: S101 - known before
        self._kept.append(rows)
        if self._seconds < LEAST_S:
            self.estimate = _waits(self._seconds)
            return
        if self._last_s - self._searched_s < SEARCH_S:
            return
        self._searched_s = self._last_s
        kept = joined(*self._kept)
        if oldest := int(np.searchsorted(kept.t_s, kept.t_s[-1] - KEPT_S)):
            kept, self._dropped = kept.part(oldest), True
        self._kept = [kept]
        search = WakeSearch(
            self._scene, self.names, kept, self._rate_hz, from_rest=not self._dropped, memory_s=self._memory_s
        )
        from_values = values_of(self._scene) | (self._known or {})
        start = round(from_values["length"]), from_values["scaling"]
        fit = search.run(*start, anew=self._known is None)
        if fit is None:
            self.estimate, self._known = _waits(self._seconds), None
            return
        self.estimate = self._judged(fit)
        sure = self.estimate.identified and _misfit_n(fit) <= _SURE * fit.force_rms_n
        self._known = dict(fit.values) if sure else None

    def _judged(self, fit: WakeFit) -> Estimate:
        half = fit.information.half
        reason = self._doubt(fit)
        intervals = {n: interval(it, float(h)) for (n, it), h in zip(fit.values.items(), half, strict=True) if it > 0}
        return Estimate(
            values=fit.values,
            intervals=intervals,
            identified=not reason,
            reason=reason,
            smallest=fit.information.smallest,
            rms_n=fit.rms_n,
            force_rms_n=fit.force_rms_n,
            seconds=self._seconds,
        )

    def _doubt(self, fit: WakeFit) -> str:
        """Return why the values found must not be used, "" if they may."""
        if not all(math.isfinite(it) and it > 0 for it in fit.values.values()):
            return "the measured force does not oppose the motion: check its signs and its unit"
        if fit.values[DRAG] > _MOST_DRAG:
            return f"a drag coefficient of {fit.values[DRAG]:.3g} is not permitted: check the unit of the force"
        if fit.edge:
            return "the wake may be longer than the measurement: continue, with stops and turns"
        if not fit.information.identified:
            vague = [WORDS[n] for n, it in zip(self.names, fit.information.vague, strict=True) if it]
            return (
                f"this motion does not identify {_listed(vague or [WORDS[n] for n in self.names])} within 5 %: "
                f"smallest eigenvalue {fit.information.smallest:.3g}, {NEEDED:.0f} needed"
            )
        if _misfit_n(fit) > MISFIT * fit.force_rms_n:
            share = 100 * _misfit_n(fit) / fit.force_rms_n
            also = "" if len(self.names) > 1 else "; estimate the wake, too"
            return (
                f"the model misses {share:.0f} % of the force: its other parameters are not those of the liquid{also}"
            )
        return ""


def value_words(estimate: Estimate, name: str) -> tuple[str, str]:
    """Return a value of an estimate and its interval as displayed text."""
    lower, upper = estimate.intervals[name]
    return f"{estimate.values[name]:.4g}", f"({lower:.4g} … {upper:.4g})"


def rate_of(rows: Rows) -> float:
    """Return the rate of rows [Hz]."""
    rate_hz = 1 / float(np.median(np.diff(rows.t_s)))
    if rate_hz < _SLOWEST_HZ:
        raise StudyError(f"the force comes at {rate_hz:.3g} rows per second: measure at least {_SLOWEST_HZ:g}")
    return min(rate_hz, 5000.0)


def _misfit_n(fit: WakeFit) -> float:
    """Return the part of the residual that is not noise [N], from its correlation between rows."""
    return math.sqrt(max(fit.following, 0.0)) * fit.rms_n


def _waits(seconds: float) -> Estimate:
    """Return an empty estimate with the reason: too little time measured, or no motion."""
    short = f"{seconds:.1f} s measured, {LEAST_S:g} s needed"
    reason = short if seconds < LEAST_S else "the body does not move in the liquid"
    return replace(NOTHING, reason=reason, seconds=seconds)


def _listed(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
