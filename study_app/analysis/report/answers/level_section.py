"""The section of a block of levels: times to answer and, once the key is open, the answers at each level."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from study_app.analysis.figures.levels.level_figure import level_words, mean_words, summary_words, with_unit
from study_app.analysis.figures.picture import Picture
from study_app.analysis.report.answers import level_conduct_section, settings_section, threshold_section
from study_app.analysis.report.answers.withheld_section import withheld
from study_app.analysis.report.html_page import drawn, heading, paragraph, table
from study_app.analysis.results.level_results import LevelAnswers, LevelsFound
from study_app.analysis.results.words import number

SEALED = (
    "Not yet revealed: standards, levels, what each interval presented, and which answers were correct. They appear "
    "here after unblinding."
)
EXPLAINED = (
    "{mean} over the participants, with the 95 % interval by Student's t where at least two participants differ. "
    "Below: each participant, with the number of answers."
)
OWN_UNITS = " The interval leaves out that each participant chose a unit: ln answers less the participant's mean."


def section(found: LevelsFound, pictures: Sequence[Picture], estimator: str | None) -> Iterator[str]:
    """Yield what a block's section says in addition to the counts of its answers.

    ``estimator`` is the name of the servo's velocity estimator, None where the receipt has none.
    """
    yield heading(3, "Time to answer")
    yield table(
        ("Setting" if found.revealed else "Code", "n", "median [s]", "quartiles [s]"),
        [[one.name, *_time_cells(one.numbers)] for one in found.times],
    )
    at_each = "Answers at each level" if found.vary is not None or not found.revealed else "Answers"
    if not found.settings:
        yield heading(3, "Answers over levels" if found.adaptive else at_each)
    if not found.revealed:
        yield paragraph(SEALED)
        return
    if found.settings:
        yield from settings_section.section(found, {one.name: one for one in pictures})
        return
    if not found.answers:
        yield paragraph("No answer counts yet.")
        return
    if not found.adaptive:
        yield _of_group(found)
        explained = EXPLAINED.format(mean=mean_words(found).capitalize())
        yield paragraph(explained + (OWN_UNITS if found.own_units else ""), "soft")
    yield from drawn({one.name: one for one in pictures}, f"levels-{found.block}")
    if not found.adaptive:
        for standard in sorted({one.standard for one in found.answers}, key=lambda one: one or 0.0):
            yield _of_people(found, standard)
    yield from threshold_section.section(found, {one.name: one for one in pictures})
    yield from level_conduct_section.section(found, estimator)
    yield from withheld(found)


def _time_cells(numbers: Mapping[str, Any]) -> list[str]:
    low, high = numbers["q1"], numbers["q3"]
    return [str(numbers["n"]), number(numbers["median"]), "–" if low is None else f"{number(low)} – {number(high)}"]


def _of_group(found: LevelsFound) -> str:
    columns = list(_columns(found))
    return table(
        (*(name for name, _ in columns), "participants", "n", summary_words(found), "95 % interval"),
        [
            [
                *(_plain(getattr(one, what)) for _, what in columns),
                str(one.participants),
                str(one.n),
                _value(found, one.value),
                _interval(found, one),
            ]
            for one in found.of_group
        ],
        words=1 if found.vary is None else 0,
    )


def _columns(found: LevelsFound) -> Iterator[tuple[str, str]]:
    """Yield the columns that say what was presented: heading, and field of the answers."""
    unit = f" [{found.unit}]" if found.unit else ""
    if any(one.standard is not None for one in found.of_group):
        yield f"Standard{unit}", "standard"
    if found.level_kind not in {None, "value"}:
        yield level_words(found), "level"
    if found.level_kind == "value" and not any(one.standard is not None for one in found.of_group):
        yield level_words(found), "comparison"
    else:
        yield f"Comparison{unit}", "comparison"


def _of_people(found: LevelsFound, standard: float | None) -> str:
    """Return a row per participant, a column per level."""
    shown = [one for one in found.of_group if one.standard == standard]
    own = {
        (one.participant, one.level, one.comparison): one
        for one in found.answers
        if one.standard == standard and not one.catch
    }
    names = [_plain(one.comparison if one.level is None else one.level) for one in shown]
    return table(
        ("Participant" if standard is None else f"Standard {with_unit(found, standard)}", *names),
        [
            [person, *(_cell(found, own.get((person, one.level, one.comparison))) for one in shown)]
            for person in found.people
        ],
    )


def _cell(found: LevelsFound, one: LevelAnswers | None) -> str:
    if one is None:
        return "–"
    if one.count is not None:
        return f"{one.count}/{one.n}"
    return f"{_value(found, one.value)} ({one.n})"


def _interval(found: LevelsFound, one: LevelAnswers) -> str:
    if one.low is None or one.high is None:
        return "–"
    return f"{_value(found, one.low)} – {_value(found, one.high)}"


def _value(found: LevelsFound, value: float) -> str:
    return f"{100 * value:.0f} %" if found.summary == "share" else f"{value:.3g}"


def _plain(value: float | str | None) -> str:
    if value is None:
        return "–"
    return value.replace("_", " ") if isinstance(value, str) else f"{value:.4g}"
