"""The answers at each level or to each condition, and the levels that participants set, by participant and group."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final, NamedTuple

import numpy as np
import pandas as pd

from study_app.analysis import wording
from study_app.analysis.data.blocks import LevelBlock, Setting
from study_app.analysis.data.measures import number_or_none
from study_app.analysis.data.study_tables import Study
from study_app.analysis.html_page import drawn_figure, paragraph, table, table_of
from study_app.analysis.levels.statistic import (
    INTERVAL,
    KINDS,
    MOTORS,
    PARTICIPANT_COLUMNS,
    LevelStatistic,
    TableColumn,
    analysed_rows,
    cell_text,
    digits,
    group_mean_row,
    interval_text,
    level_text,
    signed,
    standards_phrase,
    unit,
    with_unit,
)
from study_app.analysis.results import LevelsResult, Summary
from study_app.analysis.statistics.outcome import Array, clopper_pearson, student_interval
from study_app.analysis.wording import listed
from study_app.number_text import counted
from study_app.protocol.model import MEAN_SETTING
from study_app.protocol.trials import Reply, Stimulus

_MOST_NAMED = 6
_MOST_LISTED: Final = 12
"""The most levels that are listed one by one."""


def _condition_text(setting: Setting) -> str:
    """Return the liquid of a condition with its visual delay, if it has one."""
    return f"{(setting.liquid or '').replace('_', ' ')}{_delay_text(setting)}"


def _delay_text(setting: Setting) -> str:
    """Return the visual delay and the link of a condition as a phrase; "" without any."""
    delay = f" with a visual delay of {setting.delay_ms:g} ms" if setting.delay_ms else ""
    return f"{delay}{f' ({setting.link})' if setting.link else ''}"


@dataclass(frozen=True, slots=True, kw_only=True)
class SettingEstimate:
    """A participant's settings at one standard, as in `columns.RESULTS`, or the means of ``n`` participants.

    ``levels`` are a participant's settings in order; ``started_high`` shows which of them started at the high end.
    ``timed_out`` settings were ended by the time limit, and ``at_ends`` lie at an end of the range.
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
    timed_out: int = 0
    at_ends: int = 0
    levels: tuple[float, ...] = ()
    started_high: tuple[bool, ...] = ()


def setting_estimates(block: LevelBlock, opened: pd.DataFrame) -> Iterator[SettingEstimate]:
    """Yield the group's mean settings at each standard, then each participant's; nothing for other designs."""
    stimulus = block.stimulus
    if stimulus is None or not block.design.adjusts:
        return
    rows = analysed_rows(block, opened)
    for standard, standard_rows in rows[rows["setting"].notna()].groupby("standard", dropna=False, sort=True):
        people = standard_rows.groupby("participant", sort=True)
        estimates = [
            _estimate_settings(block, stimulus, str(person), number_or_none(standard), rows) for person, rows in people
        ]
        others = ("jnd", "constant_error", "hysteresis")
        group = group_mean_row(estimates, "pse", *others, coordinate=stimulus.coordinate, level_of=stimulus.level_of)
        counts = {name: sum(getattr(row, name) for row in estimates) for name in ("timed_out", "at_ends")}
        yield replace(group, levels=(), started_high=(), **counts)
        yield from estimates


def _estimate_settings(
    block: LevelBlock, stimulus: Stimulus, person: str, standard: float | None, rows: pd.DataFrame
) -> SettingEstimate:
    in_u = np.vectorize(stimulus.coordinate, otypes=[float])
    u, starts = (in_u(rows[name].to_numpy(dtype=float)) for name in ("setting", "level"))
    started_high = starts > sum(stimulus.domain) / 2
    pse, (low, high) = float(u.mean()), student_interval(u)
    above, below = u[started_high], u[~started_high]
    compared = standard is not None and block.design.intervals > 1
    ends = np.array(stimulus.domain)
    is_at_end = np.isclose(u[:, np.newaxis], ends, rtol=0.0, atol=1e-6 * float(ends[1] - ends[0])).any(axis=1)
    return SettingEstimate(
        participant=person,
        standard=standard,
        n=len(u),
        pse=stimulus.level_of(pse),
        low=None if low is None else stimulus.level_of(low),
        high=None if high is None else stimulus.level_of(high),
        jnd=float(u.std(ddof=1)) if len(u) > 1 else None,
        constant_error=pse - stimulus.coordinate(standard) if compared and standard is not None else None,
        hysteresis=float(above.mean() - below.mean()) if len(above) and len(below) else None,
        timed_out=int(rows["outcome"].eq("timeout").sum()),
        at_ends=int(is_at_end.sum()),
        levels=tuple(rows["setting"].to_numpy(dtype=float).tolist()),
        started_high=tuple(started_high.tolist()),
    )


class Settings(LevelStatistic[SettingEstimate]):
    """The group's settings at each standard, followed by those of its participants."""

    key = "settings"
    place = 3.5
    title = "Settings"
    figures = ("settings",)
    table = "settings"

    compute = staticmethod(lambda block, opened, _study, _found: setting_estimates(block, opened))

    @classmethod
    def is_exported_in(cls, study: Study) -> bool:
        return any(block.design.adjusts for block in study.levels)

    @classmethod
    def matches_standard(cls, result: LevelsResult) -> bool:
        """Return whether participants matched a standard, so that their mean setting is a PSE."""
        return any(row.constant_error is not None for row in cls.rows_in(result))

    @classmethod
    def measure_name(cls, result: LevelsResult) -> str:
        """Return the name of the mean of the settings."""
        return "point of subjective equality" if cls.matches_standard(result) else MEAN_SETTING

    def table_columns(self) -> Sequence[TableColumn]:
        matches = self.matches_standard(self.result)
        timed_out, at_ends = (any(getattr(row, name) for row in self.rows) for name in ("timed_out", "at_ends"))
        in_u = "decades" if self.result.spacing == "log" else self.result.unit or "units of the level"
        return (
            self.standard_column(),
            *PARTICIPANT_COLUMNS,
            (f"{'PSE' if matches else 'mean setting'}{unit(self.result)}", lambda row: digits(row.pse)),
            INTERVAL,
            (f"{'JND' if matches else 'SD'} [{in_u}]", lambda row: digits(row.jnd)),
            (f"constant error [{in_u}]", lambda row: signed(row.constant_error)) if matches else None,
            (f"hysteresis [{in_u}]", lambda row: signed(row.hysteresis)),
            ("timed out", lambda row: str(row.timed_out)) if timed_out else None,
            ("at an end of the range", lambda row: str(row.at_ends)) if at_ends else None,
        )

    def explanation(self) -> str:
        values = "logarithms of the set levels" if self.result.spacing == "log" else "set levels"
        matches = self.matches_standard(self.result)
        mean, sd = (
            ("PSE (point of subjective equality)", "JND (just-noticeable difference)")
            if matches
            else ("Mean setting", "SD")
        )
        error = " constant error: PSE − standard;" if matches else ""
        counts = (
            " Counts show how many settings were ended by the time limit (timed out) or lie at an end of the range; "
            "all of them are included."
        )
        has_counts = any(row.timed_out or row.at_ends for row in self.rows)
        return (
            f"Settings are expressed as levels ({level_text(self.result)}). {mean}: mean of the {values}, with a 95 % "
            f"confidence interval (Student’s t); {sd}: their standard deviation;{error} hysteresis: mean of the "
            "settings that started high minus mean of those that started low. Group values are means across "
            f"participants; the group {'PSE' if matches else 'mean'} has a 95 % confidence interval."
            f"{counts * has_counts}"
        )

    def is_comparable_with(self, measure: str) -> bool:
        return True

    def limits(self) -> Iterator[str]:
        title = self.result.title
        if not (estimates := self.participant_rows(self.result)):
            return
        matches = self.matches_standard(self.result)
        criterion = "criterion for calling two stimuli equal" if matches else "own criterion"
        yield (
            f"{title}: settings depend on each participant's {criterion}, so the variability of settings is not a "
            "criterion-free measure of the threshold."
        )
        if any(estimate.timed_out or estimate.at_ends for estimate in estimates):
            yield (
                f"{title}: {self._count_text()}. They are included, so means may be biased and intervals too narrow."
            )
        if people := [str(estimate.participant) for estimate in estimates if estimate.hysteresis is None]:
            reason = "all settings started near the same end of the range, so the hysteresis is unknown"
            yield f"{title}: {reason} ({listed(people[:_MOST_NAMED])})."
        yield f"{title}: {MOTORS}"

    def _count_text(self) -> str:
        """Return a clause on the settings that were ended by the time limit, and on those at an end of the range."""
        rows = self.participant_rows(self.result)
        total = sum(row.n for row in rows)
        timed_out, at_ends = sum(row.timed_out for row in rows), sum(row.at_ends for row in rows)
        were, lay = "was" if timed_out == 1 else "were", "lies" if at_ends == 1 else "lie"
        clauses = [
            f"{timed_out} of {total} settings {were} ended by the time limit" if timed_out else "",
            f"{at_ends}{'' if timed_out else f' of {total} settings'} {lay} at an end of the range" if at_ends else "",
        ]
        return " and ".join(filter(None, clauses))

    def methods(self, block: LevelBlock) -> Iterator[str]:
        if not self.rows or block.stimulus is None:
            return
        against = standards_phrase(self.result, self.rows)
        to = against.replace(" for ", " to match ", 1) if block.design.intervals > 1 else ""
        kind, (low, high) = KINDS[block.stimulus.level_kind], block.stimulus.levels
        top = f"{high:g}" if block.stimulus.level_kind == "weber" else with_unit(self.result, high)
        numbers = {row.n for row in self.participant_rows(self.result)}
        minimum, maximum = min(numbers), max(numbers)
        often = wording.counted(maximum, "time") if minimum == maximum else f"{minimum} to {maximum} times"
        each = " for each standard" if len({row.standard for row in self.rows}) > 1 else ""
        yield (
            f"In “{self.result.title}”, participants set {self.result.quantity}{to} by {block.design.paper_name}, "
            f"{often}{each}; {kind} ranged from {low:g} to {top}, and the starting level alternated between values "
            "near the lower and the upper end of this range."
        )
        if counts := self._count_text():
            yield f"In “{self.result.title}”, {counts}; these settings were included."

    @classmethod
    def common_methods(cls, blocks: Sequence[LevelsResult]) -> Iterator[str]:
        if not (blocks := [block for block in blocks if cls.rows_in(block)]):
            return
        if any(map(cls.matches_standard, blocks)):
            measures = (
                "The point of subjective equality is the mean of a participant’s settings, the just-noticeable "
                "difference is their standard deviation, the constant error is the difference between the mean and the "
                "standard, and the hysteresis is the mean of settings that started high minus the mean of those that "
                "started low. All four are calculated"
            )
        else:
            measures = (
                "For each participant, the mean of the settings, their standard deviation and the hysteresis (the mean "
                "of settings that started high minus the mean of those that started low) are calculated"
            )
        yield (
            f"{measures} from the logarithm of the level if levels are spaced logarithmically (Gescheider 1997). Group "
            "values are means across participants with 95 % confidence intervals (Student’s t)."
        )


SUMMARIES: Final[dict[Reply, Summary]] = {
    "choice": "share",
    "rating": "mean",
    "number": "geometric mean",
    "setting": "settings",
}
"""The summary of the answers at a level, by the kind of reply that the design asks for."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelAnswers:
    """The answers of one participant, or of all if ``participant`` is None, at one level.

    Answers to catch trials are separate, with ``catch``. A block that compares conditions has ``comparison`` instead of
    ``standard`` and ``level``. ``value`` summarises ``n`` answers of ``participants``; ``count`` is the number of
    counted answers in a proportion. ``low`` and ``high`` are the ends of the 95 % interval: Clopper–Pearson for a
    participant's proportion, otherwise Student's t over the answers of one participant or the participants' values.
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


def chooses_units(block: LevelBlock) -> bool:
    """Return whether each participant chooses the unit of magnitude estimates, because there is no modulus."""
    return block.design.reply == "number" and block.design.first is None


def _level_answers(
    block: LevelBlock, opened: pd.DataFrame, bounds: tuple[float, float] | None
) -> Iterator[LevelAnswers]:
    """Yield the answers at each level, and separately those to catch trials: the group's, then each participant's."""
    if block.design.adjusts:
        return
    rows = analysed_rows(block, opened)
    if block.stimulus is None:
        places = {setting.condition: place for place, setting in enumerate(block.settings)}
        rows = rows.assign(comparison=rows["track"], place=rows["track"].map(places), catch=False)
        by = ["place"]
    else:
        rows = rows.assign(catch=rows["catch"].fillna(False).astype(bool))
        by = ["standard", "level", "catch"]
    units = _log_units(block, rows)
    for _, at_level in rows.groupby(by, dropna=False, sort=True):
        yield from _answers_at_level(block, at_level, bounds, units)


def _log_units(block: LevelBlock, rows: pd.DataFrame) -> Mapping[str, float]:
    """Return the logarithm of each participant's unit relative to the mean unit; empty with a modulus.

    The unit is estimated by the mean over levels of the participant's mean ln answer.
    """
    if not chooses_units(block):
        return {}
    answered = rows.assign(log=np.log(rows["value"].to_numpy(dtype=float)))
    log_units = answered.groupby(["participant", "level"])["log"].mean().groupby("participant").mean()
    return dict(log_units - log_units.mean())


def _answers_at_level(
    block: LevelBlock, rows: pd.DataFrame, bounds: tuple[float, float] | None, units: Mapping[str, float]
) -> Iterator[LevelAnswers]:
    summary = SUMMARIES[block.design.reply]
    proportion = summary == "share"
    numbers = rows["success" if proportion else "value"].to_numpy(dtype=float)
    numbers = np.log(numbers) if summary == "geometric mean" else numbers
    first = rows.iloc[0]
    make_answers = partial(
        LevelAnswers,
        standard=number_or_none(first["standard"]),
        level=number_or_none(first["level"]),
        comparison=first["comparison"] if isinstance(first["comparison"], str) else number_or_none(first["comparison"]),
        catch=bool(first["catch"]),
    )
    summarise = partial(_summarise_mean, summary, (0.0, 1.0) if proportion else bounds)
    people = rows["participant"].to_numpy()
    numbers_by_person = {person: numbers[people == person] for person in sorted(set(people))}
    mean = summarise(np.array([values.mean() - units.get(person, 0.0) for person, values in numbers_by_person.items()]))
    count = int(numbers.sum()) if proportion else None
    yield make_answers(
        participant=None, n=len(numbers), participants=len(numbers_by_person), count=count, **mean._asdict()
    )
    for person, values in numbers_by_person.items():
        mean = summarise(values)
        if proportion:
            count = int(values.sum())
            exact = clopper_pearson(count, len(values))
            mean = mean._replace(low=exact.low, high=exact.high)
        yield make_answers(participant=person, n=len(values), participants=1, count=count, **mean._asdict())


class _Mean(NamedTuple):
    """A mean and its 95 % interval."""

    value: float
    low: float | None
    high: float | None


def _summarise_mean(summary: Summary, bounds: tuple[float, float] | None, values: Array) -> _Mean:
    """Return the back-transformed mean of proportions, points or logarithms and its 95 % interval within bounds."""
    low, high = student_interval(values)
    if summary == "geometric mean":
        low, high = (None if end is None else math.exp(end) for end in (low, high))
        return _Mean(value=math.exp(values.mean()), low=low, high=high)
    if bounds is not None and low is not None and high is not None:
        low, high = max(low, bounds[0]), min(high, bounds[1])
    return _Mean(value=float(values.mean()), low=low, high=high)


def _group_answers(result: LevelsResult) -> tuple[LevelAnswers, ...]:
    """Return the group's answers by standard and level, without catch trials."""
    return tuple(answer for answer in Answers.rows_in(result) if answer.participant is None and not answer.catch)


def people(result: LevelsResult) -> tuple[str, ...]:
    """Return the participants who answered."""
    answered = {str(answer.participant) for answer in Answers.participant_rows(result)}
    return tuple(sorted(answered | {str(setting.participant) for setting in Settings.participant_rows(result)}))


def summary_text(result: LevelsResult) -> str:
    """Return the description of a value at a level: "proportion correct", "mean rating", and so on."""
    if result.summary == "share":
        return "proportion correct" if result.counts == "correct" else f"proportion “{result.counts}”"
    return "mean rating" if result.summary == "mean" else "geometric mean of the numbers"


def mean_text(result: LevelsResult) -> str:
    """Return the noun for the group's value at a level."""
    return "geometric mean" if result.summary == "geometric mean" else "mean"


class Answers(LevelStatistic[LevelAnswers]):
    """The answers at each level; the section has a table of the group, and one by participant for each standard."""

    key = "answers"
    place = 1

    compute = staticmethod(lambda block, opened, _study, found: _level_answers(block, opened, found.bounds))

    def section(self) -> Iterator[str]:
        result = self.result
        if not result.adaptive:
            yield self._group_table()
            units = (
                " To remove the effect of each participant's choice of unit, the interval is calculated from the ln "
                "answers after subtracting the participant's mean ln answer."
            )
            yield paragraph(
                f"The table shows the {mean_text(result)} across participants, with a 95 % confidence interval "
                "(Student's t) unless all participants have the same value. The tables by participant also show "
                "the number of answers." + (units if result.own_units else ""),
                "soft",
            )
        yield from drawn_figure(self.pictures, f"levels-{result.block}")
        if not result.adaptive:
            for standard in sorted({row.standard for row in self.rows}, key=lambda standard: standard or 0.0):
                yield self._people_table(standard)

    def _value(self, value: float) -> str:
        return f"{100 * value:.0f} %" if self.result.summary == "share" else f"{value:.3g}"

    def _group_table(self) -> str:
        result, rows = self.result, _group_answers(self.result)
        standards = any(row.standard is not None for row in rows)
        alone = result.level_kind == "value" and not standards
        return table_of(
            rows,
            (f"Standard{unit(result)}", lambda answers: cell_text(answers.standard)) if standards else None,
            None
            if result.level_kind in {None, "value"}
            else (level_text(result), lambda answers: cell_text(answers.level)),
            (
                level_text(result) if alone else f"Comparison{unit(result)}",
                lambda answers: cell_text(answers.comparison),
            ),
            ("participants", lambda answers: str(answers.participants)),
            ("n", lambda answers: str(answers.n)),
            (summary_text(result), lambda answers: self._value(answers.value)),
            ("95 % interval", lambda answers: interval_text(answers.low, answers.high, self._value)),
            words=1 if result.vary is None else 0,
        )

    def _people_table(self, standard: float | None) -> str:
        """Return a table with one row per participant and one column per level."""
        columns = [answers for answers in _group_answers(self.result) if answers.standard == standard]
        own_answers = {
            (row.participant, row.level, row.comparison): row
            for row in self.rows
            if row.standard == standard and not row.catch
        }

        def cell(person: str, level: LevelAnswers) -> str:
            answers = own_answers.get((person, level.level, level.comparison))
            if answers is None:
                return "–"
            return (
                f"{self._value(answers.value)} ({answers.n})"
                if answers.count is None
                else f"{answers.count}/{answers.n}"
            )

        names = [cell_text(answers.comparison if answers.level is None else answers.level) for answers in columns]
        return table(
            ("Participant" if standard is None else f"Standard {with_unit(self.result, standard)}", *names),
            [[person, *(cell(person, answers) for answers in columns)] for person in people(self.result)],
        )

    def _presented_levels(self, stimulus: Stimulus) -> str:
        """Return the presented levels as a phrase: "of 20, 60 and 120 ms", or their range if they are many."""
        levels = sorted({row.level for row in self.rows if row.level is not None and not row.catch})
        level_unit = "" if stimulus.level_kind == "weber" else f" {self.result.unit or ''}".rstrip()
        if self.result.adaptive or len(levels) > _MOST_LISTED:
            return f"from {cell_text(levels[0])} to {cell_text(levels[-1])}{level_unit}"
        return f"of {listed([cell_text(level) for level in levels])}{level_unit}"

    def methods(self, block: LevelBlock) -> Iterator[str]:
        if not self.rows:
            return
        stimulus, title = block.stimulus, self.result.title
        trial_counts = Counter[str]()
        for row in self.rows:
            if row.participant is not None:
                trial_counts[row.participant] += row.n
        minimum, maximum = min(trial_counts.values()), max(trial_counts.values())
        trials = counted(maximum, "trial") if minimum == maximum else f"{minimum} to {maximum} trials"
        design = f"{block.design.paper_name}, {trials} per participant"
        if stimulus is None:
            settings = [] if block.reference is None else [block.reference, *block.settings]
            conditions = listed([*map(_condition_text, settings)]) or "conditions"
            yield f"In “{title}” ({design}), {conditions} were compared."
            return
        kind, chosen = KINDS[stimulus.level_kind], ""
        if block.method is not None:
            tracks = block.method.track_phrase(stimulus)
            chosen = f"; levels were chosen by {block.method.paper_name}{f', {tracks}' if tracks else ''}"
        delays = dict.fromkeys(_delay_text(setting.of) for setting in block.settings if setting.of is not None)
        yield (
            f"In “{title}” ({design}), {self.result.quantity} was judged at {kind} {self._presented_levels(stimulus)}"
            f"{standards_phrase(self.result, self.rows)}{''.join(delays)}{chosen}."
        )
        if (modulus := block.design.first) is not None:
            yield (
                f"Before these trials, a level of {with_unit(self.result, modulus.level)} was presented as the "
                f"modulus, to which the number {modulus.number:g} was assigned."
            )
