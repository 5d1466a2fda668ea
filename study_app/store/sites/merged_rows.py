"""Lists of studies and sessions that merged studies are in, too."""

from collections.abc import Iterator
from pathlib import Path

from study_app.store.folders import StudyFolder
from study_app.store.sites.merged import MANIFEST, folders_of
from study_app.store.tables.csv_files import Row
from study_app.store.tables.participants import participants


def participants_of(folder: Path) -> list[Row]:
    """Return one row per session of a study; in a merged one by site, with the site in the participants' IDs.

    Raises
    ------
    StoreError
        The list of sites cannot be read.
    """
    return [
        {**row, "participant": f"{prefix}{row['participant']}"}
        for prefix, place in folders_of(folder).items()
        for row in participants(StudyFolder(place))
    ]


def study_folders(results: Path) -> Iterator[Path]:
    """Yield the folders of studies and of merged studies under ``results``, sorted.

    Raises
    ------
    OSError
        The folder is not there, or cannot be read.
    """
    for folder in sorted(results.iterdir()):
        if (folder / "data").is_dir() or (not folder.name.startswith(".") and (folder / MANIFEST).is_file()):
            yield folder
