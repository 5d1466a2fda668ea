"""Standard questionnaires: sources, licences, texts that may be shipped, and published or worked scores."""

import tomllib
from pathlib import Path
from typing import Any

import pytest

from study_app.protocol.questionnaires import Instrument, Score

ITEMS = {"nasa-tlx": 6, "nasa-tlx-weighted": 21, "sus": 10, "ipq": 14, "panas": 20, "ssq": 16, "ueq": 26}
WITH_TEXTS = {"nasa-tlx", "nasa-tlx-weighted", "sus"}
PUBLISHED = tomllib.loads(Path(__file__).with_name("published.toml").read_text(encoding="utf-8"))


def bounds_of(item: dict[str, Any], found: dict[str, Any]) -> tuple[float, float]:
    return (item["from"], item["to"]) if "from" in item else (1, int(found["scales"][item["scale"]]["points"]))


@pytest.mark.parametrize("name", sorted(ITEMS))
def test_an_instrument_has_items_source_and_licence_and_only_licensed_texts(name: str) -> None:
    assert set(Instrument.names()) == set(ITEMS)
    table = Instrument(name).table
    assert len({item["id"] for item in table["items"]}) == len(table["items"]) == ITEMS[name]
    assert min(len(table[key]) for key in ("source", "licence", "compared")) > 20
    texts = [key for item in table["items"] for key in ("text", "low", "high", "short") if key in item]
    labels = [scale for scale in table.get("scales", {}).values() if "labels" in scale]
    assert bool(texts) == bool(table["languages"]) == (name in WITH_TEXTS)
    assert bool(labels) == (name == "sus")


@pytest.mark.parametrize("case", PUBLISHED["worked"], ids=lambda case: f"{case['instrument']} {case['answers']}"[:40])
def test_published_and_worked_scores(case: dict[str, Any]) -> None:
    table = Instrument(case["instrument"]).table
    item_ids = [item["id"] for item in table["items"]]
    item_answers = case["answers"] if isinstance(case["answers"], list) else [case["answers"]] * len(item_ids)
    answers = dict(zip(item_ids, item_answers, strict=True))
    bounds = {item["id"]: bounds_of(item, table) for item in table["items"] if item["kind"] != "choice"}
    for which, expected in case["scores"].items():
        score = Score.model_validate(table["scores"][which])
        assert score.compute(answers, bounds) == pytest.approx(expected)
        without = {item: answer for item, answer in answers.items() if item != score.items[0]}
        assert score.compute(without, bounds) is None


RANGES = {
    ("nasa-tlx", "raw"): (0, 100), ("nasa-tlx-weighted", "weighted"): (0, 100), ("sus", "sus"): (0, 100),
    ("ipq", "involvement"): (0, 6), ("panas", "positive"): (10, 50), ("ssq", "total"): (0, 235.62),
    ("ueq", "attractiveness"): (-3, 3),
}  # fmt: skip


@pytest.mark.parametrize(("name", "which"), RANGES)
def test_scores_have_their_published_range(name: str, which: str) -> None:
    table = Instrument(name).table
    bounds = {item["id"]: bounds_of(item, table) for item in table["items"] if item["kind"] != "choice"}
    assert Score.model_validate(table["scores"][which]).range_of(bounds) == pytest.approx(RANGES[name, which])


def test_the_range_of_a_score_of_reversed_and_weighted_items() -> None:
    """Items from 1 to 7 and from 0 to 10 with the weights 2 and −1: the sum is from 2 − 10 to 14 − 0."""
    rule = {"items": ["calm", "tense"], "reverse": ["calm"], "combine": "sum", "weights": {"calm": 2, "tense": -1}}
    bounds = {"calm": (1.0, 7.0), "tense": (0.0, 10.0)}
    assert Score.model_validate(rule).range_of(bounds) == (-8, 14)
    assert Score.model_validate(rule | {"factor": -0.5, "offset": 3}).range_of(bounds) == (-4, 7)
    assert Score.model_validate(rule).range_of(bounds | {"tense": None}) is None


@pytest.mark.parametrize("name", PUBLISHED["items"])
def test_scores_have_their_published_items(name: str) -> None:
    table = Instrument(name).table
    places = {item["id"]: place for place, item in enumerate(table["items"], start=1)}
    for which, expected in PUBLISHED["items"][name].items():
        assert sorted(places[item] for item in table["scores"][which]["items"]) == expected
    turned = [places[item] for score in table["scores"].values() for item in score.get("reverse", ())]
    assert sorted(turned) == PUBLISHED["reversed"].get(name, [])
