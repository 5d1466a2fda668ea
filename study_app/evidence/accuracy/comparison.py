"""Accuracy and computation time: every candidate is compared with its references, and all are timed in one run."""

import itertools
import math
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, NamedTuple, TypeAlias

import numpy as np

from study_app.errors import StudyError
from study_app.evidence import reference_solutions as truths
from study_app.evidence.accuracy import candidates as models
from study_app.evidence.accuracy.candidates import Candidate, with_given_velocity
from study_app.evidence.accuracy.plain_c import compare_with_plain_c
from study_app.evidence.cfd.stored_flows import solver_truths
from study_app.evidence.computer import machine
from study_app.evidence.cost import TickTimer
from study_app.evidence.reference_solutions import (
    COUNT_M,
    ROUNDING,
    Error,
    Truth,
    error_of,
    with_velocity,
    without_buoyancy,
)
from study_app.evidence.stability import delivered_force
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.estimators import NAMED as ESTIMATORS
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Scene

Kind: TypeAlias = Literal["numerical", "physical"]


_EQUAL_TIMES_RATIO: Final = 1.05
"""Times within this factor count as equal."""

_MAX_RESOLUTION_S: Final = 1e-6
"""Coarsest permitted resolution of the CPU clock, since batches take 100 µs or more."""

_REPEATS: Final = 5
_BATCHES: Final = 40
_TIME_LIMIT_S: Final = 0.8
"""Time limit of a candidate per repeat; a slower one runs fewer batches, at least one."""


def _clock() -> Callable[[], int]:
    """Return a clock [ns] of CPU time or, if that is too coarse, of elapsed time."""
    fine = time.get_clock_info("thread_time").resolution <= _MAX_RESOLUTION_S
    return time.thread_time_ns if fine else time.perf_counter_ns


class Time(NamedTuple):
    """Computation time per tick [ns]: median and 99th percentile of batches of 1,000 ticks, medians over repeats."""

    median_ns: float
    p99_ns: float
    batches: int


@dataclass(frozen=True)
class Row:
    """The result of one candidate against one reference."""

    kind: Kind
    liquid: str
    truth: str
    candidate: Candidate
    error: Error
    time: Time
    memory_bytes: int
    chosen: bool
    on_front: bool = False

    @property
    def ns_per_ms(self) -> float:
        """Computation time per millisecond of motion [ns]; at 1 kHz this is the time per tick."""
        return self.time.median_ns * self.candidate.rate_hz / 1000


class ActingError(NamedTuple):
    """One estimator at one delay [ticks]: time of a tick, error of the force on the hand, least error [% of the law].

    `least` is the error of the best linear estimator on the same motion.
    """

    estimator: str
    delay: int
    ns: float
    error: float
    least: float


@dataclass(frozen=True, kw_only=True)
class Accuracy:
    """All results: rows, sources of the references, omitted candidates with reasons, machine and motion.

    ``acting`` are the errors of the force on the hand in ``acting_liquid``. ``plain_c`` is the time of the whole tick
    relative to plain C, as a sentence.
    """

    rows: tuple[Row, ...]
    truths: tuple[Truth, ...]
    notes: tuple[str, ...]
    machine: str
    motion: str
    acting: tuple[ActingError, ...] = ()
    acting_liquid: str = ""
    plain_c: str = ""

    def of(self, kind: Kind) -> tuple[Row, ...]:
        return tuple(row for row in self.rows if row.kind == kind)


def accuracy(
    numerical: Scene | None,
    physical: Scene | None,
    motion: Motion,
    *,
    named: str = "the motion",
    notes: Sequence[str] = (),
    repeats: int = _REPEATS,
    batches: int = _BATCHES,
    allowance_s: float = _TIME_LIMIT_S,
    progress: Callable[[str], None] = lambda _: None,
) -> Accuracy:
    """Compare the candidates of one scene with its definition, and those of another with physical references.

    ``motion`` has the scenes' rate. The definition is evaluated along it, and all candidates are timed along it.

    Raises
    ------
    StudyError
        The first scene's liquid exerts no force along the motion, or a stored table cannot be used.
    """
    all_notes = list(notes)
    if motion.velocity_mps is None:
        all_notes.append(
            "the motion does not contain velocities: central differences of its positions are used instead"
        )
        motion = with_velocity(motion)
    fewest = len(motion.t_s) // max(models.SLOWER)
    if fewest < Candidate.BATCH:
        all_notes.append(
            f"the motion is short: each batch has {fewest} ticks instead of 1,000, so call overhead adds some µs to "
            "the times"
        )
    measured: list[Row] = []
    references: list[Truth] = []
    if numerical is not None:
        scene = models.drag_and_wake(numerical)
        candidates, choice = models.numerical_candidates(scene)
        truth = truths.definition_truth(with_given_velocity(scene), motion)
        if not truth.cases[0].force_n.any():
            raise StudyError(
                f"{scene.liquids[0].id} does not exert a force along {named}, so its error cannot be "
                "expressed as a percentage"
            )
        measured += _compare_candidates("numerical", scene, candidates, choice, (truth,), progress)
        references.append(truth)
    if physical is not None:
        candidates, choice = models.physical_candidates(physical)
        physical_references = _physical_truths(candidates[0].scene, all_notes)
        measured += _compare_candidates("physical", physical, candidates, choice, physical_references, progress)
        references += physical_references
    progress("timing")
    times = _time_candidates(
        tuple(dict.fromkeys(row.candidate for row in measured)), motion, repeats, batches, allowance_s
    )
    measured = [replace(row, time=times[row.candidate]) for row in measured]
    by_kind = [[row for row in measured if row.kind == kind] for kind in ("numerical", "physical")]
    fronts = {candidate for rows in by_kind for candidate in pareto_front(worst_rows(rows))}
    rows = tuple(replace(row, on_front=row.candidate in fronts) for row in measured)
    progress("force on the hand")
    subject = physical or numerical
    plain_c = "" if numerical is None else _plain_c_sentence(numerical, repeats * batches)
    acting = () if subject is None else _acting_errors(subject, batches)
    liquid = "" if subject is None else subject.liquids[0].id
    return Accuracy(
        rows=rows,
        truths=tuple(references),
        notes=tuple(all_notes),
        machine=machine(),
        motion=named,
        acting=acting,
        acting_liquid=liquid,
        plain_c=plain_c,
    )


def _plain_c_sentence(scene: Scene, batches: int) -> str:
    """Return the time of a tick relative to plain C, or why it was not measured, as a sentence."""
    liquid = scene.liquids[0].id
    try:
        times = compare_with_plain_c({liquid: scene}, batches=batches)[liquid]
    except StudyError as error:
        return f"The time of a tick relative to plain C was not measured: {error}."
    return (
        f"A complete servo tick in {liquid}, with the estimator and the safety layer, takes {times.tick_ns:.0f} ns, "
        f"{times.ratio:.1f} times as long as computing velocity and force in plain C ({times.plain_ns:.0f} ns; the "
        f"forces differ by at most {times.difference:.0e} of the largest force)."
    )


def _acting_errors(scene: Scene, batches: int) -> tuple[ActingError, ...]:
    """Measure every estimator at each delay; ticks of all are timed in alternating batches."""
    loops = list(itertools.product([kind for kind in ESTIMATORS.values() if kind.of_device], delivered_force.DELAYS))
    scenes = [without_buoyancy(scene.model_copy(update={"velocity": kind.model()})) for kind, _ in loops]
    timers = [
        TickTimer(loop_scene, Dynamics(delay_s=delay / loop_scene.rate_hz, count_m=COUNT_M))
        for loop_scene, (_, delay) in zip(scenes, loops, strict=True)
    ]
    for _ in range(batches):
        for timer in timers:
            timer.run_batch()
    errors = [
        delivered_force.acting_on_random_motion(delivered_force.case_of(loop_scene, kind.name, delay), loop_scene)
        for loop_scene, (kind, delay) in zip(scenes, loops, strict=True)
    ]
    return tuple(
        ActingError(
            estimator=kind.name, delay=delay, ns=statistics.median(timer.costs_ns), error=error.error, least=error.least
        )
        for (kind, delay), timer, error in zip(loops, timers, errors, strict=True)
    )


def _physical_truths(scene: Scene, notes: list[str]) -> tuple[Truth, ...]:
    measured = truths.steady_truth(scene)
    if measured is None:
        notes.append("steady drag: there are no known experiments at such low Reynolds numbers")
    solved = solver_truths(scene)
    if not solved:
        notes.append(f"fluid solver: there is no stored table for {scene.liquids[0].id} and this ball")
    steady = () if measured is None else (measured,)
    return (*steady, truths.oscillation_truth(scene), truths.starting_truth(scene), *solved)


def _compare_candidates(
    kind: Kind,
    scene: Scene,
    candidates: Sequence[Candidate],
    choice: Candidate,
    against: Sequence[Truth],
    progress: Callable[[str], None],
) -> list[Row]:
    unknown = Time(math.nan, math.nan, 0)
    rows = []
    for candidate in candidates:
        progress(f"{kind}: {candidate.name}")
        for truth in against:
            error = error_of(candidate.forces_against(truth), truth)
            chosen = candidate is choice
            rows.append(
                Row(kind, scene.liquids[0].id, truth.name, candidate, error, unknown, candidate.memory_bytes, chosen)
            )
    return rows


class _CandidateTimer:
    """The timing of one candidate along a repeated motion; its wake is filled before it is timed."""

    def __init__(self, candidate: Candidate, motion: Motion) -> None:
        self._candidate, self._motion, self._clock_ns = candidate, motion, _clock()
        self._begin_repeat()
        self.reset()

    def reset(self) -> None:
        """Reset the batch times per tick [ns] and the elapsed time [s] before a new repeat."""
        self.costs_ns: list[float] = []
        self.passed_s = 0.0

    def _begin_repeat(self) -> None:
        self._candidate.begin(self._motion)
        liquid = self._candidate.scene.liquids[0]
        length = liquid.wake.length if liquid.wake is not None and "wake" in liquid.effects else 0
        warm_up_ticks = min(round(length * self._candidate.rate_hz / 1000), self._candidate.ticks - self._size)
        self._candidate.run_ticks(0, warm_up_ticks)
        self._row = warm_up_ticks

    @property
    def _size(self) -> int:
        return min(self._candidate.BATCH, self._candidate.ticks)

    def run_batch(self) -> None:
        if self._row + self._size > self._candidate.ticks:
            self._begin_repeat()
        began_s, began = time.perf_counter(), self._clock_ns()
        self._candidate.run_ticks(self._row, self._row + self._size)
        self.costs_ns.append((self._clock_ns() - began) / self._size)
        self.passed_s += time.perf_counter() - began_s
        self._row += self._size


def _time_candidates(
    candidates: Sequence[Candidate], motion: Motion, repeats: int, batches: int, allowance_s: float
) -> dict[Candidate, Time]:
    """Return the times of all candidates in alternating batches, so that slow phases of the machine affect all alike.

    Time used by other programs is excluded: it would affect every batch of 10 ms, but few of 100 µs.
    """
    benches = {candidate: _CandidateTimer(candidate, motion) for candidate in candidates}
    costs: dict[Candidate, list[list[float]]] = {candidate: [] for candidate in candidates}
    for _ in range(repeats):
        for bench in benches.values():
            bench.reset()
        for _ in range(batches):
            for bench in benches.values():
                if bench.passed_s < allowance_s:
                    bench.run_batch()
        for candidate, bench in benches.items():
            costs[candidate].append(bench.costs_ns)
    return {
        candidate: Time(
            statistics.median(statistics.median(costs_ns) for costs_ns in repeats_ns),
            statistics.median(float(np.percentile(costs_ns, 99)) for costs_ns in repeats_ns),
            sum(len(costs_ns) for costs_ns in repeats_ns),
        )
        for candidate, repeats_ns in costs.items()
    }


def worst_rows(rows: Sequence[Row]) -> dict[Candidate, Row]:
    """Return, for each candidate, the row of the reference with the greatest error."""
    largest: dict[Candidate, Row] = {}
    for row in rows:
        if row.candidate not in largest or row.error.rms > largest[row.candidate].error.rms:
            largest[row.candidate] = row
    return largest


def pareto_front(points: dict[Candidate, Row]) -> tuple[Candidate, ...]:
    """Return the candidates that are Pareto-optimal in time and error, cheapest first.

    Differences within rounding error, or within the resolution of the timing, count as equal.
    """

    def error(row: Row) -> float:
        return max(row.error.rms, ROUNDING)

    def dominates(other: Row, row: Row) -> bool:
        if error(other) == error(row):
            return other.ns_per_ms < row.ns_per_ms
        return error(other) < error(row) and other.ns_per_ms <= row.ns_per_ms * _EQUAL_TIMES_RATIO

    best = [row for row in points.values() if not any(dominates(other, row) for other in points.values())]
    return tuple(row.candidate for row in sorted(best, key=lambda row: row.ns_per_ms))
