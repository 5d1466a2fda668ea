"""The sessions of a results folder, read from their receipts and their tables and checked against each other."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from study_app.analysis.results.level_results import OwnDynamics
from study_app.analysis.tables import typed_files
from study_app.analysis.tables.asked_questions import NOTHING_ELSE, AskedQuestions, asked_questions
from study_app.analysis.tables.compared_blocks import Block, main_blocks, spoken
from study_app.analysis.tables.level_blocks import LevelBlock, level_blocks
from study_app.analysis.tables.typed_files import Whole
from study_app.errors import AnalysisError
from study_app.protocol.table import text_in
from study_app.store.blinded.blinding import Key
from study_app.store.folders import SessionFolder, check_study_name
from study_app.store.tables.columns import tables_of


@dataclass(frozen=True)
class Session:
    """What was asked, what was answered, and the facts of the visit (``facts``: one row of ``Study.participants``).

    ``own_dynamics`` are the device's own damping [N·s/m], friction [N] and mass [kg], means over axes; None where they
    were not measured. ``device_velocity`` is whether the device measured its velocity, in place of the estimator.
    """

    folder: SessionFolder
    study: str
    title: str
    version: str
    protocol: Mapping[str, Any]
    blocks: tuple[Block, ...]
    facts: Mapping[str, Any]
    others: AskedQuestions = NOTHING_ELSE
    levels: tuple[LevelBlock, ...] = ()
    own_dynamics: tuple[float, float, float] | None = None
    device_velocity: bool = False

    @property
    def asked(self) -> tuple[tuple[str, tuple[str, ...], tuple[str, ...]], ...]:
        """Block, codes and items, and forms with their items: what must be alike in sessions that are pooled."""
        blocks = ((block.id, block.codes_as_dealt, tuple(item.id for item in block.items)) for block in self.blocks)
        others = ((one.where.id, (one.id,), (one.question.kind_id,)) for one in self.others.questions)
        return (*blocks, *others)

    @property
    def protocol_format(self) -> int:
        """The format of the study's protocol."""
        return int(self.protocol.get("format", 1))


def read_session(folder: SessionFolder, key: Key | None, like: Session | None = None) -> Session:
    """Read a session's receipt; ``key`` is the study's once it was opened.

    ``like`` is another session of the study: of what is the same in both one copy is kept.

    Raises
    ------
    AnalysisError
        The receipt is missing or damaged.
    """
    receipt = typed_files.document(folder.receipt)
    try:
        protocol = receipt["protocol"]
        if like is not None and protocol == like.protocol:
            protocol = like.protocol
        head = protocol["study"]
        study, title, version = (
            check_study_name(head["name"]),
            text_in(head["title"], spoken(protocol)),
            str(head["version"]),
        )
        facts = {
            "participant": folder.participant,
            "session": folder.number,
            **{name: receipt[name] for name in ("simulated", "pilot", "status", "language", "started_at", "ended_at")},
            "device": receipt["device"].get("name"),
            "motors_masked": _masking(receipt.get("motors_masked")),
            "protocol_version": version,
            "key_hash": receipt["key_hash"],
            **{name: receipt.get(name) for name in ("seed", "protocol_hash", "version")},
        }
        own_dynamics = _own_dynamics(receipt["device"].get("bench"))
        device_velocity = receipt["device"].get("estimator") == "device"
        alike = like is not None and protocol is like.protocol
        blocks = like.blocks if like is not None and alike else main_blocks(protocol, key)
        others = like.others if like is not None and alike else asked_questions(protocol, key)
        levels = like.levels if like is not None and alike else level_blocks(protocol, key)
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise AnalysisError(
            f"{folder.receipt} does not describe the session ({type(error).__name__}: {error}): it was changed, or "
            "written by another version of the program; restore it from a copy"
        ) from error
    return Session(
        folder, study, title, version, protocol, blocks, facts, others, levels, own_dynamics, device_velocity
    )


def _own_dynamics(bench: Mapping[str, Any] | None) -> tuple[float, float, float] | None:
    """Return damping, friction and mass of a receipt's bench, each the mean over its axes."""
    if bench is None:
        return None
    damping_nspm, friction_n, mass_kg = (
        float(np.mean([float(value) for value in bench[name]])) for name in ("damping_nspm", "friction_n", "mass_kg")
    )
    return damping_nspm, friction_n, mass_kg


def estimators_of(records: Sequence[Session]) -> str | None:
    """Return the names of the velocity estimators of all sessions: "kalman", "device" or "kalman or device"."""
    own = records[0].protocol.get("scene", {}).get("velocity", {}).get("kind")
    measured = [one.device_velocity for one in records]
    names = [*([] if all(measured) or own is None else [str(own)]), *(["device"] if any(measured) else [])]
    return " or ".join(names) or None


def mean_dynamics(records: Sequence[Session]) -> OwnDynamics | None:
    """Return the mean of what sessions know of the device's own dynamics; None where none knows them."""
    known = [one.own_dynamics for one in records if one.own_dynamics is not None]
    if not known:
        return None
    damping_nspm, friction_n, mass_kg = np.mean(known, axis=0).tolist()
    return OwnDynamics(damping_nspm, friction_n, mass_kg, len(known), len(records))


def _masking(answer: Mapping[str, Any] | None) -> str | None:
    """Return how motors were masked in words, None where that was not asked."""
    if answer is None:
        return None
    level = answer.get("noise_db")
    return str(answer["means"]) if level is None else f"{answer['means']} of {level} dB"


def read_tables(sessions: Sequence[Session], name: str) -> pd.DataFrame:
    """Read table ``name`` of sessions that were asked alike, with ``session_status`` added; rows in their order.

    Raises
    ------
    AnalysisError
        A file is missing, damaged or of another session, or answers what was not asked.
    """
    paths = [session.folder.table(session.study, name) for session in sessions]
    table, lengths = typed_files.tables(paths, tables_of(sessions[0].protocol_format)[name])
    _check_own(sessions, paths, table, lengths)
    if name == "responses":
        _check_answers(sessions, paths, table, lengths)
    status = np.repeat([session.facts["status"] for session in sessions], lengths)
    return table.assign(session_status=pd.array(status, dtype="string"))


def _check_own(sessions: Sequence[Session], paths: Sequence[Path], table: pd.DataFrame, lengths: Whole) -> None:
    """Refuse rows that are not of the session whose file they stand in."""
    own: dict[str, list[Any]] = {
        "study": [session.study for session in sessions],
        "participant": [session.folder.participant for session in sessions],
        "session": [session.folder.number for session in sessions],
    }
    for column, values in own.items():
        found = table[column].to_numpy()
        foreign = np.flatnonzero(found != np.repeat(np.array(values, dtype=object), lengths))
        if len(foreign):
            which, row = _place(lengths, int(foreign[0]))
            raise AnalysisError(
                f"{paths[which]}, row {row}, column {column}: {str(found[foreign[0]])!r} instead of "
                f"{str(values[which])!r}: the file belongs elsewhere; restore this session's own from a copy"
            )


def _check_answers(sessions: Sequence[Session], paths: Sequence[Path], table: pd.DataFrame, lengths: Whole) -> None:
    """Refuse answers to what was not asked, and answers given twice."""
    blocks = sessions[0].blocks
    asked = {(block.id, code, item.id) for block in blocks for code in block.codes for item in block.items}
    asked |= {
        (one.where.id, setting.code, one.id) for one in sessions[0].others.questions for setting in one.where.settings
    }
    main = np.flatnonzero(table["phase"].eq("main").fillna(False).to_numpy(dtype=bool))
    answered = zip(*(table[name].to_numpy()[main] for name in ("block", "code", "item")), strict=True)
    for index, (block, code, item) in zip(main, answered, strict=True):
        if (block, code, item) not in asked:
            which, row = _place(lengths, int(index))
            raise AnalysisError(
                f"{paths[which]}, row {row}: the receipt knows no statement {item!r} on a setting {code!r} in block "
                f"{block!r}: the file was changed or belongs to another study; make it again from the journal: "
                f"liquid-study rebuild {sessions[which].folder.path}"
            )
    which_one = [name for name in ("participant", "session", "form", "trial", "attempt", "item") if name in table]
    twice = np.flatnonzero(table.duplicated(which_one))
    if len(twice):
        which, row = _place(lengths, int(twice[0]))
        answer = table.iloc[int(twice[0])]
        raise AnalysisError(
            f"{paths[which]}, row {row}: the answer to {answer['item']!r} in trial {answer['trial']} stands there "
            f"twice; make the table again from the journal: liquid-study rebuild {sessions[which].folder.path}"
        )


def _place(lengths: Whole, index: int) -> tuple[int, int]:
    """Return the session of the row at ``index``, and the row's number in its file, the header's being 1."""
    ends = np.cumsum(lengths)
    which = int(np.searchsorted(ends, index, side="right"))
    return which, int(index - ends[which] + lengths[which]) + 2
