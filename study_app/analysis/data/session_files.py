"""Read sessions into typed tables, check them against their receipts, and mark excluded rows."""

import contextlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from study_app.analysis.data.blocks import (
    NO_QUESTIONS,
    Block,
    LevelBlock,
    OtherQuestions,
    OwnDynamics,
    level_blocks,
    main_blocks,
    other_questions,
)
from study_app.errors import AnalysisError, StoreError, as_argument
from study_app.protocol.blocks import display_language
from study_app.protocol.source import text_in
from study_app.store.blinded import Key
from study_app.store.exclusions import Exclusion, describe_exclusion
from study_app.store.files import (
    INTERVALS,
    MISSING,
    RESPONSES,
    TRIALS,
    TRIALS_MISSING,
    Column,
    SessionFolder,
    StudyFolder,
    check_study_name,
    header,
    parse_json,
    read_cells,
    read_regular,
)
from study_app.store.journals import journal
from study_app.store.session_progress import MissingTrials, progress_of
from study_app.store.tables import has_intervals

_DTYPES: Final[dict[str, Any]] = {
    "text": "string",
    "time": "string",
    "integer": "Int64",
    "number": "Float64",
    "flag": "boolean",
}

_Counts: TypeAlias = NDArray[np.int64]


def _read_typed_tables(paths: Sequence[Path], columns: tuple[Column, ...]) -> tuple[pd.DataFrame, _Counts]:
    """Read one table of many sessions with the types of ``columns``, and the number of rows of each file.

    Cells with ``n/a`` are missing values, and so are all cells of a sealed column that a file does not have.
    """
    values: dict[str, list[Any]] = {column.name: [] for column in columns}
    parsed: dict[str, dict[str, Any]] = {column.name: {} for column in columns}
    lengths = []
    for path in paths:
        texts, rows = _cell_texts(path, columns)
        lengths.append(rows)
        for column in columns:
            texts_of_column = texts.get(column.name, [MISSING] * rows)
            values[column.name] += _parse_column(column, texts_of_column, parsed[column.name], path)
    typed = {column.name: pd.array(values[column.name], dtype=_DTYPES[column.kind]) for column in columns}
    return pd.DataFrame(typed), np.array(lengths, dtype=np.int64)


def _cell_texts(path: Path, columns: tuple[Column, ...]) -> tuple[Mapping[str, Sequence[str]], int]:
    """Return the cells of a file as text by column, and its number of rows."""
    try:
        names, *rows = read_cells(read_regular(path))
    except OSError as error:
        raise _unreadable_error(path, error, _rebuild_remedy(path)) from error
    except ValueError as error:
        raise AnalysisError(f"{path} {error}: it has been truncated or changed; {_rebuild_remedy(path)}") from error
    present = tuple(column for column in columns if column.name in names or not column.sealed)
    if tuple(names) != header(present):
        raise AnalysisError(
            f"{path} does not begin with the columns of this table: it has been changed, or was written by a different "
            f"version of the program (expected {len(present)} columns: {', '.join(header(present)[:4])} …); "
            f"{_rebuild_remedy(path)}"
        )
    return (dict(zip(names, zip(*rows, strict=True), strict=True)) if rows else {}), len(rows)


def _parse_column(column: Column, texts: Sequence[str], known: dict[str, Any], path: Path) -> list[Any]:
    """Return the values of a column in a file; ``known`` caches the value of each text over all files."""
    for text in dict.fromkeys(texts):
        try:
            if text not in known:
                known[text] = None if text == MISSING and column.sealed else column.value(text)
        except ValueError as error:
            row = texts.index(text) + 2
            raise AnalysisError(f"{path}, row {row}, column {column.name}: {error}; {_rebuild_remedy(path)}") from error
    return [known[text] for text in texts]


def _rebuild_remedy(path: Path) -> str:
    return f"create it again from the journal with liquid-study rebuild {as_argument(path.parent)}"


def _read_receipt(path: Path) -> dict[str, Any]:
    try:
        parsed = parse_json(read_regular(path))
    except FileNotFoundError as error:
        raise DamagedReceiptError(f"{path} is missing: restore it from a backup") from error
    except OSError as error:
        raise _unreadable_error(path, error) from error
    except ValueError as error:
        raise DamagedReceiptError(f"{path} is damaged ({error}): restore it from a backup") from error
    if not isinstance(parsed, dict):
        raise DamagedReceiptError(f"{path} is damaged (it does not contain a JSON object): restore it from a backup")
    return parsed


class DamagedReceiptError(AnalysisError):
    """A receipt is missing or does not describe its session, so that the session cannot be analysed."""


def _unreadable_error(path: Path, error: OSError, remedy: str = "restore it from a backup") -> AnalysisError:
    """Return the error for a file that cannot be read."""
    permissions = "" if isinstance(error, FileNotFoundError) else ", or correct its permissions"
    return AnalysisError(f"{path} cannot be read ({error.strerror or type(error).__name__}): {remedy}{permissions}")


class Bench(NamedTuple):
    """Damping [N·s/m], friction [N] and mass [kg] from a receipt's bench measurement, each averaged over the axes."""

    damping_nspm: float
    friction_n: float
    mass_kg: float


@dataclass(frozen=True, kw_only=True)
class Session:
    """The contents of one session's receipt; ``visit`` is its row of ``Study.participants``.

    ``blocks`` are the main blocks with statements, ``unrated_blocks`` those with neither statements nor a design.
    ``own_dynamics`` are the device's own damping, friction and mass; None if they were not measured.
    ``device_velocity`` is whether the device measured its velocity.
    """

    folder: SessionFolder
    study: str
    title: str
    version: str
    protocol: Mapping[str, Any]
    blocks: tuple[Block, ...]
    visit: Mapping[str, Any]
    unrated_blocks: tuple[Block, ...] = ()
    others: OtherQuestions = NO_QUESTIONS
    levels: tuple[LevelBlock, ...] = ()
    own_dynamics: Bench | None = None
    device_velocity: bool = False

    @property
    def questionnaire(self) -> tuple[tuple[str, tuple[str, ...], tuple[str, ...]], ...]:
        """Blocks with codes and items, and forms with items; these must be equal in pooled sessions."""
        blocks = ((block.id, block.codes_as_dealt, tuple(item.id for item in block.items)) for block in self.blocks)
        others = (
            (question.where.id, (question.id,), (question.question.kind_id,)) for question in self.others.questions
        )
        return (*blocks, *others)


def read_session(folder: SessionFolder, key: Key | None, like: Session | None = None) -> Session:
    """Read a session's receipt; ``key`` is the study's opened key, if any.

    ``like`` is another session of the study, with which equal values are shared to save memory. Raise
    `DamagedReceiptError` if the receipt is missing or does not describe the session.
    """
    receipt = _read_receipt(folder.receipt)
    try:
        protocol = receipt["protocol"]
        if like is not None and protocol == like.protocol:
            protocol = like.protocol
        study_table = protocol["study"]
        study, title, version = (
            check_study_name(study_table["name"]),
            text_in(study_table["title"], display_language(protocol)),
            str(study_table["version"]),
        )
        visit = {
            "participant": folder.participant,
            "session": folder.number,
            **{name: receipt[name] for name in ("simulated", "pilot", "status", "language", "started_at", "ended_at")},
            "device": receipt["device"].get("name"),
            "motors_masked": _masking_text(receipt.get("motors_masked")),
            "protocol_version": version,
            "key_hash": receipt["key_hash"],
            **{name: receipt.get(name) for name in ("seed", "protocol_hash", "version", "group")},
            "missing": _missing_trials(folder) if has_intervals(protocol) else None,
        }
        own_dynamics = _own_dynamics(receipt["device"].get("bench"))
        device_velocity = receipt["device"].get("estimator") == "device"
        same_protocol = like is not None and protocol is like.protocol
        blocks = (
            (*like.blocks, *like.unrated_blocks) if like is not None and same_protocol else main_blocks(protocol, key)
        )
        others = like.others if like is not None and same_protocol else other_questions(protocol, key)
        levels = like.levels if like is not None and same_protocol else level_blocks(protocol, key)
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise DamagedReceiptError(
            f"{folder.receipt} does not describe the session ({type(error).__name__}, {error}): it has been changed, "
            "or was written by a different version of the program; restore it from a backup"
        ) from error
    return Session(
        folder=folder,
        study=study,
        title=title,
        version=version,
        protocol=protocol,
        blocks=tuple(block for block in blocks if block.items),
        unrated_blocks=tuple(block for block in blocks if not block.items),
        visit=visit,
        others=others,
        levels=levels,
        own_dynamics=own_dynamics,
        device_velocity=device_velocity,
    )


def _missing_trials(folder: SessionFolder) -> MissingTrials | None:
    """Return the undelivered trials of a session with interval trials; None if its journal is damaged.

    The tables may be valid although the journal is damaged; `doubts` reports it.
    """
    with contextlib.suppress(StoreError):
        return progress_of(journal.read(folder.journal)).missing_trials
    return None


def _own_dynamics(bench: Mapping[str, Any] | None) -> Bench | None:
    if bench is None:
        return None
    return Bench(**{name: float(np.mean([float(value) for value in bench[name]])) for name in Bench._fields})


def estimators_of(records: Sequence[Session]) -> str | None:
    """Return the velocity estimators of all sessions as text: "kalman", "device" or "kalman or device"."""
    configured = records[0].protocol.get("scene", {}).get("velocity", {}).get("kind")
    measured = [record.device_velocity for record in records]
    names = [
        *([] if all(measured) or configured is None else [str(configured)]),
        *(["device"] if any(measured) else []),
    ]
    return " or ".join(names) or None


def mean_dynamics(records: Sequence[Session]) -> OwnDynamics | None:
    """Return the mean of the device dynamics over sessions; None if no session recorded them."""
    measured = [record.own_dynamics for record in records if record.own_dynamics is not None]
    if not measured:
        return None
    means = Bench._make(np.mean(measured, axis=0).tolist())
    return OwnDynamics(**means._asdict(), sessions=len(measured), of=len(records))


def _masking_text(answer: Mapping[str, Any] | None) -> str | None:
    """Return the answer about masking of motor noise as text, None if it was not asked."""
    if answer is None:
        return None
    level = answer.get("noise_db")
    return str(answer["means"]) if level is None else f"{answer['means']} of {level} dB"


def read_tables(sessions: Sequence[Session], name: str) -> pd.DataFrame:
    """Read table ``name`` of sessions with the same questionnaire, with rows in session order.

    The columns ``session_status`` and ``trials_missing`` are added.
    """
    paths = [session.folder.table(session.study, name) for session in sessions]
    table, lengths = _read_typed_tables(paths, {"responses": RESPONSES, "trials": TRIALS, "intervals": INTERVALS}[name])
    _check_session_columns(sessions, paths, table, lengths)
    if name == "responses":
        _check_answers(sessions, paths, table, lengths)
    status = np.repeat([session.visit["status"] for session in sessions], lengths)
    missing_trials = [session.visit["missing"] for session in sessions]
    missing_counts = np.repeat(
        np.array([None if trials is None else trials.count for trials in missing_trials], dtype=object), lengths
    )
    return table.assign(
        session_status=pd.array(status, dtype="string"),
        **{TRIALS_MISSING.name: pd.array(missing_counts, dtype="Int64")},
    )


def _check_session_columns(
    sessions: Sequence[Session], paths: Sequence[Path], table: pd.DataFrame, lengths: _Counts
) -> None:
    """Raise AnalysisError if a row does not belong to the session of its file."""
    expected: dict[str, list[Any]] = {
        "study": [session.study for session in sessions],
        "participant": [session.folder.participant for session in sessions],
        "session": [session.folder.number for session in sessions],
    }
    for column, values in expected.items():
        recorded = table[column].to_numpy()
        mismatches = np.flatnonzero(recorded != np.repeat(np.array(values, dtype=object), lengths))
        if len(mismatches):
            index, row = _row_location(lengths, int(mismatches[0]))
            raise AnalysisError(
                f"{paths[index]}, row {row}, column {column}: {str(recorded[mismatches[0]])!r} instead of "
                f"{str(values[index])!r}; the file belongs to a different session. Restore this session's file from a "
                "backup"
            )


def _check_answers(sessions: Sequence[Session], paths: Sequence[Path], table: pd.DataFrame, lengths: _Counts) -> None:
    """Raise AnalysisError if an answer has no question, or was given twice."""
    blocks = sessions[0].blocks
    asked = {(block.id, code, item.id) for block in blocks for code in block.codes for item in block.items}
    asked |= {
        (question.where.id, setting.code, question.id)
        for question in sessions[0].others.questions
        for setting in question.where.settings
    }
    main = np.flatnonzero(table["phase"].eq("main").fillna(False).to_numpy(dtype=bool))
    answered = zip(*(table[name].to_numpy()[main] for name in ("block", "code", "item")), strict=True)
    for place, (block, code, item) in zip(main, answered, strict=True):
        if (block, code, item) not in asked:
            index, row = _row_location(lengths, int(place))
            raise AnalysisError(
                f"{paths[index]}, row {row}: the receipt does not contain the statement {item!r} for code {code!r} in "
                f"block {block!r}. The file has been changed or belongs to a different study: create it again from the "
                f"journal with liquid-study rebuild {as_argument(sessions[index].folder.path)}"
            )
    twice = np.flatnonzero(
        table.duplicated(["participant", "session", "form", "after_block", "trial", "attempt", "item"])
    )
    if len(twice):
        index, row = _row_location(lengths, int(twice[0]))
        answer = table.iloc[int(twice[0])]
        raise AnalysisError(
            f"{paths[index]}, row {row}: the answer to {answer['item']!r} in trial {answer['trial']} occurs "
            "twice; create the table again from the journal with liquid-study rebuild "
            f"{sessions[index].folder.path}"
        )


def _row_location(lengths: _Counts, index: int) -> tuple[int, int]:
    """Return the index of the session to which a row belongs, and the row's line number in its file."""
    ends = np.cumsum(lengths)
    session = int(np.searchsorted(ends, index, side="right"))
    return session, int(index - ends[session] + lengths[session]) + 2


def read_sessions(
    folders: Iterable[SessionFolder], key: Key | None
) -> tuple[tuple[Session, ...], tuple[SessionFolder, ...]]:
    """Return the sessions of a study, and the folders whose receipts are missing or damaged.

    Raise AnalysisError if no receipt describes its session, or a receipt may not be read.
    """
    sessions: list[Session] = []
    damaged: list[SessionFolder] = []
    first_error: DamagedReceiptError | None = None
    for folder in folders:
        try:
            sessions.append(read_session(folder, key, like=sessions[0] if sessions else None))
        except DamagedReceiptError as error:
            first_error = first_error or error
            damaged.append(folder)
    if first_error is not None and not sessions:
        raise first_error
    return tuple(sessions), tuple(damaged)


def mark_excluded(table: pd.DataFrame, listed: Sequence[Exclusion]) -> pd.DataFrame:
    """Return a table of sessions or trials with the columns ``excluded`` and ``exclusion_reason`` added.

    A session is excluded with all its trials, a trial with all its attempts.
    """
    if not listed:
        return table.assign(excluded=False, exclusion_reason=pd.Series(pd.NA, index=table.index, dtype="string"))
    by_session_and_trial: dict[tuple[str, int, int | None], list[Exclusion]] = {}
    for exclusion in listed:
        by_session_and_trial.setdefault(exclusion.what, []).append(exclusion)
    trials = table["trial"] if "trial" in table.columns else [None] * len(table)
    matching = [
        [
            exclusion
            # exclusions of the session first
            for excluded_trial in dict.fromkeys((None, None if pd.isna(trial) else trial))
            for exclusion in by_session_and_trial.get((participant, session, excluded_trial), ())
        ]
        for participant, session, trial in zip(table["participant"], table["session"], trials, strict=True)
    ]
    reasons = ["; ".join(exclusion.reason for exclusion in of_row if exclusion.reason) or None for of_row in matching]
    return table.assign(
        excluded=pd.Series([bool(of_row) for of_row in matching], index=table.index, dtype=bool),
        exclusion_reason=pd.Series(reasons, index=table.index, dtype="string"),
    )


def check_exclusions_exist(study: StudyFolder, trials: pd.DataFrame, listed: Sequence[Exclusion]) -> None:
    """Raise AnalysisError if an excluded session or trial does not exist, for example because of a typing error."""
    sessions = {(session.participant, session.number) for session in study.sessions()}
    presented = set(zip(trials["participant"], trials["session"], trials["trial"], strict=True))
    for exclusion in listed:
        if (exclusion.participant, exclusion.session) not in sessions or (
            exclusion.trial is not None and exclusion.what not in presented
        ):
            raise AnalysisError(
                f"{study.exclusions} excludes {describe_exclusion(exclusion)}, which does not exist: correct or remove "
                "the row, so that the intended data are excluded"
            )
