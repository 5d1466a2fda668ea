"""Series: ids, titles, values that are refused, and the study that they make."""

import pytest

from study_app.authoring.changes.series import members, number_row
from study_app.authoring.edited_study import Study, read
from study_app.authoring.new_study import template
from study_app.authoring.writer.refused import Refused
from study_app.protocol.source.document import Path
from tests.authoring.grown import PROTOCOLS

REK = (PROTOCOLS / "rek2024.toml").read_text(encoding="utf-8")
TITLE = 'title = { en = "Baseline settings", nl = "Basisinstellingen" }'
WATER = ("conditions", "water")
DELAY = (*WATER, "delay_ms")


@pytest.fixture(scope="module")
def study() -> Study:
    return template("compare-liquids")


def made(study: Study, field: Path, text: str) -> list[tuple[str, str]]:
    row = number_row(study.document, field[:2], field)
    return [(one.name, one.title) for one in members(study, field[:2], row, text)]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("0 sixty", "“sixty” is not a number"),
        ("0 nan", "“nan” is not a number"),
        ("0 1_0", "“1_0” is not a number"),
        ("0 2000", "2000 is not permitted: Delay is at most 1000"),
        ("-5 0", "-5 is not permitted: Delay is at least 0"),
        ("\u22120,5 0", "\u22120,5 is not permitted: Delay is at least 0"),
        ("0 60 60.0", "60.0 is there twice"),
        ("60,120", "“60,120” may be one number or several: separate numbers by spaces or semicolons"),
        ("0, 60,120", "“60,120” may be one number or several: separate numbers by spaces or semicolons"),
        ("0,60,120 240", "“0,60,120” may be one number or several: separate numbers by spaces or semicolons"),
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


def test_titles_say_the_number_in_each_language() -> None:
    assert TITLE in REK
    field = ("blocks", "liquids", "repetitions")
    found = members(*_of(REK, field), "1 2")
    assert [dict(one.titles) for one in found] == [
        {}, {("title", "en"): "Baseline settings, 2", ("title", "nl"): "Basisinstellingen, 2"},
    ]  # fmt: skip
    numbered = REK.replace(TITLE, 'title = { en = "Times 1", nl = "Keer 1" }')
    found = members(*_of(numbered, field), "3 2")
    assert [dict(one.titles)["title", "nl"] for one in found] == ["Keer 3", "Keer 2"]


@pytest.mark.parametrize(
    ("title", "titles"),
    [
        ("Liquids 2", ["Liquids 2", "Liquids 2, 2", "Liquids 2, 3"]),
        ("Pilot 2026", ["Pilot 2026", "Pilot 2026, 2", "Pilot 2026, 3"]),
        ("Level A-1", ["Level A-1", "Level A-2", "Level A-3"]),
        ("Level A1", ["Level A1", "Level A2", "Level A3"]),
        ("Level -1", ["Level -1", "Level -1, 2", "Level -1, 3"]),
        ("Times 1.0", ["Times 1", "Times 2", "Times 3"]),
    ],
)
def test_only_the_number_of_the_element_is_replaced_in_its_title(title: str, titles: list[str]) -> None:
    field = ("blocks", "liquids", "repetitions")
    study, path, row = _of(REK.replace(TITLE, f'title = "{title}"'), field)
    assert [dict(one.titles).get(("title",), title) for one in members(study, path, row, "1 2 3")] == titles


def test_a_title_of_another_element_is_refused() -> None:
    field = ("blocks", "liquids", "repetitions")
    named = REK.replace(TITLE, 'title = "Liquids 1"')
    named = named.replace('title = { en = "Baseline", nl = "Nulmeting" }', 'title = "Liquids 3"')
    study, path, row = _of(named, field)
    assert [one.name for one in members(study, path, row, "1 2")] == ["liquids", "liquids_2"]
    with pytest.raises(Refused, match=r'^"baseline" has the title "Liquids 3" already$'):
        members(study, path, row, "1 2 3")


def _of(text: str, field: Path) -> tuple[Study, Path, object]:
    study = read(text.encode(), PROTOCOLS)
    return study, field[:2], number_row(study.document, field[:2], field)
