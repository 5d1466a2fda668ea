"""``dataset_description.json``: the Psych-DS description of a study folder, generated from the column dictionary.

Psych-DS 1.5 wants every header of every table listed in ``variableMeasured``, and nothing else: the tables of a study
folder are written whole, headers included, before this file.
"""

import contextlib
import json
from collections.abc import Mapping
from typing import Any

from study_app.errors import StoreError
from study_app.protocol.model import StudyHead
from study_app.protocol.table import text_in
from study_app.store.atomic import is_there, read_own, write_file
from study_app.store.blinded.blinding import reveals
from study_app.store.folders import StudyFolder
from study_app.store.journals.parsing import check_study_name, parse_json
from study_app.store.sites.merged import refuse_merged
from study_app.store.tables.columns import LATER, SEALED, every_column

# What a study folder holds besides tables; patterns as in .gitignore.
IGNORED = b"""\
.psychds-ignore
.*.tmp
.open-*.json
journal.jsonl
receipt.json
checksums.sha256
recordings/
blinding/
exclusions.csv
exclusions_reversed.jsonl
fingerprints.txt
withdrawals.jsonl
rebuilt.txt
"""


def description_bytes(study: StudyHead, *, sealed: bool, protocol_format: int = 1, intervals: bool = False) -> bytes:
    """Return the file for ``study``; the same bytes for the same study on every machine.

    ``sealed`` says that no table has the sealed columns; ``protocol_format`` is the format of the study's file,
    ``intervals`` whether it has blocks with a design.
    """
    title = text_in(study.title, study.languages[0])
    content = {
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": study.name,
        "alternateName": title,
        "description": study.description or title,
        "version": study.version,
        "variableMeasured": [
            column.variable
            for column in every_column(protocol_format, intervals=intervals)
            if not (sealed and column.sealed)
        ],
    }
    return (json.dumps(content, indent=2, ensure_ascii=False) + "\n").encode()


def describes_alike(content: bytes, expected: bytes) -> bool:
    """Return whether a description says the same of the study, and of the same columns but for `LATER`.

    Earlier versions of the program lack columns, describe others in other words, and add a pattern of the cells, which
    is no property of schema.org's PropertyValue; units and ranges are the same in all.
    """
    try:
        found, wanted = parse_json(content), parse_json(expected)
        columns, wanted_columns = (
            [(variable["name"], _comparable(variable)) for variable in it.pop("variableMeasured")]
            for it in (found, wanted)
        )
    except (AttributeError, KeyError, TypeError, ValueError):
        return False
    names = [name for name, _ in columns]
    return bool(
        found == wanted and columns == [one for one in wanted_columns if one[0] in names or one[0] not in LATER]
    )


def _comparable(variable: Mapping[str, Any]) -> dict[str, Any]:
    """Return what every version says of a column."""
    return {name: value for name, value in variable.items() if name not in ("description", "valuePattern")}


def write_description(
    folder: StudyFolder, study: StudyHead, protocol_format: int = 1, *, intervals: bool = False
) -> None:
    """Write the description where it is missing or of an older version of the study.

    Until the key is opened it lacks the sealed columns, unless an earlier version of the program described them: then
    tables have them.
    """
    held = read_own(folder.description, folder.path) if is_there(folder.description) else b""
    sealed = not (reveals(folder.path) or names_sealed(held))
    content = description_bytes(study, sealed=sealed, protocol_format=protocol_format, intervals=intervals)
    if held != content:
        write_file(folder.description, content)
    if not is_there(folder.ignore):
        write_file(folder.ignore, IGNORED)


def has_intervals(protocol: Mapping[str, Any]) -> bool:
    """Return whether the protocol in a receipt has blocks with a design."""
    return any("slots" in block for block in protocol["blocks"].values())


def names_sealed(content: bytes) -> bool:
    """Return whether a description names a sealed column."""
    with contextlib.suppress(AttributeError, KeyError, TypeError, ValueError):
        return any(variable["name"] in SEALED for variable in parse_json(content)["variableMeasured"])
    return False


def described_study(folder: StudyFolder) -> str | None:
    """Return the name of the study whose folder this is, or None where it is none yet.

    Raises
    ------
    StoreError
        The description is there and cannot be read.
    """
    if not is_there(folder.description):
        return None
    try:
        return check_study_name(parse_json(read_own(folder.description, folder.path))["name"])
    except (ValueError, KeyError, TypeError) as error:
        raise StoreError(
            f"{folder.description} does not describe a study: is {folder.path} a results folder?"
        ) from error


def check_study(folder: StudyFolder, study: str) -> None:
    """Refuse a folder of another study, of merged sites, of studies in folders of their own, or within one of these.

    Raises
    ------
    StoreError
        Says what the folder is, and which one to use.
    """
    refuse_merged(folder.path)
    described = described_study(folder)
    if described is not None:
        if described != study:
            raise StoreError(f"{folder.path} holds the study {described!r}, not {study!r}: use another results folder")
        return
    for above in folder.path.absolute().parents:
        if is_there(StudyFolder(above).key):
            raise StoreError(f"{folder.path} lies within {above}, which is a study's folder: use one outside of it")
    if within := sorted(path.name for path in folder.path.glob("*") if is_there(StudyFolder(path).key)):
        raise StoreError(
            f"{folder.path} holds folders of studies ({', '.join(within[:3])}{' ...' if within[3:] else ''}): use "
            f"one of these or a new one next to them, such as {folder.path / study}"
        )
