"""Results of blocks of levels and their parts of a report, collected from the statistics in this folder."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Final

import pandas as pd

from study_app.analysis.data.blocks import LevelBlock, Setting, published_text, setting_name
from study_app.analysis.data.measures import quartiles_or_none
from study_app.analysis.data.study_tables import Study
from study_app.analysis.html_page import heading, paragraph, table_of
from study_app.analysis.levels.answers import SUMMARIES, Answers, Settings, chooses_units
from study_app.analysis.levels.statistic import interval_text, statistics
from study_app.analysis.levels.tracks import timed_answers, tracks
from study_app.analysis.page_layout import Picture
from study_app.analysis.results import GroupAnswers, LevelsResult
from study_app.analysis.wording import number

TRACK_COLUMNS: Final = (
    *("participant", "session", "trial", "block", "code", "track", "catch", "standard", "level", "level_delivered"),
    *("comparison", "arrangement", "analysed", "response", "value", "success", "right", "response_s", "reversal"),
    *("setting", "outcome"),
)
"""The columns of tracks that statistics read."""

_SEALED: Final = (
    "The standards, the levels, the contents of each interval and the correct answers appear here after unblinding."
)


def level_results(study: Study, rows: pd.DataFrame | None = None) -> tuple[LevelsResult, ...]:
    """Return the results of every main block of levels in session order.

    ``rows`` are those of `tracks`, if they are already known.
    """
    main = [block for block in study.levels if block.phase == "main"]
    if not main:
        return ()
    timed = timed_answers(study)
    opened = rows if rows is not None else tracks(study) if study.revealed else None
    opened = None if opened is None else opened[list(TRACK_COLUMNS)]  # grouping few columns is faster
    return tuple(_block_levels(study, block, timed, opened) for block in main)


def _block_levels(study: Study, block: LevelBlock, timed: pd.DataFrame, opened: pd.DataFrame | None) -> LevelsResult:
    counted = timed[(timed["block"] == block.id) & timed["counted"] & timed["response"].notna()]
    stimulus = block.stimulus
    result = LevelsResult(
        block=block.id,
        title=block.title,
        design=block.design.kind,
        revealed=opened is not None,
        times=tuple(_response_times(counted, block, setting) for setting in block.settings),
        summary=SUMMARIES[block.design.reply],
        counts=block.counts,
        guess_rate=block.design.guess_rate if block.has_correct_answer else None,
        bounds=next((question.bounds for question in study.others.questions if question.where.id == block.id), None),
        own_units=chooses_units(block),
        family=None if block.assumed is None else block.assumed.family,
        adaptive=block.method is not None and block.method.adaptive,
        published=block.published,
        device=study.own_dynamics,
    )
    if stimulus is not None:
        result = replace(
            result,
            vary=stimulus.vary,
            quantity=stimulus.quantity,
            unit=stimulus.unit,
            level_kind=stimulus.level_kind,
            spacing=stimulus.spacing,
        )
    if opened is not None:
        for statistic in statistics():
            rows = tuple(statistic.compute(block, opened, study, result))
            result = replace(result, statistics={**result.statistics, statistic.key: rows})
    return result


def _response_times(answers: pd.DataFrame, block: LevelBlock, setting: Setting) -> GroupAnswers:
    seconds = answers.loc[answers["code"] == setting.code, "response_s"].dropna().to_numpy(dtype=float)
    numbers = {"n": len(seconds), **quartiles_or_none(seconds)._asdict()}
    return GroupAnswers(setting.code, setting_name(setting, block.settings), numbers)


def level_section(result: LevelsResult, pictures: Sequence[Picture], estimator: str | None) -> Iterator[str]:
    """Yield the parts of a block's section that follow the counts of its answers.

    ``estimator`` is the name of the servo's velocity estimator, None if the receipt has none.
    """
    yield heading(3, "Response times")
    yield table_of(
        result.times,
        ("Condition" if result.revealed else "Code", lambda answers: answers.name),
        ("n", lambda answers: str(answers.numbers["n"])),
        ("median [s]", lambda answers: number(answers.numbers["median"])),
        ("quartiles [s]", lambda answers: interval_text(answers.numbers["q1"], answers.numbers["q3"], number)),
    )
    at_each = "Answers at each level" if result.vary is not None or not result.revealed else "Answers"
    if not Settings.rows_in(result):
        yield heading(3, "Answers as a function of level" if result.adaptive else at_each)
    if not result.revealed:
        yield paragraph(_SEALED)
        return
    if not Settings.rows_in(result) and not Answers.rows_in(result):
        yield paragraph("There are no answers to analyse yet.")
        return
    for statistic in (Settings,) if Settings.rows_in(result) else statistics():
        yield from statistic(result, {picture.name: picture for picture in pictures}, estimator).section()


def level_findings(result: LevelsResult) -> Iterator[str]:
    """Yield sentences on the findings of a block, with n and interval; nothing while the key is sealed."""
    sentences = [line for statistic in statistics() for line in statistic(result).sentences()]
    yield from sentences
    if sentences and result.published:
        published = [published_text(value, result.unit) for value in result.published]
        yield f"{result.title}: published values: {'; '.join(published)}."


def level_limits(result: LevelsResult) -> Iterator[str]:
    """Yield sentences on the limitations of a block's statistics."""
    for statistic in statistics():
        yield from statistic(result).limits()


def level_methods(blocks: Sequence[LevelBlock], levels: Sequence[LevelsResult]) -> Iterator[str]:
    """Yield the sentences of the methods paragraph about blocks with answers, once the key is open."""
    by_id = {block.id: block for block in blocks}
    opened = [level for level in levels if level.revealed and (Answers.rows_in(level) or Settings.rows_in(level))]
    for result in opened:
        for statistic in statistics():
            yield from statistic(result).methods(by_id[result.block])
    for statistic in statistics():
        yield from statistic.common_methods(opened)


def level_entries(result: LevelsResult) -> dict[str, Any]:
    """Return the report.json entries of a block's statistics; entries of later formats only if they have rows."""
    return {
        statistic.key: statistic.rows_in(result)
        for statistic in statistics()
        if statistic.since == 1 or statistic.rows_in(result)
    }
