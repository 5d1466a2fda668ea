"""What is shown of a block with a method: numbers, psychometric function, expected track, force of each level."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from study_app.designer.measures.level_words import LevelWords, even_ticks, rounded
from study_app.designer.measures.number_cards import (
    FAILED,
    LIMIT_NAMES,
    NO_FORCES,
    ON_AVERAGE,
    UNKNOWN,
    ForceBar,
    ForcesPlot,
    FunctionPlot,
    Limit,
    NumberCard,
    RepairOffer,
    TrackPlot,
    Verdict,
    people,
)
from study_app.designer.measures.observers import Observed
from study_app.designer.measures.planned import ENOUGH, Simulated
from study_app.designer.problems.problems import ProblemRow
from study_app.haptics.model.device_dynamics import ASSUMED_TICKS
from study_app.number_text import counted, duration_figure
from study_app.protocol.blocks import Block
from study_app.protocol.checks.force_limits import clipped, clipped_unpaced
from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import BlockOrder
from study_app.protocol.trials.presented_levels import (
    Clipping,
    Level,
    LevelLimits,
    clipping,
    level_limits,
    levels,
    standard_of,
)
from study_app.protocol.trials.tracks import design_of, stimulus_of

MOST_LABELS: Final = 9
CLIPPED: Final[Verdict] = ("bad", "warning", "levels are clipped")
TOO_SMALL: Final = "All levels are below twice the level error of a valid trial"
AS_ASKED: Final = "Clipped levels are simulated as they are requested"


@dataclass(frozen=True, slots=True)
class Controls:
    """What is simulated: participants, the threshold (a level), the lapse rate, and the precision that is wanted.

    ``planned`` is how many participants the file plans, None where it does not say.
    """

    participants: int = 12
    threshold: float = 0.2
    lapses: float = 0.02
    precision: float = 0.15
    planned: int | None = None


@dataclass(frozen=True, slots=True)
class LevelBlock:
    """A block with a stimulus: what its levels are, how limits clip them, and whether their forces are known."""

    protocol: Protocol
    block: Block
    words: LevelWords
    levels: tuple[Level, ...]
    limits: LevelLimits | None
    clipping: Clipping | None
    forces: bool = True

    @property
    def standard(self) -> float | None:
        """The standard that is shown: the highest, whose forces are the strongest."""
        return max((one.standard for one in self.levels if one.standard is not None), default=None)

    @property
    def shown(self) -> tuple[Level, ...]:
        """The levels of that standard."""
        return tuple(one for one in self.levels if one.standard == self.standard)

    @property
    def clipped_from(self) -> tuple[float, Limit] | None:
        """The place from which on a limit takes part of the force away, and which; None where no level is beyond it."""
        level = math.inf if self.clipping is None else self.clipping.highest(self.words.stimulus)
        if self.limits is None or not math.isfinite(level):
            return None
        return self.words.at(level), "norm" if self.limits.force == self.limits.lowest else "slope"

    def measures(self, threshold: float) -> bool:
        """Return whether a threshold is below the highest level that observers answer to in full."""
        paced = self.clipping is not None and self.clipping.paced
        return not paced or self.clipping is None or threshold < self.clipping.highest(self.words.stimulus)

    @property
    def as_asked(self) -> str:
        """That clipped levels are simulated as they are asked; "" where none is clipped, or as they are presented."""
        simulated = self.clipping is not None and self.clipping.paced
        return "" if simulated or all(one.clipped_by is None for one in self.shown) else AS_ASKED

    @property
    def clipped_words(self) -> str:
        """Which levels a limit clips, and what is simulated of them; "" where none is clipped."""
        if self.clipping is None:
            return self.as_asked
        highest = self.clipping.highest(self.words.stimulus)
        named = self.clipping.named and f"{self.clipping.named} {self.words.value_unit}".rstrip()
        which = f"Levels above {self.words.words(highest)}{named and f' of standard{named}'} are"
        if self.clipping.clips_standard:
            which = f"The standard{named} is"
        if self.clipping.paced:
            return f"{which} clipped: observers are simulated with what the limits leave"
        return f"{which} clipped in fast motions, whose trials are repeated. {AS_ASKED}"


def level_block(protocol: Protocol, block: Block, *, forces: bool = True) -> LevelBlock | None:
    """Return a block's levels; None where it varies nothing. Without ``forces`` its limits are not known."""
    if block.stimulus is None or block.design is None:
        return None
    found = levels(protocol, block.id)
    words = LevelWords(stimulus_of(protocol, block), design_of(protocol, block))
    if not forces:
        return LevelBlock(protocol, block, words, found, None, None, forces)
    limits = level_limits(protocol, block)
    return LevelBlock(protocol, block, words, found, limits, clipping(protocol, block, limits), forces)


def number_cards(
    of: LevelBlock, simulated: Simulated, controls: Controls, duration_s: float, order: BlockOrder
) -> tuple[NumberCard, ...]:
    """Return the four numbers of a block whose tracks are simulated."""
    breaks = f", {counted(order.breaks, 'break')}" if order.breaks else ""
    return (
        _range(of, simulated, controls),
        _one_person(of, simulated),
        _people(of, simulated, controls),
        NumberCard(
            "Lasts", *duration_figure(duration_s),
            ("neutral", "clock", f"{order.trials} trials{breaks}"), simulated=False,
        ),
    )  # fmt: skip


def _unknown(title: str, unit: str, simulated: Simulated) -> NumberCard:
    """Return a number that is not known: not yet, because its simulation failed, or because nothing simulates it."""
    if simulated.failed:
        return NumberCard(title, UNKNOWN, unit, FAILED, simulated.failed)
    return NumberCard(title, UNKNOWN, unit, ("neutral", "info", "not simulated"))


def _range(of: LevelBlock, simulated: Simulated, controls: Controls) -> NumberCard:
    title, found, words = (
        f"{of.words.name[:1].upper()}{of.words.name[1:]}s it can measure",
        simulated.measurable,
        of.words,
    )
    if found is None:
        return _unknown(title, words.unit, simulated)
    clipped = of.clipped_words
    if found.ends is None:
        if found.planted:
            return NumberCard(title, "none", "", ("bad", "warning", "estimates are biased"), clipped)
        if of.clipping is None:
            return NumberCard(title, "none", "", ("bad", "warning", "levels are too small"), TOO_SMALL)
        why = "the standard is clipped" if of.clipping.clips_standard else CLIPPED[2]
        return NumberCard(title, "none", "", ("bad", "warning", why), clipped)
    low, high = found.ends
    note: Verdict = ("neutral", "info", f"of {words.number(of.words.stimulus.levels[1])} {words.unit} at most")
    if words.stimulus.level_kind == "weber" and of.standard is not None:
        values = (rounded(level * of.standard, 2) for level in (low, high))
        note = ("neutral", "info", f"{' to '.join(values)} {words.value_unit}")
    if not low * 0.999 <= controls.threshold <= high * 1.001:
        note = ("warn", "warning", f"not {words.words(controls.threshold)}")
    return NumberCard(title, f"{words.number(low, 2)} – {words.number(high, 2)}", words.unit, note, clipped)


def _one_person(of: LevelBlock, simulated: Simulated) -> NumberCard:
    found = simulated.observed
    if found is None:
        return _unknown("One person", "%", simulated)
    if not of.measures(found.threshold):
        return NumberCard("One person", UNKNOWN, "%", CLIPPED, of.clipped_words)
    note: Verdict = ("neutral", "people", f"at a {of.words.name} of {of.words.words(found.threshold)}")
    return NumberCard("One person", f"± {100 * found.error:.0f}", "%", note, of.as_asked)


def _people(of: LevelBlock, simulated: Simulated, controls: Controls) -> NumberCard:
    found = simulated.group
    if found is None:
        title = f"{people(controls.participants, controls.planned)} in ± {100 * controls.precision:g} %"
        return _unknown(title, "% of studies", simulated)
    title = f"{people(found.participants, controls.planned)} in ± {100 * found.precision:g} %"
    if not of.measures(controls.threshold):
        return NumberCard(title, UNKNOWN, "% of studies", CLIPPED, of.clipped_words)
    enough = found.share >= ENOUGH
    note: Verdict = ("ok", "check", "Enough") if enough else ("warn", "warning", "Not enough")
    many = f"more than {found.most}" if found.enough is None else f"about {found.enough}"
    needed = f"{100 * ENOUGH:g} % are enough" if enough else f"Needed: {many} participants for {100 * ENOUGH:g} %"
    more = f"{needed}; with {found.more_trials} trials: {100 * found.more_share:.0f} %"
    more = ". ".join(filter(None, (more, ON_AVERAGE if simulated.warnings else "", of.as_asked)))
    return NumberCard(title, f"{100 * found.share:.0f}", "% of studies", note, more)


def function_plot(of: LevelBlock, simulated: Simulated) -> FunctionPlot | None:
    """Return the psychometric function; None before the first answer."""
    found, words = simulated.observed, of.words
    if found is None:
        return None
    low = min(found.planted[0], *(one[0] for one in found.found))
    low_percent = 10.0 * math.floor(10.0 * low + 1e-9)
    most, _ = max(found.asked, key=lambda pair: pair[1], default=(0.0, 0.0))
    middle = [words.number(level) for level in _within(found)]
    sentence = (
        f"Share of answers that are {words.success}, over the {words.kind}: {100 * found.planted[0]:.0f} % at "
        f"{words.words(found.levels[0])} to {100 * found.planted[-1]:.0f} % at {words.words(found.levels[-1])}, "
        f"{100 * found.at_threshold:.0f} % at the simulated {words.name} of {words.words(found.threshold)}. "
        f"Half of {found.observers} observers are estimated between {middle[0]} and {words.words(_within(found)[1])}. "
        f"The level presented most often is {words.words(most)}."
    )
    return FunctionPlot(
        heading=f"% {words.success} over {words.kind}, {words.unit}".rstrip(", "),
        span=(words.at(found.levels[0]), words.at(found.levels[-1])),
        x=tuple(words.at(level) for level in found.levels),
        planted=_percent(found.planted),
        found=tuple(_percent(one) for one in found.found),
        asked=tuple((words.at(level), share) for level, share in found.asked),
        mark=(words.at(found.threshold), 100 * found.at_threshold),
        mark_words=words.words(found.threshold),
        low=low_percent,
        clipped_from=of.clipped_from,
        ticks_x=words.ticks(),
        ticks_y=tuple((one, f"{one:g}") for one in even_ticks(low_percent, 100.0, 7)),
        sentence=sentence,
    )


def _within(found: Observed) -> tuple[float, float]:
    """Return the 25 and 75 % quantiles of the estimates after all trials."""
    quantiles = found.course[-1][1]
    return quantiles[1], quantiles[3]


def _percent(values: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(100 * value for value in values)


def track_plot(of: LevelBlock, simulated: Simulated) -> TrackPlot | None:
    """Return the expected track; None before the first answer."""
    found, words = simulated.observed, of.words
    if found is None or not found.course:
        return None
    last = max((one.trial for one in found.one), default=1)
    right = sum(one.success for one in found.one)
    low, high = _within(found)
    unit = f", {words.unit}" if words.unit else ""
    return TrackPlot(
        heading=f"{words.kind}{unit} over trials",
        span=(words.at(found.levels[0]), words.at(found.levels[-1])),
        trials=tuple(float(number) for number, _ in found.course),
        found=tuple(tuple(words.at(one[at]) for _, one in found.course) for at in range(len(found.course[0][1]))),
        one=tuple((one.trial, words.at(one.level), one.track, one.success) for one in found.one),
        last=last,
        planted=words.at(found.threshold),
        clipped_from=of.clipped_from,
        ticks_x=tuple((one or 1, f"{one or 1:g}") for one in even_ticks(0, last, 7)),
        ticks_y=words.ticks(),
        observers=found.observers,
        sentence=(
            f"Estimates of the {words.name} over {last} trials: after the last one half of the observers are between "
            f"{words.number(low)} and {words.words(high)}, the simulated value is {words.words(found.threshold)}. "
            f"One of them answered {right} of {len(found.one)} trials with success."
        ),
    )


def forces_plot(of: LevelBlock, problems: Mapping[ProblemRow, tuple[str, ...]]) -> ForcesPlot | None:
    """Return the force at each level; None where levels have no force of their own.

    Parameters
    ----------
    of : LevelBlock
        The block.
    problems : mapping
        The problems of the study, each with the words of its repairs as far as they were found.
    """
    shown = [one for one in of.shown if one.asked_n is not None]
    if shown and not of.forces:
        verdict: Verdict = ("neutral", "info", f"{UNKNOWN} of {len(of.levels)} as asked")
        return ForcesPlot("", (), (), (), 0.0, None, (verdict,), NO_FORCES, None, NO_FORCES)
    if not shown or of.limits is None:
        return None
    bars = [ForceBar(one.asked_n or 0.0, one.sent_n or 0.0, one.clipped_by) for one in shown]
    values = [one.comparison for one in shown]
    if of.standard is not None:
        own = standard_of(of.protocol, of.block.id, of.standard)
        bars.insert(0, ForceBar(own.asked_n or 0.0, own.sent_n or 0.0, own.clipped_by, standard=True))
        values.insert(0, of.standard)
    unit, limit_n = of.words.value_unit, of.protocol.device.force_limit_n
    count = sum(one.clipped_by is not None for one in of.levels)
    asked = len(of.levels) - count
    rows = [row for row in problems if row.fault.path == ("stimuli", str(of.block.stimulus), "levels")]
    repair = next((RepairOffer(words[0], row) for row in rows if (words := problems[row])), None)
    messages = [fault.message for fault in clipped(of.protocol, [of.block], ASSUMED_TICKS)]
    said = ". ".join(f"{one[:1].upper()}{one[1:]}" for one in messages)
    warning = said or clipped_unpaced(of.protocol, [of.block]) or ""
    top = max(limit_n, *(bar.asked_n for bar in bars))
    step = max(1, math.ceil(len(bars) / MOST_LABELS))
    standard = "" if of.standard is None else f"standard {rounded(of.standard)} {unit}, "
    told = f"{asked} of {len(of.levels)} as asked"
    verdicts: tuple[Verdict, ...] = (("ok", "check", told),)
    if count:
        verdicts = ("neutral", "info", told), ("bad" if rows else "warn", "warning", f"{count} clipped")
    strongest = max(one.asked_n or 0.0 for one in shown)
    slope_n = min((one.sent_n or 0.0 for one in shown if one.clipped_by == "slope"), default=None)
    slope = "" if slope_n is None else f", the {LIMIT_NAMES['slope']} {slope_n:.2f} N"
    return ForcesPlot(
        heading=f"N, {standard}at {of.limits.hand_mps:.3f} m/s of the hand",
        bars=tuple(bars),
        ticks_x=tuple((float(at), rounded(values[at])) for at in range(0, len(bars), step)),
        ticks_y=tuple((one, f"{one:g}") for one in even_ticks(0.0, 1.02 * top, 5)),
        limit_n=limit_n,
        slope_n=slope_n,
        verdicts=verdicts,
        warning=warning,
        repair=repair,
        sentence=(
            f"Force at {len(shown)} levels from {rounded(values[0])} to {rounded(values[-1])} {unit}: at most "
            f"{strongest:.2f} N are requested; the {LIMIT_NAMES['norm']} is {limit_n:g} N{slope}. {asked} of "
            f"{len(of.levels)} levels are as requested, {count} are clipped."
        ),
    )
