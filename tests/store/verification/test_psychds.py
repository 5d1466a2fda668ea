import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from study_app.store.tables.csv_files import Column, header, problems
from study_app.store.verification.psychds import Issue, validate

DESCRIPTION: dict[str, Any] = {
    "@context": "https://schema.org/",
    "@type": "Dataset",
    "name": "brackish",
    "description": "Water.",
    "variableMeasured": [{"@type": "PropertyValue", "name": "trial"}, "response"],
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The smallest folder that keeps every rule."""
    describe(tmp_path)
    (tmp_path / "data" / "sub-1").mkdir(parents=True)
    (tmp_path / "data" / "sub-1" / "subject-1_data.csv").write_text("trial,response\n1,7\n2,4\n")
    return tmp_path


def describe(folder: Path, **changes: Any) -> None:
    told = {name: value for name, value in (DESCRIPTION | changes).items() if value is not ...}
    (folder / "dataset_description.json").write_text(json.dumps(told))


def codes(issues: tuple[Issue, ...]) -> list[str]:
    return [issue.code for issue in issues]


def table(content: bytes, name: str = "data/subject-2_data.csv") -> Callable[[Path], None]:
    def act(folder: Path) -> None:
        (folder / name).write_bytes(content)

    return act


def described(**changes: Any) -> Callable[[Path], None]:
    return lambda folder: describe(folder, **changes)


def with_repeated_rows(folder: Path) -> None:
    describe(folder, variableMeasured=["trial", "response", "row_id"])
    table(b"row_id\n1\n2\n1\n")(folder)


@pytest.mark.parametrize(
    ("act", "expected"),
    [
        (lambda folder: (folder / "dataset_description.json").unlink(), ["MISSING_DATASET_DESCRIPTION"]),
        (table(b"{", "dataset_description.json"), ["INVALID_JSON_FORMATTING"]),
        (table(b"[]", "dataset_description.json"), ["INVALID_JSON_FORMATTING"]),
        (table(b'{"name":"\xff"}', "dataset_description.json"), ["INVALID_JSON_FORMATTING"]),
        (described(**{"@context": ...}), ["INVALID_JSONLD_FORMATTING"]),
        (described(**{"@context": "https://example.org/"}), ["INVALID_JSONLD_FORMATTING"]),
        (described(**{"@type": ...}), ["MISSING_DATASET_TYPE"]),
        (described(**{"@type": "Book"}), ["INCORRECT_DATASET_TYPE"]),
        (described(**{"@type": "https://schema.org/Dataset"}), []),
        (described(**{"@context": "http://schema.org"}), []),
        (described(name=...), ["JSON_KEY_REQUIRED"]),
        (described(description=""), ["JSON_KEY_REQUIRED"]),
        (described(variableMeasured=["trial"]), ["CSV_COLUMN_MISSING_FROM_METADATA"]),
        (described(variableMeasured=["trial", "response", "mood"]), ["VARIABLE_MISSING_FROM_CSV_COLUMNS"]),
        (table(b"trial,response\n1,2\n"), []),
        (table(b"trial,response\n"), []),
        (table(b""), ["CSV_HEADER_MISSING"]),
        (table(b"\xef\xbb\xbftrial,response\n1,2\n"), ["CSV_COLUMN_MISSING_FROM_METADATA"]),
        (table(b"trial,response\n1,\xff\n"), ["CSV_FORMATTING_ERROR"]),
        (table(b'trial,response\n1,"2\n'), ["CSV_FORMATTING_ERROR"]),
        (table(b"trial,trial\n1,2\n"), ["CSV_HEADER_REPEATED"]),
        (table(b"trial,response\n1\n"), ["CSV_HEADER_LENGTH_MISMATCH"]),
        (table(b"trial,response\n1,2\n\n3,4\n"), ["CSV_HEADER_LENGTH_MISMATCH"]),
        (table(b'trial,response\n1,"a, b\nc"\n'), []),
        (table(b"trial,mood\n1,2\n"), ["CSV_COLUMN_MISSING_FROM_METADATA"]),
        (table(b"trial\n1\n", "data/subject_2_data.csv"), ["FILENAME_KEYWORD_FORMATTING_ERROR"]),
        (table(b"trial\n1\n", "data/subject-2-x_data.csv"), ["FILENAME_KEYWORD_FORMATTING_ERROR"]),
        (table(b"trial\n1\n", "data/Subject-2_data.csv"), ["FILENAME_KEYWORD_FORMATTING_ERROR"]),
        (table(b"trial\n1\n", "data/visual_delay-2_data.csv"), ["FILENAME_KEYWORD_FORMATTING_ERROR"]),
        (table(b"{", "data/subject-1_data.json"), ["JSON_INVALID"]),
        (with_repeated_rows, ["ROWID_VALUES_NOT_UNIQUE"]),
        (lambda folder: shutil.rmtree(folder / "data"), ["MISSING_DATA_DIRECTORY"]),
        (table(b"{", "data/notes.json"), ["JSON_INVALID"]),
    ],
)
def test_every_rule_is_an_error_where_it_is_broken(
    folder: Path, act: Callable[[Path], None], expected: list[str]
) -> None:
    act(folder)
    assert [code for code in codes(validate(folder).errors) if code in expected] == expected
    broken_description = {"MISSING_DATASET_DESCRIPTION", "INVALID_JSON_FORMATTING"} & set(expected)
    assert set(codes(validate(folder).errors)) - set(expected) <= (
        {"CSV_COLUMN_MISSING_FROM_METADATA"} if broken_description else set()
    )


def test_a_file_of_its_own_metadata_overrides_the_nearest_and_the_datasets(folder: Path) -> None:
    table(b"mood\nfine\n", "data/sub-1/subject-1_session-2_data.csv")(folder)
    assert codes(validate(folder).errors) == ["CSV_COLUMN_MISSING_FROM_METADATA"]
    for name in (
        "data/sub-1/subject-1_session-2_data.json",
        "data/sub-1/file_metadata.json",
        "data/file_metadata.json",
    ):
        (folder / name).write_text(json.dumps({"variableMeasured": ["mood", "trial", "response"]}))
        assert validate(folder).errors == ()
        (folder / name).unlink()


@pytest.mark.parametrize(
    ("act", "code", "place"),
    [
        (table(b"trial\n1\n", "data/mood-2_data.csv"), "FILENAME_UNOFFICIAL_KEYWORD_WARNING", "data/mood-2_data.csv"),
        (table(b"trial\n1\n", "data/notes.csv"), "FILE_NOT_CHECKED", "data/notes.csv"),
        (table(b"x", "exclusions.txt"), "FILE_NOT_CHECKED", "exclusions.txt"),
        (table(b"", "data/sub-1/empty.txt"), "FILE_EMPTY", "data/sub-1/empty.txt"),
        (table(b"{}", "data/dataset_description.json"), "WRONG_METADATA_LOCATION", "data/dataset_description.json"),
        (
            described(variableMeasured=[{"name": "trial"}, {"name": "response"}]),
            "OBJECT_TYPE_MISSING",
            "dataset_description.json",
        ),
    ],
)
def test_what_is_unusual_is_a_warning_with_its_place(
    folder: Path, act: Callable[[Path], None], code: str, place: str
) -> None:
    act(folder)
    findings = validate(folder)
    assert findings.errors == ()
    assert [issue.place for issue in findings.warnings if issue.code == code] == [place]


def test_what_is_to_be_ignored_is_not_looked_at(folder: Path) -> None:
    (folder / "data" / "raw").mkdir()
    (folder / "analysis").mkdir()
    for name in ("data/raw/broken.json", "data/broken.jsonl", "analysis/broken.json", ".git"):
        (folder / name).write_text("{")
    assert "JSON_INVALID" in codes(validate(folder).errors)
    (folder / ".psychds-ignore").write_text("# ours\nraw/\n*.jsonl\n\n")
    assert validate(folder).errors == ()
    assert "FILE_NOT_CHECKED" not in codes(validate(folder).warnings)


COLUMNS = (
    Column("name", "text", "A name."),
    Column("count", "integer", "How many.", minimum=1, maximum=99),
    Column("speed", "number", "How fast.", "m/s", minimum=0, may_miss=True),
    Column("real", "flag", "Whether."),
    Column("level", "text", "Which.", levels=(("low", "little"), ("high", "much")), may_miss=True),
    Column("at", "time", "When."),
)
RIGHT = ["x", "7", "0.5", "true", "low", "2026-03-01T10:00:00.000+01:00"]


def found(*rows: list[str], names: tuple[str, ...] = header(COLUMNS)) -> list[str]:
    text = "".join(f"{','.join(row)}\n" for row in (list(names), *rows))
    return list(problems(text.encode(), COLUMNS))


def with_cell(column: str, cell: str) -> list[str]:
    index = header(COLUMNS).index(column)
    return [*RIGHT[:index], cell, *RIGHT[index + 1 :]]


@pytest.mark.parametrize(
    ("column", "cell", "sentence"),
    [
        ("count", "0", "'0' is not a whole number from 1 to 99"),
        ("count", "100", "'100' is not a whole number from 1 to 99"),
        ("count", "n/a", "'n/a' is not a whole number from 1 to 99"),
        ("count", "7.0", "'7.0' is not a whole number from 1 to 99"),
        ("count", "", "'' is not a whole number from 1 to 99"),
        ("speed", "-0.5", "'-0.5' is not a number of at least 0 or n/a"),
        ("speed", "nan", "'nan' is not a number of at least 0 or n/a"),
        ("speed", '"0,5"', "'0,5' is not a number of at least 0 or n/a"),
        ("real", "True", "'True' is not true or false"),
        ("level", "middle", "'middle' is not one of low, high or n/a"),
        ("at", "2026-03-01 10:00", "'2026-03-01 10:00' is not a time with zone"),
        ("at", "x" * 99, f"'{'x' * 39}…' is not a time with zone"),
    ],
)
def test_what_it_does_not_permit_is_named_with_its_row(column: str, cell: str, sentence: str) -> None:
    assert found(RIGHT, with_cell(column, cell), with_cell(column, cell)) == [f"row 3, {column}: {sentence}"]
