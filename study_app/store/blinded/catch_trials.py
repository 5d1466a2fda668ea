"""The rule `catch`: sessions with too many incorrect answers to catch trials are excluded, once the key is open.

Before that, the count would reveal which answers were correct.
"""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from study_app.errors import StoreError
from study_app.protocol.trials.presentation import heard_in
from study_app.store import receipt
from study_app.store.blinded.blinding import Key, read_key
from study_app.store.blinded.sealing import opened
from study_app.store.blinded.whole_protocol import whole_protocol
from study_app.store.exclusions import Exclusion, exclude, exclusions, reversals
from study_app.store.folders import SessionFolder, StudyFolder
from study_app.store.journals import journal
from study_app.store.sessions.folder_lock import is_open

RULE: Final = "catch"


def exclude_inattentive(folder: Path) -> tuple[Exclusion, ...]:
    """Exclude the sessions that answered too many catch trials incorrectly; return what was added.

    A session that is excluded already, or was included again by a person, keeps that decision; one that runs is not
    judged. The study's key must be open.

    Raises
    ------
    StoreError
        The list of exclusions cannot be read or written.
    """
    study, key = StudyFolder(folder), read_key(folder)
    decided = {row.what[:2] for row in exclusions(folder) if row.trial is None}
    decided |= {row.what[:2] for row in reversals(folder) if row.rule_or_person == RULE}
    added: list[Exclusion] = []
    for session in study.sessions():
        if (session.participant, session.number) in decided or is_open(session.path):
            continue
        reason = ""
        with contextlib.suppress(StoreError, KeyError, TypeError, ValueError, AttributeError):  # `verify` names damage
            reason = "; ".join(_missed(session, key))
        if reason:
            added.append(exclude(folder, session.participant, session.number, by=RULE, reason=reason))
    return tuple(added)


def _missed(session: SessionFolder, key: Key) -> Iterator[str]:
    """Yield the number of incorrect answers to catch trials of each block with too many."""
    published = receipt.read(session.receipt)["protocol"]
    if not any("catch" in block for block in published["blocks"].values()):
        return
    protocol = whole_protocol(published, key)
    lines = opened(journal.read(session.journal), key)
    blocks = {line["trial"]: line["block"] for line in lines if line["event"] == "trial_started"}
    heard = [one for one in heard_in(protocol, lines) if one.catch]
    for block in protocol.blocks.values():
        answered = [one for one in heard if blocks[one.trial] == block.id]
        wrong = sum(not one.correct for one in answered)
        if block.catch is not None and answered and wrong / len(answered) > block.catch.wrong_most:
            yield (
                f'block "{block.id}": {wrong} of {len(answered)} catch trials answered incorrectly, '
                f"at most {100 * block.catch.wrong_most:g} % are permitted"
            )
