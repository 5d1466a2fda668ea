"""Each sentence of the reports of random studies is true of their numbers."""

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from study_app.analysis.contrasts import answer
from study_app.analysis.data import measures
from study_app.analysis.data.blocks import other_questions
from study_app.analysis.data.study_tables import Study, group_counts, group_means
from study_app.analysis.evaluate import evaluate
from study_app.analysis.report import methods as methods_module
from study_app.analysis.report import sections
from study_app.analysis.report.first_page import cards
from study_app.analysis.report.methods import methods
from study_app.analysis.report.motion_section import _recordings_sentence
from study_app.analysis.report.sections import false_claims_sentence, limits, no_findings_sentence
from study_app.analysis.results import Failures
from study_app.analysis.statistics.outcome import alpha_of_looks
from study_app.analysis.wording import all_of
from study_app.protocol.model import Contrast
from tests.analysis.made_up import DECIDED, ITEMS, everybody, liquids, study
from tests.analysis.random_studies import drawn
from tests.analysis.report.sentences import ReportNumbers, check, check_verdicts

STUDIES = 300
COVERING = {2, 9, 15, 16, 17, 19, 23, 29, 66, 68, 74, 75, 104, 106, 152, 158, 226, 263}
"""The studies that together have every sentence, nearly every one twice; the nightly circle has them all."""


def with_plan(rng: np.random.Generator) -> Study:
    """Return a random study; some have hypotheses of conditions and groups, and planned looks."""
    planned_study = drawn(rng)
    (block,) = planned_study.blocks
    settings, contrasts = block.settings, []
    if len(settings) > 1 and planned_study.n:
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
    if planned_study.n and rng.random() < 0.4:
        members = {person: ("trained", "naive")[number % 3 == 0] for number, person in enumerate(planned_study.people)}
        groups = {"trained": {"share": 2, "sequence": ["b"]}, "naive": {"share": 1, "sequence": ["b"]}}
        trials = planned_study.trials.assign(group=planned_study.trials["participant"].map(members).astype("string"))
        planned_study = replace(
            planned_study, trials=trials, protocol={**planned_study.protocol, "study": {}, "groups": groups}
        )
        bound = float(rng.choice([0.5, 1.0])) if rng.random() < 0.5 else None
        contrasts.append(Contrast(measure=ITEMS[1], blocks=("b",), groups=("trained", "naive"), bound=bound))
    rising = (ITEMS[:1], ITEMS, ())[int(rng.integers(0, 3))]
    falling = ITEMS[1:] if rising == ITEMS[:1] and rng.random() < 0.5 else ()
    planned_study = replace(planned_study, decided=replace(planned_study.decided, rising=rising, falling=falling))
    if planned_study.decided.made and rng.random() < 0.4:
        planned_study = replace(planned_study, decided=replace(planned_study.decided, looks=(5, 12, 20), alpha=0.05))
        planned_study = replace(planned_study, decided=planned_study.decided.at(planned_study.n))
    return with_forms(replace(planned_study, contrasts=tuple(contrasts)), rng)


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
    protocol_tables = made.protocol | {
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
    groups = {name: {**group, "sequence": steps} for name, group in protocol_tables.get("groups", {}).items()}
    protocol_tables |= {"groups": groups} if groups else {"sequence": [str(step) for step in steps]}
    return replace(made, protocol=protocol_tables, others=other_questions(protocol_tables, None))


def check_report(made: Study) -> None:
    """Check the first page, the limits and the methods of a study."""
    results = evaluate(made)
    assert results.failures == ()
    report = ReportNumbers(made, results)
    check_verdicts(report)
    for place, contrast in enumerate(results.contrasts):
        check(answer(contrast), replace(report, only=place))
    for line in limits(made, results):
        check(line, report)
    check(results.decided.look_text(len(results.people)), report)
    check(false_claims_sentence(made.n), report)
    check(methods(made, results), report)
    assert "  " not in methods(made, results)
    answer_cards = cards(replace(results, contrasts=()))  # theirs are checked one by one
    for card in answer_cards:
        for sentence in card.sentences:
            check(sentence, report)
    if not cards(results):
        check(no_findings_sentence(results), report)


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
        assert methods_module._form_times_phrase(study, tuple(steps.split()), "form") == times


def test_missing_trials_are_those_of_included_sessions() -> None:
    sessions = [(True, 30, 4), (False, 50, 7), (True, 20, 1)]
    missing = [SimpleNamespace(asked=trials_asked, count=count) for _, trials_asked, count in sessions]
    is_counted = [included for included, *_ in sessions]
    participants = pd.DataFrame({"counted": [*is_counted, True], "missing": [*missing, None]})
    study: Any = SimpleNamespace(levels=["block"], participants=participants)
    assert methods_module._missing_trials_sentence(study).startswith("5 of 50 main trials were lost because ")


@pytest.mark.parametrize(
    ("valid", "sentence"),
    [
        ([True, None], "All interval trials in the main blocks met the limits for valid trials."),
        ([None, None], "Whether interval trials met the limits for valid trials was not measured."),
    ],
)
def test_trials_meet_the_limits_only_if_these_were_measured(valid: list[bool | None], sentence: str) -> None:
    participants = pd.DataFrame({"counted": [True], "missing": [SimpleNamespace(asked=30, count=0)]})
    intervals = pd.DataFrame({"counted": [True, True, False], "valid": pd.array([*valid, True], dtype="boolean")})
    study: Any = SimpleNamespace(levels=["block"], participants=participants, intervals=intervals)
    assert methods_module._missing_trials_sentence(study) == sentence


@pytest.mark.slow
def test_a_part_of_a_section_that_fails_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: Any) -> str:
        raise ValueError

    monkeypatch.setattr(sections, "incomplete_answers_sentence", fail)
    results = evaluate(drawn(np.random.default_rng(1)))
    incomplete, failures = replace(results.blocks[0], incomplete={ITEMS[0]: ("P001",)}), Failures()
    list(sections.block(incomplete, results, (), failures))
    assert [failure.what for failure in failures.found] == ["missing answers"]


@pytest.mark.parametrize("look", [None, 1])
def test_the_planned_sample_is_a_number_of_participants_or_of_looks(look: int | None) -> None:
    decided = replace(DECIDED, alpha=0.0123, planned_alpha=0.04, looks=(7, 12), spending="pocock", look=look)
    planned: Any = SimpleNamespace(protocol={"analysis": {"participants": 31}})
    results: Any = SimpleNamespace(decided=replace(decided, looks=()) if look is None else decided, people=("P1",) * 7)
    sentences = methods_module._sample_size_sentences(planned, results)
    if look is None:
        assert sentences == "The planned sample size was 31 participants."
        assert methods_module._sample_size_sentences(SimpleNamespace(protocol={"analysis": None}), results) == ""
        return
    first, second = (f"{level:.3g}" for level in alpha_of_looks((7, 12), 0.04, "pocock"))
    assert decided.look_text(7) in sentences
    assert f"up to {first} and {second} are significant (Pocock alpha spending with alpha = 0.04, Lan" in sentences


def test_a_form_is_named_with_its_questions_and_the_times_at_which_it_is_completed() -> None:
    def asked(form: str, title: str, count: int) -> list[Any]:
        return [SimpleNamespace(where=SimpleNamespace(id=form, title=title, is_form=form != "b")) for _ in range(count)]

    blocks = {"a": {"title": {"en": "First"}, "phase": "main"}, "b": {"title": {"en": "Second"}, "phase": "main"}}
    groups = {"early": {"sequence": ["load", "a", "b"]}, "late": {"sequence": ["a", "b", "load", "end"]}}
    head = {"study": {"languages": ["en"], "block_order": "fixed"}, "blocks": blocks, "questionnaires": {}}
    questions = (*asked("load", "Workload", 3), *asked("b", "Second", 5), *asked("end", "Goodbye", 1))
    study: Any = SimpleNamespace(others=SimpleNamespace(questions=questions), protocol=head | {"groups": groups})
    assert list(methods_module._form_sentences(study)) == [
        "Participants completed the questionnaire “Workload” (three questions) before the first block or after the "
        "last block, depending on the group or session.",
        "Participants completed the questionnaire “Goodbye” (1 question) after the last block, in the group late.",
    ]


@pytest.mark.parametrize(
    ("sequences", "when"),
    [
        ({"": [["load", "a"], ["a"], ["a"]]}, "in session 1"),
        ({"": [["load", "a"], ["a"], ["load", "a"]]}, "in sessions 1 and 3"),
        ({"early": [["load", "a"], ["a"]], "late": [["load", "a"], ["a"]]}, "in session 1"),
        ({"early": [["a"], ["a"]], "late": [["load", "a"], ["load", "a"]]}, "in the group late"),
        ({"early": [["load", "a"], ["a"]], "late": [["a"], ["load", "a"]]}, "in some groups or sessions"),
        ({"early": [["load", "a"], ["a"]], "late": [["a"], ["a"]]}, "in some groups or sessions"),
    ],
)
def test_a_form_of_some_sessions_is_named_with_them(sequences: dict[str, list[list[str]]], when: str) -> None:
    groups = {group: {"sequences": steps} for group, steps in sequences.items()}
    own = {"sequences": sequences[""]} if "" in sequences else {"groups": groups}
    blocks = {"a": {"title": {"en": "First"}, "phase": "main"}}
    question: Any = SimpleNamespace(where=SimpleNamespace(id="load", title="Workload", is_form=True))
    head = {"study": {"languages": ["en"], "block_order": "fixed"}, "blocks": blocks, "questionnaires": {}}
    study: Any = SimpleNamespace(others=SimpleNamespace(questions=(question,)), protocol=head | own)
    (sentences,) = methods_module._form_sentences(study)
    assert (
        sentences == f"Participants completed the questionnaire “Workload” (1 question) before the first block, {when}."
    )


@pytest.mark.parametrize(
    ("counts", "sentence"),
    [
        ((0, 0, 0, 0), "The study does not contain any reaching trials, so reaching measures are not available."),
        ((5, 9, 0, 0), "recordings of 5 of 9 reaching trials (reasons for the others: lost). No data are available"),
        ((5, 9, 4, 0), "of 5 of 9 reaching trials (reasons for the others: lost). All trials with measured timing"),
        ((5, 9, 4, 1), "(reasons for the others: lost). 1 trial exceeded the protocol's limits but is included"),
        ((5, 9, 4, 3), "(reasons for the others: lost). Three trials exceeded the protocol's limits but are incl"),
    ],
)
def test_recordings_are_counted_with_the_reasons_and_the_trials_beyond_limits(
    counts: tuple[int, ...], sentence: str
) -> None:
    names = ("recorded", "trials", "judged", "invalid")
    measured: Any = SimpleNamespace(unread=("lost",), **dict(zip(names, counts, strict=True)))
    assert sentence in _recordings_sentence(measured)


def test_orders_are_shown_by_position_for_blocks_with_several_orders() -> None:
    def order(orders: int, codes: tuple[str, ...], positions: Any, follows: tuple[int, ...], even: bool) -> Any:
        return SimpleNamespace(
            orders=orders, codes=codes, positions=positions, after_another=follows, positions_even=even,
            follows_even=not even,
        )  # fmt: skip

    blocks = [SimpleNamespace(id=name, title=name.upper(), revealed=False) for name in "abcd"]
    blocks[1] = SimpleNamespace(
        id="b",
        title="B",
        revealed=True,
        delays_ms=(),
        settings=[SimpleNamespace(code=code) for code in ("M2", "M1")],
        names=("Wax", "Oil"),
    )
    orders = {
        "a": order(7, ("L1", "L2"), ((3, 4), (5, 2)), (1, 6), False),
        "b": order(9, ("M1", "M2"), ((8, 8), (8, 8)), (2, 5), True),
        "c": order(0, ("N1", "N2"), ((1, 1),), (1,), True),
        "d": order(6, ("O1",), ((6,),), (1,), True),
    }
    results: Any = SimpleNamespace(trial_blocks=blocks, orders=orders)
    text = " ".join(re.sub(r"<[^>]+>", " ", "".join(map(str, sections._trial_orders_part(results)))).split())
    assert text == (
        "Trial orders A (seven orders): positions were not balanced; each condition occurred 2 to 5 times in each "
        "position and followed every other condition equally often. Position L1 L2 1 3 4 2 5 2 B (nine orders): each "
        "condition occurred eight times in each position and followed every other condition 2 to 5 times. Position Oil "
        "Wax 1 8 8 2 8 8 The tables show how often each condition occurred in each position of its block."
    )


@pytest.mark.slow
def test_common_methods_name_adjustment_alpha_and_missing_answers() -> None:
    def block(id_: str, incomplete: dict[str, tuple[str, ...]]) -> Any:
        return replace(evaluated.blocks[0], id=id_, incomplete=incomplete)

    evaluated = evaluate(study(liquids(3), list(everybody(liquids(3), 8, lambda p, s, c, i: 1 + (p + int(c[1])) % 7))))
    decided = replace(DECIDED, alpha=0.04, primary=("different",))
    blocks = [block("a", {"harder": ("P001", "P002")}), block("b", {"different": ("P002",), "harder": ("P005",)})]
    untested = replace(block("c", {}), findings={})
    for count, holm in ((1, "."), (2, ", Holm-adjusted across two blocks.")):
        sentences = list(
            methods_module._common_sentences(
                replace(evaluated, decided=decided, performance=None), [*blocks[:count], untested]
            )
        )
        assert sentences[0].endswith(f"in its block{holm}")
        assert sentences[1] == (
            "Alpha (0.04) and the primary statements (“different”) were specified before the first session."
        )
        assert f"{count + 1} participants with a missing answer" in sentences[-1].lower()
    changed = replace(evaluated, decided=replace(decided, changed=True), performance=None)
    assert "changed between sessions" in list(methods_module._common_sentences(changed, blocks))[1]
    unplanned = replace(evaluated, decided=replace(decided, made=False), performance=None)
    assert list(methods_module._common_sentences(unplanned, blocks))[1].startswith(
        "The analysis was not specified beforehand"
    )


def test_answers_are_placed_by_person_setting_and_time() -> None:
    rows = [
        ("P2", 2, 5, "L1", "x", 3.0), ("P2", 1, 7, "L1", "x", 5.0), ("P1", 1, 4, "L2", "x", 6.0),
        ("P1", 1, 2, "L3", "x", 1.0), ("P1", 1, 3, "L1", "y", 7.0), ("P1", 1, 1, "L1", "x", None),
    ]  # fmt: skip
    answers = pd.DataFrame(rows, columns=["participant", "session", "trial", "code", "item", "response"])
    values, sessions = measures.presentations(answers, ("P1", "P2"), {"L1": 0, "L2": 1, "L3": 1}, "x")
    nan = np.nan
    assert np.array_equal(values, [[[nan, nan], [1.0, 6.0]], [[5.0, 3.0], [nan, nan]]], equal_nan=True)
    assert np.array_equal(sessions, [[[nan, nan], [1.0, 1.0]], [[1.0, 2.0], [nan, nan]]], equal_nan=True)
    assert np.array_equal(measures.medians(values), [[nan, 3.5], [4.0, nan]], equal_nan=True)


def test_means_of_groups_are_those_of_their_members() -> None:
    people = {"P000": "trained", "P001": "naive", "P002": "trained"}
    case_study = study(
        liquids(2), list(everybody(liquids(2), 3, lambda p, s, c, i: 1 + p * 2 + (c == "L2"), repetitions=2))
    )
    case_study = replace(
        case_study,
        participants=case_study.participants.assign(group=case_study.participants["participant"].map(people)),
    )
    assert group_counts(case_study) == {"naive": 1, "trained": 2}
    rows = [row for row in group_means(case_study) if row.item == ITEMS[1]]
    assert [(row.code, row.group, row.n, row.mean) for row in rows] == [
        ("L1", "naive", 1, 3.0), ("L1", "trained", 2, 3.0), ("L2", "naive", 1, 4.0), ("L2", "trained", 2, 4.0),
    ]  # fmt: skip
    assert [row.sd for row in rows if row.group == "trained"] == pytest.approx([8**0.5] * 2)


@pytest.mark.parametrize(
    ("number", "words"), [(1, "the one statement"), (2, "both statements"), (3, "all three statements")]
)
def test_statements_are_counted_in_words(number: int, words: str) -> None:
    assert all_of(number, "statement") == words


def test_a_sample_is_whole_only_if_each_condition_of_each_block_has_everybody() -> None:
    case_study = replace(study(liquids(2), list(everybody(liquids(2), 3, lambda p, s, c, i: 4))), sites=("A", "B"))
    partly = replace(case_study, blocks=(*case_study.blocks, replace(case_study.blocks[0], id="c")))
    for sample, ends in (
        (case_study, ", each in all conditions."),
        (partly, ", but some did not complete all conditions."),
    ):
        sentences = methods_module._sample_sentence(sample)
        assert sentences.startswith(
            "Three participants (SIMULATED, not people) took part in “Made up” (protocol made_up, v"
        )
        assert sentences.endswith(f" at the sites A and B{ends}")
