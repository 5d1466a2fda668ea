"""Each sentence of the reports of random studies is true of their numbers."""

from dataclasses import replace

import numpy as np
import pytest

from study_app.analysis.contrasts import answer
from study_app.analysis.data.blocks import other_questions
from study_app.analysis.data.study_tables import Study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.report.first_page import cards
from study_app.analysis.report.methods import methods
from study_app.analysis.report.sections import empty_studies, limits, none_found
from study_app.protocol.model import Contrast
from tests.analysis.made_up import ITEMS
from tests.analysis.random_studies import drawn
from tests.analysis.report.sentences import Told, check, check_verdicts

STUDIES = 300


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
    order = rng.choice(["fixed", "random"])
    kept = made.protocol | {
        "format": 2,
        "study": {"languages": ["en"], "block_order": str(order)},
        "blocks": {"b": made.protocol["blocks"]["b"] | block, "other": block | {"title": {"en": "Other"}}},
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
@pytest.mark.variants(10)
@pytest.mark.parametrize("number", range(STUDIES))
def test_each_sentence_is_true_of_its_numbers(number: int) -> None:
    check_report(with_plan(np.random.default_rng([9, number])))
