"""Figures of the first page with each participant's values: hypotheses, estimates of levels, ratings and scores."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Final, NamedTuple

import pandas as pd

from study_app import figure_style as style
from study_app.analysis.data.blocks import QuestionPlace
from study_app.analysis.data.study_tables import Study
from study_app.analysis.figures.people_figures import Column, Mean, Panel, mean_of, people_picture
from study_app.analysis.levels.answers import Answers, Settings
from study_app.analysis.levels.exponents import Exponents
from study_app.analysis.levels.sensitivities import Sensitivities
from study_app.analysis.levels.statistic import LevelStatistic, level_text
from study_app.analysis.levels.thresholds import Thresholds
from study_app.analysis.page_layout import FigureTask, Picture, sample_text
from study_app.analysis.questions import scored
from study_app.analysis.results import ContrastResult, LevelsResult, Results
from study_app.number_text import capitalised
from study_app.protocol.participants import EACH_GROUP

_MEASURES: Final[tuple[tuple[type[LevelStatistic[Any]], str, str], ...]] = (
    (Thresholds, "threshold", "threshold"),
    (Settings, "pse", "point of subjective equality"),
    (Exponents, "exponent", "exponent"),
    (Sensitivities, "d_prime", "d′"),
)
"""Statistics of blocks of levels in order of preference, with the attribute and the name of the estimate."""

MOST_PANELS: Final = 9
"""The most panels of a figure of scores or questions; tables contain the others."""


_CELL_PLACES: Final = (0.0, 1.0, 2.5, 3.5)
"""Positions of the two conditions of each group of an interaction."""


class Estimates(NamedTuple):
    """The main estimates of a block of levels: rows of the group and of participants, and the name of the measure."""

    group: list[Any]
    own: list[Any]
    attribute: str
    words: str


class Numbers(NamedTuple):
    """The values of a score or a question: the name of each setting with each participant's value.

    ``bounds`` are the ends of the answer scale, ``codes`` and ``conditions`` those of the settings; ``unit`` is that of
    the values, or "".
    """

    title: str
    bounds: tuple[float, float] | None
    is_score: bool
    by_setting: tuple[tuple[str, dict[str, float]], ...]
    id: str = ""
    codes: tuple[str, ...] = ()
    conditions: tuple[str | None, ...] = ()
    unit: str = ""


def estimates_of(result: LevelsResult) -> Estimates | None:
    """Return the estimates that answer a block's question; None if there are none."""
    for statistic, attribute, words in _MEASURES:
        rows = [row for row in statistic.rows_in(result) if getattr(row, attribute) is not None]
        if own := [row for row in rows if row.participant is not None]:
            name = "point of subjective equality" if attribute == "threshold" and result.has_pse else words
            name = Settings.measure_name(result) if statistic is Settings else name
            return Estimates([row for row in rows if row.participant is None], own, attribute, name)
    answers = [answer for answer in Answers.rows_in(result) if not answer.catch]
    own = [answer for answer in answers if answer.participant is not None]
    words = (
        f"proportion of “{result.counts}” answers" if result.summary == "share" else f"{result.summary} of the answers"
    )
    return Estimates([answer for answer in answers if answer.participant is None], own, "value", words) if own else None


def place_of(estimate: Any) -> float | str | None:
    """Return the comparison, level or standard of an estimate."""
    places = (getattr(estimate, name, None) for name in ("comparison", "level", "standard"))
    return next((place for place in places if place is not None), None)


def summary_figure_tasks(
    study: Study, results: Results, numbers: Mapping[str, Sequence[Numbers]], forms: Sequence[str] = style.FORMATS
) -> Iterator[FigureTask]:
    """Yield the figures of hypotheses, of the estimates of blocks of levels, and of ``numbers`` (`numbers_of`)."""
    for number, contrast in enumerate(results.contrasts, start=1):
        compares_groups = contrast.contrast.groups is not None
        if any(side.values for side in contrast.sides) and not (compares_groups and _is_one_group(study)):
            name = f"hypothesis-{number}"
            yield contrast.contrast.blocks[0], name, partial(_hypothesis_picture, study, results, contrast, forms, name)
    for level in results.levels:
        if estimates_of(level) is not None:
            name = f"estimates-{level.block}"
            yield level.block, name, partial(_estimates_picture, study, level, forms, name)
    for where, of_place in numbers.items():
        name = f"answers-{where}"
        yield where, name, partial(_answers_picture, study, where, of_place[:MOST_PANELS], forms, name)


def _is_one_group(study: Study) -> bool:
    return study.split not in ("", EACH_GROUP)


def _hypothesis_picture(
    study: Study, results: Results, contrast: ContrastResult, forms: Sequence[str], name: str
) -> Picture:
    within = contrast.contrast.groups is None
    log = contrast.ratio
    columns = tuple(
        Column(
            name=side.name,
            values=side.values,
            mean=None if side.mean is None else Mean(value=side.mean, low=side.low, high=side.high),
            group=group,
        )
        for side, group in zip(contrast.sides, contrast.contrast.groups or ("", ""), strict=True)
    )
    chance = 0.0 if contrast.contrast.measure == "d_prime" else None
    panels = [Panel(columns=columns, joined=within, share=1.6, line=chance, log=log)]
    kind, sign = ("ratio", " ÷ ") if contrast.ratio else ("difference", " − ")
    if contrast.cells:
        cells = tuple(
            Column(
                name=cell.name,
                values=cell.values,
                mean=None if cell.mean is None else Mean(value=cell.mean, low=cell.low, high=cell.high),
                group=contrast.compared[place // 2],
            )
            for place, cell in enumerate(contrast.cells)
        )
        panels = [
            Panel(title="Values", columns=cells, places=_CELL_PLACES, share=3.2, line=chance, log=log),
            replace(panels[0], title=f"{kind.capitalize()}: {sign.join(cell.name for cell in contrast.cells[:2])}"),
        ]
    ends = contrast.interval
    mean = None if contrast.effect is None else Mean(
        value=contrast.effect, low=None if ends is None else ends.low, high=None if ends is None else ends.high
    )  # fmt: skip
    bound = contrast.contrast.bound
    panels.append(
        Panel(
            title="",
            columns=(Column(name=contrast.comparison, values=contrast.differences, mean=mean),),
            joined=False,
            line=1.0 if log else 0.0,
            bound=None if bound is None else (1 / bound, bound) if log else (-bound, bound),
            log=log,
        )
    )
    band_note = " Band: equivalence bounds." if bound is not None else ""
    is_weighted = contrast.contrast.measure == "threshold" and not (within and study.split)
    weights_note = " Means are weighted as in the test." if is_weighted else ""
    lines_note = "Each line connects a participant's two values. " if within or contrast.cells else ""
    if contrast.cells:
        lines_note = f"Left: each group under each condition. {lines_note}Middle: each participant's {kind}. "
    caption = (
        f"{capitalised(contrast.hypothesis)}. {lines_note}Right: {contrast.comparison}"
        f"{', for each participant and on average' if within else ''}; dashed line: no "
        f"difference.{band_note}{weights_note} "
        f"{sample_text(study, len({person for side in contrast.sides for person in side.values} & {*study.people}))}"
    )
    result = next((level for level in results.levels if level.block == contrast.contrast.blocks[0]), None)
    title, above = capitalised(contrast.measure_name or contrast.contrast.measure_text), _scale_title(contrast, result)
    return people_picture(study, contrast.contrast.blocks[0], name, title, caption, panels, forms, above=above)


def _scale_title(contrast: ContrastResult, result: LevelsResult | None) -> str:
    """Return the title of a hypothesis' scale."""
    measure = contrast.measure_name or contrast.contrast.measure_text
    if contrast.contrast.form is not None:
        return measure
    if contrast.contrast.measure in ("threshold", "pse") and result is not None:
        return level_text(result)
    return {"d_prime": "d′", "exponent": "Exponent"}.get(contrast.contrast.measure, "Points on the scale")


def _estimates_picture(study: Study, result: LevelsResult, forms: Sequence[str], name: str) -> Picture | None:
    estimates = estimates_of(result)
    if estimates is None:
        return None
    own = [row for row in estimates.own if row.participant in study.people]
    places = sorted({place_of(row) for row in own}, key=lambda place: (str(type(place)), place))
    alone = len(places) == 1
    log = estimates.attribute in ("threshold", "pse") and result.spacing == "log"

    def column(place: float | str | None) -> Column:
        at_place = [row for row in own if place_of(row) == place]
        group = next((row for row in estimates.group if place_of(row) == place), None)
        value = None if group is None else getattr(group, estimates.attribute)
        ends = {row.participant: (row.low, row.high) for row in at_place if None not in (row.low, row.high)}
        return Column(
            name="" if alone or place is None else place.replace("_", " ") if isinstance(place, str) else f"{place:g}",
            values={row.participant: getattr(row, estimates.attribute) for row in at_place},
            mean=None if group is None or value is None else Mean(value=value, low=group.low, high=group.high),
            ends=ends if alone and ends else None,
        )

    panel = Panel(columns=tuple(map(column, places)), log=log)
    people = len({row.participant for row in own})
    lines_note = " Thin lines: each participant's 95 % interval, sorted by value." if alone else ""
    caption = (
        f"{result.title}: {estimates.words} for each participant, and the mean with its 95 % interval.{lines_note} "
        f"{sample_text(study, people)}"
    )
    words = estimates.words if estimates.words == "d′" else capitalised(estimates.words)
    above = level_text(result) if estimates.attribute in ("threshold", "pse") else words
    axis = "Standard" if getattr(estimates.own[0], "level", None) is None else "Level"
    below = "" if result.quantity is None or alone else f"{axis}: {result.quantity} [{result.unit}]"
    title = f"{result.title}: {estimates.words}"
    return people_picture(study, result.block, name, title, caption, [panel], forms, above=above, below=below)


def numbers_of(study: Study) -> dict[str, list[Numbers]]:
    """Return scores and numeric answers by the place where they were asked, except in blocks of levels."""
    levels = {block.id for block in study.levels}
    places = dict.fromkeys(question.where.id for question in study.others.questions if question.where.id not in levels)
    return {where: numbers for where in places if (numbers := _numbers_at(study, where))}


def _numbers_at(study: Study, where: str) -> list[Numbers]:
    """Return the scores of a questionnaire or, if it has none, the numeric answers to its questions.

    If a hypothesis compares two settings, they are in the order of the hypothesis.
    """
    scores = [score for score in study.others.scores if score.where.id == where]
    units: dict[str, str] = {}
    tables: list[tuple[str, str, tuple[float, float] | None, QuestionPlace, pd.DataFrame]]
    if scores:
        tables = [
            (
                score.name,
                score.title,
                score.bounds,
                score.where,
                scored(study, score).rename(columns={"score": "value"}),
            )
            for score in scores
        ]
    else:
        questions = [
            question
            for question in study.others.questions
            if question.where.id == where and question.bounds is not None
        ]
        units = {question.id: question.unit for question in questions}
        tables = [
            (question.id, question.short, question.scale_ends, question.where, study.answers_to(question))
            for question in questions
        ]
    numbers = []
    in_hypotheses = [contrast.within for contrast in study.contrasts]
    for name, title, bounds, place, rows in tables:
        settings: list[tuple[str | None, str]] = [(setting.code, place.name(setting)) for setting in place.settings]
        if tuple(setting.condition for setting in reversed(place.settings)) in in_hypotheses:
            settings.reverse()
        by_setting = []
        for code, setting_name in settings or [(None, "")]:
            answers = (rows if code is None else rows[rows["code"] == code]).dropna(subset=["value"])
            means = answers.astype({"value": float}).groupby("participant")["value"].mean()
            by_setting.append((setting_name, {str(person): float(value) for person, value in means.items()}))
        if any(values for _, values in by_setting):
            codes = tuple(code for code, _ in settings if code is not None)
            numbers.append(
                Numbers(
                    id=name,
                    title=title,
                    bounds=bounds,
                    is_score=bool(scores),
                    by_setting=tuple(by_setting),
                    codes=codes,
                    conditions=tuple(setting.condition for setting in place.settings),
                    unit=units.get(name, ""),
                )
            )
    return numbers


def _answers_picture(study: Study, where: str, shown: Sequence[Numbers], forms: Sequence[str], name: str) -> Picture:
    panels = [
        Panel(
            title=f"{numbers.title} ({numbers.unit})" if numbers.unit else numbers.title,
            columns=tuple(
                Column(name=words, values=values, mean=mean_of(values.values())) for words, values in numbers.by_setting
            ),
            ends=numbers.bounds,
        )
        for numbers in shown
    ]
    people = len({person for panel in panels for column in panel.columns for person in column.values})
    title = next(question.where.title for question in study.others.questions if question.where.id == where)
    caption = (
        f"{title}: the value for each participant, and the mean with its 95 % confidence interval (Student's t). "
        f"{sample_text(study, people)}"
    )
    return people_picture(study, where, name, title, caption, panels, forms, above="")
