"""What tables and progress are made of a journal's lines: as files that people review."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from study_app.store.journals.journal_events import Event
from study_app.store.session_progress.progress import progress_of
from study_app.store.tables.session_tables import SessionRows, participant_row
from tests.golden import compare
from tests.journal_lines import event_of
from tests.transcripts import acts, every, played, value_of

FILES = every(Path(__file__).parent / "transcripts", "progress rows")
OF_ALL = ("study", "participant", "session", "simulated", "pilot", "phase", "part", "device", "operator")
PROGRESS = ("step", "page", "trial", "attempt", "task_done", "answers", "unconfirmed", "ended", "resumed", "language")


class Lines:
    """A growing journal: each public method adds a line or yields the tables of all lines."""

    def __init__(self, **session: Any) -> None:
        self._lines: list[Event] = []
        begin_fields = {"study": "brackish", "participant": "P007", "session": 1, "simulated": False, "pilot": False}
        self.line("session_started", **(begin_fields | {"language": "en", "device": "mouse", "seed": 11} | session))

    def line(self, event: str, t_s: float | None = None, **fields: Any) -> None:
        n = len(self._lines) + 1
        at = f"2026-03-01T10:00:{n:02d}.000+01:00"
        self._lines.append(event_of(event, n=n, t_s=float(n) if t_s is None else t_s, at=at, **fields))

    def nothing(self) -> None:
        """Begin anew, without a line."""
        self._lines.clear()

    def shown(self, page: str) -> None:
        self.line("page_shown", page=page)

    def left(self, page: str) -> None:
        self.line("page_left", page=page)

    def started(self, trial: int, attempt: int = 1, phase: str = "main") -> None:
        trial_fields = {"block": "liquids", "phase": phase, "part": 1, "index": trial, "of": 3, "code": f"L{trial}"}
        self.line("trial_started", trial=trial, attempt=attempt, **trial_fields)

    def ended(self, trial: int, attempt: int = 1, outcome: str = "complete", **summary: Any) -> None:
        self.line("trial_ended", trial=trial, attempt=attempt, outcome=outcome, **summary)

    def seen(self, item: str, at_s: float) -> None:
        self.line("item_shown", at_s, trial=1, item=item)

    def chosen(self, item: str, value: int | None, at_s: float) -> None:
        self.line("choice", at_s, trial=1, item=item, value=value)

    def answered(self, trial: int, *values: int | None, attempt: int = 1) -> None:
        answer_fields = {"onset_s": 1.0, "first_s": 2.0, "last_s": 3.0, "changes": 1}
        items = [
            {"item": f"i{n}", "number": n, "value": value, **answer_fields} for n, value in enumerate(values, start=1)
        ]
        self.line("responses", trial=trial, attempt=attempt, items=items)

    def note(self, kind: str, text: str) -> None:
        self.line("note", kind=kind, text=text)

    def rows(self) -> Iterator[str]:
        session_rows = SessionRows(self._lines)
        for name, table in (
            ("trial", session_rows.trials),
            ("interval", session_rows.intervals),
            ("response", session_rows.responses),
        ):
            for row in table:
                cells = {column: value for column, value in row.items() if value is not None and column not in OF_ALL}
                yield f"{name} {cells}"

    def person(self) -> Iterator[str]:
        yield str({column: value for column, value in participant_row(self._lines).items() if value is not None})

    def progress(self) -> Iterator[str]:
        progress_now = progress_of(self._lines)
        fields = {name: getattr(progress_now, name) for name in PROGRESS}
        yield ", ".join(f"{name} {value}" for name, value in fields.items() if value)


def begun(start: str) -> Lines:
    journal: Lines = value_of(f"lines({start})", {"lines": Lines})
    return journal


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_rows_and_progress_of_journal_lines_are_as_recorded(file: Path, pytestconfig: pytest.Config) -> None:
    compare(file, played(file, acts(begun, {})), pytestconfig)
