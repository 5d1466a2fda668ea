import json
import re
from contextlib import nullcontext
from pathlib import Path
from unittest import mock

import pytest

from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.protocol.questions import KINDS
from study_app.store.blinded.blinding import open_or_draw_key, reveal
from study_app.store.files.atomic import cannot_write
from study_app.store.files.columns import PARTICIPANTS, RESPONSES, TRIALS_MISSING, every_column
from study_app.store.files.csv_files import Row
from study_app.store.files.folders import StudyFolder
from study_app.store.tables import study_files
from study_app.store.tables.column_dictionary import dictionary_markdown
from study_app.store.tables.study_files import check_study, columns_of, description_bytes, write_description


@pytest.mark.parametrize(
    "line",
    [
        "| `part` | a whole number of at least 1 or n/a | Part of the study, as shown to the participant. |",
        "| `simulated` | true or false | true if the participant and the device were simulated (a rehearsal). |",
        "| `force_peak_n` | a number of at least 0 or n/a [N] | Largest magnitude of the force sent to the device. "
        "**Sealed until unblinding.** |",
        "| `page_shown` | `page` | A page of text was shown. |",
        "| `due_ns` | a whole number [ns] | Time at which the tick was due; its lateness is time_ns - due_ns. |",
    ],
)
def test_a_codebook_line_states_kind_unit_range_and_meaning(line: str) -> None:
    assert line in dictionary_markdown().splitlines()


UNITS = {"s": "s", "ms": "ms", "ns": "ns", "mps": "m/s", "n": "N", "hz": "Hz", "m": "m", "kg": "kg"}


def test_the_unit_of_every_column_is_the_one_at_the_end_of_its_name() -> None:
    rows = re.findall(r"^\| `(\w+)` \| ([^|]*?)(?: \[([^]]+)\])? \| ", dictionary_markdown(), re.M)
    assert {unit for _, _, unit in rows} == {"", *UNITS.values()}
    for name, _, unit in rows:
        _, has_suffix, suffix = name.rpartition("_")
        assert unit == (UNITS.get(suffix, "") if has_suffix else ""), name


@pytest.mark.parametrize(
    ("title", "file", "meaning"),
    [
        ("Exclusions", "exclusions.csv", "one row per excluded session or trial"),
        ("Frames", "recordings/trial-…_frames.parquet", "one row per frame shown"),
        ("Journal", "journal.jsonl", "one line per event"),
    ],
)
def test_a_heading_is_followed_by_file_and_meaning_of_a_row(title: str, file: str, meaning: str) -> None:
    assert f"## {title}\n\n`{file}`: {meaning}\n\n" in dictionary_markdown()
    heads = re.findall(r"(?:^|\n)(.*)\n(\|.*\|)\n\| ?---", dictionary_markdown())
    assert {(before, len(head.split("|"))) for before, head in heads} == {("", 5)}


def test_the_column_of_kinds_names_every_kind_of_question() -> None:
    (kind,) = (column for column in RESPONSES if column.name == "kind")
    assert set(KINDS) == set(kind.description.rstrip(".").partition(": ")[2].split(", "))


def test_a_new_version_of_the_study_renews_it(tmp_path: Path, protocol: Protocol) -> None:
    folder = StudyFolder(tmp_path)
    write_description(folder, protocol.study)
    newer = protocol.study.model_copy(update={"version": "1.1", "description": "What liquids feel like."})
    write_description(folder, newer)
    content = json.loads(folder.description.read_text(encoding="utf-8"))
    assert (content["version"], content["description"]) == ("1.1", "What liquids feel like.")


def test_sealed_columns_are_described_once_tables_have_them(tmp_path: Path, protocol: Protocol) -> None:
    sealed = {column.name for column in every_column() if column.sealed}

    def described(folder: StudyFolder) -> set[str]:
        write_description(folder, protocol.study.model_copy(update={"version": "1.1"}))
        content = json.loads(folder.description.read_text(encoding="utf-8"))
        assert content["version"] == "1.1"
        return sealed & {variable["name"] for variable in content["variableMeasured"]}

    folder = StudyFolder(tmp_path)
    write_description(folder, protocol.study)
    assert described(folder) == set()
    folder.description.write_bytes(description_bytes(protocol.study, sealed=False))
    assert described(folder) == sealed, "an earlier version of the program described them"
    folder.description.unlink()
    open_or_draw_key(folder.path, protocol)
    reveal(folder.path, by="AB", reason="to analyse")
    assert described(folder) == sealed


@pytest.mark.parametrize("intervals", [False, True])
def test_only_sessions_with_trials_of_intervals_can_be_incomplete(
    tmp_path: Path, protocol: Protocol, intervals: bool
) -> None:
    folder = StudyFolder(tmp_path)
    write_description(folder, protocol.study, intervals=intervals)
    variables = json.loads(folder.description.read_text(encoding="utf-8"))["variableMeasured"]
    descriptions = {variable["name"]: str(variable) for variable in variables}
    assert ("trials_missing" in descriptions, "incomplete" in descriptions["status"]) == (intervals, intervals)
    rows: list[Row] = [{TRIALS_MISSING.name: 3}] if intervals else []
    names = [column.name for column in columns_of(folder, rows)]
    assert names == [*(column.name for column in PARTICIPANTS), *(["trials_missing"] if intervals else [])]


@pytest.mark.parametrize("cause", [OSError(28, "no space"), PermissionError(13, "open in another program")])
def test_only_a_table_that_another_program_has_open_may_stay_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, cause: OSError
) -> None:
    study = StudyFolder(tmp_path)
    study.data.mkdir()
    study.participants("brackish").touch()
    monkeypatch.setattr(study_files, "write_file", mock.Mock(side_effect=cannot_write(tmp_path, cause)))
    study_files.write_file.side_effect.__cause__ = cause
    with nullcontext() if isinstance(cause, PermissionError) else pytest.raises(StoreError, match="no space"):
        study_files.update_participants(study, "brackish")
    assert len(caplog.records) == isinstance(cause, PermissionError)
    caplog.clear()


def test_a_study_is_not_begun_around_or_within_another(tmp_path: Path, protocol: Protocol) -> None:
    (tmp_path / "dataset_description.json").write_text(
        "{}", encoding="utf-8", newline="\n"
    )  # of a project, which may well hold results
    results = StudyFolder(tmp_path / "results")
    study = StudyFolder(results.path / "brackish")
    study.data.mkdir(parents=True)
    open_or_draw_key(study.path, protocol)
    check_study(study, "brackish")
    check_study(StudyFolder(results.path / "other"), "other")
    with pytest.raises(StoreError, match=r"contains study folders \(brackish\).*results.brackish"):
        check_study(results, "brackish")
    for within in (study.data, study.path / "new" / "deep"):
        with pytest.raises(StoreError, match="which is a study's folder"):
            check_study(StudyFolder(within), "brackish")


def test_a_description_that_cannot_be_read_is_named(tmp_path: Path, protocol: Protocol) -> None:
    folder = StudyFolder(tmp_path)
    folder.description.mkdir()
    for attempt in (lambda: check_study(folder, "brackish"), lambda: write_description(folder, protocol.study)):
        with pytest.raises(StoreError, match=r"dataset_description\.json cannot be read \(it is not a file\)"):
            attempt()
