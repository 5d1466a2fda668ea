"""The tables of an export, as typed data frames with a description of every column.

Until the key is open, settings are codes and sealed columns are omitted. Afterwards, tables also have columns for
condition, liquid, and requested and achieved delay.
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
class ExportTable:
    """A table of an export: its name, its columns in order, and a data frame with these columns."""

    name: str
    columns: tuple[Column, ...]
    frame: pd.DataFrame


SITE: Final = Column("site", "text", "The participant's site (the part of the ID before the dash).")


def _add_site(study: Study, table: ExportTable) -> ExportTable:
    """Return a table with the column ``site`` after ``participant`` if the study is merged and the table has IDs."""
    if not study.sites or "participant" not in header(table.columns):
        return table
    place = header(table.columns).index("participant") + 1
    sites = pd.array([study.site_of(str(person)) for person in table.frame["participant"]], dtype="string")
    columns = (*table.columns[:place], SITE, *table.columns[place:])
    return _select_columns(table.name, columns, table.frame.assign(site=sites))


def _select_columns(name: str, columns: tuple[Column, ...], frame: pd.DataFrame) -> ExportTable:
    """Return a table with these columns of a frame."""
    return ExportTable(name, columns, frame[list(header(columns))])


_OF_TRIAL: Final = ("study", "participant", "session", "simulated", "pilot", "group", "trial", "attempt", "block")
_OF_BLOCK: Final = ("phase", "part", "index", "code")
_LEVEL_COLUMNS: Final = {column.name: column for column in (*TRIALS, *INTERVALS)}

_OF_PERSON: Final = tuple(_LEVEL_COLUMNS[name] for name in ("study", "participant", "simulated", "pilot", "group"))
_TYPES: Final[dict[Kind, str]] = {"text": "string", "number": "Float64", "integer": "Int64", "flag": "boolean"}

_TRACKS: Final = (*(_LEVEL_COLUMNS[name] for name in (*_OF_TRIAL, *_OF_BLOCK)), *JUDGED, TRIALS_MISSING, *OF_TRACKS)


def _level_tables(study: Study) -> Iterator[ExportTable]:
    """Yield the tables of a study with levels; none for other studies."""
    if not study.levels:
        return
    intervals = INTERVALS if study.revealed else unsealed_columns(INTERVALS)
    yield _select_columns("intervals", (*intervals, *JUDGED, TRIALS_MISSING), study.intervals)
    if not study.revealed:
        return
    frame = _add_conditions(study, tracks(study)).rename(columns={"level": "level_asked"})
    # reindex adds the columns of intervals that no trial reached
    track_columns = (*_TRACKS, *_optional_columns((*OPENED, ACHIEVED)), *_interval_columns(study))
    yield _select_columns("tracks", track_columns, frame.reindex(columns=list(header(track_columns))))
    results = level_results(study, frame.rename(columns={"level_asked": "level"}))
    study_fields = {"study": study.name, "simulated": study.simulated, "pilot": study.pilot}
    groups = dict(zip(frame["participant"], frame["group"], strict=True))
    for statistic in statistics():
        if statistic.is_exported_in(study):
            columns = (*_OF_PERSON, *RESULTS[statistic.table].columns)
            rows = [
                {**row, **study_fields, "group": groups[row["participant"]]}
                for result in results
                for row in statistic(result).export_rows()
            ]
            table = pd.DataFrame(rows, columns=list(header(columns)))
            yield _select_columns(
                statistic.table, columns, table.astype({column.name: _TYPES[column.kind] for column in columns})
            )


def _interval_columns(study: Study) -> tuple[Column, ...]:
    """Return the columns of force and speed in each interval of a trial."""
    most = max(block.design.intervals for block in study.levels)
    return tuple(
        replace(column, name=f"{name}_{number}", description=f"{column.description} In interval {number}.")
        for name in OF_INTERVALS
        for column in (_LEVEL_COLUMNS[name],)
        for number in range(1, most + 1)
    )


def sealed_interval_columns(study: Study) -> set[str]:
    """Return the interval columns that are not exported before the key is opened."""
    return {column.name for column in INTERVALS if column.sealed} if study.levels else set()


_OF_A_FORM: Final = Setting(code="")
"""The setting of answers in forms, which have none."""

_BY_NAME: Final = {column.name: column for column in TRIALS}


_MEASURE_COLUMNS: Final = (
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


def _optional_columns(columns: tuple[Column, ...]) -> tuple[Column, ...]:
    """Return columns that may have missing values, such as the condition of answers in forms."""
    return tuple(replace(column, may_miss=True) for column in columns)


def exported_tables(study: Study) -> tuple[ExportTable, ...]:
    """Return the tables of a study: responses, trials and aggregate; with levels also intervals.

    Once the key is open, a study with levels also has tracks and the tables of statistics.
    """
    opened = OPENED if study.revealed else ()
    achieved = (*OPENED, ACHIEVED) if study.revealed else ()
    trials = TRIALS if study.revealed else unsealed_columns(TRIALS)
    judged = (*JUDGED, TRIALS_MISSING) if study.levels else JUDGED
    tables = (
        _select_columns(
            "responses",
            (*RESPONSES, *judged, *_optional_columns(achieved)),
            _add_conditions(study, _add_delay_error(study)),
        ),
        _select_columns(
            "trials",
            (*trials, *judged, *(_optional_columns(achieved) if study.levels else achieved)),
            _add_conditions(study, study.trials),
        ),
        _select_columns("aggregate", (*_aggregate_head(), *opened, *_MEASURE_COLUMNS), _aggregate_frame(study)),
        *_level_tables(study),
    )
    return tuple(_add_site(study, table) for table in tables)


def _add_conditions(study: Study, table: pd.DataFrame) -> pd.DataFrame:
    """Return a table with the condition of each code, missing for answers in forms and while the key is sealed."""
    pairs = zip(table["block"], table["code"], strict=True)
    settings = [setting.of or setting for setting in (study.settings.get(pair, _OF_A_FORM) for pair in pairs)]
    delay_ms = np.array([np.nan if setting.delay_ms is None else setting.delay_ms for setting in settings], np.float64)
    opened = table.assign(
        condition=pd.array([setting.condition for setting in settings], dtype="string"),
        liquid=pd.array([setting.liquid for setting in settings], dtype="string"),
        delay_ms=delay_ms,
    )
    if "delay_error_mean_ms" in table:
        opened["delay_achieved_ms"] = (table["delay_error_mean_ms"] + delay_ms).round(6)
    return opened


def _add_delay_error(study: Study) -> pd.DataFrame:
    """Return the responses with the delay error of the preceding trial."""
    if not study.revealed:
        return study.answered
    trial = ["participant", "session", "trial", "attempt"]
    return study.answered.merge(study.trials[[*trial, "delay_error_mean_ms"]], on=trial, how="left")


def _aggregate_head() -> tuple[Column, ...]:
    return tuple(_BY_NAME[name] for name in ("study", "simulated", "pilot", "block", "code"))


def _aggregate_frame(study: Study) -> pd.DataFrame:
    frames = []
    for block in study.blocks:
        frame = study.aggregate(block)
        shorts = frame["item"].map({item.id: item.short for item in block.items})
        frames.append(frame.assign(block=block.id, short=shorts))
    if not frames:
        names = [*header(_aggregate_head()), *header(OPENED), *header(_MEASURE_COLUMNS)]
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
    """The content of a wide-table column for another question or a questionnaire score.

    ``occasion`` is the session and the number of the answer in that session, if a column has one of several answers.
    """

    asked: PlacedQuestion | PlacedScore
    setting: Setting | None
    occasion: tuple[int, int] | None = None

    def select(self, answers: pd.DataFrame) -> pd.DataFrame:
        """Return the rows of the column's setting and occasion."""
        if self.setting is not None:
            answers = answers[answers["code"] == self.setting.code]
        if self.occasion is None:
            return answers
        numbered = _number_answers(answers)
        return numbered[(numbered["session"] == self.occasion[0]) & (numbered["number"] == self.occasion[1])]


def wide_table(study: Study) -> tuple[ExportTable, dict[str, Cells | QuestionCells]]:
    """Return the wide table of all valid answers, and the content of each of its columns.

    Columns are ``item__condition``, or ``item__code`` until the key is opened; if names would not be unique, they are
    ``block__item__condition``. A column has the median of repeated answers; options and texts have a column for each
    answer, whose name ends with the session and the number of the answer in the session, if there are several.
    Questions of forms are ``form__item``, scores ``form__score``, and for repeated forms ``form__item__block``.
    """
    participants, cells = list(study.people), _wide_cells(study)
    simulated = dict(zip(study.participants["participant"], study.participants["simulated"], strict=True))
    values_by_name = {
        "participant": pd.array(participants, dtype="string"),
        "simulated": pd.array([bool(simulated[person]) for person in participants], dtype="boolean"),
    }
    columns = [_BY_NAME["participant"], _BY_NAME["simulated"]]
    if groups := group_members(study):
        values_by_name["group"] = pd.array([groups.get(person) for person in participants], dtype="string")
        columns.append(_BY_NAME["group"])
    for name, cell in cells.items():
        column = (
            _statement_column(study, cell, participants)
            if isinstance(cell, Cells)
            else _question_column(study, cell, participants)
        )
        values_by_name[name], description, (minimum, maximum) = column
        kind = next(kind for kind, dtype in _TYPES.items() if dtype == values_by_name[name].dtype.name)
        columns.append(optional(name, kind, description, minimum=minimum, maximum=maximum))
    return _add_site(study, ExportTable("wide", tuple(columns), pd.DataFrame(values_by_name))), cells


def _wide_cells(study: Study) -> dict[str, Cells | QuestionCells]:
    """Return the content of each column of the wide table by name: statements, other questions, scores."""
    statements = [
        (f"{item.id}__{setting.condition or setting.code}", Cells(block, setting, item))
        for block in study.blocks
        for setting in block.settings
        for item in block.items
    ]
    other_cells: dict[str, Cells | QuestionCells] = {}
    questions: tuple[PlacedQuestion | PlacedScore, ...] = (*study.others.questions, *study.others.scores)
    levels = {block.id for block in study.levels}  # their answers are in the table of tracks
    for other in (question for question in questions if question.where.id not in levels):
        question_name = other.name if isinstance(other, PlacedScore) else other.id
        for setting in other.where.settings or (None,):
            ending = "" if setting is None else f"__{setting.condition or setting.code}"
            for occasion_ending, cells in _cells_by_occasion(study, QuestionCells(other, setting)):
                other_cells[f"{other.where.id}__{question_name}{ending}{occasion_ending}"] = cells
    name_counts = Counter((*other_cells, *(name for name, _ in statements)))
    return {
        name if name_counts[name] == 1 else f"{cells.block.id}__{name}": cells for name, cells in statements
    } | other_cells


def _cells_by_occasion(study: Study, cells: QuestionCells) -> Iterator[tuple[str, QuestionCells]]:
    """Yield the end of the name and the content of each column of a question: one unless options or texts repeat."""
    question = cells.asked
    answers = None
    if not isinstance(question, PlacedScore) and question.question.value_type == "text":
        answers = _number_answers(cells.select(study.answers_to(question)))
    if answers is None or not answers["participant"].duplicated().any():
        yield "", cells
        return
    occasions = sorted({*zip(answers["session"].astype(int), answers["number"].astype(int), strict=True)})
    sessions, numbers = (len({occasion[place] for occasion in occasions}) > 1 for place in (0, 1))
    for session, number in occasions:
        yield f"{f'__{session}' * sessions}{f'__{number}' * numbers}", replace(cells, occasion=(session, number))


def _number_answers(answers: pd.DataFrame) -> pd.DataFrame:
    """Return answers with their ``number`` among the participant's answers in the session, from 1."""
    ordered = answers.sort_values(["session", "trial"], kind="stable")
    return ordered.assign(number=ordered.groupby(["participant", "session"]).cumcount() + 1)


Answers: TypeAlias = tuple[pd.api.extensions.ExtensionArray, str, tuple[float | None, float | None]]
"""The cells of a column of the wide table, its description, and the ends of the scale."""


def _statement_column(study: Study, cells: Cells, participants: list[str]) -> Answers:
    block, setting, item = cells.block, cells.setting, cells.item
    answers = study.answers(block)
    answers = answers[(answers["code"] == setting.code) & (answers["item"] == item.id)]
    description = f"{item.text} About {block.name(setting)}, in {block.title}.{_repeats_note(answers, 'median')}"
    return _median_column(answers, "response", participants), description, (1, 7)


def _question_column(study: Study, cells: QuestionCells, participants: list[str]) -> Answers:
    question, setting = cells.asked, cells.setting
    answers = cells.select(scored(study, question) if isinstance(question, PlacedScore) else study.answers_to(question))
    setting_note = ""
    if setting is not None:
        setting_note = (
            f" {question.where.name(setting)}." if question.where.is_form else f" About {question.where.name(setting)}."
        )
    if isinstance(question, PlacedScore):
        instrument = f" of {question.instrument}" if question.instrument else ""
        description = f"Score {question.name}{instrument}, in {question.where.title}.{setting_note}"
        description += _repeats_note(answers, "median", _MEAN_ELSEWHERE)
        return _median_column(answers, "score", participants), description, (None, None)
    text = question.text if question.text.endswith((".", "?", "!")) else f"{question.text}."
    description = f"{text} In {question.where.title}.{setting_note}"
    if question.question.value_type != "text":
        description += _repeats_note(answers, "median", _MEAN_ELSEWHERE)
        return _median_column(answers, "value", participants), description, question.bounds or (None, None)
    if cells.occasion is not None:
        description += " Session {}, answer {}.".format(*cells.occasion)
    texts = answers.groupby("participant")["response"].first()
    return pd.array([texts.get(person, pd.NA) for person in participants], dtype="string"), description, (None, None)


_MEAN_ELSEWHERE: Final = " (hypotheses and the first page of the report use the mean)"


def _repeats_note(answers: pd.DataFrame, which: str, note: str = "") -> str:
    """Return a sentence on which of a participant's answers a cell has, with a note; "" if everybody answered once."""
    is_repeated = bool(answers["participant"].duplicated().any())
    return f" The {which} of each participant's answers{note}." if is_repeated else ""


def _median_column(answers: pd.DataFrame, column: str, participants: list[str]) -> pd.api.extensions.ExtensionArray:
    """Return each participant's median, missing without numbers; the type is integer if all medians are whole."""
    numbers = answers[column].dropna().astype(float).groupby(answers["participant"]).median()
    values = numbers.reindex(participants).to_numpy()
    missing = np.isnan(values)
    filled = np.where(missing, 0, values)
    if (filled == np.floor(filled)).all():
        return pd.arrays.IntegerArray(filled.astype(np.int64), missing)
    return pd.arrays.FloatingArray(filled, missing)
