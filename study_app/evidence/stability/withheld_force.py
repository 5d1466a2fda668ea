"""The proportion of each liquid's force that passivity controller and slew limit withhold during and after fast motion.

The proportion is Σ|F_a - F_b| / Σ|F_a|, where F_a is the force after slope limit, fades and norm clamp, and F_b the
force sent. A handle is moved along straight strokes A cos 2πft, which begin at rest; and along 0.9 s of such a stroke
followed by four seconds of slow stirring in circles of radius 30 mm, each second of which is evaluated. Each motion is
imposed three times: on the position itself, whatever the force; by a hand that holds the handle firmly enough to follow
a stroke of 8 Hz; and on a hand that holds it through the tissue of its fingers, in which it swings, so that strokes
have no goal.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from study_app.evidence.stability.bench import DIRECTION, Bench
from study_app.evidence.stability.stability_cases import Case, liquids
from study_app.evidence.table import Evidence, run
from study_app.haptics.runtime.closed_loop import ARMS


class _Stroke(NamedTuple):
    """A straight motion back and forth."""

    frequency_hz: float
    amplitude_mm: float

    def __str__(self) -> str:
        return f"{self.frequency_hz:g} Hz ±{self.amplitude_mm:g}"


_SLOW: Final = (_Stroke(1.0, 30.0), _Stroke(2.0, 30.0), _Stroke(3.0, 30.0))
QUICK: Final = (_Stroke(4.0, 30.0), _Stroke(5.0, 20.0), _Stroke(5.0, 30.0), _Stroke(8.0, 10.0))
STROKES: Final = _SLOW + QUICK
SHOWN_SHAKE: Final = QUICK[2]
_RATE_HZ: Final = 1000.0
_STROKE_S: Final = 3.0
_SHAKE_DURATION_S: Final = 0.9
_STIRRING_MPS: Final = 0.2
_STIRRING_M: Final = 0.03
SECONDS: Final = 4

_HAND_KG: Final = 0.554
_HAND_NPM: Final = 2000.0
_HAND_NSPM: Final = 60.0
"""Mass of the middle grip, with stiffness and damping that keep the handle on its path at 8 Hz. [choice]"""
_HANDLE_KG: Final = 0.1
_SHAKEN_HANDLE_KG: Final = 0.2
"""Mass of a handle held through tissue [kg], since one of 0.1 kg swings by itself in physical honey with `ewma`."""

_MAX_SHARE: Final = 0.05
_MAX_REVERSED_SHARE: Final = 0.08
_REVERSED: Final = ("physical_honey", "kalman")
"""Its force reverses from +8 N to −8 N (the force limit), which takes the slew limit 13 ms. [choice]"""
MOST_AFTER: Final = 0.005
_EXEMPT: Final = ("physical_tar",)
_ESTIMATORS: Final = ("ewma", "kalman")
"""The estimators that studies use."""
_IMPOSED: Final = "position imposed"
_HELD: Final = "handle held"
SHAKEN: Final = "hand shaken"
MODES: Final = (_IMPOSED, _HELD, SHAKEN)


class Withheld(NamedTuple):
    """Withheld proportions of one liquid's force: in each stroke of `STROKES`, and in each second after `QUICK`."""

    liquid: str
    estimator: str
    mode: str
    strokes: tuple[float, ...]
    after: tuple[tuple[float, ...], ...]

    @property
    def quick(self) -> float:
        """The greatest proportion over all strokes that have a limit."""
        return 0.0 if self.mode == SHAKEN else max(self.strokes)

    @property
    def most(self) -> float:
        return _MAX_REVERSED_SHARE if (self.liquid, self.estimator) == _REVERSED else _MAX_SHARE

    @property
    def lasting(self) -> float:
        """The greatest proportion from one second after a shake onwards."""
        return max(proportion for seconds in self.after for proportion in seconds[1:])

    @property
    def met(self) -> bool:
        """Whether the liquid meets both limits; tar has none."""
        return self.liquid in _EXEMPT or (self.quick <= self.most and self.lasting < MOST_AFTER)


def measure_withheld_force(
    names: Sequence[str] | None = None,
    estimators: Sequence[str] = _ESTIMATORS,
    *,
    delay: int = 1,
    executor: Executor | None = None,
) -> tuple[Withheld, ...]:
    """Return the withheld proportions of liquids (by default all shipped ones), each at its own scale, at 1 kHz."""
    shipped = [name for name in liquids() if name not in {"dense", "damper"}]
    planned = [
        (
            Case(
                liquid=liquid,
                scale=liquids()[liquid].scale,
                delay=delay,
                estimator=estimator,
                mass_kg=_SHAKEN_HANDLE_KG if mode == SHAKEN else _HANDLE_KG,
            ),
            mode,
        )
        for estimator, mode, liquid in itertools.product(estimators, MODES, names or shipped)
    ]
    return run(_measure_withheld, planned, executor)


def withheld_force_evidence(found: Sequence[Withheld]) -> Evidence:
    """Return the table of proportions in percent, and whether each limit is met."""
    text = "\n".join(_lines(found)) + "\n"
    return Evidence(text, {"withheld.txt": text}, missed=not all(withheld.met for withheld in found))


def _lines(found: Sequence[Withheld]) -> Iterator[str]:
    yield "force held back by the passivity controller and the slew limit, Σ|F_a - F_b| / Σ|F_a| [%]; strokes in mm"
    for (estimator, mode), rows in itertools.groupby(found, key=lambda withheld: (withheld.estimator, withheld.mode)):
        yield ""
        strokes = "".join(f"{stroke!s:>11}" for stroke in STROKES)
        after = f"   in seconds 1 to {SECONDS} after {SHOWN_SHAKE}; maximum after the first second"
        yield f"{f'{estimator}, {mode}':21}{strokes}{after}"
        for row in rows:
            after = "".join(f"{100 * proportion:7.1f}" for proportion in row.after[QUICK.index(SHOWN_SHAKE)])
            goals = "no goal" if row.liquid in _EXEMPT else _goal_text(row.met) + " afterwards" * (mode == SHAKEN)
            strokes = "".join(f"{100 * proportion:11.1f}" for proportion in row.strokes)
            yield f"  {row.liquid:19}{strokes}  {after}{100 * row.lasting:10.1f}   {goals}"
    with_limits = [withheld for withheld in found if withheld.liquid not in _EXEMPT]
    lasting = max(withheld.lasting for withheld in with_limits)
    yield ""
    for most in sorted({withheld.most for withheld in with_limits}):
        quick = max(withheld.quick for withheld in with_limits if withheld.most == most)
        where = "except in tar" if most == _MAX_SHARE else f"in {' with '.join(_REVERSED)}"
        motion = f"in every stroke with imposed position or a firm hand, {where}"
        yield f"at most {most:.0%} held back {motion}: {_goal_text(quick <= most)} ({quick:.1%})"
    if shaken := [withheld for withheld in with_limits if withheld.mode == SHAKEN]:
        worst = max(shaken, key=lambda withheld: max(withheld.strokes))
        which = f"in {worst.liquid} with {worst.estimator}"
        yield f"strokes of a shaken hand, without a goal: up to {max(worst.strokes):.1%} held back ({which})"
    met = _goal_text(lasting < MOST_AFTER)
    after = f"less than {MOST_AFTER:.1%} held back from one second after a shake onwards, except in tar"
    yield f"{after}: {met} ({lasting:.1%})"


def _goal_text(met: bool) -> str:
    return "met" if met else "not met"


def _measure_withheld(case: Case, mode: str) -> Withheld:
    strokes = tuple(_withheld_share(_play_path(case, _stroke_m(stroke, _STROKE_S), mode)) for stroke in STROKES)
    after = []
    for shake in QUICK:
        shaken_m = _stroke_m(shake, _SHAKE_DURATION_S)
        trace = _play_path(case, np.concatenate([shaken_m, _stirring_m(shaken_m[-1])]), mode)
        seconds = np.split(trace[len(shaken_m) :], SECONDS)
        after.append(tuple(_withheld_share(second) for second in seconds))
    return Withheld(liquid=case.liquid, estimator=case.estimator, mode=mode, strokes=strokes, after=tuple(after))


def _stroke_m(stroke: _Stroke, lasts_s: float) -> NDArray[np.float64]:
    t_s = np.arange(round(lasts_s * _RATE_HZ)) / _RATE_HZ
    along_m = 1e-3 * stroke.amplitude_mm * np.cos(2.0 * math.pi * stroke.frequency_hz * t_s)
    return np.outer(along_m, DIRECTION)


def _stirring_m(from_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return positions (rows, 3) [m] of slow stirring that starts at a position."""
    angle = _STIRRING_MPS / _STIRRING_M * np.arange(1, round(SECONDS * _RATE_HZ) + 1) / _RATE_HZ
    return from_m + _STIRRING_M * np.column_stack([np.cos(angle) - 1.0, np.zeros_like(angle), np.sin(angle)])


def _play_path(case: Case, path_m: NDArray[np.float64], mode: str) -> Any:
    bench = Bench(case)
    handle = bench.handle
    handle.hand_kg, handle.stiffness_npm, handle.damping_nspm = _HAND_KG, _HAND_NPM, _HAND_NSPM
    if mode == SHAKEN:
        arm = ARMS["middle"]
        handle.hand_kg, handle.stiffness_npm, handle.damping_nspm = 0.0, arm.tissue_npm, arm.tissue_nspm
    return bench.follow(path_m, rigid=mode == _IMPOSED)


def _withheld_share(trace: Any) -> float:
    permitted_n = float(trace.permitted_n.sum())
    return float(trace.withheld_n.sum()) / permitted_n if permitted_n > 0.0 else 0.0
