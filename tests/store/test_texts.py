"""Texts and what the store says of them, in reviewed files: lines, cells, words that reveal a condition, settings."""

import re
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft7Validator

from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.store.files.csv_files import Column, guard_formula, header, read_table, table_problems
from study_app.store.journals.journal_events import journal_schema, line_problem
from study_app.store.sessions.begin import check_participant
from study_app.store.verification.leaks import telltales
from study_app.store.workstation import ASIDE, DEFAULTS, MachineSettings, load_or_default, load_settings, save_settings
from study_app.user_folder import settings_file
from tests.golden import compare
from tests.transcripts import calls, played

ALL = {"n": 1, "t_s": 0.0, "at": "2026-03-01T10:00:00.000+01:00"}
COLUMNS = (
    Column("name", "text", "A name."),
    Column("count", "integer", "How many.", minimum=1, maximum=99),
    Column("speed", "number", "How fast.", unit="m/s", minimum=0, may_miss=True),
    Column("real", "flag", "Whether."),
    Column("level", "text", "Which.", levels=(("low", "little"), ("high", "much")), may_miss=True),
    Column("at", "time", "When."),
)
RIGHT = dict(zip(header(COLUMNS), ("x", "7", "0.5", "true", "low", "2026-03-01T10:00:00.000+01:00"), strict=True))


def line(fields: dict[str, Any], **more: Any) -> tuple[str | None, bool]:
    """Return the problem of a journal line, and whether the schema refuses it."""
    return line_problem(fields | more), any(Draft7Validator(journal_schema()).iter_errors(fields | more))


def cell(column: str, text: str) -> tuple[list[str], bool]:
    """Return the problems of a table, and whether it is read."""
    wrong = ['"' + value + '"' for value in (RIGHT | {column: text}).values()]
    table = "".join(f"{','.join(row)}\n" for row in (RIGHT, RIGHT.values(), wrong, wrong)).encode()
    try:
        read_table(table, COLUMNS)
    except ValueError as error:
        return list(table_problems(table, COLUMNS)), "is not" not in str(error)
    return list(table_problems(table, COLUMNS)), True


def settings(content: bytes) -> str:
    """Return the messages about a settings file."""
    settings_file().parent.mkdir(exist_ok=True)
    settings_file().write_bytes(content)
    loaded, messages = load_or_default()
    assert loaded == DEFAULTS
    save_settings(MachineSettings(screen="DP-1", theme="dark"))
    assert load_settings() == MachineSettings(screen="DP-1", theme="dark")
    assert settings_file().with_name(ASIDE).read_bytes() == content
    return re.sub(r"\(Expecting .*\)", "(...)", messages.replace(str(settings_file()), "FILE"))


def screen(*there: str, **chosen: Any) -> int:
    return MachineSettings(**chosen).screen_among(there)


NAMES = {"ALL": ALL, "LONG": 999 * "x"}
NAMES |= {function.__name__: function for function in (line, cell, guard_formula, settings, screen, check_participant)}


@pytest.mark.parametrize("file", sorted((Path(__file__).parent / "texts").iterdir()), ids=lambda file: file.stem)
def test_texts_are_checked_and_guarded_as_recorded(
    file: Path, protocol: Protocol, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, pytestconfig: pytest.Config
) -> None:
    monkeypatch.setenv("LIQUID_STUDY_CONFIG", str(tmp_path / "settings"))
    play = calls(NAMES | {"in_text": telltales(protocol).in_text}, StoreError)
    compare(file, played(file, play), pytestconfig, exact=True)
