"""What a study's folder tells, as the results window shows it."""

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path

from study_app.store.exclusions import Exclusion
from study_app.store.folders import StudyFolder
from study_app.store.sites.merged import FOLDER, folders_of
from study_app.viewmodels.results import LeftOut, Opened


def left_out(row: Exclusion) -> LeftOut:
    """Return a row of ``exclusions.csv``."""
    name = row.participant if row.session == 1 else f"{row.participant}, session {row.session}"
    what = name if row.trial is None else f"{name}, trial {row.trial}"
    return LeftOut(what, row.rule_or_person, row.reason, _time(row.excluded_at), row.what)


def exclusions_at(study: Path) -> Path:
    """Return the list of exclusions; of a merged study the folder of its sites, each of which has one."""
    folders = folders_of(study)
    return StudyFolder(study).exclusions if "" in folders else study / FOLDER


def opened(reveal: Mapping[str, str]) -> Opened:
    """Return how the key was opened."""
    by, reason = str(reveal.get("by", "unknown")), str(reveal.get("reason", "no reason given"))
    return Opened(_time(reveal.get("at")), by, reason)


def _time(text: object) -> datetime | None:
    """Return the time in a file, None where there is none: people may have changed it."""
    try:
        return datetime.fromisoformat(str(text))
    except ValueError:
        return None
