"""The entries of the allocation to groups against the sessions, and against what the sealed key gives."""

from collections import Counter
from collections.abc import Collection

from study_app.protocol.streams import group_of
from study_app.store.atomic import is_there
from study_app.store.blinded.allocation import claims, entries_begun, group_in
from study_app.store.blinded.blinding import Key
from study_app.store.folders import StudyFolder
from study_app.store.verification.violations import Gathered


def check_allocation(study: StudyFolder, key: Key | None, withdrawn: Collection[str], found: Gathered) -> None:
    """Check that every participant with a session has one entry, that of the journals, and that none was changed.

    Those of the participants who have ``withdrawn`` stay used.
    """
    if key is None:
        return
    begun = entries_begun(study)
    holders: dict[str, int] = {}
    for claim in claims(study):
        if not claim.participant:
            if claim.path.stat().st_size:
                found.error(claim.path, "was changed: restore it from a copy")
            else:
                found.warning(claim.path, "was claimed by a program that ended before it wrote it; it stays unused")
            continue
        if not key.groups or group_in(claim, key) != group_of(key.groups, key.nonce, claim.entry):
            found.error(claim.path, "was changed: restore it from a copy")
        elif claim.participant in holders:
            first = holders[claim.participant]
            found.error(claim.path, f"is a second entry of participant {claim.participant}, who has entry {first}")
        elif claim.participant not in begun and claim.participant not in withdrawn:
            found.warning(claim.path, f"belongs to participant {claim.participant}, who has no session yet")
        holders.setdefault(claim.participant, claim.entry)
    for participant, entry in begun.items():
        path = study.allocation(entry)
        if not is_there(path):
            found.error(path, f"is missing, though participant {participant} has entry {entry}")
        elif holders.get(participant) != entry:
            found.error(path, f"is not of participant {participant}, whose journal has entry {entry}")
    shared = Counter(begun.values())
    for participant, entry in begun.items():
        if shared[entry] > 1:
            found.error(study.allocated, f"entry {entry} of participant {participant} is another participant's, too")
