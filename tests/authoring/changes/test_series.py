"""Series: ids, titles, values that are refused, and the study that they make."""

from __future__ import annotations

import pytest

from study_app.authoring.changes.series import members, number_row, number_rows
from study_app.authoring.edited_study import Study, read
from study_app.authoring.new_study import template
from study_app.authoring.writer.refused import Refused
from study_app.protocol.source.document import Path
from tests.authoring.grown import PROTOCOLS

WATER = ("conditions", "water")
DELAY = (*WATER, "delay_ms")


@pytest.fixture(scope="module")
def study() -> Study:
    return template("compare-liquids")


def made(study: Study, field: Path, text: str) -> list[tuple[str, str]]:
    row = number_row(study.document, field[:2], field)
    return [(one.name, one.title) for one in members(study, field[:2], row, text)]


@pytest.mark.parametrize("text", ["0 60 120", "0, 60,120", "0\n60\n 120 ms", " 0; 60ms; 120 "])
def test_values_are_typed_with_spaces_commas_or_lines(study: Study, text: str) -> None:
    assert [name for name, _ in made(study, DELAY, text)] == ["water", "water_60", "water_120"]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("0 sixty", '"sixty" is not a number'),
        ("0 nan", '"nan" is not a number'),
        ("0 1_0", '"1_0" is not a number'),
        ("0 2000", "2000 is not permitted: Delay is at most 1000"),
        ("-5 0", "-5 is not permitted: Delay is at least 0"),
        ("0 60 60.0", "60.0 is there twice"),
        ("60", "a series has two values or more"),
        (" ".join(map(str, range(25))), "a series has at most 24 values"),
    ],
)
def test_values_are_refused_in_one_sentence(study: Study, text: str, why: str) -> None:
    with pytest.raises(Refused, match=f"^{why}$"):
        made(study, DELAY, text)


def test_a_whole_number_is_refused_with_a_fraction(study: Study) -> None:
    with pytest.raises(Refused, match=r"1\.5 is not permitted: Repetitions is a whole number"):
        made(study, ("blocks", "liquids", "repetitions"), "1 1.5")


def test_ids_are_free_and_replace_the_number_that_they_end_in() -> None:
    study = read((PROTOCOLS / "rek2024.toml").read_bytes(), PROTOCOLS)
    delay = ("conditions", "delay_0", "delay_ms")
    assert made(study, delay, "10 50 2.5") == [
        ("delay_10", "Delay 10"), ("delay_50_2", "Delay 50 2"), ("delay_2_5", "Delay 2 5"),
    ]  # fmt: skip
    density = ("liquids", "light_oil", "density_kg_m3")
    assert [name for name, _ in made(study, density, "900 950")] == ["light_oil", "light_oil_950"]


def test_titles_say_the_number_in_each_language() -> None:
    text = (PROTOCOLS / "rek2024.toml").read_text(encoding="utf-8")
    old = 'title = { en = "Baseline settings", nl = "Basisinstellingen" }'
    assert old in text
    field = ("blocks", "liquids", "repetitions")
    found = members(*_of(text, field), "1 2")
    assert [dict(one.titles) for one in found] == [
        {}, {("title", "en"): "Baseline settings, 2", ("title", "nl"): "Basisinstellingen, 2"},
    ]  # fmt: skip
    numbered = text.replace(old, 'title = { en = "Times 1", nl = "Keer 1" }')
    found = members(*_of(numbered, field), "3 2")
    assert [dict(one.titles)["title", "nl"] for one in found] == ["Keer 3", "Keer 2"]


def _of(text: str, field: Path) -> tuple[Study, Path, object]:
    study = read(text.encode(), PROTOCOLS)
    return study, field[:2], number_row(study.document, field[:2], field)


def test_numbers_of_tables_within_an_element_count_and_those_of_questions_do_not() -> None:
    study = read((PROTOCOLS / "rek2024.toml").read_bytes(), PROTOCOLS)
    paths = [row.path[2:] for row in number_rows(study.document, ("liquids", "water"))]
    assert ("density_kg_m3",) in paths
    assert ("wake", "length") in paths
    assert number_rows(study.document, ("questionnaires", "liquid", "items", 0)) == ()
    assert number_rows(study.document, ("device",)) == ()
