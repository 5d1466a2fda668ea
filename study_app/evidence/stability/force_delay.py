"""The proportion of a delayed force that the passivity controller passes, by liquid, hand and delay.

A hand moves a handle of about 0.1 kg at 1 kHz and one tick of delay along a sine of ±30 mm and at most 0.2 m/s. The
force of the liquid, within the slope limits, reaches the passivity controller later, as if the liquid were on another
computer. Buoyancy is omitted because it is constant. The first second is not evaluated. Near the limit of stability,
micrometres decide whether a loop oscillates; shares are therefore means over five masses of the handle.

- *left*: RMS of the force sent over RMS of the force as it came to the controller;
- *withheld*: Σ|F_a - F_b| / Σ|F_a| of the two, as ``withheld_share`` of a trial.
"""

import dataclasses
import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from statistics import fmean
from typing import Any, Final, NamedTuple

import numpy as np

from study_app.evidence.reference_solutions import without_buoyancy
from study_app.evidence.stability.bench import Bench, sine_path
from study_app.evidence.stability.stability_cases import Case, scene_of, scenes
from study_app.evidence.table import Evidence, Table, run
from study_app.protocol.warnings import Entry

LIQUIDS: Final = (
    "water",
    "honey",
    "light_oil",
    "syrup",
    *(f"physical2_{name}" for name in ("water", "olive_oil", "glycerin", "gear_oil", "honey")),
)
_ESTIMATORS: Final = ("ewma", "kalman")
_HANDS: Final = ("light", "middle", "firm")
_DELAYS_MS: Final = (0, 1, 2, 5, 10, 20, 50, 100, 200)
_MASSES_KG: Final = (0.095, 0.0975, 0.1, 0.1025, 0.105)
_AMPLITUDE_M: Final = 0.03
_SPEED_MPS: Final = 0.2
_DURATION_S: Final = 6.0
_SETTLED_S: Final = 1.0


def measure_force_delays(
    liquids: Iterable[str] = LIQUIDS,
    estimators: Iterable[str] = _ESTIMATORS,
    hands: Iterable[str] = _HANDS,
    delays_ms: Iterable[float] = _DELAYS_MS,
    progress: Callable[[int], object] = lambda _done: None,
) -> tuple[Entry, ...]:
    """Return the table line by line; ``progress`` is called with the number of lines so far."""
    return run(_entry, itertools.product(liquids, estimators, hands, delays_ms), None, progress)


def force_delay_evidence(entries: Sequence[Entry], file: str) -> Evidence:
    """Return the remaining proportion [%] as a table, and the file that ``protocol.warnings.delayed_force`` reads.

    The table has one line per liquid, estimator and hand, and one column per delay.
    """
    delays_ms = sorted({entry.delay_ms for entry in entries})
    left_by_case = {entry[:4]: entry.left_percent for entry in entries}
    lines = [f"{'remaining force [%], by delay [ms]':40}" + "".join(f"{delay:6g}" for delay in delays_ms)]
    for liquid, estimator, hand in dict.fromkeys(entry[:3] for entry in entries):
        percentages = (left_by_case.get((liquid, estimator, hand, delay), math.nan) for delay in delays_ms)
        lines.append(
            f"{f'{liquid}, {estimator}, {hand}':40}" + "".join(f"{proportion:6.0f}" for proportion in percentages)
        )
    rows = [(*entry[:3], *(f"{value:g}" for value in entry[3:])) for entry in entries]
    return Evidence("\n".join(lines) + "\n", {file: Table(Entry._fields, rows).csv()})


def delayed_trace(case: Case) -> Any:
    """Return the trace of a hand that stirs the case's liquid without buoyancy, with the case's force delay."""
    path_m = sine_path(_AMPLITUDE_M, _SPEED_MPS / _AMPLITUDE_M, _DURATION_S, case.rate_hz)
    return Bench(case, scene=without_buoyancy(scene_of(case))).follow(path_m)


def _entry(liquid: str, estimator: str, hand: str, delay_ms: float) -> Entry:
    case = Case(liquid=liquid, scale=scenes()[liquid].scale, estimator=estimator, hand=hand, force_delay_ms=delay_ms)
    proportions = [_shares(dataclasses.replace(case, mass_kg=mass_kg)) for mass_kg in _MASSES_KG]
    return Entry(
        liquid=liquid,
        estimator=estimator,
        hand=hand,
        delay_ms=delay_ms,
        left_percent=round(100 * fmean(proportion.left for proportion in proportions), 1),
        withheld_percent=round(100 * fmean(proportion.withheld for proportion in proportions), 1),
    )


class _Shares(NamedTuple):
    left: float
    withheld: float


def _shares(case: Case) -> _Shares:
    trace = delayed_trace(case)
    counted = trace[trace.t_s >= _SETTLED_S]
    sent_n = np.linalg.norm(counted.sent_n, axis=1)
    return _Shares(
        left=math.sqrt(float(np.mean(sent_n**2) / np.mean(counted.permitted_n**2))),
        withheld=float(np.sum(counted.withheld_n) / np.sum(counted.permitted_n)),
    )
