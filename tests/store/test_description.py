from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.store.description import check_study, described_study, description_bytes, write_description
from study_app.store.layout import StudyFolder
from study_app.store.session import SessionStore

DATA_FILE = re.compile(r"([a-z]+-[a-zA-Z0-9]+)(_[a-z]+-[a-zA-Z0-9]+)*_data\.csv")


def psych_ds_errors(folder: Path) -> list[str]:
    """What the published rules of Psych-DS 1.5 call errors, found in ``folder``."""
    found: list[str] = []
    description = json.loads((folder / "dataset_description.json").read_text(encoding="utf-8"))
    if description.get("@type") != "Dataset" or "schema.org" not in description.get("@context", ""):
        found.append("not a schema.org Dataset")
    found += [f"no {key}" for key in ("name", "description", "variableMeasured") if not description.get(key)]
    described = {variable["name"] for variable in description["variableMeasured"]}
    headers: set[str] = set()
    files = list((folder / "data").rglob("*.csv"))
    for path in files:
        content = path.read_bytes()
        header, *rows = list(csv.reader(io.StringIO(content.decode("utf-8"), newline="")))
        headers |= set(header)
        if not DATA_FILE.fullmatch(path.name):
            found.append(f"name {path.name}")
        if content.startswith(b"\xef\xbb\xbf") or len(set(header)) < len(header):
            found.append(f"header of {path.name}")
        found += [f"row of {path.name}" for row in rows if len(row) != len(header)]
    found += [] if files else ["no data file"]
    found += [f"not described: {name}" for name in headers - described]
    found += [f"in no file: {name}" for name in described - headers]
    return found


def test_a_study_folder_keeps_the_rules_of_psych_ds_from_the_first_moment(
    tmp_path: Path, start: Callable[..., SessionStore], attend: Callable[[SessionStore], None]
) -> None:
    folder = tmp_path / "study"
    store = start("P001")
    assert psych_ds_errors(folder) == []
    attend(store)
    store.append("note", kind="note", text='comma, "quote"\nnew line')
    store.write_tables()
    assert psych_ds_errors(folder) == []
    store.finish("complete")
    start("P002").finish("withdrawn")
    assert psych_ds_errors(folder) == []


def test_the_rules_find_what_is_wrong(tmp_path: Path, start: Callable[..., SessionStore]) -> None:
    folder = tmp_path / "study"
    start("P001").finish("complete")
    (folder / "data" / "extra_notes.csv").write_text("trial,mood\n1\n")
    assert psych_ds_errors(folder) == ["name extra_notes.csv", "row of extra_notes.csv", "not described: mood"]


def test_the_description_is_the_same_for_every_participant(
    tmp_path: Path, protocol: Protocol, start: Callable[..., SessionStore]
) -> None:
    path = tmp_path / "study" / "dataset_description.json"
    start("P001").finish("complete")
    written = path.stat().st_ino
    start("P002").finish("complete")
    assert path.read_bytes() == description_bytes(protocol.study)
    assert path.stat().st_ino == written


def test_a_new_version_of_the_study_renews_it(tmp_path: Path, protocol: Protocol) -> None:
    folder = StudyFolder(tmp_path)
    write_description(folder, protocol.study)
    newer = protocol.study.model_copy(update={"version": "1.1", "description": "What liquids feel like."})
    write_description(folder, newer)
    content = json.loads(folder.description.read_text(encoding="utf-8"))
    assert (content["version"], content["description"]) == ("1.1", "What liquids feel like.")


def test_the_folder_of_another_study_is_refused(tmp_path: Path, protocol: Protocol) -> None:
    folder = StudyFolder(tmp_path)
    check_study(folder, "brackish")
    assert described_study(folder) is None
    write_description(folder, protocol.study)
    check_study(folder, "brackish")
    with pytest.raises(StoreError, match="holds the study 'brackish', not 'rek2024': use another results folder"):
        check_study(folder, "rek2024")


@pytest.mark.parametrize("content", [b"", b"[]", b"{}", b"\xff"])
def test_a_description_that_is_none_is_named(tmp_path: Path, content: bytes) -> None:
    folder = StudyFolder(tmp_path)
    folder.description.write_bytes(content)
    with pytest.raises(StoreError, match=r"dataset_description\.json describes no study"):
        check_study(folder, "brackish")


def test_a_description_that_cannot_be_read_is_named(tmp_path: Path, protocol: Protocol) -> None:
    folder = StudyFolder(tmp_path)
    folder.description.mkdir()
    for attempt in (lambda: check_study(folder, "brackish"), lambda: write_description(folder, protocol.study)):
        with pytest.raises(StoreError, match=r"dataset_description\.json cannot be read \(Is a directory\)"):
            attempt()
