"""One session of a results folder, read from its receipt and its tables and checked against each other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from study_app.analysis import reading
from study_app.analysis.questions import Block, main_blocks, spoken, text_in
from study_app.errors import AnalysisError
from study_app.store.blinding import Key
from study_app.store.columns import TABLES
from study_app.store.layout import SessionFolder


@dataclass(frozen=True)
class Session:
    """What was asked, what was answered, and the facts of the visit (``facts``: one row of ``Study.participants``)."""

    folder: SessionFolder
    study: str
    title: str
    version: str
    blocks: tuple[Block, ...]
    facts: Mapping[str, Any]
    responses: pd.DataFrame
    trials: pd.DataFrame

    @property
    def asked(self) -> tuple[tuple[str, tuple[str, ...], tuple[str, ...]], ...]:
        """Block, codes and items: what must be alike in sessions that are pooled."""
        return tuple((block.id, block.codes_as_dealt, tuple(item.id for item in block.items)) for block in self.blocks)


def read_session(folder: SessionFolder, key: Key | None) -> Session:
    """Read a session; ``key`` is the study's once it was opened.

    Raises
    ------
    AnalysisError
        A file of it is missing, damaged or of another session.
    """
    receipt = reading.document(folder.receipt)
    try:
        protocol = receipt["protocol"]
        head = protocol["study"]
        study, title, version = str(head["name"]), text_in(head["title"], spoken(protocol)), str(head["version"])
        facts = {
            "participant": folder.participant,
            "session": folder.number,
            **{name: receipt[name] for name in ("simulated", "pilot", "status", "language", "started_at", "ended_at")},
            "device": receipt["device"].get("name"),
            "key_hash": receipt["key_hash"],
        }
        blocks = main_blocks(protocol, key)
    except (KeyError, TypeError, AttributeError) as error:
        raise AnalysisError(
            f"{folder.receipt} does not describe the session ({type(error).__name__}: {error}): it was changed, or "
            "written by another version of the program; restore it from a copy"
        ) from error
    session = Session(
        folder=folder,
        study=study,
        title=title,
        version=version,
        blocks=blocks,
        facts=facts,
        responses=_table(folder, study, "responses"),
        trials=_table(folder, study, "trials"),
    )
    _check_answers(session)
    return session


def _table(folder: SessionFolder, study: str, name: str) -> pd.DataFrame:
    """Read a table of a session, whose rows must be that session's."""
    path = folder.table(study, name)
    found = reading.table(path, TABLES[name])
    for column, value in {"study": study, "participant": folder.participant, "session": folder.number}.items():
        foreign = found[found[column] != value]
        if len(foreign):
            raise AnalysisError(
                f"{path}, row {foreign.index[0] + 1}, column {column}: {str(foreign[column].iloc[0])!r} instead of "
                f"{str(value)!r}: the file belongs elsewhere; restore this session's own from a copy"
            )
    return found


def _check_answers(session: Session) -> None:
    """Refuse answers that nobody asked for, and answers given twice."""
    path = session.folder.table(session.study, "responses")
    items = {(block.id, item.id) for block in session.blocks for item in block.items}
    codes = {(block.id, code) for block in session.blocks for code in block.codes}
    rows = session.responses[session.responses["phase"] == "main"]
    for row, block, code, item in zip(rows.index + 1, rows["block"], rows["code"], rows["item"], strict=True):
        if (block, item) not in items or (block, code) not in codes:
            raise AnalysisError(
                f"{path}, row {row}: the receipt knows no statement {item!r} on a setting {code!r} in block {block!r}: "
                "the file was changed or belongs to another study; make it again from the journal: "
                f"liquid-study rebuild {session.folder.path}"
            )
    twice = session.responses[session.responses.duplicated(["trial", "attempt", "item"])]
    if len(twice):
        raise AnalysisError(
            f"{path}, row {twice.index[0] + 1}: the answer to {twice['item'].iloc[0]!r} in trial "
            f"{twice['trial'].iloc[0]} stands there twice; make the table again from the journal: liquid-study rebuild "
            f"{session.folder.path}"
        )
