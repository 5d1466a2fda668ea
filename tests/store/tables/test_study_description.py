import json
from collections.abc import Callable
from pathlib import Path

import pytest

from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.store.blinded.blinding import open_or_draw_key
from study_app.store.exclusions import exclude
from study_app.store.folders import StudyFolder
from study_app.store.sessions.open_session import SessionStore
from study_app.store.tables.study_description import check_study, described_study, description_bytes, write_description
from study_app.store.verification.psychds import validate


def psych_ds_errors(folder: Path) -> list[str]:
    return [str(issue) for issue in validate(folder).errors]


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
    store.finish("completed")
    start("P002").finish("withdrawn")
    assert psych_ds_errors(folder) == []


def test_what_else_lies_there_is_known_to_be_no_table(
    tmp_path: Path, start: Callable[..., SessionStore], attend: Callable[[SessionStore], None]
) -> None:
    store = start("P001", recordings=True)
    attend(store)
    store.finish("completed")
    exclude(tmp_path / "study", "P001", 1, by="AB", reason="tired")
    assert not [issue for issue in validate(tmp_path / "study").warnings if issue.code == "FILE_NOT_CHECKED"]


def test_the_description_is_the_same_for_every_participant(
    tmp_path: Path, protocol: Protocol, start: Callable[..., SessionStore]
) -> None:
    path = tmp_path / "study" / "dataset_description.json"
    start("P001").finish("completed")
    written = path.stat().st_ino
    start("P002").finish("completed")
    assert path.read_bytes() == description_bytes(protocol.study, sealed=True)
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
    with pytest.raises(StoreError, match=r"dataset_description\.json does not describe a study"):
        check_study(folder, "brackish")


def test_a_description_that_cannot_be_read_is_named(tmp_path: Path, protocol: Protocol) -> None:
    folder = StudyFolder(tmp_path)
    folder.description.mkdir()
    for attempt in (lambda: check_study(folder, "brackish"), lambda: write_description(folder, protocol.study)):
        with pytest.raises(StoreError, match=r"dataset_description\.json cannot be read \(it is not a file\)"):
            attempt()


def test_no_study_is_begun_around_or_within_others(tmp_path: Path, protocol: Protocol) -> None:
    (tmp_path / "dataset_description.json").write_text("{}")  # of a project, which may well hold results
    results = StudyFolder(tmp_path / "results")
    study = StudyFolder(results.path / "brackish")
    study.data.mkdir(parents=True)
    open_or_draw_key(study.path, protocol)
    check_study(study, "brackish")
    check_study(StudyFolder(results.path / "other"), "other")
    with pytest.raises(StoreError, match=r"holds folders of studies \(brackish\).*results.brackish"):
        check_study(results, "brackish")
    for within in (study.data, study.path / "new" / "deep"):
        with pytest.raises(StoreError, match="which is a study's folder"):
            check_study(StudyFolder(within), "brackish")
