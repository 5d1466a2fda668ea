"""Series: ids, titles, values that are refused, and the blocks that list the copies."""

from typing import Any

import pytest

from study_app.designer.document.additions import check_values, number_row, titles_with
from study_app.designer.document.steps import MakeSeries, Situation
from study_app.designer.document.study import Study, read
from study_app.designer.document.toml_text import Refused
from study_app.protocol.source.document import value_at
from tests.designer.document.grown import PROTOCOLS

REK = (PROTOCOLS / "rek2024.toml").read_text(encoding="utf-8")
TITLE = 'title = { en = "Baseline settings", nl = "Basisinstellingen" }'
NO_DELAY = ("conditions", "delay_0")
REPETITIONS = ("blocks", "liquids", "repetitions")


@pytest.fixture(scope="module")
def study() -> Study:
    return read(REK.encode(), PROTOCOLS)


@pytest.mark.parametrize(
    ("values", "why"),
    [
        ((2000,), "2000 is not permitted: Delay is at most 1000"),
        ((-5, 30), "-5 is not permitted: Delay is at least 0"),
        ((30, 30.0), "30 is there twice, or is the value of the original"),
        ((30, 0), "0 is there twice, or is the value of the original"),
        ((), "a series has 1 to 24 copies"),
        (tuple(range(1, 26)), "a series has 1 to 24 copies"),
    ],
)
def test_values_are_refused_in_one_sentence(study: Study, values: tuple[float, ...], why: str) -> None:
    row = number_row(study.document, NO_DELAY, (*NO_DELAY, "delay_ms"))
    with pytest.raises(Refused, match=f"^{why}$"):
        check_values(study.document, row, values)


@pytest.mark.parametrize(
    ("title", "titles"),
    [
        (TITLE.removeprefix("title = "), {"en": "Baseline settings, 3", "nl": "Basisinstellingen, 3"}),
        ('"Liquids 2"', "Liquids 2, 3"),
        ('"Level A-1"', "Level A-3"),
        ('"Level -1"', "Level -1, 3"),
        ('"Times 1.0"', "Times 3"),
    ],
)
def test_the_number_of_the_element_is_replaced_in_each_title_and_else_added(title: str, titles: Any) -> None:
    study = read(REK.replace(TITLE, f"title = {title}").encode(), PROTOCOLS)
    row = number_row(study.document, REPETITIONS[:2], REPETITIONS)
    found = dict(titles_with(study.document, REPETITIONS[:2], row, 3))
    assert found == (
        {("title", code): text for code, text in titles.items()} if isinstance(titles, dict) else {("title",): titles}
    )


def test_copies_are_listed_after_the_original_where_the_block_can_take_them(study: Study) -> None:
    step = MakeSeries(NO_DELAY, (*NO_DELAY, "delay_ms"), (30, 60)).step(Situation(study))
    after, _ = study.edited(*step.edits)
    assert after.faults == ()
    assert step.several == (("conditions", "delay_30"), ("conditions", "delay_60"))
    assert value_at(after.document, ("conditions", "delay_60", "delay_ms")) == 60
    assert list(value_at(after.document, ("blocks", "baseline", "conditions"))) == ["delay_0"]
    assert list(value_at(after.document, ("blocks", "delays", "conditions")))[:4] == [
        "delay_0", "delay_30", "delay_60", "delay_50",
    ]  # fmt: skip
