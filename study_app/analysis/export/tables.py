"""The tables that are handed out, as typed frames with a description of every column.

Settings are codes until the key was opened, and the sealed columns are left out; then condition, liquid and delay
(asked for, and achieved) are columns.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

import numpy as np
import pandas as pd

from study_app.analysis.data.blocks import Block, Item, PlacedQuestion, PlacedScore, Setting
from study_app.analysis.data.measures import AGREEMENT, LEVELS, QUARTILES
from study_app.analysis.data.study_tables import Study, group_members
from study_app.analysis.levels.columns import ACHIEVED, JUDGED, OF_TRACKS, OPENED, RESULTS
from study_app.analysis.levels.evaluate import level_results
from study_app.analysis.levels.statistic import statistics
from study_app.analysis.levels.tracks import OF_INTERVALS, tracks
from study_app.analysis.questions import scored
from study_app.store.files import (
    INTERVALS,
    RESPONSES,
    TRIALS,
    TRIALS_MISSING,
    Column,
    Kind,
    header,
    optional,
    unsealed_columns,
)


@dataclass(frozen=True, eq=False)
class Delivered:
    """A table: its name, its columns in order, and a data frame with them."""

    name: str
    columns: tuple[Column, ...]
    frame: pd.DataFrame


SITE: Final = Column("site", "text", "The participant's site (the part of the ID before the dash).")


def _add_site(study: Study, table: Delivered) -> Delivered:
    """Return a table of a merged study with the column ``site`` after the participants; other tables unchanged."""
    if not study.sites or "participant" not in header(table.columns):
        return table
    place = header(table.columns).index("participant") + 1
    sites = pd.array([study.site_of(str(one)) for one in table.frame["participant"]], dtype="string")
    columns = (*table.columns[:place], SITE, *table.columns[place:])
    return _select_columns(table.name, columns, table.frame.assign(site=sites))


def _select_columns(name: str, columns: tuple[Column, ...], frame: pd.DataFrame) -> Delivered:
    """Return a table with these columns of a frame."""
    return Delivered(name, columns, frame[list(header(columns))])


_OF_TRIAL: Final = ("study", "participant", "session", "simulated", "pilot", "group", "trial", "attempt", "block")
_OF_BLOCK: Final = ("phase", "part", "index", "code")
_LEVEL_COLUMNS: Final = {column.name: column for column in (*TRIALS, *INTERVALS)}

_OF_PERSON: Final = tuple(_LEVEL_COLUMNS[name] for name in ("study", "participant", "simulated", "pilot", "group"))
_TYPES: Final[dict[Kind, str]] = {"text": "string", "number": "Float64", "integer": "Int64", "flag": "boolean"}

_TRACKS: Final = (*(_LEVEL_COLUMNS[name] for name in (*_OF_TRIAL, *_OF_BLOCK)), *JUDGED, TRIALS_MISSING, *OF_TRACKS)


def _level_tables(study: Study) -> Iterator[Delivered]:
    """Yield the tables of a study with levels; none for other studies."""
    if not study.levels:
        return
    intervals = INTERVALS if study.revealed else unsealed_columns(INTERVALS)
    yield _select_columns("intervals", (*intervals, *JUDGED, TRIALS_MISSING), study.intervals)
    if not study.revealed:
        return
    frame = _add_conditions(study, tracks(study)).rename(columns={"level": "level_asked"})
    # the frame has no column for an interval that no trial reached
    of_tracks = (*_TRACKS, *_may_miss((*OPENED, ACHIEVED)), *_interval_columns(study))
    yield _select_columns("tracks", of_tracks, frame.reindex(columns=list(header(of_tracks))))
    results = level_results(study, frame.rename(columns={"level_asked": "level"}))
    about = {"study": study.name, "simulated": study.simulated, "pilot": study.pilot}
    groups = dict(zip(frame["participant"], frame["group"], strict=True))
    for statistic in statistics():
        if statistic.exported_in(study):
            columns = (*_OF_PERSON, *RESULTS[statistic.table].columns)
            rows = [
                {**row, **about, "group": groups[row["participant"]]}
                for of in results
                for row in statistic(of).exported()
            ]
            table = pd.DataFrame(rows, columns=list(header(columns)))
            yield _select_columns(
                statistic.table, columns, table.astype({column.name: _TYPES[column.kind] for column in columns})
            )


def _interval_columns(study: Study) -> tuple[Column, ...]:
    """Return the force and speed columns, for the largest number of intervals per trial."""
    most = max(block.design.intervals for block in study.levels)
    return tuple(
        replace(column, name=f"{name}_{number}", description=f"{column.description} In interval {number}.")
        for name in OF_INTERVALS
        for column in (_LEVEL_COLUMNS[name],)
        for number in range(1, most + 1)
    )


def names_of_sealed(study: Study) -> set[str]:
    """Return the interval columns that are not exported before the key is opened."""
    return {column.name for column in INTERVALS if column.sealed} if study.levels else set()


_OF_A_FORM: Final = Setting(code="")
"""Stands for the setting of an answer in a form, which has none."""

_BY_NAME: Final = {column.name: column for column in TRIALS}


_MEASURED: Final = (
    Column("item", "text", "ID of the statement; its text is in the codebook."),
    Column("short", "text", "Short label of the statement."),
    Column("participants", "integer", "Number of participants with a valid answer.", minimum=0),
    Column(
        "presented",
        "integer",
        "Number of presentations after which participants were asked to rate the statement.",
        minimum=0,
    ),
    Column(
        "presented_excluded",
        "integer",
        "Number of presentations that exclusions.csv excludes individually; the other columns include neither them nor "
        "their answers.",
        minimum=0,
    ),
    Column("n", "integer", "Number of valid answers.", minimum=0),
    Column("cannot_judge", "integer", "Number of “cannot judge” answers.", minimum=0),
    Column("missing", "integer", "Number of presentations without an answer.", minimum=0),
    *(Column(f"count_{level}", "integer", f"Number of answers at level {level}.", minimum=0) for level in LEVELS),
    optional("median", "number", "Median of the valid answers.", minimum=1, maximum=7),
    optional("q1", "number", f"Lower quartile, by {QUARTILES}.", minimum=1, maximum=7),
    optional("q3", "number", f"Upper quartile, by {QUARTILES}.", minimum=1, maximum=7),
    optional(
        "agree_percent",
        "number",
        f"Percentage of valid answers that express agreement (levels {AGREEMENT[0]} to {AGREEMENT[-1]}).",
        unit="%",
        minimum=0,
        maximum=100,
    ),
)


def _may_miss(columns: tuple[Column, ...]) -> tuple[Column, ...]:
    """Return columns about a trial's setting that are empty for some rows: those of forms and of tracks."""
    return tuple(replace(column, may_miss=True) for column in columns)


def exported_tables(study: Study) -> tuple[Delivered, ...]:
    """Return responses, trials and aggregate of a study; with levels, also intervals, opened tracks and thresholds."""
    opened = OPENED if study.revealed else ()
    achieved = (*OPENED, ACHIEVED) if study.revealed else ()
    trials = TRIALS if study.revealed else unsealed_columns(TRIALS)
    judged = (*JUDGED, TRIALS_MISSING) if study.levels else JUDGED
    tables = (
        _select_columns(
            "responses", (*RESPONSES, *judged, *_may_miss(achieved)), _add_conditions(study, _add_delay_error(study))
        ),
        _select_columns(
            "trials",
            (*trials, *judged, *(_may_miss(achieved) if study.levels else achieved)),
            _add_conditions(study, study.trials),
        ),
        _select_columns("aggregate", (*_aggregate_head(), *opened, *_MEASURED), _aggregate(study)),
        *_level_tables(study),
    )
    return tuple(_add_site(study, table) for table in tables)


def _add_conditions(study: Study, table: pd.DataFrame) -> pd.DataFrame:
    """Add the condition of each code; empty for answers in forms and while the key is sealed."""
    pairs = zip(table["block"], table["code"], strict=True)
    settings = [setting.of or setting for setting in (study.settings.get(pair, _OF_A_FORM) for pair in pairs)]
    delay_ms = np.array([np.nan if setting.delay_ms is None else setting.delay_ms for setting in settings], np.float64)
    named = table.assign(
        condition=pd.array([setting.condition for setting in settings], dtype="string"),
        liquid=pd.array([setting.liquid for setting in settings], dtype="string"),
        delay_ms=delay_ms,
    )
    if "delay_error_mean_ms" in table:
        named["delay_achieved_ms"] = (table["delay_error_mean_ms"] + delay_ms).round(6)
    return named


def _add_delay_error(study: Study) -> pd.DataFrame:
    """Return the responses with the delay error of the preceding trial."""
    if not study.revealed:
        return study.answered
    trial = ["participant", "session", "trial", "attempt"]
    return study.answered.merge(study.trials[[*trial, "delay_error_mean_ms"]], on=trial, how="left")


def _aggregate_head() -> tuple[Column, ...]:
    return tuple(_BY_NAME[name] for name in ("study", "simulated", "pilot", "block", "code"))


def _aggregate(study: Study) -> pd.DataFrame:
    frames = []
    for block in study.blocks:
        frame = study.aggregate(block)
        shorts = frame["item"].map({item.id: item.short for item in block.items})
        frames.append(frame.assign(block=block.id, short=shorts))
    if not frames:
        names = [*header(_aggregate_head()), *header(OPENED), *header(_MEASURED)]
        return pd.DataFrame({name: pd.Series(dtype=object) for name in names})
    frame = pd.concat(frames, ignore_index=True)
    return _add_conditions(study, frame.assign(study=study.name, simulated=study.simulated, pilot=study.pilot))


@dataclass(frozen=True, slots=True)
class Cells:
    """The content of a wide-table column: answers to an item about a setting of a block."""

    block: Block
    setting: Setting
    item: Item


@dataclass(frozen=True, slots=True)
class QuestionCells:
    """The content of a wide-table column for another question or a questionnaire score."""

    asked: PlacedQuestion | PlacedScore
    setting: Setting | None


def wide_table(study: Study) -> tuple[Delivered, dict[str, Cells | QuestionCells]]:
    """Return the wide table of all valid answers, and the content of each of its columns.

    Columns are ``item__condition``, or ``item__code`` until the key is opened; if names would clash,
    ``block__item__condition``. Repeated settings have the median, as in the analysis; options and texts have the last
    answer. Questions of forms are ``form__item``, scores ``form__score``, and for repeated forms ``form__item__block``.
    """
    people, cells = list(study.people), _wide_cells(study)
    simulated = dict(zip(study.participants["participant"], study.participants["simulated"], strict=True))
    held = {
        "participant": pd.array(people, dtype="string"),
        "simulated": pd.array([bool(simulated[person]) for person in people], dtype="boolean"),
    }
    columns = [_BY_NAME["participant"], _BY_NAME["simulated"]]
    if groups := group_members(study):
        held["group"] = pd.array([groups.get(person) for person in people], dtype="string")
        columns.append(_BY_NAME["group"])
    for name, cell in cells.items():
        found = _statement(study, cell, people) if isinstance(cell, Cells) else _question(study, cell, people)
        held[name], description, (least, most) = found
        kind = next(kind for kind, dtype in _TYPES.items() if dtype == held[name].dtype.name)
        columns.append(optional(name, kind, description, minimum=least, maximum=most))
    return _add_site(study, Delivered("wide", tuple(columns), pd.DataFrame(held))), cells


def _wide_cells(study: Study) -> dict[str, Cells | QuestionCells]:
    """Return the content of each column of the wide table by name: statements, then other questions and scores."""
    statements = [
        (f"{item.id}__{setting.condition or setting.code}", Cells(block, setting, item))
        for block in study.blocks
        for setting in block.settings
        for item in block.items
    ]
    found: dict[str, Cells | QuestionCells] = {}
    asked: tuple[PlacedQuestion | PlacedScore, ...] = (*study.others.questions, *study.others.scores)
    levels = {block.id for block in study.levels}  # their answers belong to no track: see the table of tracks
    for other in (one for one in asked if one.where.id not in levels):
        called = other.name if isinstance(other, PlacedScore) else other.id
        for about in other.where.settings or (None,):
            ending = "" if about is None else f"__{about.condition or about.code}"
            found[f"{other.where.id}__{called}{ending}"] = QuestionCells(other, about)
    often = Counter((*found, *(name for name, _ in statements)))
    return {name if often[name] == 1 else f"{cells.block.id}__{name}": cells for name, cells in statements} | found


Answers: TypeAlias = tuple[pd.api.extensions.ExtensionArray, str, tuple[float | None, float | None]]
"""The cells of a column of the wide table, its description, and the ends of the scale."""


def _statement(study: Study, cells: Cells, people: list[str]) -> Answers:
    block, setting, item = cells.block, cells.setting, cells.item
    answers = study.answers(block)
    answers = answers[(answers["code"] == setting.code) & (answers["item"] == item.id)]
    description = f"{item.text} About {block.name(setting)}, in {block.title}."
    return _medians(answers, "response", people), description, (1, 7)


def _question(study: Study, cells: QuestionCells, people: list[str]) -> Answers:
    asked, setting = cells.asked, cells.setting
    answers = scored(study, asked) if isinstance(asked, PlacedScore) else study.answers_to(asked)
    about = ""
    if setting is not None:
        answers = answers[answers["code"] == setting.code]
        about = f" {asked.where.name(setting)}." if asked.where.is_form else f" About {asked.where.name(setting)}."
    if isinstance(asked, PlacedScore):
        of = f" of {asked.instrument}" if asked.instrument else ""
        description = f"Score {asked.name}{of}, in {asked.where.title}.{about}"
        return _medians(answers, "score", people), description, (None, None)
    text = asked.text if asked.text.endswith((".", "?", "!")) else f"{asked.text}."
    description = f"{text} In {asked.where.title}.{about}"
    if asked.question.value_type != "text":
        return _medians(answers, "value", people), description, asked.bounds or (None, None)
    last = answers.sort_values(["session", "trial"]).groupby("participant")["response"].last()
    return pd.array([last.get(person, pd.NA) for person in people], dtype="string"), description, (None, None)


def _medians(answers: pd.DataFrame, column: str, people: list[str]) -> pd.api.extensions.ExtensionArray:
    """Return each participant's median; missing without numbers, integers if all are."""
    numbers = answers[column].dropna().astype(float).groupby(answers["participant"]).median()
    values = numbers.reindex(people).to_numpy()
    missing = np.isnan(values)
    known = np.where(missing, 0, values)
    if (known == np.floor(known)).all():
        return pd.arrays.IntegerArray(known.astype(np.int64), missing)
    return pd.arrays.FloatingArray(known, missing)
