"""The column dictionary as text: the page Data dictionary of the documentation."""

from collections.abc import Sequence

from study_app.store.files.columns import (
    EXCLUSIONS,
    FRAMES,
    GROUP,
    INTERVALS,
    PARTICIPANTS,
    RESPONSES,
    SAMPLES,
    TRIALS,
    with_missing_trials,
)
from study_app.store.files.csv_files import Column
from study_app.store.journals.journal_events import EVENTS

_SECTIONS: tuple[tuple[str, str, str, Sequence[Column]], ...] = (
    ("Responses", "subject-…_description-responses_data.csv", "one row per response", RESPONSES),
    ("Trials", "subject-…_description-trials_data.csv", "one row per presentation of a trial", TRIALS),
    (
        "Intervals",
        "subject-…_description-intervals_data.csv",
        "one row per interval, in studies with designs",
        INTERVALS,
    ),
    ("Participants", "study-…_description-participants_data.csv", "one row per session", PARTICIPANTS),
    (
        "Participants, groups",
        "study-…_description-participants_data.csv",
        "an additional column in studies with groups, and in every study after unblinding",
        (GROUP,),
    ),
    (
        "Participants, interval trials",
        "study-…_description-participants_data.csv",
        "columns that differ in studies with interval trials",
        tuple(column for column in with_missing_trials(PARTICIPANTS) if column not in PARTICIPANTS),
    ),
    ("Exclusions", "exclusions.csv", "one row per excluded session or trial", EXCLUSIONS),
    ("Samples", "recordings/trial-….parquet", "one row per servo tick", SAMPLES),
    ("Frames", "recordings/trial-…_frames.parquet", "one row per frame shown", FRAMES),
)
"""Title, file, meaning of a row, and columns of each table."""


def dictionary_markdown() -> str:
    """Return the columns of every file and the journal's events as Markdown, each with a heading and a table."""
    return "\n".join((*(table_markdown(*section) for section in _SECTIONS), _journal()))


def table_markdown(title: str, file: str, row: str, columns: Sequence[Column]) -> str:
    """Return a heading, the meaning of a row and a table of the columns as Markdown."""
    rows = [
        f"| `{column.name}` | {column.permitted}{f' [{column.unit}]' if column.unit else ''} | "
        f"{column.variable['description']}{' **Sealed until unblinding.**' if column.sealed else ''} |"
        for column in columns
    ]
    return _section(title, file, row, ("| column | value | meaning |", "| --- | --- | --- |", *rows))


def _section(title: str, file: str, row: str, lines: Sequence[str]) -> str:
    return "\n".join((f"## {title}", "", f"`{file}`: {row}", "", *lines, ""))


def _journal() -> str:
    head = (
        "Every line has `n` (counting from 1, without gaps), `event`, `t_s` (on the session's clock), `at` (ISO 8601) "
        "and `previous` (SHA-256 of all bytes before it). `session_started` has `format` 2; format 1 did "
        "not have `previous`.",
        "",
        "| event | fields | meaning |",
        "| --- | --- | --- |",
    )
    rows = [
        f"| `{name}` | {', '.join(f'`{field}`' for field in event.required)} | "
        f"{' '.join((event.__doc__ or '').split())} |"
        for name, event in EVENTS.items()
    ]
    return _section("Journal", "journal.jsonl", "one line per event", (*head, *rows))
