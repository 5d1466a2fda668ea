"""The state of a study's results folder: the used participant ids, or why the folder cannot be used."""

from dataclasses import dataclass
from pathlib import Path

from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.store.blinded.blinding import check_conditions
from study_app.store.folders import StudyFolder
from study_app.store.sessions.begin import UsedIds, used_ids
from study_app.store.tables.study_files import check_study


@dataclass(frozen=True, slots=True)
class StudyFolderState:
    """A study's folder when it was read: which ids are used, and why no session of the study can be put there."""

    path: Path
    used: UsedIds
    fault: str


def read_study_folder_state(path: Path, protocol: Protocol) -> StudyFolderState:
    """Read the folder of a study; a folder that cannot be used has a ``fault``."""
    folder, fault = StudyFolder(path), ""
    used = UsedIds(path, frozenset(), ())
    try:
        check_study(folder, protocol.study.name)
        used = used_ids(folder)
        check_conditions(path, protocol)
    except StoreError as error:
        fault = str(error)
    return StudyFolderState(path, used, fault)
