"""Exclusions from the analysis, each with its rule or person and its reason. Data are never deleted."""

import contextlib
import csv
import io
import json
import re
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from study_app.errors import StoreError
from study_app.protocol.model import RULES
from study_app.protocol.source import did_you_mean
from study_app.store.blinded.blinding import reveals
from study_app.store.files.atomic import append_line, parse_json, read_own_if_there, write_file
from study_app.store.files.columns import EXCLUSIONS
from study_app.store.files.csv_files import MISSING, csv_bytes, header, unguard_formula
from study_app.store.files.folders import StudyFolder, check_name_and_reason
from study_app.store.integrity.folder_lock import lock_folder
from study_app.store.journals import journal
from study_app.store.session_progress.progress import progress_of
from study_app.text_tables import decoded, separator_of, wrong_length

_SHOWN_IDS = 6
_INTEGER = re.compile("[0-9]{1,9}")
MISSING_RULE = "missing"
"""The rule that excludes a session in which more trials are missing than the study permits."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Exclusion:
    """An excluded session or trial; a row of ``exclusions.csv``.

    ``key_open`` tells whether the study's key was open at the decision; None in a row of an earlier version.
    """

    participant: str
    session: int
    trial: int | None
    rule_or_person: str
    reason: str
    excluded_at: str
    key_open: bool | None = None

    @property
    def what(self) -> tuple[str, int, int | None]:
        """Participant, session and trial."""
        return self.participant, self.session, self.trial

    def fields(self) -> dict[str, Any]:
        """Return the fields for JSON; ``key_open`` is omitted if None, as in earlier versions."""
        return {name: value for name, value in asdict(self).items() if (name, value) != ("key_open", None)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Reversal:
    """An exclusion that was reversed: time, person and reason. ``key_open`` is None if it was not recorded."""

    exclusion: Exclusion
    at: str
    key_open: bool | None
    by: str = ""
    reason: str = ""


def exclude(
    folder: Path,
    participant: str,
    session: int,
    *,
    trial: int | None = None,
    by: str,
    reason: str,
    rule: str = "",
    now: datetime | None = None,
) -> Exclusion:
    """Exclude a session of the study in ``folder``, or one of its trials, from the analysis.

    Parameters
    ----------
    folder : Path
        The study folder.
    participant : str
        The participant's id.
    session : int
        The session's number.
    trial : int, optional
        The trial's number; by default the whole session is excluded.
    by : str
        The initials of the person, or the rule that the program applies.
    reason : str
        The reason.
    rule : str, optional
        The planned rule that the session meets; the reason then also names the person who decided.
    now : datetime, optional
        Wall time with its zone; by default the system's.

    Raises
    ------
    StoreError
        There is no such session, trial or rule, ``by`` is a planned rule, it is excluded already, ``by`` or ``reason``
        is empty, or the list cannot be read or written.
    """
    by, reason = check_name_and_reason(by, reason, "an exclusion requires a rule or name, and a reason")
    if by in RULES:
        raise StoreError(
            f"{by} is an exclusion rule, not a person: specify it as the rule, together with the name of the "
            "person who decides"
        )
    if rule:
        by, reason = _rule_and_reason(rule, by, reason)
    study = StudyFolder(folder)
    _check_recorded(study, participant, session, trial)
    at = (now if now is not None else datetime.now().astimezone()).isoformat(timespec="milliseconds")
    with lock_folder(folder):
        new = Exclusion(
            participant=participant,
            session=session,
            trial=trial,
            rule_or_person=by,
            reason=reason,
            excluded_at=at,
            key_open=bool(reveals(folder)),
        )
        rows = exclusions(folder)
        for row in rows:
            if row.what in (new.what, (participant, session, None)):
                raise StoreError(f"{describe_exclusion(new)} has been excluded since {row.excluded_at} ({row.reason})")
        write_file(study.exclusions, exclusion_bytes((*rows, new)))
    return new


def exclude_incomplete(folder: Path, participant: str, session: int, reason: str) -> None:
    """Exclude an incomplete session by `MISSING_RULE`, unless it is excluded or was included again.

    Raises
    ------
    StoreError
        The list of exclusions or of reversals cannot be read or written.
    """
    reversed_by_person = (row for row in reversals(folder) if row.rule_or_person == MISSING_RULE)
    decided = {row.what for row in (*exclusions(folder), *reversed_by_person)}
    if (participant, session, None) not in decided:
        exclude(folder, participant, session, by=MISSING_RULE, reason=reason)


def include(
    folder: Path,
    participant: str,
    session: int,
    *,
    trial: int | None = None,
    by: str,
    reason: str,
    now: datetime | None = None,
) -> Exclusion:
    """Reverse the exclusion of a session, or of one of its trials; return that exclusion.

    Its row is moved from ``exclusions.csv`` to ``exclusions_reversed.jsonl``, with person, time and reason. Repeating
    an interrupted call completes it, and records nothing twice.

    Raises
    ------
    StoreError
        The session or trial is not excluded, ``by`` or ``reason`` is empty, or a file cannot be read or written.
    """
    by, reason = check_name_and_reason(by, reason, "reversing an exclusion requires a name and a reason")
    study = StudyFolder(folder)
    with lock_folder(folder):
        rows = exclusions(folder)
        exclusion = next((row for row in rows if row.what == (participant, session, trial)), None)
        if exclusion is None:
            name = describe_exclusion(
                Exclusion(
                    participant=participant, session=session, trial=trial, rule_or_person="", reason="", excluded_at=""
                )
            )
            known = "; ".join(describe_exclusion(row) for row in rows) or "none"
            raise StoreError(f"{name} is not excluded; exclusions: {known}")
        if exclusion not in reversals(folder):
            at = (now if now is not None else datetime.now().astimezone()).isoformat(timespec="milliseconds")
            _append_reversal(study, exclusion, at=at, by=by, reason=reason)
        write_file(study.exclusions, exclusion_bytes(tuple(row for row in rows if row is not exclusion)))
    return exclusion


def keep(folder: Path, participant: str, session: int, *, rule: str, by: str, reason: str) -> Exclusion:
    """Decide to analyse a session although it meets a planned rule; return the exclusion that this prevents.

    Raises
    ------
    StoreError
        There is no such session, it is excluded, this was decided already, ``by`` or ``reason`` is empty, or the record
        cannot be read or written.
    """
    by, reason = check_name_and_reason(by, reason, "keeping a session requires a name and a reason")
    rule, decided = _rule_and_reason(rule, by, reason)
    study = StudyFolder(folder)
    _check_recorded(study, participant, session, None)
    at = datetime.now().astimezone().isoformat(timespec="milliseconds")
    kept = Exclusion(
        participant=participant, session=session, trial=None, rule_or_person=rule, reason=decided, excluded_at=at
    )
    with lock_folder(folder):
        if kept.what in {row.what for row in exclusions(folder)}:
            raise StoreError(f"{describe_exclusion(kept)} is excluded: include it without --rule")
        if any(row.what == kept.what and row.rule_or_person == rule for row in reversals(folder)):
            raise StoreError(f"{describe_exclusion(kept)} has already been kept, although the rule {rule} applies")
        _append_reversal(study, kept, at=at, by=by, reason=reason)
    return kept


def _append_reversal(study: StudyFolder, exclusion: Exclusion, *, at: str, by: str, reason: str) -> None:
    key_open = bool(reveals(study.path))
    record = {"at": at, "by": by, "reason": reason, "key_open": key_open, "exclusion": exclusion.fields()}
    append_line(study.reversed_exclusions, json.dumps(record, ensure_ascii=False).encode() + b"\n")


def _rule_and_reason(rule: str, by: str, reason: str) -> tuple[str, str]:
    """Return a planned rule, and the reason with the name of the person who decided; StoreError for another rule."""
    if rule not in RULES:
        raise StoreError(f"there is no exclusion rule {rule!r} ({did_you_mean(rule, RULES)})")
    return rule, f"{reason} (decided by {by})"


def exclusions(folder: Path) -> tuple[Exclusion, ...]:
    """Return the exclusions of the study in ``folder`` in the order of the decisions.

    Raises
    ------
    StoreError
        The list cannot be read, or a row of it is invalid.
    """
    path = StudyFolder(folder).exclusions
    content = read_own_if_there(path, folder)
    if content is None:
        return ()
    columns = header(EXCLUSIONS)
    earlier_columns = columns[:-1]  # of versions that did not write key_open
    try:
        text = decoded(content)
        reader = csv.reader(io.StringIO(text, newline=""), strict=True)
        names, *rows = [(reader.line_num, row) for row in reader] or [(1, [])]
    except ValueError as error:
        raise StoreError(f"{path}: {error}") from error
    except csv.Error as error:
        raise StoreError(f"{path} is not valid CSV ({error}): save it as CSV in UTF-8, with commas") from error
    if (separator := separator_of(text.partition("\n")[0], columns)) != ",":
        raise StoreError(f"{path} uses {separator!r} as a separator: save it as CSV with commas")
    if tuple(names[1]) not in (columns, earlier_columns):
        raise StoreError(f"{path}: its columns must be {', '.join(columns)}, but are {', '.join(names[1])}")
    return tuple(_parse_exclusion(path, line, row, len(names[1])) for line, row in rows)


def reversals(folder: Path) -> tuple[Exclusion, ...]:
    """Return the reversed exclusions of the study in ``folder``, in the order of the reversals."""
    return tuple(reversal.exclusion for reversal in dated_reversals(folder))


def dated_reversals(folder: Path) -> tuple[Reversal, ...]:
    """Return each reversed exclusion with the time of its reversal."""
    path = StudyFolder(folder).reversed_exclusions
    lines = (read_own_if_there(path, folder) or b"").split(b"\n")  # a reason may contain other line endings
    return tuple(_parse_reversal(path, number, line) for number, line in enumerate(lines, start=1) if line.strip())


def _parse_reversal(path: Path, number: int, line: bytes) -> Reversal:
    with contextlib.suppress(ValueError, KeyError, TypeError):
        record = parse_json(line)
        exclusion = Exclusion(**record["exclusion"])
        texts = (exclusion.participant, exclusion.rule_or_person, exclusion.reason, exclusion.excluded_at)
        if (
            all(isinstance(text, str) for text in texts)
            and isinstance(exclusion.session, int)
            and isinstance(exclusion.key_open, bool | None)
        ):
            key_open = record.get("key_open")
            details = {name: str(record.get(name, "")) for name in ("at", "by", "reason")}
            return Reversal(exclusion=exclusion, key_open=key_open if isinstance(key_open, bool) else None, **details)
    raise StoreError(f"{path}, line {number} is not a reversed exclusion: remove it, or restore it from a backup")


def exclusion_bytes(rows: tuple[Exclusion, ...]) -> bytes:
    """Return ``exclusions.csv``."""
    return csv_bytes(EXCLUSIONS, [{name: getattr(row, name) for name in header(EXCLUSIONS)} for row in rows])


def _parse_exclusion(path: Path, line: int, row: list[str], length: int) -> Exclusion:
    if problem := wrong_length(row, length):
        raise StoreError(f"{path}, line {line}: {problem}")
    participant, session, trial, by, reason, at, *optional_cells = row
    key_open = optional_cells[0].lower() if optional_cells else MISSING  # a spreadsheet writes TRUE
    flags = {"true": True, "false": False, MISSING: None}
    if not (_INTEGER.fullmatch(session) and (trial == MISSING or _INTEGER.fullmatch(trial)) and key_open in flags):
        raise StoreError(
            f"{path}, line {line}: {','.join(row)!r} is not a valid exclusion (participant, session, trial or "
            f"{MISSING}, name, reason, time, and whether the key was open): correct or remove the row"
        )
    return Exclusion(
        participant=participant,
        session=int(session),
        trial=None if trial == MISSING else int(trial),
        rule_or_person=unguard_formula(by),
        reason=unguard_formula(reason),
        excluded_at=at,
        key_open=flags[key_open],
    )


def _check_recorded(study: StudyFolder, participant: str, session: int, trial: int | None) -> None:
    folder = study.session(participant, session)
    if folder not in study.sessions():
        numbers = [str(session.number) for session in study.sessions() if session.participant == participant]
        ids = study.ids()
        more = f" … {ids[-1]}" if len(ids) > _SHOWN_IDS else ""
        participants = f"participants: {', '.join(ids[:_SHOWN_IDS]) or 'none'}{more}"
        available = f"sessions of that participant: {', '.join(numbers)}" if numbers else participants
        raise StoreError(f"{study.path} does not contain session {session} of participant {participant}; {available}")
    if trial is None:
        return
    presented = progress_of(journal.read(folder.journal)).presented
    if trial not in presented:
        listed = ", ".join(map(str, sorted(presented))) or "none"
        raise StoreError(
            f"session {session} of participant {participant} does not contain trial {trial}; its trials are {listed}"
        )


def describe_exclusion(row: Exclusion) -> str:
    """Return a description of the excluded session or trial, for messages."""
    trial = "" if row.trial is None else f", trial {row.trial}"
    return f"participant {row.participant}, session {row.session}{trial}"
