"""Tests whether known thresholds and exponents are recovered, by methods and analysis alone and by the whole program.

In many simulated studies with differing observers the presented levels equal the requested ones, so that errors are
those of methods and estimates. The data of rehearsed participants pass through servo, store, unblinding and analysis.

In magnitude estimation an observer's estimate is exp(n y + 0.25 N), where y is the logarithm of the resistance at the
hand: mean force over RMS speed. The exponent over the varied number is n times the slope of y over its logarithm at the
task's pace, from which n follows.
"""

import math
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import NormalDist
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.stats import beta
from scipy.stats import t as student

from study_app.analysis.data import Array, LevelBlock, load_study
from study_app.analysis.levels.exponents import estimate_slope, estimated_exponents, jnd_slope
from study_app.analysis.levels.thresholds import thresholds
from study_app.analysis.levels.tracks import tracks
from study_app.analysis.statistics import student_interval
from study_app.evidence.table import Evidence, Table, run
from study_app.haptics.model.overrides import override_all
from study_app.haptics.model.slope_limits import steady_force
from study_app.protocol.blocks import Block
from study_app.protocol.model import Follow, Protocol
from study_app.protocol.randomization import Draw, stream
from study_app.protocol.simulated import OBSERVER, Observer, as_requested, simulate_study
from study_app.protocol.trials import DELAYS, SESSION_SD
from study_app.psychophysics.people import (
    BETWEEN_PEOPLE,
    ESTIMATE_NOISE,
    KINDS,
    LAPSES_MOST,
    MIXED,
    Person,
    draw_normal,
    person_of_kind,
)
from study_app.session.replay import replay
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.files import StudyFolder
from study_app.store.unblinding import unblind
from study_app.store.verification import reproduce_session, verify_study

_SHIPPED: Final[dict[str, Observer]] = {
    "viscosityjnd": OBSERVER,
    "delaydetect": Observer(delay_jnd_s=0.045),
    "delayjnd": OBSERVER,
    "forcedelay": Observer(delay_jnd_s=0.015),
}
"""The shipped studies with thresholds, and their observers. The known values are a Weber fraction of 0.24 at 75 %
correct, or 0.19 at 71 % (Jones, Hunter & Lafontaine 1997), 45 ms (Vogels 2004), 25 ms at every standard (below 33 ms:
Ellis et al. 1999), and 15 ms for a force (Rank et al. 2010)."""
NAMES: Final = (*_SHIPPED, "thickness")
"""The shipped studies that are validated."""
EXPONENT: Final = 0.44
"""Exponent of perceived thickness over viscosity (Stevens & Guirao 1964)."""
_POINTS: Final = 64
_BETWEEN_SESSIONS: Final = 10**SESSION_SD
"""Factor by which a person's thresholds typically vary between sessions."""

PEOPLE: Final = 20
"""Participants of a simulated study; like `_NEAR`, planned in the shipped studies (``participants``, ``precision``)."""
_REHEARSED: Final = 2
_MAX_ERROR: Final = 0.05
_NEAR: Final = 0.15
_MIN_NEAR_SHARE: Final = 0.95
MIN_COVERAGE: Final = 0.93
_MAX_OWN_COVERAGE: Final = 0.98
_MAX_SLOPE_ERROR: Final = 0.15
_MAX_EXPONENT_ERROR: Final = 0.03
_MIN_DELIVERED: Final = 0.99
_FAMILY_ERROR: Final = 0.05
"""Probability that chance alone takes any value beyond its limit, shared equally among all (Bonferroni)."""
_STUDIES_PER_KIND_STUDY: Final = 20
"""Ratio of all simulated studies to those for each kind of people."""


class Verdict(NamedTuple):
    """One judged quantity: its name, value and limit as text, and whether the limit is met."""

    study: str
    what: str
    value: str
    limit: str
    holds: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Measure:
    """A quantity with a limit, and the interval that contains its true value at a given confidence.

    Attributes
    ----------
    study, what : str
        As in `Verdict`.
    value : float
        The value.
    interval : callable
        Returns the ends of its interval from a confidence.
    least, most : float
        The range that the limit permits.
    limit : str
        The limit as text.
    written : callable
        Returns a value as text.
    """

    study: str
    what: str
    value: float
    interval: Callable[[float], tuple[float, float]]
    least: float = -math.inf
    most: float = math.inf
    limit: str
    format_value: Callable[[float], str]

    def verdict(self, confidence: float) -> Verdict:
        """Return the verdict: the limit is exceeded if the whole interval lies beyond it."""
        low, high = self.interval(confidence)
        value = self.format_value(self.value)
        if low < high:
            value += f" [{self.format_value(low)}, {self.format_value(high)}]"
        holds = low <= self.most and high >= self.least
        return Verdict(study=self.study, what=self.what, value=value, limit=self.limit, holds=holds)


def verdicts_on(measures: Sequence[Measure]) -> list[Verdict]:
    """Return the verdicts; the probability that any limit is exceeded by chance is at most `_FAMILY_ERROR`."""
    return [measure.verdict(1.0 - _FAMILY_ERROR / len(measures)) for measure in measures]


def mean_interval(values: ArrayLike) -> Callable[[float], tuple[float, float]]:
    """Return Student's t interval for the mean over independent studies, as a function of the confidence."""
    study_values = np.asarray(values, float)
    mean, error = float(study_values.mean()), float(study_values.std(ddof=1)) / math.sqrt(len(study_values))

    def ends(confidence: float) -> tuple[float, float]:
        half = float(student.ppf((1 + confidence) / 2, len(study_values) - 1)) * error
        return mean - half, mean + half

    return ends


def share_interval(shares: ArrayLike, cases_per_study: int) -> Callable[[float], tuple[float, float]]:
    """Return the interval of the mean share of studies (n,) with ``cases_per_study`` cases, which may be correlated.

    It is the Clopper–Pearson interval for the effective number of independent cases (Korn & Graubard 1998, Survey
    Methodology 24, 193–201).
    """
    study_shares = np.asarray(shares, float)
    share, studies = float(study_shares.mean()), len(study_shares)
    variance = float(study_shares.var(ddof=1)) / studies
    cases = min(share * (1 - share) / variance, studies * cases_per_study) if variance else studies

    def ends(confidence: float) -> tuple[float, float]:
        tail, successes = (1 - confidence) / 2, share * cases
        low = float(beta.ppf(tail, successes, cases - successes + 1)) if successes else 0.0
        return low, float(beta.ppf(1 - tail, successes + 1, cases - successes)) if successes < cases else 1.0

    return ends


class Estimated(NamedTuple):
    """A value that the analysis estimates, with its 95 % interval, and the true value."""

    value: float
    low: float = math.nan
    high: float = math.nan
    truth: float = math.nan

    @property
    def covered(self) -> bool:
        return self.low <= self.truth <= self.high


@dataclass(frozen=True, slots=True)
class StudyFound:
    """The estimates of one study at each standard: the group's value, and each participant's."""

    group: tuple[Estimated, ...]
    own: tuple[tuple[Estimated, ...], ...]


@dataclass(frozen=True, slots=True)
class Rehearsed:
    """The proportion of intervals delivered as requested, the number of findings, and the estimated values."""

    delivered: float
    findings: int
    values: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class _KnownValue(ABC):
    """A study's main block whose true value is known."""

    name: str
    protocol: Protocol
    block: Block

    @abstractmethod
    def error(self, values: Sequence[float]) -> float:
        """Return the mean error of values."""

    def spread(self, studies: Sequence[StudyFound], people: int) -> float:
        """Return the standard deviation over studies of the error relative to their own participants."""
        errors = [
            self.error([estimate.value for estimate in some]) - self.error([one.truth for one in some])
            for study in studies
            for some in ([estimate for own in study.own[:people] for estimate in own],)
        ]
        return float(np.std(errors, ddof=1))

    def _draw_deviations(self, people: int, seed: int, number: int) -> tuple[list[float], Draw]:
        """Return the participants' deviations from the mean, in ln of `BETWEEN_PEOPLE`, and the random generator."""
        draw = stream(seed, f"validate/{self.name}/{number}/people").random
        return [math.log(BETWEEN_PEOPLE) * draw_normal(draw) for _ in range(people)], draw

    def _simulate_answers(
        self, observers: Sequence[Observer], seed: int, number: int, sense: Callable[[Any], float] = as_requested
    ) -> pd.DataFrame:
        """Return the answers in the block; ``sense`` returns the quantity that observers perceive in an interval."""
        observers_by_id = {f"P{index:03d}": observer for index, observer in enumerate(observers, start=1)}
        rows = pd.DataFrame(
            simulate_study(self.protocol, observers_by_id, seed, f"validate/{self.name}/{number}", sense)
        )
        return rows[rows["block"] == self.block.id]


@dataclass(frozen=True, slots=True)
class KnownThreshold(_KnownValue):
    """The threshold of a block with an adaptive method, given its observer; errors are in ln threshold."""

    observer: Observer = OBSERVER

    @property
    def threshold(self) -> float:
        """The mean threshold as a level: a Weber fraction or a difference [ms]."""
        return self._threshold(self.observer)

    def _threshold(self, observer: Observer) -> float:
        return 1000 * observer.delay_jnd_s if self._of_delay else observer.weber_fraction

    @property
    def _of_delay(self) -> bool:
        return self.protocol.stimulus_of(self.block).vary in DELAYS

    def error(self, values: Sequence[float]) -> float:
        """Return the mean of ln(value/threshold)."""
        return sum(math.log(value / self.threshold) for value in values) / len(values)

    def people(self, number: int, seed: int, kind: str = "") -> Iterator[tuple[Observer, float]]:
        """Yield the participants of a study with their different thresholds.

        Thresholds also vary between sessions. ``kind`` is one of `KINDS` or `MIXED`; by default participants differ in
        lapse rates up to `LAPSES_MOST`.
        """
        deviations, draw = self._draw_deviations(PEOPLE, seed, number)
        name = "delay_jnd_s" if self._of_delay else "weber_fraction"
        for deviation in deviations:
            participant = replace(
                self.observer, person=person_of_kind(kind, draw) if kind else Person(lapse=LAPSES_MOST * draw())
            )
            participant = replace(participant, **{name: getattr(participant, name) * math.exp(deviation)})
            session_threshold = getattr(participant, name) * _BETWEEN_SESSIONS ** draw_normal(draw)
            yield replace(participant, **{name: session_threshold}), self._threshold(participant)

    def simulate(self, number: int, seed: int, kind: str = "", observers: Sequence[Observer] = ()) -> StudyFound:
        """Return the estimates of one study of ``observers``, by default from `people`."""
        people = [(observer, self._threshold(observer)) for observer in observers] or [*self.people(number, seed, kind)]
        rows = self._simulate_answers([observer for observer, _ in people], seed, number)
        frame = rows.assign(session=1, level_delivered=rows["level"], analysed=True)
        frame = frame.astype({"level_delivered": "Float64", "success": "boolean"})
        protocol, block = self.protocol, self.block
        levels = LevelBlock(
            id=block.id,
            title=block.id,
            phase=block.phase,
            design=protocol.design_of(block),
            stimulus=protocol.stimulus_of(block),
            settings=(),
            method=protocol.method_of(block),
        )
        truths = {f"P{index:03d}": threshold for index, (_, threshold) in enumerate(people, start=1)}
        estimates: dict[str | None, list[Estimated]] = {}
        for row in thresholds(levels, frame):
            truth = self.threshold if row.participant is None else truths[row.participant]
            assert row.low is not None and row.high is not None  # noqa: S101, PT018 - ten participants have an interval
            estimates.setdefault(row.participant, []).append(
                Estimated(value=row.threshold, low=row.low, high=row.high, truth=truth)
            )
        group = tuple(estimates.pop(None))
        return StudyFound(group, tuple(map(tuple, estimates.values())))

    def errors(self, studies: Sequence[StudyFound]) -> Array:
        """Return the error of the group's ln threshold in each study, relative to its own participants."""
        truths = [[estimate.truth for person in study.own for estimate in person] for study in studies]
        group_errors = [self.error([estimate.value for estimate in study.group]) for study in studies]
        return np.array(group_errors) - [self.error(people_truths) for people_truths in truths]

    def measures(self, studies: Sequence[StudyFound]) -> Iterator[Measure]:
        """Yield the error and, with several standards, the slope of ln JND against ln standard."""
        errors = self.errors(studies)
        yield _error_measure(self.name, errors)
        is_near = np.abs(np.expm1(errors)) <= _NEAR
        yield Measure(
            study=self.name,
            what=f"studies with {PEOPLE} participants within ±15 %",
            value=float(is_near.mean()),
            interval=share_interval(is_near, 1),
            least=_MIN_NEAR_SHARE,
            limit="at least 95 %",
            format_value=percent,
        )
        standards = np.array([standard for standard in self.protocol.standards_of(self.block) if standard is not None])
        if len(standards) < 2:
            return
        unit = standards if self.protocol.stimulus_of(self.block).level_kind == "weber" else 1.0
        slopes = [
            [jnd_slope(standards, np.array([estimate.value for estimate in person]) * unit) for person in study.own]
            for study in studies
        ]
        # a constant JND, or Weber's law
        mean_slopes, expected = (np.mean(slopes, axis=1), 0.0 if self._of_delay else 1.0)
        yield Measure(
            study=self.name,
            what="exponent of the JND against the standard",
            value=float(mean_slopes.mean()),
            interval=mean_interval(mean_slopes),
            least=expected - _MAX_SLOPE_ERROR,
            most=expected + _MAX_SLOPE_ERROR,
            limit=f"{expected:g} ± {_MAX_SLOPE_ERROR:g}",
            format_value="{:.3f}".format,
        )

    def estimates_of(self, block: LevelBlock, rows: pd.DataFrame) -> Iterator[float]:
        return (row.threshold for row in thresholds(block, rows) if row.participant is not None)

    def recovery_measure(self, values: Sequence[float], spread: float) -> Measure:
        """Return the threshold of rehearsed participants; ``spread`` is the standard error (ln) of such a study."""
        error = self.error(values)

        def ends(confidence: float) -> tuple[float, float]:
            half = _normal_half(confidence) * spread
            return self.threshold * math.exp(error - half), self.threshold * math.exp(error + half)

        return Measure(
            study=self.name,
            what=f"threshold of {_REHEARSED} participants, {'ms' if self.threshold > 1 else 'Weber fraction'}",
            value=self.threshold * math.exp(error),
            interval=ends,
            least=self.threshold,
            most=self.threshold,
            limit=f"{self.threshold:g}",
            format_value="{:.3g}".format,
        )


@dataclass(frozen=True, slots=True)
class KnownExponent(_KnownValue):
    """The exponent of a block of magnitude estimation.

    ``resistances`` are those of each level in ascending order: mean force over RMS speed at the pace [N·s/m].
    """

    resistances: tuple[float, ...] = ()

    @property
    def observer(self) -> Observer:
        """The observer whose exponent is the known one."""
        return self._observer(EXPONENT)

    def _observer(self, exponent: float) -> Observer:
        """Return an observer; the slope of ln resistance against ln level is a least-squares fit."""
        slope = float(np.polyfit(np.log(_levels(self.protocol, self.block)), np.log(self.resistances), 1)[0])
        return replace(OBSERVER, estimates=(exponent / slope, ESTIMATE_NOISE))

    def error(self, values: Sequence[float]) -> float:
        """Return the mean difference from the exponent."""
        return sum(values) / len(values) - EXPONENT

    def simulate(self, number: int, seed: int, people: int = PEOPLE) -> StudyFound:
        """Return the estimates of one study; observers perceive the force that reaches the hand at the pace."""
        resistance_by_level = dict(zip(_levels(self.protocol, self.block), self.resistances, strict=True))
        truths = [EXPONENT * (1 + one) for one in self._draw_deviations(people, seed, number)[0]]
        observers = [self._observer(truth) for truth in truths]
        frame = self._simulate_answers(
            observers, seed, number, lambda presented: resistance_by_level.get(presented.value, math.nan)
        )
        slopes = np.array([estimate_slope(rows["level"], rows["answer"]) for _, rows in frame.groupby("participant")])
        low, high = student_interval(slopes)
        assert low is not None and high is not None  # noqa: S101, PT018 - several participants have an interval
        by_participant = tuple(
            (Estimated(one, truth=truth),) for one, truth in zip(slopes.tolist(), truths, strict=True)
        )
        return StudyFound((Estimated(value=float(slopes.mean()), low=low, high=high, truth=EXPONENT),), by_participant)

    def measures(self, studies: Sequence[StudyFound]) -> Iterator[Measure]:
        """Yield the mean exponent."""
        exponents = [study.group[0].value for study in studies]
        yield Measure(
            study=self.name,
            what=f"exponent against {self.protocol.stimulus_of(self.block).vary}",
            value=float(np.mean(exponents)),
            interval=mean_interval(exponents),
            least=EXPONENT - _MAX_EXPONENT_ERROR,
            most=EXPONENT + _MAX_EXPONENT_ERROR,
            limit=f"{EXPONENT:g} ± {_MAX_EXPONENT_ERROR:g}",
            format_value="{:.3f}".format,
        )

    def estimates_of(self, block: LevelBlock, rows: pd.DataFrame) -> Iterator[float]:
        return (
            estimated_exponent.exponent
            for estimated_exponent in estimated_exponents(block, rows)
            if estimated_exponent.participant is not None
        )

    def recovery_measure(self, values: Sequence[float], spread: float) -> Measure:
        """Return the mean exponent of rehearsed participants; ``spread`` is the standard error of such a study."""
        mean = float(np.mean(values))
        return Measure(
            study=self.name,
            what=f"exponent of {len(values)} participants",
            value=mean,
            interval=lambda confidence: (
                mean - _normal_half(confidence) * spread,
                mean + _normal_half(confidence) * spread,
            ),
            least=EXPONENT,
            most=EXPONENT,
            limit=f"{EXPONENT:g}",
            format_value="{:.3f}".format,
        )


Known: TypeAlias = KnownThreshold | KnownExponent


def known_value(name: str, protocol: Protocol) -> Known:
    """Return the known value of a study: the exponent of magnitude estimates, or a threshold.

    Raises
    ------
    ValueError
        No main block has a known value.
    """
    blocks = [
        main_block
        for main_block in protocol.main_blocks
        if main_block.stimulus is not None and main_block.design is not None
    ]
    for block in blocks:
        stimulus, task = protocol.stimulus_of(block), protocol.tasks[block.task]
        if protocol.design_of(block).reply == "number" and stimulus.vary not in DELAYS and isinstance(task, Follow):
            scene = protocol.scene_for(protocol.condition_of(stimulus))
            fastest_mps = task.fastest_stroke(protocol.device.workspace_m).speed_mps
            level_scenes = [override_all(scene, {stimulus.vary: level}) for level in _levels(protocol, block)]
            return KnownExponent(
                name, protocol, block, tuple(_resistance(level_scene, fastest_mps) for level_scene in level_scenes)
            )
    for block in blocks:
        standards = protocol.standards_of(block)
        if protocol.stimulus_of(block).level_kind != "value" and not all(standard is None for standard in standards):
            return KnownThreshold(name, protocol, block, _SHIPPED.get(name, OBSERVER))
    raise ValueError(
        f"{name} does not have a main block with levels above a standard, or with magnitude estimation of a liquid at "
        "a set pace, so its true values are unknown"
    )


def _levels(protocol: Protocol, block: Block) -> list[float]:
    """Return the levels of a block in ascending order, in the unit of the varied number."""
    return sorted(protocol.method_of(block).levels_of(protocol.stimulus_of(block)))


def _resistance(scene: Any, fastest_mps: float) -> float:
    """Return mean force over RMS speed [N·s/m] in a sinusoidal motion with this peak speed."""
    speeds = [fastest_mps * math.sin(math.pi * (point + 0.5) / _POINTS) for point in range(_POINTS)]
    mean_n = sum(steady_force(scene, speed).drag_n for speed in speeds) / _POINTS
    return mean_n / (fastest_mps / math.sqrt(2))


def rehearse_known(known: Known, source: bytes, seed: int) -> Rehearsed:
    """Rehearse `_REHEARSED` participants of a protocol in a temporary folder; return the results."""
    with tempfile.TemporaryDirectory() as temporary:
        file, folder = Path(temporary) / f"{known.name}.toml", Path(temporary) / "study"
        file.write_bytes(source)
        rehearse(str(file), participants=_REHEARSED, seed=seed, results=folder, observer=known.observer)
        sessions = StudyFolder(folder).sessions()
        finding_count = len(verify_study(folder, None).errors)
        finding_count += sum(len(reproduce_session(session.path).differences) for session in sessions)
        finding_count += sum(not replay(session.path).proved for session in sessions)
        unblind(folder, "validate", "to compare the results with the known values")
        study = load_study(folder)
        intervals = study.intervals[study.intervals["block"] == known.block.id]
        block = next(block for block in study.levels if block.id == known.block.id)
        values = tuple(known.estimates_of(block, tracks(study)))
        return Rehearsed(float(intervals["invalid_reasons"].isna().mean()), finding_count, values)


def percent(share: float) -> str:
    """Return a proportion in percent."""
    return f"{100 * share:.1f} %"


def _normal_half(confidence: float) -> float:
    """Return half the width of a normal interval [standard deviations]."""
    return NormalDist().inv_cdf((1 + confidence) / 2)


def _error_measure(study: str, errors: Array) -> Measure:
    """Return the mean error of thresholds from their ln errors in each study."""
    ends = mean_interval(errors)
    return Measure(
        study=study,
        what="mean error of the threshold",
        value=math.expm1(float(errors.mean())),
        interval=lambda confidence: (math.expm1(ends(confidence)[0]), math.expm1(ends(confidence)[1])),
        least=-_MAX_ERROR,
        most=_MAX_ERROR,
        limit="within ±5 %",
        format_value=lambda share: f"{100 * share:+.1f} %",
    )


def coverage(name: str, studies: Sequence[StudyFound]) -> Iterator[Measure]:
    """Yield how often the 95 % intervals of groups and of participants contain the true value."""
    group_coverage = [[estimate.covered for estimate in study.group] for study in studies]
    people_coverage = [
        [estimate.covered for person in study.own for estimate in person if not math.isnan(estimate.low)]
        for study in studies
    ]
    for owner, covered, most in (
        ("the group's", group_coverage, 1.0),
        ("participants'", people_coverage, _MAX_OWN_COVERAGE),
    ):
        proportions = [float(np.mean(study_coverage)) for study_coverage in covered if study_coverage]
        if not proportions:
            continue
        yield Measure(
            study=name,
            what=f"coverage of {owner} 95 % intervals",
            value=float(np.mean(proportions)),
            interval=share_interval(proportions, max(map(len, covered))),
            least=MIN_COVERAGE,
            most=most,
            limit="at least 93 %" if most == 1.0 else f"93 to {100 * most:.0f} %",
            format_value=percent,
        )


def rehearsed_measures(known: Known, found: Rehearsed, spread: float) -> Iterator[Measure]:
    """Yield the measures of rehearsed participants; ``spread`` is that over studies of the same size."""
    yield Measure(
        study=known.name,
        what="intervals delivered as requested",
        value=found.delivered,
        interval=lambda _confidence: (found.delivered, found.delivered),
        least=_MIN_DELIVERED,
        limit="at least 99 %",
        format_value=percent,
    )
    yield Measure(
        study=known.name,
        what="findings of verify, reproduce and replay",
        value=found.findings,
        interval=lambda _confidence: (found.findings, found.findings),
        most=0,
        limit="0",
        format_value=str,
    )
    yield known.recovery_measure(found.values, spread)


def validate_known_values(
    known: Sequence[tuple[bytes, Known]],
    studies: int,
    seeds: Sequence[int],
    executor: Executor,
    progress: Callable[[str, float | None], object],
    say: Callable[[str], object] = lambda _text: None,
) -> list[Verdict]:
    """Return all verdicts on known values; ``known`` gives the protocol source of each. Seeds are pooled.

    Sessions are rehearsed with the first seed. ``progress`` is called with the current part and the fraction done;
    ``say`` with a line when each rehearsal, study and kind of participants is finished.
    """
    measures: list[Measure] = []
    all_studies: list[StudyFound] = []
    rehearsals = [executor.submit(rehearse_known, value, source, seeds[0]) for source, value in known]
    for (_, value), rehearsal in zip(known, rehearsals, strict=True):

        def finished(_rehearsal: object, name: str = value.name) -> None:
            say(f"{name}: {_REHEARSED} simulated participants rehearsed")

        rehearsal.add_done_callback(finished)
    cases = [(number, seed) for seed in dict.fromkeys(seeds) for number in range(studies)]
    for (_, value), rehearsal in zip(known, rehearsals, strict=True):

        def counted(done: int, name: str = value.name) -> None:
            progress(f"{name}: {done} of {len(cases)} studies", done / len(cases))

        progress(f"{value.name}: studies and rehearsals", 0.0)
        studies_found = run(value.simulate, cases, executor, counted)
        all_studies += studies_found
        measures += [*value.measures(studies_found), *coverage(value.name, studies_found)]
        progress(f"{value.name}: rehearsing {_REHEARSED} participants", None)
        measures += rehearsed_measures(value, rehearsal.result(), value.spread(studies_found, _REHEARSED))
        say(f"{value.name}: {len(cases)} studies")
    measures += coverage("all studies", all_studies)
    known_thresholds = [value for _, value in known if isinstance(value, KnownThreshold)]
    cases = cases[:: max(1, min(_STUDIES_PER_KIND_STUDY, len(cases) // 2))]
    for kind in (*KINDS, MIXED) if known_thresholds else ():
        progress(f"people: {kind}", None)
        found_by_threshold = [
            run(threshold.simulate, [(*case, kind) for case in cases], executor) for threshold in known_thresholds
        ]
        errors = np.concatenate(
            [
                threshold.errors(studies_found)
                for threshold, studies_found in zip(known_thresholds, found_by_threshold, strict=True)
            ]
        )
        measures += [
            _error_measure(kind, errors),
            *coverage(kind, [study for studies_found in found_by_threshold for study in studies_found]),
        ]
        say(f"people, {kind}: {len(errors)} studies")
    return verdicts_on(measures)


def known_values_evidence(verdicts: Sequence[Verdict], heading: str) -> Evidence:
    """Return one row per value with its limit, as Markdown below a heading and as CSV."""
    table = Table(Verdict._fields, [(*verdict[:-1], "yes" if verdict.holds else "no") for verdict in verdicts], left=5)
    csv = Table(Verdict._fields, [(*verdict[:-1], str(verdict.holds).lower()) for verdict in verdicts]).csv()
    text = f"{heading}\n\n{table.markdown()}\n"
    beyond = sum(not verdict.holds for verdict in verdicts)
    closing = f"{beyond} of {len(verdicts)} values exceed their limits" if beyond else "every value is within its limit"
    files = {"thresholds.md": text, "thresholds.csv": csv}
    return Evidence(text, files, missed=beyond > 0, closing=closing)
