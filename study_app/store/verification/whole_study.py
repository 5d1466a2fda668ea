"""Verification of a study folder: every file against the journals, the column dictionary, the checksums and the key.

Nothing is changed. An error is a file that cannot be trusted; a warning is a fact to know before the analysis, such as
an unfinished session. No message reveals a condition. For a session that is open in a program the journal and its entry
in the list of fingerprints are checked, but not the tables. In a merged study each site is checked separately, and then
the data that must agree between the sites.
"""

from __future__ import annotations

import contextlib
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeAlias

from study_app.discovery import registry
from study_app.errors import StoreError
from study_app.protocol.model import StudyHead
from study_app.protocol.source import without_byte_order_mark
from study_app.store import exclusions, receipt
from study_app.store.blinded import blinding
from study_app.store.blinded.allocation import Claim, claims, is_unchanged, recorded_entries
from study_app.store.blinded.blinding import Key, complete_protocol, open_events, sealed_hash
from study_app.store.files import csv_files
from study_app.store.files.atomic import is_there, read_own, read_regular, temporary_files
from study_app.store.files.columns import EXCLUSIONS
from study_app.store.files.folders import StudyFolder, check_study_name
from study_app.store.integrity.checksums import Proofs, checked_line, place_of, read_list, unreadable_lines
from study_app.store.integrity.folder_lock import is_open
from study_app.store.journals import journal
from study_app.store.merged import Merged, Site, read_merged
from study_app.store.sessions.open_session import Place
from study_app.store.sites.merge import stray_entries
from study_app.store.tables.study_files import (
    columns_of,
    described_study,
    description_bytes,
    has_intervals,
    has_sealed_columns,
    is_same_description,
    refuse_earlier_columns,
    table_bytes,
)
from study_app.store.verification.leaks import certain_telltales, find_leaks, presented_numbers, recorded_numbers
from study_app.store.verification.proofs import Proof, read_proof, record_proofs, site_prefix
from study_app.store.verification.verify_session import (
    INTERRUPTED,
    CheckedSession,
    Findings,
    check_session,
    check_table,
)
from study_app.store.versions.study_runs import run_of
from study_app.store.withdrawals import Tombstone, describe_session, proof_of_withdrawal, tombstones, unerased_files

_CHECKED_KINDS: Final = ("question", "task", "method")
"""The kinds of plug-ins without which a session cannot be checked in full."""
Sessions: TypeAlias = list[CheckedSession]


def verify_study(folder: Path, fingerprints: Path | None = None) -> Findings:
    """Check a whole study, merged or not.

    Parameters
    ----------
    folder : Path
        The study folder.
    fingerprints : Path, optional
        A proof of the study (`proofs`), or for a study that is not merged a copy of its ``fingerprints.txt``, stored
        elsewhere. Every ended session must be in it unchanged, and all its records must exist.

    Raises
    ------
    StoreError
        The path is not a study folder, or ``fingerprints`` is not a copy of fingerprints.
    """
    merged = read_merged(folder)
    findings = Findings(folder)
    copy = None if fingerprints is None else (fingerprints, read_proof(fingerprints))
    if merged is None:
        sessions = _verify_study(folder, copy, findings)
    else:
        _check_sites(merged, findings)
        sessions = []
        for site in filter(Path.is_dir, map(merged.folder, merged.names)):  # `_check_sites` reports the missing ones
            site_copy = None if copy is None else (copy[0], _proof_of_site(copy[1], site_prefix(folder, site)))
            with findings.reading(site):
                sessions += _verify_study(site, site_copy, findings)
    findings.sessions, findings.running = len(sessions), sum(session.running for session in sessions)
    return findings


def _proof_of_site(proof: Proof, prefix: str) -> Proof:
    """Return the lines of a proof whose names begin with a site's ``prefix``, without that prefix."""
    prefix_length = len(prefix)
    lines = tuple(
        (fingerprint, name[prefix_length:])
        for fingerprint, name in proof.lines
        if name.lower().startswith(prefix.lower())
    )
    return Proof(lines, proof.notes)


def _verify_study(folder: Path, copy: tuple[Path, Proof] | None, findings: Findings) -> Sessions:
    study = StudyFolder(folder)
    name = described_study(study)
    if name is None and (name := _recorded_study(study)) is None:
        raise StoreError(
            f"{folder} is not a study folder ({study.description.name} is missing): specify one such as results/rek2024"
        )
    refuse_earlier_columns(study)
    key = None
    with findings.reading(study.key):
        key = blinding.read_key(study.path)
    listed = read_list(study.fingerprints)
    withdrawn, unerased = _check_withdrawals(study, findings)
    sessions = [
        check_session(Place(study, session, name), key, findings)
        for session in study.sessions()
        if session.participant not in withdrawn
    ]
    _check_plug_ins(study, findings)
    _check_contents(study, findings)
    if study.participants(name) not in unerased:
        _check_participants(study, name, sessions, findings)
    if early_journals := sum(session.row is not None and not session.chained for session in sessions):
        subject = "1 journal is" if early_journals == 1 else f"{early_journals} journals are"
        findings.warning(study.data, f"{subject} in format 1, which cannot show whether an earlier line was changed")
    _check_fingerprints(study, sessions, listed, withdrawn, findings)
    if copy is not None:
        _check_copy(study, sessions, withdrawn, *copy, findings)
    _check_description(study, findings)
    _check_exclusions(study, sessions, withdrawn, findings)
    _check_reveals(study, key, findings)
    _check_allocation(study, key, withdrawn, findings)
    _check_blinding(study, key, findings)
    places = {place for session in study.sessions() for place in (session.path, session.path.parent)}
    for path in {*study.data.glob("sub-*"), *study.data.glob("sub-*/ses-*")} - places:
        if path.is_dir() and (path.name.startswith("sub-") or path.parent in places):
            findings.warning(path, "is ignored because it is not a session folder; it may be a copy of one")
    for path, original in _stray_copies(study, name):
        findings.warning(path, f"is ignored because it seems to be a copy of {original.name}: compare the two files")
    for path in (*temporary_files(folder), *temporary_files(study.data)):
        findings.warning(path, "is being written, or is an incomplete file left by a program that was killed")
    return sessions


def _stray_copies(study: StudyFolder, name: str) -> Iterator[tuple[Path, Path]]:
    """Yield each copy of a study's own file, made by a file-sharing program or a person, and the original."""
    lists = (
        study.exclusions,
        study.reversed_exclusions,
        study.withdrawals,
        study.fingerprints,
        study.reveals,
        study.key,
    )
    for path in (*lists, study.participants(name)):
        stem, suffix = re.escape(path.stem), re.escape(path.suffix)
        pattern = re.compile(
            rf"{stem}(([ (\[~-]|_conflict|\.sync-conflict-).*{suffix}|{suffix}(~|\.bak))", re.IGNORECASE
        )
        yield from ((copy, path) for copy in sorted(path.parent.glob("*")) if pattern.fullmatch(copy.name))


def _check_plug_ins(study: StudyFolder, findings: Findings) -> None:
    """Collect the plug-ins that the sessions used, and report those that are not installed."""
    used = receipt.recorded_plug_ins(session.receipt for session in study.sessions())
    findings.plug_ins |= used
    for package, names in used.items():
        parts_by_name = {name: name.partition(" ") for name in names}
        if missing := [
            name
            for name, (kind, _, name_of_plug_in) in parts_by_name.items()
            if kind in _CHECKED_KINDS and name_of_plug_in not in registry(kind)
        ]:
            message = f"sessions used {', '.join(missing)} of {package}, which is not installed"
            findings.warning(study.data, f"{message}: checks that need the plug-in were skipped")


def _check_contents(study: StudyFolder, findings: Findings) -> None:
    """Report versions under which different contents of the study's file were run."""
    runs = filter(None, (run_of(session.receipt) for session in study.sessions()))
    hashes: dict[str, set[str]] = {}
    for run in runs:
        hashes.setdefault(run.version, set()).add(run.hash)
    for version, contents in hashes.items():
        if len(contents) > 1:
            message = f"sessions with version {version} used {len(contents)} different study files (see protocol_hash)"
            findings.warning(study.data, f"{message}: change study.version whenever the file changes")


def _check_allocation(study: StudyFolder, key: Key | None, withdrawn: Collection[str], findings: Findings) -> None:
    """Check that every participant with a session has one unchanged entry, the one in the journals.

    Entries of participants who have ``withdrawn`` remain used.
    """
    if key is None:
        return
    recorded = recorded_entries(study)
    holders: dict[str, Claim] = {}
    for claim in claims(study):
        if not claim.participant:
            if claim.path.lstat().st_size:
                findings.error(claim.path, "has been changed: restore it from a backup")
            else:
                findings.warning(claim.path, "was reserved by a program that ended early; it will remain unused")
            continue
        if not is_unchanged(claim, key):
            findings.error(claim.path, "has been changed: restore it from a backup")
        elif claim.participant in holders:
            first = holders[claim.participant].path.stem
            findings.error(
                claim.path, f"is a second entry for participant {claim.participant}, who already has entry {first}"
            )
        elif claim.participant not in recorded and claim.participant not in withdrawn:
            findings.warning(claim.path, f"belongs to participant {claim.participant}, who does not have a session yet")
        holders.setdefault(claim.participant, claim)
    for claim in holders.values():
        if claim.replaces is not None and not _is_same_entry(claim, holders.get(claim.replaces)):
            findings.error(claim.path, f"replaces participant {claim.replaces}, who does not have a matching entry")
    shared = Counter((entry.group, entry.entry) for entry in recorded.values() if entry.replaces is None)
    for participant, entry in recorded.items():
        path = study.allocation(entry.entry, entry.group, None if entry.replaces is None else participant)
        if not is_there(path):
            findings.error(path, f"is missing, although participant {participant} has entry {entry.entry}")
        elif (holder := holders.get(participant)) is None or holder.path != path or holder.replaces != entry.replaces:
            findings.error(path, f"does not belong to participant {participant}, whose journal has entry {entry.entry}")
        if shared[entry.group, entry.entry] > 1 and entry.replaces is None:
            message = f"entry {entry.entry} of participant {participant} also belongs to another participant"
            findings.error(study.allocated, message)


def _is_same_entry(claim: Claim, replaced: Claim | None) -> bool:
    return replaced is not None and (claim.group, claim.entry) == (replaced.group, replaced.entry)


def _check_withdrawals(study: StudyFolder, findings: Findings) -> tuple[dict[str, Tombstone], set[Path]]:
    """Return the withdrawals, and the files that interrupted withdrawals have not erased; report both."""
    unerased: set[Path] = set()
    try:
        withdrawn = tombstones(study)
    except StoreError as error:
        findings.add_failure(study.withdrawals, error)
        return {}, unerased
    for participant, tombstone in withdrawn.items():
        remains: list[Path] = []
        with contextlib.suppress(StoreError):  # reported for the unreadable list
            remains += unerased_files(study, participant)
        for path in remains:
            problem = "still exists" if path.is_dir() else f"still lists {participant}"
            advice = "the withdrawal was interrupted: run liquid-study withdraw again"
            findings.error(path, f"{problem}, although {participant} withdrew; {advice}")
        if not remains:
            details = f"at {tombstone.at} (recorded by {tombstone.by})"
            findings.warning(study.withdrawals, f"participant {participant} withdrew {details}; the data were erased")
        unerased.update(remains)
    return withdrawn, unerased


def _check_participants(study: StudyFolder, name: str, sessions: Sessions, findings: Findings) -> None:
    """Check the participants table if the journals of all sessions could be read.

    Lines of sessions that have not ended may be behind their journals. The table is not checked if a program has the
    study open, or has had a session open since the check began, because that program updates the table at the end.
    """
    if is_open(study.path) or not all(session.readable for session in sessions):
        return
    rows = [session.row for session in sessions if session.row is not None]
    content, columns = table_bytes(study, rows), columns_of(study, rows)
    path, sealed = study.participants(name), csv_files.csv_bytes(csv_files.unsealed_columns(columns), ())
    if path.is_file() and sealed != csv_files.csv_bytes(columns, ()) and path.read_bytes().startswith(sealed):
        findings.error(path, f"does not contain the sealed columns: {INTERRUPTED}")
        return
    unfinished = {number for number, row in enumerate(rows, start=2) if row["status"] == receipt.UNFINISHED}
    table_findings = Findings(findings.folder)
    check_table(path, content, columns, table_findings, may_differ=unfinished.__contains__)
    current_sessions = study.sessions()
    is_being_written = (
        len(current_sessions) != len(sessions)
        or any(session.running for session in sessions)
        or any(is_open(session.path) for session in current_sessions)
    )
    if not (table_findings.errors and is_being_written):
        findings.extend(table_findings)


def _check_fingerprints(
    study: StudyFolder, sessions: Sessions, listed_before: Proofs, withdrawn: Collection[str], findings: Findings
) -> None:
    """Compare the sessions with the study's own list, read before they were checked.

    A program lists a session once its files are final, just before it closes the session. A listed session is therefore
    checked even while it is open.
    """
    path = study.fingerprints
    for number in unreadable_lines(path):
        findings.error(path, f"line {number} is not a fingerprint: restore it from a backup")
    erased = tuple(f"data/sub-{participant}/" for participant in withdrawn)  # reported as an interrupted withdrawal
    expected = [proof for proof in listed_before if not proof[1].startswith(erased)]
    _compare_proofs(study, sessions, expected, path.name, findings)
    if is_open(study.path):  # written by a program that lists a session just after creating it
        return
    listed = {place for _, place in read_list(path)}
    for session in sessions:
        if (
            session.fingerprint
            and session.chained
            and not session.running
            and place_of(study, session.place.folder) not in listed
        ):
            place = place_of(study, session.place.folder)
            findings.error(path, f"does not list {place}, which has ended; the rebuild command adds it")


def _check_copy(
    study: StudyFolder,
    sessions: Sessions,
    withdrawn: Mapping[str, Tombstone],
    path: Path,
    proof: Proof,
    findings: Findings,
) -> None:
    """Compare sessions, records and withdrawals with a proof stored elsewhere."""
    for note in proof.notes:
        findings.warning(study.path, f"{path} {note}")
    erased: set[tuple[str, str]] = set()
    recorded: Proofs = ()
    with contextlib.suppress(StoreError):  # already reported
        recorded = record_proofs(study)
    kept = _with_study_spelling(
        proof.lines, [*withdrawn, *(session.place.folder.participant for session in sessions)], recorded
    )
    for participant, tombstone in withdrawn.items():
        folders = [study.session(participant, erased.session) for erased in tombstone.sessions]
        proofs_of_erased = {
            (erased.fingerprint, place_of(study, folder))
            for erased, folder in zip(tombstone.sessions, folders, strict=True)
        }
        if proofs_of_erased.isdisjoint(kept):
            continue
        erased |= {
            *proofs_of_erased,
            *(line for line in kept if line[1] == f"{study.exclusions.name}/sub-{participant}"),
        }
        if (withdrawal_proof := proof_of_withdrawal(tombstone)) not in kept:
            remedy = "create a new proof" if proof.notes else f"add the line: {checked_line(*withdrawal_proof)}"
            advice = f"if {participant} requested it, {remedy}"
            findings.error(study.withdrawals, f"the withdrawal of {participant} is not in {path}: {advice}")
    copy = [line for line in kept if line not in erased]
    for record, place in copy:
        if not place.startswith("data/") and (record, place) not in recorded:
            message = f"does not contain {record} ({place}), although {path} lists it: it was deleted or changed"
            findings.error(study.path / place.partition("/")[0], message)
    _compare_proofs(study, sessions, copy, str(path), findings)
    listed = {place for _, place in copy}
    for session in sessions:
        if session.fingerprint and not session.running and place_of(study, session.place.folder) not in listed:
            problem = f"(fingerprint {session.fingerprint}) is not in {path}"
            findings.error(
                session.place.folder.path, f"{problem}: the session was added or ended after that copy was made"
            )


def _with_study_spelling(lines: Proofs, participants: Iterable[str], recorded: Proofs) -> Proofs:
    """Normalise the case of participant IDs in ``lines`` to the study's spelling."""
    known = {*participants, *(place.rpartition("sub-")[2] for _, place in recorded)}
    names = {name.lower(): name for name in known} | {name: name for name in known}
    return tuple(
        (proof, re.sub(r"(?<=/sub-)\w+", lambda match: names.get(match[0], match[0]), place)) for proof, place in lines
    )


def _compare_proofs(
    study: StudyFolder, sessions: Sessions, proofs: Iterable[tuple[str, str]], name: str, findings: Findings
) -> None:
    by_place = {place_of(study, session.place.folder): session for session in sessions}
    for proof, place in proofs:
        if not place.startswith("data/"):
            continue
        session, path = by_place.get(place), study.path / place
        if session is None:
            findings.error(path, f"is missing, but {name} lists it: the session was deleted after it had ended")
            continue
        if proof != session.fingerprint:
            state = f"its fingerprint is {session.fingerprint}" if session.fingerprint else "its end is missing"
            findings.error(path, f"is not the session that {name} lists as {proof}: it has been changed ({state})")


def _check_description(study: StudyFolder, findings: Findings) -> None:
    """Compare the description with the one that this version writes for the study in one of the receipts."""
    if not is_there(study.description):
        findings.error(study.description, "is missing; the rebuild command creates it")
        return
    current = read_own(study.description, study.path)
    opened = bool(blinding.reveals(study.path))
    sealed = not (opened or has_sealed_columns(current))
    heads: set[bytes] = set()
    sealed_heads: set[bytes] = set()
    for protocol in _published_protocols(study):
        with contextlib.suppress(KeyError, TypeError, ValueError):  # already reported for the receipt
            head = StudyHead.model_validate(protocol["study"])
            describe = partial(description_bytes, head, intervals=has_intervals(protocol))
            heads.add(describe(sealed=sealed))
            sealed_heads.add(describe(sealed=True))
    if not heads or current in heads:
        return
    if opened and current in sealed_heads:
        findings.error(study.description, f"does not contain the sealed columns: {INTERRUPTED}")
        return
    if any(is_same_description(current, head) for head in heads):
        findings.warning(
            study.description, "contains the column descriptions of an earlier version of the program", shares=True
        )
    else:
        findings.error(study.description, "does not match the study in the receipts")


def _recorded_study(study: StudyFolder) -> str | None:
    """Return the name of the study in one of the receipts; None if no receipt contains one."""
    for protocol in _published_protocols(study):
        with contextlib.suppress(KeyError, TypeError, ValueError):  # reported for the receipt
            return check_study_name(protocol["study"]["name"])
    return None


def _published_protocols(study: StudyFolder) -> Iterator[dict[str, Any]]:
    """Yield the protocols of the receipts that can be read."""
    for session in study.sessions():
        with contextlib.suppress(StoreError):  # already reported for the receipt
            protocol = receipt.read(session.receipt).get("protocol")
            if isinstance(protocol, dict):
                yield protocol


def _check_exclusions(study: StudyFolder, sessions: Sessions, withdrawn: Collection[str], findings: Findings) -> None:
    with findings.reading(study.reversed_exclusions):
        exclusions.reversals(study.path)
    with findings.reading(study.exclusions):
        rows = exclusions.exclusions(study.path)
        if not is_there(study.exclusions):
            return
        content = without_byte_order_mark(read_regular(study.exclusions))
        names = content.partition(b"\n")[0].decode("utf-8", "replace")
        columns = EXCLUSIONS if EXCLUSIONS[-1].name in names else EXCLUSIONS[:-1]  # an earlier version's list
        for problem in csv_files.table_problems(content, columns):
            findings.error(study.exclusions, problem)
        trials = {
            (session.place.folder.participant, session.place.folder.number): session.trials for session in sessions
        }
        for row in (row for row in rows if row.participant not in withdrawn):
            known = trials.get((row.participant, row.session))
            if known is None or (row.trial is not None and row.trial not in known):
                findings.error(study.exclusions, f"there is no {exclusions.describe_exclusion(row)}")


def _check_reveals(study: StudyFolder, key: Key | None, findings: Findings) -> None:
    with findings.reading(study.reveals):
        for number, torn in blinding.unreadable_reveals(study.path):
            if torn:
                findings.warning(
                    study.reveals,
                    f"line {number} is an incomplete record of an unblinding (possibly because of a power failure)",
                )
            else:
                findings.error(
                    study.reveals,
                    f"line {number} is not a record of an unblinding: it has been changed; restore the file from a "
                    "backup",
                )
        for number, record in enumerate(blinding.reveals(study.path), start=1):
            if key is not None and record["key_hash"] != key.hash:
                findings.error(study.reveals, f"unblinding {number} used a different key")


def _check_blinding(study: StudyFolder, key: Key | None, findings: Findings) -> None:
    """Report files that reveal a condition although the key is sealed, without naming it."""
    published = next(_published_protocols(study), None)
    if key is None or blinding.reveals(study.path) or published is None:
        return
    levels: frozenset[float] = frozenset()
    # A receipt that lacks required fields, or has a code that the key lacks, is reported with its session.
    with contextlib.suppress(StoreError, KeyError, TypeError, AttributeError, ValueError):
        protocol = complete_protocol(published, key)
        levels = presented_numbers(protocol)
        for session in study.sessions() if has_intervals(published) else ():  # others present no levels
            with contextlib.suppress(StoreError):  # already reported for the journal
                levels |= recorded_numbers(protocol, open_events(journal.read(session.journal), key))
    for leak in find_leaks(study.path, certain_telltales(key.tables, published, levels)):
        findings.warning(study.path, f"{leak.place} reveals a condition, although the key is sealed")


def _check_sites(merged: Merged, findings: Findings) -> None:
    """Compare the sites with the list of sites, and check that no session is in two sites."""
    seen: dict[str, Path] = {}
    for site in merged.sites:
        folder = merged.folder(site.name)
        if not folder.is_dir():
            reason = f"{merged.manifest.name} lists site {site.name}"
            findings.error(folder, f"is missing, although {reason}: restore it from a backup")
            continue
        if sealed_hash(folder) != site.key_hash:
            key = StudyFolder(folder).key
            findings.error(key, f"is not the key that site {site.name} was merged with: restore it from a backup")
        _check_site(merged, site, findings)
        for session in StudyFolder(folder).sessions():
            with contextlib.suppress(StoreError):  # reported when the site is checked
                if (other := receipt.read(session.receipt)["protocol_hash"]) != merged.protocol_hash:
                    findings.error(session.receipt, f"has protocol {other}, but was merged with {merged.protocol_hash}")
            begun = describe_session(session).begun
            if begun and (twin := seen.get(begun)) is not None:
                findings.error(
                    session.path, f"is a copy of {twin.relative_to(merged.path).as_posix()}: its data are counted twice"
                )
            seen[begun] = session.path
    for path in stray_entries(merged):
        findings.warning(path, f"is not listed as a site in {merged.manifest.name}, so it is ignored")
    for path in temporary_files(merged.path):
        findings.warning(path, "is being written, or is an incomplete file left by a program that was killed")


def _check_site(merged: Merged, site: Site, findings: Findings) -> None:
    """Compare a site's folder with its entry in the list of sites; only withdrawn sessions may be missing."""
    study = StudyFolder(merged.folder(site.name))
    if (name := described_study(study)) not in (None, merged.study):
        findings.error(
            study.path, f"contains study {name}, but {merged.manifest.name} lists the sites of {merged.study}"
        )
    with contextlib.suppress(StoreError):  # reported when the site is checked
        withdrawn, merged_at = list(tombstones(study).values()), datetime.fromisoformat(site.merged_at)
        earlier_withdrawals = site.withdrawals  # clocks of sites may differ, so times decide only for format 1
        if earlier_withdrawals is None:
            earlier_withdrawals = sum(datetime.fromisoformat(tombstone.at) < merged_at for tombstone in withdrawn)
        erased = sum(len(tombstone.sessions) for tombstone in withdrawn[earlier_withdrawals:])
        if (present := len(study.sessions())) + erased < site.sessions:
            count = f"{present} of the {site.sessions} sessions that {merged.manifest.name} lists"
            findings.error(study.path, f"contains only {count}: restore the others from a backup")
