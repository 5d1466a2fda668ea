"""Standard questionnaires: sources, licences, texts that may be shipped, and worked scores."""

import pytest

from study_app.protocol.questionnaires import Score, instrument, instruments, score

ITEMS = {"nasa-tlx": 6, "nasa-tlx-weighted": 21, "sus": 10, "ipq": 14, "panas": 20, "ssq": 16, "ueq": 26}
WITH_TEXTS = {"nasa-tlx", "nasa-tlx-weighted", "sus"}


def computed(name: str, which: str, answers: dict[str, float | str]) -> float | None:
    bounds = {
        item["id"]: (item["from"], item["to"]) if "from" in item else (1, scale_points(name, item))
        for item in instrument(name)["items"]
        if item["kind"] != "choice"
    }
    return score(Score.model_validate(instrument(name)["scores"][which]), answers, bounds)


def scale_points(name: str, item: dict[str, str]) -> int:
    return int(instrument(name)["scales"][item["scale"]]["points"])


def same(name: str, value: float) -> dict[str, float | str]:
    return {item["id"]: value for item in instrument(name)["items"] if item["kind"] != "choice"}


def test_every_instrument_has_its_items_source_and_licence() -> None:
    assert {name: len(instrument(name)["items"]) for name in instruments()} == ITEMS
    for name in instruments():
        found = instrument(name)
        assert len(found["source"]) > 40
        assert len(found["licence"]) > 20
        assert len(found["compared"]) > 20
        assert len({item["id"] for item in found["items"]}) == len(found["items"])


@pytest.mark.parametrize("name", sorted(ITEMS))
def test_no_instrument_has_texts_that_it_may_not_have(name: str) -> None:
    found = instrument(name)
    texts = [key for item in found["items"] for key in ("text", "low", "high", "short") if key in item]
    labels = [scale for scale in found.get("scales", {}).values() if "labels" in scale]
    assert bool(texts) == (name in WITH_TEXTS)
    assert bool(found["languages"]) == (name in WITH_TEXTS)
    assert bool(labels) == (name == "sus")


def test_sus_scores_0_to_100_and_50_where_all_are_neutral() -> None:
    best = {f"sus{n}": 5 if n % 2 else 1 for n in range(1, 11)}
    worst = {f"sus{n}": 1 if n % 2 else 5 for n in range(1, 11)}
    assert computed("sus", "sus", best) == 100
    assert computed("sus", "sus", worst) == 0
    assert computed("sus", "sus", same("sus", 3)) == 50


def test_sus_of_brookes_worked_example() -> None:
    """Brooke 1996, p. 193 (also Tullis & Albert 2013): answers 5 4 2 1 2 3 2 4 5 2 give 22 × 2.5 = 55."""
    answers = dict(zip((f"sus{n}" for n in range(1, 11)), (5, 4, 2, 1, 2, 3, 2, 4, 5, 2), strict=True))
    assert computed("sus", "sus", answers) == 55


def test_weighted_tlx_is_the_sum_of_weights_times_ratings_over_15() -> None:
    """By hand: weights 3 0 5 1 3 3 and ratings 30 15 60 40 30 40 give (90 + 0 + 300 + 40 + 90 + 120) / 15."""
    scales = ("mental_demand", "physical_demand", "temporal_demand", "performance", "frustration", "effort")
    ratings = dict(zip(scales, (30, 15, 60, 40, 30, 40), strict=True))
    weights = dict(zip(scales, (3, 0, 5, 1, 3, 3), strict=True))
    answers: dict[str, float | str] = {**ratings}
    left = dict(weights)
    pairs = [item for item in instrument("nasa-tlx-weighted")["items"] if item["kind"] == "choice"]
    assert len(pairs) == 15
    chosen = dealt([tuple(option["id"] for option in pair["options"]) for pair in pairs], left)
    answers |= {pair["id"]: choice for pair, choice in zip(pairs, chosen, strict=True)}
    assert computed("nasa-tlx-weighted", "weighted", answers) == pytest.approx(640 / 15)
    assert computed("nasa-tlx-weighted", "raw", answers) == pytest.approx(215 / 6)


def dealt(pairs: list[tuple[str, ...]], left: dict[str, int]) -> list[str]:
    """Return a choice of each pair so that every scale is chosen as often as its weight says."""
    if not pairs:
        return []
    for one in pairs[0]:
        if left[one]:
            rest = {**left, one: left[one] - 1}
            if (found := _try(pairs[1:], rest)) is not None:
                return [one, *found]
    raise AssertionError("these weights belong to no choices")


def _try(pairs: list[tuple[str, ...]], left: dict[str, int]) -> list[str] | None:
    try:
        return dealt(pairs, left)
    except AssertionError:
        return None


def test_ssq_counts_from_0_and_has_the_published_largest_scores() -> None:
    """Kennedy et al. 1993: all 16 symptoms severe give 200.34, 159.18, 292.32 and 235.62."""
    most = {
        which: computed("ssq", which, same("ssq", 4)) for which in ("nausea", "oculomotor", "disorientation", "total")
    }
    assert most == pytest.approx({"nausea": 200.34, "oculomotor": 159.18, "disorientation": 292.32, "total": 235.62})
    for which in most:
        assert computed("ssq", which, same("ssq", 1)) == pytest.approx(0)


def numbers(name: str, items: list[str]) -> set[int]:
    """Return the places of items in their questionnaire, from 1."""
    order = [item["id"] for item in instrument(name)["items"]]
    return {order.index(item) + 1 for item in items}


@pytest.mark.parametrize(
    ("which", "items", "factor"),
    [
        ("nausea", {1, 6, 7, 8, 9, 15, 16}, 9.54),
        ("oculomotor", {1, 2, 3, 4, 5, 9, 11}, 7.58),
        ("disorientation", {5, 8, 10, 11, 12, 13, 14}, 13.92),
    ],
)
def test_ssq_has_the_published_groups_of_symptoms(which: str, items: set[int], factor: float) -> None:
    """Kennedy et al. 1993, table 5, with the numbers of the symptoms in the questionnaire."""
    found = instrument("ssq")["scores"][which]
    assert numbers("ssq", found["items"]) == items
    assert found["factor"] == factor
    for number, item in enumerate(instrument("ssq")["items"], start=1):
        one = same("ssq", 1) | {item["id"]: 3}
        assert computed("ssq", which, one) == pytest.approx(2 * factor * (number in items))


def test_ssq_total_counts_a_symptom_as_often_as_it_is_in_the_groups() -> None:
    """Answers 1 0 1 1 2 0 0 1 1 2 0 1 0 0 1 0 (none to severe: 0 to 3): groups 4, 6, 6; 3.74 x 16."""
    given = (1, 0, 1, 1, 2, 0, 0, 1, 1, 2, 0, 1, 0, 0, 1, 0)
    answers = {item["id"]: 1 + value for item, value in zip(instrument("ssq")["items"], given, strict=True)}
    assert computed("ssq", "nausea", answers) == pytest.approx(4 * 9.54)
    assert computed("ssq", "oculomotor", answers) == pytest.approx(6 * 7.58)
    assert computed("ssq", "disorientation", answers) == pytest.approx(6 * 13.92)
    assert computed("ssq", "total", answers) == pytest.approx(3.74 * 16)


def test_panas_sums_the_published_words() -> None:
    """Watson et al. 1988: positive 1 3 5 9 10 12 14 16 17 19, negative the others, from 10 to 50."""
    scores = instrument("panas")["scores"]
    positive = {1, 3, 5, 9, 10, 12, 14, 16, 17, 19}
    assert numbers("panas", scores["positive"]["items"]) == positive
    assert numbers("panas", scores["negative"]["items"]) == set(range(1, 21)) - positive
    assert computed("panas", "positive", same("panas", 5)) == 50
    assert computed("panas", "negative", same("panas", 1)) == 10


def test_ueq_reverses_pairs_with_the_positive_word_first_and_has_the_published_scales() -> None:
    scores = instrument("ueq")["scores"]
    assert {name: numbers("ueq", score["items"]) for name, score in scores.items()} == {
        "attractiveness": {1, 12, 14, 16, 24, 25},
        "perspicuity": {2, 4, 13, 21},
        "efficiency": {9, 20, 22, 23},
        "dependability": {8, 11, 17, 19},
        "stimulation": {5, 6, 7, 18},
        "novelty": {3, 10, 15, 26},
    }
    reverse = {3, 4, 5, 9, 10, 12, 17, 18, 19, 21, 23, 24, 25}
    assert set.union(*(numbers("ueq", score["reverse"]) for score in scores.values())) == reverse
    best = {f"ueq{n:02d}": -3 if n in reverse else 3 for n in range(1, 27)}
    assert {computed("ueq", name, best) for name in scores} == {3}


def test_ipq_reverses_three_items() -> None:
    """As the file assumes, unconfirmed: sp2, inv3 and real1 are high where presence is low."""
    scores = instrument("ipq")["scores"]
    assert {name: len(score["items"]) for name, score in scores.items()} == {
        "general_presence": 1, "spatial_presence": 5, "involvement": 4, "realness": 4,
    }  # fmt: skip
    best = same("ipq", 6) | {"sp2": 0, "inv3": 0, "real1": 0}
    assert {computed("ipq", name, best) for name in scores} == {6}
    assert computed("ipq", "spatial_presence", same("ipq", 6)) == pytest.approx(24 / 5)


def test_missing_answer_gives_no_score() -> None:
    answers = same("sus", 3)
    del answers["sus4"]
    assert computed("sus", "sus", answers) is None
