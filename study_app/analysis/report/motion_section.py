"""The section of the report on motion and force in each condition."""

from collections.abc import Iterator, Sequence
from typing import Final

from study_app.analysis.data.motion import (
    OF_REACHES,
    OF_TRIALS,
    REACH_DEFINITIONS,
    TRIAL_DEFINITIONS,
    MovementQuartiles,
    Performance,
)
from study_app.analysis.html_page import bullets, heading, paragraph, table
from study_app.analysis.results import BlockResult, Delivered, Results, name, settings_noun
from study_app.analysis.wording import counted, number

_UNITS: Final = {"s": "s", "m": "m", "mm": "mm", "n": "N", "percent": "%"}


def within_limits_text(delivered: Delivered) -> str:
    """Return how many of the measured trials met the limits: "7 of 9"."""
    return f"{delivered.valid} of {delivered.judged}" if delivered.judged else "not measured"


def motion_section(results: Results) -> Iterator[str]:
    """Yield the section on motion and force; nothing without blocks of trials."""
    if not results.trial_blocks:
        return
    yield heading(2, "Motion and force")
    measured = results.performance
    if measured is None:
        yield paragraph("Motion and force are shown only after unblinding, because they reveal liquids and delays.")
        return
    for result in results.trial_blocks:
        measures = [
            measure
            for measure in (*OF_TRIALS, *OF_REACHES)
            if any(_movement_measures(measured, result, measure=measure))
        ]
        rows = _motion_rows(result, measured, measures, results.delivered)
        if rows:
            yield heading(3, result.title)
            noun = settings_noun(result) if len(result.settings) > 1 else "condition"
            head = (noun.capitalize(), "n", *map(_measure_label, measures), "trials within limits")
            yield table(head, rows)
            if result.id not in measured.reaching:
                yield paragraph(
                    "This block does not contain a reaching task, so no movement times, overshoots or submovements "
                    "are reported.",
                    "soft",
                )
            elif not measured.recorded_in(result.id):
                yield paragraph(
                    "Without readable recordings of this block, reaching measures are not available.", "soft"
                )
    yield paragraph(_recordings_sentence(measured))
    recorded = any(measured.recorded_in(result.id) for result in results.trial_blocks)
    definitions = TRIAL_DEFINITIONS | (REACH_DEFINITIONS if recorded else {})
    yield bullets(f"{_measure_label(measure)}: {words}." for measure, words in definitions.items())
    yield paragraph(
        "The tables show the median across participants (with quartiles) of each participant's own median. “Trials "
        "within limits” shows how many of the measured trials met the protocol's limits; the other columns "
        "include all trials. These measures are not tested.",
        "soft",
    )


def _movement_measures(measured: Performance, result: BlockResult, **fields: str) -> Iterator[MovementQuartiles]:
    """Yield the movement measures of a block whose fields have the given values."""
    for moved in measured.moved:
        if moved.block == result.id and all(getattr(moved, field) == value for field, value in fields.items()):
            yield moved


def _motion_rows(
    result: BlockResult, measured: Performance, measures: Sequence[str], delivered: Sequence[Delivered]
) -> list[list[str]]:
    within_limits = {setting.code: within_limits_text(setting) for setting in delivered if setting.block == result.id}
    rows = []
    for setting in result.settings:
        measures_by_name = {
            moved.measure: moved for moved in _movement_measures(measured, result, code=setting.code) if moved.n
        }
        if measures_by_name:
            n = max(moved.n for moved in measures_by_name.values())
            cells = [
                _quartiles_text(measures_by_name[measure]) if measure in measures_by_name else "–"
                for measure in measures
            ]
            rows.append([name(result, setting.code), str(n), *cells, within_limits[setting.code]])
    return rows


def _quartiles_text(moved: MovementQuartiles) -> str:
    digits = 2 if moved.measure.endswith(("_s", "_n", "_m", "percent")) else 1
    return f"{number(moved.median, digits)} ({number(moved.q1, digits)}–{number(moved.q3, digits)})"


def _measure_label(measure: str) -> str:
    words, _, unit = measure.rpartition("_")
    if unit not in _UNITS:
        return measure.replace("_", " ")
    return f"{words.replace('_', ' ')}, {_UNITS[unit]}"


def _recordings_sentence(measured: Performance) -> str:
    if not measured.trials:
        return "The study does not contain any reaching trials, so reaching measures are not available."
    text = f"Reaching measures are based on the recordings of {measured.recorded} of {measured.trials} reaching trials"
    if measured.unread:
        text += f" (reasons for the others: {'; '.join(measured.unread)})"
    if not measured.judged:
        return f"{text}. No data are available on whether trials met the protocol's limits."
    if not measured.invalid:
        return f"{text}. All trials with measured timing met the protocol's limits."
    verb = "is" if measured.invalid == 1 else "are"
    invalid = f"{counted(measured.invalid, 'trial').capitalize()} exceeded the protocol's limits but {verb}"
    return f"{text}. {invalid} included."
