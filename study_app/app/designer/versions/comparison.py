"""A study compared with a version of it: with its copy where one is kept, else with what a receipt says of it."""

from collections.abc import Iterable
from pathlib import Path
from typing import Final, NamedTuple

from study_app.app.designer.open_study import OpenStudy
from study_app.authoring.edited_study import Study
from study_app.authoring.versions.changes import NOTATION, changes, changes_from_receipt
from study_app.authoring.versions.contents import content_hash, kept_content
from study_app.authoring.versions.runs import Run, source_of
from study_app.protocol.source.files import unbundled, with_liquid_files
from study_app.viewmodels.designer.versions.change_rows import ChangeGroup, change_groups

NO_COPY: Final = (
    "No copy of this version is kept on this computer. What differs is taken from a receipt, which does not say what "
    "the conditions are; single differences cannot be reverted."
)
NOT_TOML: Final = "The text of the study cannot be read: correct it to list the differences."
FAULTY: Final = "No copy of this version is kept on this computer: solve the problems of the study to list differences."
EQUAL: Final = "The study does not differ from this version."


class Version(NamedTuple):
    """A version to compare with: its source (text and liquid files) where a copy is kept, and a run with a receipt."""

    source: str | None
    run: Run | None = None

    @property
    def text(self) -> str | None:
        """The text of the study's own file."""
        return None if self.source is None else unbundled(self.source.encode())[0].decode()


class Comparison(NamedTuple):
    """What differs, and what is to be known of it."""

    groups: tuple[ChangeGroup, ...] = ()
    note: str = ""


def version_of(opened: OpenStudy, run: Run) -> Version:
    """Return a version that was run: its copy is kept, or it is what the file holds."""
    source = source_of(run)
    if source is None:
        file = with_liquid_files(opened.saved.encode(), opened.study.folder)
        source = file.decode() if content_hash(file) == run.hash else None
    return Version(source, run)


def kept_version(hash_: str) -> Version:
    """Return a version that was saved."""
    content = kept_content(hash_)
    return Version(None if content is None else content.decode("utf-8", "replace"))


def file_version(file: Path) -> Version:
    """Return what a study's file holds at this moment."""
    try:
        return Version(file.read_bytes().decode("utf-8", "replace"))
    except OSError:
        return Version(None)


def compare(version: Version, study: Study) -> Comparison:
    """Return how a study differs from a version."""
    if version.source is None:
        held = None if version.run is None else version.run.protocol
        if held is None or study.protocol is None:
            return Comparison((), FAULTY)
        return Comparison(change_groups(changes_from_receipt(held, study.protocol), study), NO_COPY)
    if version.text == study.text:
        return Comparison((), EQUAL)
    try:
        found = changes(version.source, study)
    except ValueError:  # the text of one of them is not TOML
        return Comparison((), NOT_TOML)
    return Comparison(change_groups(found, study), "" if found else f"{NOTATION[:1].upper()}{NOTATION[1:]}.")


def newest(known: Iterable[Run]) -> Run | None:
    """Return what participants were run with last; where there are none, what was run last as a pilot or rehearsal."""
    ran = tuple(known)
    return next((run for run in reversed(ran) if run.sessions), ran[-1] if ran else None)
