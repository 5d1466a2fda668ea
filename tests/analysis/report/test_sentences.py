"""Each sentence of the reports of random studies is true of their numbers."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from study_app.analysis.contrasts import answer
from study_app.analysis.data.blocks import other_questions
from study_app.analysis.data.study_tables import Study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.report import methods as methods_module
from study_app.analysis.report import sections
from study_app.analysis.report.first_page import cards
from study_app.analysis.report.methods import methods
from study_app.analysis.report.sections import empty_studies, limits, none_found
from study_app.analysis.results import Failures
from study_app.analysis.statistics.outcome import alpha_of_looks
from study_app.protocol.model import Contrast
from tests.analysis.made_up import DECIDED, ITEMS
from tests.analysis.random_studies import drawn
from tests.analysis.report.sentences import Told, check, check_verdicts

STUDIES = 300
COVERING = {2, 9, 15, 16, 17, 19, 23, 29, 66, 68, 74, 75, 104, 106, 152, 158, 226, 263}
"""The studies that together have every sentence, nearly every one twice; the nightly circle has them all."""


def with_plan(rng: np.random.Generator) -> Study:
    """Return a random study; some have hypotheses of conditions and groups, and planned looks."""
    made = drawn(rng)
    (block,) = made.blocks
    settings, contrasts = block.settings, []
    if len(settings) > 1 and made.n:
        for item in ITEMS[: int(rng.integers(0, 3))]:
            first, second = (settings[place].condition for place in rng.choice(len(settings), 2, replace=False))
            bound, expected = rng.choice([0.5, 1.0, 3.0]), rng.choice(["higher", "lower", ""])
            contrasts.append(
                Contrast(
                    measure=item,
                    blocks=("b",),
                    conditions=(first, second),
                    bound=float(bound) if rng.random() < 0.6 else None,
                    expected=str(expected) or None,
                )
            )
    if made.n and rng.random() < 0.4:
        members = {person: ("trained", "naive")[number % 3 == 0] for number, person in enumerate(made.people)}
        groups = {"trained": {"share": 2, "sequence": ["b"]}, "naive": {"share": 1, "sequence": ["b"]}}
        trials = made.trials.assign(group=made.trials["participant"].map(members).astype("string"))
        made = replace(made, trials=trials, protocol={**made.protocol, "study": {}, "groups": groups})
        bound = float(rng.choice([0.5, 1.0])) if rng.random() < 0.5 else None
        contrasts.append(Contrast(measure=ITEMS[1], blocks=("b",), groups=("trained", "naive"), bound=bound))
    rising = (ITEMS[:1], ITEMS, ())[int(rng.integers(0, 3))]
    falling = ITEMS[1:] if rising == ITEMS[:1] and rng.random() < 0.5 else ()
    made = replace(made, decided=replace(made.decided, rising=rising, falling=falling))
    if made.decided.made and rng.random() < 0.4:
        made = replace(made, decided=replace(made.decided, looks=(5, 12, 20), alpha=0.05))
        made = replace(made, decided=made.decided.at(made.n))
    return with_forms(replace(made, contrasts=tuple(contrasts)), rng)


def with_forms(made: Study, rng: np.random.Generator) -> Study:
    """Return the study with forms at drawn positions and planned exclusion rules."""
    steps = ["b", *rng.choice(["other", "start", "load", "load", "end"], int(rng.integers(0, 6)), replace=False)]
    rng.shuffle(steps)
    limits = {"constant_answers": float(rng.integers(40, 100)), "fast_answers": float(rng.integers(1, 9)) / 10}
    rules = [{"rule": rule, "limit": limit} for rule, limit in limits.items() if rng.random() < 0.4]
    block = {"title": {"en": "Block"}, "phase": "main", "questionnaire": None}
    question = {"kind": "text", "text": {"en": "Why?"}, "short": {"en": "Why"}}
    forms = {
        form: {"title": None, "items": [{**question, "id": f"q{place}"} for place in range(rng.integers(1, 5))]}
        for form in ("start", "load", "end")
    }
    order, phase = rng.choice(["fixed", "random"]), rng.choice(["main", "main", "practice"])
    kept = made.protocol | {
        "format": 2,
        "study": {"languages": ["en"], "block_order": str(order)},
        "blocks": {
            "b": made.protocol["blocks"]["b"] | block,
            "other": block | {"title": {"en": "Other"}, "phase": str(phase)},
        },
        "questionnaires": forms,
        "scales": {},
        "analysis": {"exclusions": rules},
    }
    groups = {name: {**group, "sequence": steps} for name, group in kept.get("groups", {}).items()}
    kept |= {"groups": groups} if groups else {"sequence": [str(step) for step in steps]}
    return replace(made, protocol=kept, others=other_questions(kept, None))


def check_report(made: Study) -> None:
    """Check the first page, the limits and the methods of a study."""
    results = evaluate(made)
    assert results.failures == ()
    told = Told(made, results)
    check_verdicts(told)
    for place, one in enumerate(results.contrasts):
        check(answer(one), replace(told, only=place))
    for line in limits(made, results):
        check(line, told)
    check(results.decided.look_words(len(results.people)), told)
    check(empty_studies(made.n), told)
    check(methods(made, results), told)
    shown = cards(replace(results, contrasts=()))  # theirs are checked one by one
    for card in shown:
        for sentence in card.sentences:
            check(sentence, told)
    if not cards(results):
        check(none_found(results), told)


@pytest.mark.slow
@pytest.mark.parametrize(
    "number",
    [pytest.param(number, marks=() if number in COVERING else pytest.mark.nightly) for number in range(STUDIES)],
)
def test_each_sentence_is_true_of_its_numbers(number: int) -> None:
    check_report(with_plan(np.random.default_rng([9, number])))


@pytest.mark.parametrize(
    ("steps", "fixed", "shuffled"),
    [
        ("form p a b", "before the first block", "before the first block"),
        ("p form a b", "after “P”", "after “P”"),
        ("p a form b", "after “A”", "between the blocks"),
        ("p a b form", "after the last block", "after the last block"),
        ("p a form b form", "after each main block", "after each main block"),
        ("p form a form b form", "after “P”, after “A” and after the last block",
         "after “P”, between the blocks and after the last block"),
    ],
)  # fmt: skip
def test_a_form_is_completed_between_the_blocks_if_main_blocks_are_exchanged(
    steps: str, fixed: str, shuffled: str
) -> None:
    blocks = {name: {"title": {"en": name.upper()}, "phase": "main"} for name in "ab"}
    blocks["p"] = {"title": {"en": "P"}, "phase": "practice"}
    for order, times in (("fixed", fixed), ("random", shuffled)):
        study: Any = SimpleNamespace(
            protocol={"study": {"languages": ["en"], "block_order": order}, "blocks": blocks, "questionnaires": {}}
        )
        assert methods_module._form_times(study, tuple(steps.split()), "form") == times


def test_missing_trials_are_those_of_included_sessions() -> None:
    sessions = [(True, 30, 4), (False, 50, 7), (True, 20, 1)]
    missing = [SimpleNamespace(asked=asked, count=count) for _, asked, count in sessions]
    counted = [included for included, *_ in sessions]
    participants = pd.DataFrame({"counted": [*counted, True], "missing": [*missing, None]})
    study: Any = SimpleNamespace(levels=["block"], participants=participants)
    assert methods_module._missing_trials(study).startswith("5 of 50 main trials were lost because ")


@pytest.mark.slow
def test_a_part_of_a_section_that_fails_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: Any) -> str:
        raise ValueError

    monkeypatch.setattr(sections, "incomplete_words", fail)
    results = evaluate(drawn(np.random.default_rng(1)))
    incomplete, failures = replace(results.blocks[0], incomplete={ITEMS[0]: ("P001",)}), Failures()
    list(sections.block(incomplete, results, (), failures))
    assert [failure.what for failure in failures.found] == ["missing answers"]


@pytest.mark.parametrize("look", [None, 1])
def test_the_planned_sample_is_a_number_of_participants_or_of_looks(look: int | None) -> None:
    decided = replace(DECIDED, alpha=0.0123, planned_alpha=0.04, looks=(7, 12), spending="pocock", look=look)
    planned: Any = SimpleNamespace(protocol={"analysis": {"participants": 31}})
    results: Any = SimpleNamespace(decided=replace(decided, looks=()) if look is None else decided, people=("P1",) * 7)
    said = methods_module._planned(planned, results)
    if look is None:
        assert said == "The planned sample size was 31 participants."
        assert methods_module._planned(SimpleNamespace(protocol={"analysis": None}), results) == ""
        return
    first, second = (f"{level:.3g}" for level in alpha_of_looks((7, 12), 0.04, "pocock"))
    assert decided.look_words(7) in said
    assert f"up to {first} and {second} are significant (Pocock alpha spending with alpha = 0.04, Lan" in said
