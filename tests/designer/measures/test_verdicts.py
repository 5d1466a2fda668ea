"""Verdicts of the tab Measures, ticks of an axis, and the course of a simulation, each computed by hand."""

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest

from study_app.analysis.planning import power_estimates
from study_app.designer.document.document import template
from study_app.designer.document.study import Study
from study_app.designer.document.toml_edits import Insert, Set, Unset
from study_app.designer.form.form import form_of
from study_app.designer.measures import simulation
from study_app.designer.measures.cards import Table
from study_app.designer.measures.levels import even_ticks, log_ticks, rounded
from study_app.designer.measures.measures_view import measures_view
from study_app.designer.measures.simulation import Simulated, run_simulation, simulation_of
from study_app.designer.measures.study_facts import facts, restored_part
from study_app.session.simulated import predicted_delivery, rehearsal
from study_app.workers.server import Stopped
from tests.designer.support.designer import DEMO

LIQUIDS = ("blocks", "liquids")
ITEMS = ("questionnaires", "liquid", "items")


def study_with_order(order: str, conditions: int, participants: int | None = None, repetitions: int = 1) -> Study:
    """Return the demo with conditions that differ in their delay in its first block."""
    names = [f"late{number}" for number in range(conditions)]
    edits = [Set(("conditions", name), {"liquid": "thin", "delay_ms": 7 * number}) for number, name in enumerate(names)]
    edits += [Set((*LIQUIDS, "conditions"), names), Set((*LIQUIDS, "order"), order)]
    edits += [Set((*LIQUIDS, "repetitions"), repetitions)]
    edits += [Set(("analysis", "participants"), participants)] if participants else []
    study = Study(DEMO).with_edits(*edits)[0]
    assert study.protocol is not None, study.faults
    return study


def balance_card(study: Study) -> Any:
    cards = measures_view(study, facts(study), LIQUIDS, Simulated()).cards
    return next(card for card in cards if card.title == "Balance")


@pytest.mark.parametrize(
    ("order", "conditions", "participants", "state", "sentence"),
    [
        ("williams", 4, 12, "ok", "balanced: 12 participants, each of the 4 orders 3 times"),
        ("williams", 3, 6, "ok", "balanced: 6 participants, each of the 6 orders 1 time"),
        ("williams", 4, 13, "warn", "a Williams design would be balanced with 12 or 16 participants"),
        ("williams", 5, 7, "warn", "a Williams design would be balanced with 10 participants"),
        ("latin", 4, 10, "warn", "a Latin square would be balanced with 8 or 12 participants"),
        ("latin", 4, 8, "warn", "positions are balanced, but carry-over is not"),
        ("fixed", 3, 5, "warn", "the order is the same for all participants, which reveals the codes"),
        ("shuffled", 4, 7, "neutral",
         "balanced only on average, because a new order is drawn for each session"),
        # Of the 9 rows of a Latin square, each has 8 successions; of the 9 pairs of neighbours each lacks another one.
        ("latin", 9, 10, "warn",
         "a Latin square would be balanced with 9 or 18 participants; each code occurs in each position 1 to 2 times "
         "and follows every other code 0 to 9 times"),
        ("latin", 9, 18, "warn",
         "positions are balanced, but carry-over is not; each code occurs in each position 2 times and follows every "
         "other code 0 to 16 times"),
    ],
)  # fmt: skip
def test_the_balance_of_an_order_is_judged_for_the_planned_participants(
    order: str, conditions: int, participants: int, state: str, sentence: str
) -> None:
    card = balance_card(study_with_order(order, conditions, participants))
    assert card.aside == f"Liquids, {participants} planned"
    icon = {"ok": "check", "warn": "warning", "neutral": "info"}[state]
    assert card.parts[-1] == (state, icon, sentence)


def test_the_balance_counts_positions_and_successions_of_each_code() -> None:
    card = balance_card(study_with_order("fixed", 3))
    codes = card.parts[0][0].codes
    assert len({*codes}) == 3
    assert card.aside == "Liquids, 12 participants"
    assert card.parts[0] == (
        Table("position", codes, ("1", "2", "3"), ((12, 0, 0), (0, 12, 0), (0, 0, 12))),
        Table("comes after", codes, codes, ((0, 12, 0), (0, 0, 12), (0, 0, 0))),
    )
    assert len(card.parts) == 2
    six_of_nine = balance_card(study_with_order("fixed", 3, repetitions=3)).parts
    assert (six_of_nine[0][0].places, six_of_nine[1]) == (tuple("123456"), "and 3 more positions")
    assert balance_card(study_with_order("latin", 7)).parts[1] == "and 1 more position"


@pytest.mark.parametrize(
    ("order", "conditions", "repetitions", "chip", "sentence"),
    [
        ("fixed", 3, 1, ("neutral", "ring", "same for everyone"),
         "The effects of condition and position cannot be separated."),
        ("shuffled", 3, 1, ("neutral", "ring", "balanced on average"),
         "A new order is drawn for each session, so positions are balanced only on average."),
        ("latin", 3, 1, ("warn", "warning", "partly for 3, 6, 9 …"),
         "Only positions are balanced for any multiple of 3 participants."),
        ("latin", 2, 1, ("ok", "check", "balanced for 2, 4, 6 …"),
         "Positions and carry-over are balanced for any multiple of 2 participants."),
        ("williams", 3, 1, ("ok", "check", "balanced for 6, 12, 18 …"),
         "Positions and carry-over are balanced for any multiple of 6 participants."),
        ("williams", 4, 2, ("warn", "warning", "partly for 4, 8, 12 …"),
         "Only positions are balanced for any multiple of 4 participants."),
        ("williams", 4, 4, ("ok", "check", "balanced for 4, 8, 12 …"),
         "Positions and carry-over are balanced for any multiple of 4 participants."),
    ],
)  # fmt: skip
def test_the_form_states_the_participants_needed_for_a_balanced_order(
    order: str, conditions: int, repetitions: int, chip: tuple[str, str, str], sentence: str
) -> None:
    study = study_with_order(order, conditions, repetitions=repetitions)
    row = next(row for row in form_of(study, LIQUIDS).rows if row.path == (*LIQUIDS, "order"))
    assert row.facts == (chip, sentence)


def test_ticks_are_round_numbers_within_the_axis() -> None:
    assert even_ticks(0, 10, 6) == (0, 2, 4, 6, 8, 10)
    assert even_ticks(0, 10, 5) == (0, 2.5, 5, 7.5, 10)
    assert even_ticks(3, 17, 4) == (5, 10, 15)
    assert even_ticks(-130, 470, 7) == (-100, 0, 100, 200, 300, 400)
    assert even_ticks(5, 5, 4) == even_ticks(5, 2, 4) == (5,)
    assert log_ticks(1, 100, 3) == (1, 10, 100)
    assert log_ticks(1, 100, 5) == (1, 3, 10, 30, 100)
    assert log_ticks(0.2, 3, 5) == pytest.approx((0.2, 0.5, 1, 2))
    assert log_ticks(0.2, 3, 3) == pytest.approx((0.3, 1, 3))
    assert log_ticks(2.1, 2.9, 6) == (2.1, 2.9), "no round number lies between them"
    assert log_ticks(0.95, 1.2, 2) == (0.95, 1.2), "a single round number is no scale"
    numbers = (0, 1234.5, 0.012345, -2.5, 0.99996, float("nan"))
    assert [rounded(number) for number in numbers] == ["0", "1234", "0.0123", "-2.5", "1", "–"]
    assert rounded(36.25, 2) == "36"


@pytest.mark.parametrize("key", ["precision", "participants"])
def test_the_precision_is_simulated_only_if_it_and_the_participants_are_planned(key: str) -> None:
    study = template("viscosity-jnd")
    incomplete = study.with_edits(Unset(("analysis", key)))[0]
    assert study.protocol is not None
    assert incomplete.protocol is not None
    assert simulation_of(study.protocol, power=False) is not None
    assert simulation_of(incomplete.protocol, power=False) is None
    assert simulation_of(incomplete.protocol, power=True) is not None


def test_a_simulation_sends_partial_results_and_ends_with_the_complete_one(monkeypatch: pytest.MonkeyPatch) -> None:
    protocol = template("viscosity-jnd").protocol
    assert protocol is not None
    order = simulation_of(protocol, power=True)
    assert order is not None
    sent, arguments = list[Simulated](), dict[str, Any]()

    def estimate(protocol: Any, executor: Any, *, sizes: Any, rehearse: Any, progress: Any) -> Iterator[Any]:
        arguments.update(protocol=protocol, sizes=sizes, features=rehearse())
        yield from (SimpleNamespace(studies=studies, asked=70) for studies in executor.map(pow, (2, 3), (5, 3)))

    features: list[Any] = []
    monkeypatch.setattr(power_estimates, "planned_sizes", lambda protocol: (protocol.study.name, 16, 24))
    monkeypatch.setattr(power_estimates, "estimate_power", estimate)
    monkeypatch.setattr(power_estimates, "estimate_markdown", lambda estimate: f"{estimate.studies} simulated")
    monkeypatch.setattr(simulation, "imprecise", lambda _protocol, block: [f"{block.id} is imprecise"])
    delivery = SimpleNamespace(sentences=("3 of 8 trials would not be delivered",))
    monkeypatch.setattr(predicted_delivery, "predicted_delivery", lambda *_: delivery)
    monkeypatch.setattr(
        rehearsal, "condition_features", lambda _protocol, *, seed, progress: features.append((seed, progress("felt")))
    )
    last = run_simulation(order, sent.append, lambda: False)
    known = [(answer.waiting, answer.table, answer.lost, answer.warnings) for answer in (*sent, last)]
    lost, warnings = delivery.sentences, tuple(f"{block.id} is imprecise" for block in protocol.main_blocks)
    assert known == [
        ("predicting which trials can be delivered…", "", (), warnings),
        ("felt…", "", lost, warnings),
        ("32 of 70 studies simulated per sample size", "32 simulated", lost, warnings),
        ("27 of 70 studies simulated per sample size", "27 simulated", lost, warnings),
        ("", "27 simulated", lost, warnings),
    ]
    assert arguments == {"protocol": protocol, "sizes": (protocol.study.name, 16, 24), "features": None}
    assert [seed for seed, _ in features] == [1]
    sent.clear()
    with pytest.raises(Stopped):
        run_simulation(order, sent.append, lambda: len(sent) > 1)
    assert len(sent) == 2, "it ends before the first batch"


def test_a_faulty_part_is_shown_as_it_was() -> None:
    before = Study(DEMO)
    path = (*ITEMS, 0, "text")
    third = {"id": "thirsty", "text": "I am thirsty.", "short": "Thirsty"}
    density = ("liquids", "thick", "density_kg_m3")
    edits = Unset((*ITEMS, 0)), Set(path, 5), Insert((*ITEMS, 1), third), Set(density, "x")
    study = before.with_edits(*edits)[0]
    assert {fault.path for fault in study.faults} == {path, density}
    part = restored_part(study, before.document)
    assert part.protocol is not None
    form = part.protocol.questionnaires["liquid"]
    assert [(item.id, item.text) for item in form.items] == [
        ("like_honey", "This liquid behaves like honey."), ("thirsty", "I am thirsty.")
    ]  # fmt: skip
    assert part.protocol.liquids["thick"].density_kg_m3 == 1400
    assert (part.is_complete, part.forces) == (True, True)
    same = before.with_edits(Set((*ITEMS, 1, "text"), before.document["questionnaires"]["liquid"]["items"][0]["text"]))
    protocol = restored_part(same[0], before.document).protocol
    assert protocol is not None
    first, second = (str(item.text) for item in protocol.questionnaires["liquid"].items)
    assert first != second
    assert second.rstrip("\u034f") == first.rstrip("\u034f"), "only invisible marks make it unique"
