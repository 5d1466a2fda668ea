"""What is found in a block of levels, and of other questions, as frozen values."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

from study_app.analysis.data.blocks import OwnDynamics, PublishedValue, compared_percent
from study_app.analysis.statistics.thresholds import WORST, drifts


@dataclass(frozen=True, slots=True)
class GroupAnswers:
    """The numbers of the answers about one setting, or of all where ``code`` is None."""

    code: str | None
    name: str
    numbers: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class QuestionFound:
    """A question asked after the trials of a block, or in a form: ``where`` is its id, ``title`` what people read.

    ``measure`` and ``figure`` are the ids of what computes and draws its numbers.
    """

    where: str
    title: str
    is_form: bool
    item: str
    text: str
    short: str
    kind: str
    measure: str
    figure: str | None
    groups: tuple[GroupAnswers, ...]

    @property
    def n(self) -> int:
        """How many answers there are."""
        return sum(int(group.numbers["n"]) for group in self.groups)


@dataclass(frozen=True, slots=True)
class ScoreFound:
    """A score of a questionnaire: number, mean, standard deviation and range over its answers, by setting."""

    where: str
    title: str
    name: str
    instrument: str | None
    source: str | None
    groups: tuple[GroupAnswers, ...]


Summary: TypeAlias = Literal["share", "mean", "geometric mean", "settings"]


@dataclass(frozen=True, slots=True)
class LevelAnswers:
    """The answers at one level, of one participant or, where ``participant`` is None, of all.

    Those to catch trials are apart, with ``catch``.
    A block that compares conditions has ``comparison`` in place of ``standard`` and ``level``. ``n`` answers of
    ``participants`` are summarised in ``value``, ``count`` of them are what a share counts. ``low`` and ``high`` are
    the ends of the 95 % interval: of a participant's share by Clopper and Pearson, otherwise by Student's t, over the
    answers of one participant, or over the participants' values.
    """

    participant: str | None
    standard: float | None
    level: float | None
    comparison: float | str | None
    n: int
    participants: int
    count: int | None
    value: float
    low: float | None
    high: float | None
    catch: bool = False


@dataclass(frozen=True, slots=True)
class ThresholdFound:
    """A participant's threshold at one standard or, where ``participant`` is None, the group's.

    ``threshold`` with the ends of its 95 % interval and ``flat_width`` (the threshold under a flat prior on the width)
    are levels. ``width`` reaches from 5 to 95 % of the function's rise, in decades on log spacing.
    ``beyond`` says that the threshold lies above or below the levels presented; ``variance`` is the threshold's
    posterior variance in u. ``fit_p`` is that of the deviance, ``drift`` the correlation of trial number and deviance
    residual. ``reversal_mean`` is the classical estimate of the up–down tracks, at ``target_percent`` successes.
    ``compared`` is the level at the percentage of successes of the published value, see `compared_percent`. Of the
    group only ``n`` (participants), threshold and ``compared`` are known, each with its interval.
    """

    participant: str | None
    standard: float | None
    n: int
    threshold: float
    low: float | None
    high: float | None
    width: float | None = None
    lapse: float | None = None
    guess: float | None = None
    flat_width: float | None = None
    beyond: str | None = None
    variance: float | None = None
    fit_p: float | None = None
    drift: float | None = None
    reversal_mean: float | None = None
    target_percent: float | None = None
    compared: float | None = None
    compared_low: float | None = None
    compared_high: float | None = None

    @property
    def fits(self) -> bool:
        """Whether simulated answers deviate from the function as much as those given; true where this is not known."""
        return self.fit_p is None or self.fit_p >= WORST

    @property
    def drifts(self) -> bool:
        """Whether answers became better or worse over the trials, beyond 2/√n."""
        return drifts(self.drift, self.n)


@dataclass(frozen=True, slots=True)
class ExponentFound:
    """A participant's exponent: of a power law, from ``n`` levels, or Weber's, of the JND over ``n`` standards.

    Where ``participant`` is None, it is the mean over ``n`` participants, with its 95 % interval by Student's t.
    """

    participant: str | None
    n: int
    exponent: float
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True, slots=True)
class SettingFound:
    """A participant's settings at one standard or, where ``participant`` is None, the means of all participants.

    ``pse`` with the ends of its 95 % interval is a level; ``jnd``, ``constant_error`` (PSE − standard) and
    ``hysteresis`` (started high − started low) are in u: decades on log spacing, else in the unit of the levels.
    ``levels`` are a participant's settings, in order, and ``started_high`` says from which end; of the group ``n`` is
    the number of participants.
    """

    participant: str | None
    standard: float | None
    n: int
    pse: float
    low: float | None
    high: float | None
    jnd: float | None
    constant_error: float | None
    hysteresis: float | None
    levels: tuple[float, ...] = ()
    started_high: tuple[bool, ...] = ()


@dataclass(frozen=True, slots=True)
class SensitivityFound:
    """A participant's sensitivity and bias or, where ``participant`` is None, their means over ``n`` participants.

    They are those at a ``standard``, to a condition as ``comparison``, or of ratings at a ``level`` against the lowest.
    ``shares`` are those of each answer. ``d_prime`` has a 95 % interval where its variance is known, of the group by
    Student's t; ``criterion`` is c, or k of same–different; ``other`` is d′ under the model that is not ``model``.
    """

    participant: str | None
    n: int
    shares: Mapping[str, float]
    standard: float | None = None
    comparison: str | None = None
    level: float | None = None
    d_prime: float | None = None
    low: float | None = None
    high: float | None = None
    criterion: float | None = None
    model: str | None = None
    other: float | None = None


@dataclass(frozen=True, slots=True)
class LevelTimes:
    """Median times to answer [s] of all participants at the levels from ``low`` to ``high`` of a standard."""

    standard: float | None
    low: float
    high: float
    right_n: int
    right_s: float | None
    wrong_n: int
    wrong_s: float | None


@dataclass(frozen=True, slots=True)
class WithheldForce:
    """Share of the requested force that safety withheld [%] in the comparisons at levels from ``low`` to ``high``."""

    standard: float | None
    low: float
    high: float
    n: int
    mean_percent: float
    most_percent: float


@dataclass(frozen=True, slots=True)
class LevelConduct:
    """How the trials at a standard were presented.

    ``trials`` are analysed, ``repeated`` attempts at them were presented again: ``reasons`` counts the intervals that
    broke each limit. ``error_mean`` and ``error_largest`` are those of the delivered less the requested level, in the
    unit of the level, over ``measured`` trials; ``pace_mps`` is the mean RMS speed of the hand [m/s],
    ``apparent_mass_kg`` the mean apparent mass [kg].
    """

    standard: float | None
    trials: int
    repeated: int
    reasons: Mapping[str, int]
    measured: int
    error_mean: float | None
    error_largest: float | None
    pace_mps: float | None
    apparent_mass_kg: float | None


@dataclass(frozen=True, slots=True)
class CatchAnswers:
    """Catch trials of a session: how many of ``n`` were answered incorrectly; a larger share than ``most`` excludes."""

    participant: str
    session: int
    n: int
    wrong: int
    most: float

    @property
    def excludes(self) -> bool:
        """Whether the rule ``catch`` excludes the session."""
        return self.wrong / self.n > self.most


@dataclass(frozen=True, slots=True)
class LevelsFound:
    """A block of levels.

    ``summary`` says how the answers at a level are summarised, ``counts`` what a share is of ("correct"); ``vary`` is
    the varied number, ``quantity`` its name in words, ``unit`` its unit, ``level_kind`` what a level is (weber,
    difference, value), all None where conditions are compared; ``family`` is the psychometric function of the
    thresholds; ``adaptive``: answers chose the levels; ``guess_rate`` is the share at chance, ``bounds`` are the ends
    of a scale; ``own_units``: each participant chose the unit of the numbers named, which group intervals leave out;
    ``withheld`` is known where the force is delayed, with jitter or loss. Where participants set the levels
    there are ``settings`` in place of answers at levels. ``device`` are the device's own dynamics, None where they were
    not measured. Without the key only ``times`` are known.
    """

    block: str
    title: str
    design: str
    revealed: bool
    times: tuple[GroupAnswers, ...]
    summary: Summary
    counts: str
    vary: str | None = None
    quantity: str | None = None
    unit: str | None = None
    level_kind: str | None = None
    spacing: str = "linear"
    guess_rate: float | None = None
    bounds: tuple[float, float] | None = None
    own_units: bool = False
    answers: tuple[LevelAnswers, ...] = ()
    thresholds: tuple[ThresholdFound, ...] = ()
    exponents: tuple[ExponentFound, ...] = ()
    sensitivities: tuple[SensitivityFound, ...] = ()
    level_times: tuple[LevelTimes, ...] = ()
    withheld: tuple[WithheldForce, ...] = ()
    conduct: tuple[LevelConduct, ...] = ()
    catches: tuple[CatchAnswers, ...] = ()
    family: str | None = None
    adaptive: bool = False
    published: tuple[PublishedValue, ...] = ()
    settings: tuple[SettingFound, ...] = ()
    device: OwnDynamics | None = None

    def with_device(self, one: ThresholdFound) -> float | None:
        """Return a Weber fraction of damping with the device's own in the standard, ΔB/(B + b); None where unknown."""
        if self.device is None or one.standard is None or (self.vary, self.level_kind) != ("damping_nspm", "weber"):
            return None
        return one.threshold * one.standard / (one.standard + self.device.damping_nspm)

    @property
    def compared_percent(self) -> float | None:
        """The percentage of successes at which thresholds are compared with published ones; None: at no other."""
        known = any(one.compared is not None for one in self.thresholds)
        return compared_percent(self.published) if known else None

    @property
    def exponent_name(self) -> str:
        """What its exponents are."""
        return "exponent of the power law" if self.summary == "geometric mean" else "Weber exponent"

    @property
    def of_group(self) -> tuple[LevelAnswers, ...]:
        """The answers of all participants together, in order of standard and level; without catch trials."""
        return tuple(one for one in self.answers if one.participant is None and not one.catch)

    @property
    def has_catch_trials(self) -> bool:
        """Whether some of the answers are to catch trials."""
        return any(one.catch for one in self.answers)

    @property
    def own_thresholds(self) -> tuple[ThresholdFound, ...]:
        """The participants' thresholds."""
        return tuple(one for one in self.thresholds if one.participant is not None)

    @property
    def own_settings(self) -> tuple[SettingFound, ...]:
        """The participants' settings."""
        return tuple(one for one in self.settings if one.participant is not None)

    @property
    def own_power_exponents(self) -> tuple[ExponentFound, ...]:
        """The participants' exponents of magnitude estimation."""
        power_law = self.summary == "geometric mean"
        return tuple(one for one in self.exponents if power_law and one.participant is not None)

    @property
    def people(self) -> tuple[str, ...]:
        """The participants who answered."""
        answered = {one.participant for one in self.answers} | {one.participant for one in self.settings}
        return tuple(sorted(one for one in answered if one is not None))
