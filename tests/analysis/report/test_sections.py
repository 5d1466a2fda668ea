"""The sections of the report for results made up by hand, so that each text has its own value."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from study_app.analysis.data.blocks import Item, Setting
from study_app.analysis.findings.finding import Answer
from study_app.analysis.page_layout import Picture
from study_app.analysis.report import sections
from study_app.analysis.results import (
    BlockResult,
    Failure,
    Failures,
    GroupAnswers,
    LevelsResult,
    NotTested,
    QuestionResult,
    ScoreResult,
)
from study_app.protocol.model import OF_LEVELS
from study_app.store.exclusions import Exclusion
from tests.analysis.made_up import DECIDED, delays, everybody, liquids, study
from tests.golden_values import page_lines

ITEMS = tuple(Item(id=item, text=f"It is {item}.", short=item.capitalize()) for item in ("warm", "thick", "calm"))


def block(name: str, **changes: Any) -> BlockResult:
    """Return the result of a block of the liquids Thin and Wax without any findings."""
    block_result = BlockResult(
        id=name, title=f"Block {name}", kind="liquids", revealed=True, n=3, settings=liquids(2), names=("Thin", "Wax"),
        items=ITEMS, labels=(), measures=(),
    )  # fmt: skip
    return replace(block_result, **changes)


def results_of(*blocks: BlockResult, **changes: Any) -> Any:
    """Return results without hypotheses, questions and levels."""
    fields = dict.fromkeys(("contrasts", "questions", "levels", "delivered", "scores", "failures"), ())
    decided = replace(DECIDED, primary=("warm",))
    fields |= {"blocks": blocks, "trial_blocks": blocks, "orders": {}, "block_orders": None}
    return SimpleNamespace(**{**fields, "decided": decided, **changes})


def of_people(number: int, **changes: Any) -> Any:
    """Return a study of so many people."""
    case_study = study(liquids(2), list(everybody(liquids(2), number, lambda *_: 4)))
    people = case_study.participants.assign(simulated=False, protocol_hash="h")
    return replace(case_study, participants=people, **changes)


def outcome_of(item: str, verdict: str, note: str = "") -> Any:
    return SimpleNamespace(item=item, verdict=verdict, outcome=SimpleNamespace(note=note))


def lines_of(parts: Iterable[Any]) -> list[str]:
    """Return the headings, paragraphs and rows of parts of the page."""
    return list(page_lines("".join(map(str, parts))))


def order(orders: int, *positions: tuple[int, int]) -> Any:
    return SimpleNamespace(orders=orders, codes=("L1", "L2"), positions=positions)


def test_the_limits_are_those_of_each_block_and_each_task(monkeypatch: pytest.MonkeyPatch) -> None:
    """L1 is first in both orders of C and in the only one of D."""
    monkeypatch.setattr(sections, "level_limits", lambda level: (f"{level} has limits.",))
    of_c = (
        outcome_of("warm", "out of reach"),
        outcome_of("thick", "not tested", "alike"),
        outcome_of("calm", "not tested", "alike"),
    )
    of_d = outcome_of("thick", "out of reach"), outcome_of("calm", "not shown", "two sessions")
    against = SimpleNamespace(
        item="warm", delay_ms=50.0, control_ms=0.0, verdict="inconclusive", found=SimpleNamespace(alpha=0.05, bound=1.0)
    )
    late = {"kind": "delays", "settings": delays([0, 50]), "findings": {"against": (against,)}}
    blocks = (
        block("A", n=0),
        block("B", settings=liquids(1), names=("Thin",)),
        block("C", findings={"omnibus": of_c}, absent=(NotTested("trend", "few"), NotTested("pairs", "few"))),
        block("D", findings={"omnibus": of_d}),
        block("E", **late),
    )
    orders = {"C": order(2, (2, 0), (0, 1)), "D": order(1, (1, 0), (0, 1))}
    lines = sections.limits(of_people(12), results_of(*blocks, orders=orders, levels=("Pitch", "Tone")))
    reach = (
        "could not have been significant with so few participants, because no rearrangement of the answers within "
        "participants gives a small enough adjusted p value."
    )
    expected = (
        "Block A (liquids): no answers are included yet.",
        "Block B presents only one liquid, so its ratings are not compared.",
        "Block C (liquids): the trend and the pairs were not computed because few.",
        f"Block C (liquids): the test for “Warm” {reach}",
        "Block C (liquids): “Thick” and “Calm” could not be tested (alike).",
        "Block C (liquids): Thin was in position 1 for all participants, so its effect cannot be distinguished from "
        "the effect of that position.",
        f"Block D (liquids): the test for “Thick” {reach}",
        "Block E (delays): to show that a mean answer stays within ±1 point of that at 0 ms, a study needs",
        "Block E (delays): in 1 of 1 comparison with 0 ms (one for each statement and delay), the data show neither",
        "Pitch has limits.",
        "Tone has limits.",
    )
    assert len(lines) == len(expected)
    for line, start in zip(lines, expected, strict=True):
        assert line == start if start.endswith(".") else line.startswith(f"{start} ")


def hypothesis(**changes: Any) -> Any:
    """Return a hypothesis that was not tested."""
    stated = {"groups": None, "is_interaction": False, "measure": "warm", "blocks": ("b",), "expected": None}
    contrast = SimpleNamespace(**{name: changes.pop(name, value) for name, value in stated.items()})
    fields = {"p_adjusted": None, "verdict": "not tested", "sides": (), "members": 1, "n": 12, "sd": None}
    fields |= {"largest": None if contrast.measure in OF_LEVELS else 6.0, "ratio": False, "standard_error": None}
    return SimpleNamespace(contrast=contrast, **{**fields, **changes})


PAIRED, BETWEEN = {}, {"groups": ("old", "new")}
CROSSED = {**BETWEEN, "is_interaction": True}
FOUND_BEFORE = {"protocol": {"groups": {"old": {}}, "study": {"group_assignment": "pre-existing"}}}
DEALT = {"protocol": {"groups": {"old": {}}, "study": {"group_assignment": "randomised"}}}
LATE = Exclusion(
    participant="P1", session=1, trial=None, rule_or_person="AK", reason="spoke", excluded_at="2026-03-02T09:00:00"
)


@pytest.mark.parametrize(
    ("hypotheses", "of_study", "of_results", "starts"),
    [
        ([PAIRED, BETWEEN], {}, {}, ["No hypothesis tests an interaction between groups and blocks or conditions."]),
        ([BETWEEN, BETWEEN], {}, {}, []),
        ([PAIRED, BETWEEN, CROSSED], {}, {}, []),
        ([BETWEEN], FOUND_BEFORE, {}, ["Participants were not assigned to groups at random, so a difference between"]),
        ([PAIRED], FOUND_BEFORE, {}, []),
        ([BETWEEN], DEALT, {}, []),
        ([], {}, {"questions": [1]}, []),
        ([], {}, {"questions": [1], "blocks": (), "levels": [1]}, []),
        ([], {}, {"questions": [1], "blocks": ()}, ["The answers to these questions are summarised but not tested."]),
        (
            [PAIRED],
            {},
            {"questions": [1], "blocks": ()},
            ["Apart from the hypotheses, the answers to these questions are summarised but not tested."],
        ),
        ([], {"hashes": "aab"}, {}, ["The study file was changed between sessions without a new version number, so 2"]),
        ([], {"hashes": "aab", "versions": "112"}, {}, []),
        ([], {"hashes": "abc", "versions": "112"}, {}, ["The study file was changed between sessions without a new"]),
        ([], {"late": (LATE,), "exclusions": (LATE,)}, {}, ["Some decisions were made after the key was opened, when"]),
        ([], {"exclusions": (LATE,)}, {}, []),
        (
            [],
            {"n": 9},
            {},
            ["Intervals for mean rank correlations and exploratory tests of means need at least 10 par"],
        ),
        ([], {"n": 10}, {}, []),
        ([], {"n": 9}, {"blocks": ()}, []),
    ],
)
def test_the_limits_of_the_study_are_only_those_that_apply(
    hypotheses: list[dict[str, Any]], of_study: dict[str, Any], of_results: dict[str, Any], starts: list[str]
) -> None:
    changes = dict(of_study)
    case_study = of_people(changes.pop("n", 12))
    for column, values in (("protocol_hash", "hashes"), ("protocol_version", "versions")):
        if value := changes.pop(values, None):
            filled = [*value, *value[-1] * (len(case_study.participants) - len(value))]
            case_study = replace(case_study, participants=case_study.participants.assign(**{column: filled}))
    contrasts = [hypothesis(**stated) for stated in hypotheses]
    results = results_of(**{"blocks": (block("b"),), "contrasts": contrasts, **of_results})
    lines = list(sections._general_sentences(replace(case_study, **changes), results))
    assert len(lines) == len(starts)
    assert [line[: len(start)] for line, start in zip(lines, starts, strict=True)] == starts


def test_the_trials_with_a_late_device_are_counted_main_trials() -> None:
    """Rows 1 and 3 are late; row 4 is not counted and row 5 is practice."""
    trials = pd.DataFrame(
        {
            "counted": [True, True, True, False, True],
            "phase": [*["main"] * 4, "practice"],
            "loop_delay_ticks": [2.0, 5.0, 1.0, 8.0, 9.0],
            "device_delay_ticks": [3.0, np.nan, 4.0, 11.0, 12.0],
        }
    )
    lines = sections.limits(of_people(12, trials=trials), results_of(block("A")))
    assert len(lines) == 1
    assert lines[0].startswith(
        "In 2 of three trials in the main blocks, the device responded later than the servo assumed: in the worst case "
        "after at least 4 ticks instead of 1 or 2. "
    )
    for presented in (trials[1:2], trials.drop(columns="device_delay_ticks")):
        assert sections.limits(of_people(12, trials=presented), results_of(block("A"))) == ()


def side(name: str, n: int, sd: float | None, low: float = 0.5) -> Any:
    return SimpleNamespace(name=name, values=dict.fromkeys(range(n)), sd=sd, low=low, high=1.0)


TWO = side("Oil", 12, 1.0), side("Wax", 12, 2.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({}, "Hypothesis: with twelve participants and the observed standard deviation, the true mean difference must"),
        ({"verdict": "shown"}, None),
        ({"verdict": "suggested"}, None),
        ({"verdict": "equivalent"}, None),
        ({"p_adjusted": None}, None),
        ({"sides": TWO[:1]}, None),
        ({"sides": (TWO[0], side("Wax", 12, None))}, None),
        ({"sd": 8.0}, "Hypothesis: with twelve participants, even the largest difference on the scale cannot be "
         "detected "),
        ({"sd": 8.0, "measure": "threshold"}, "Hypothesis: with twelve participants and the observed standard "),
        ({"n": 3, "sides": (side("Oil", 3, 1.0), side("Wax", 3, 1.0))}, "Hypothesis: with three participants, even a "
         "difference of 3 SD cannot be detected with 80 % power"),
    ],
)  # fmt: skip
def test_low_power_is_a_limit_of_a_hypothesis_that_was_not_shown(changes: dict[str, Any], sentence: str | None) -> None:
    """Statements differ by at most 6 points; 80 % power needs a difference of 0.9 SD in twelve participants."""
    hypothesis_result = hypothesis(**{"p_adjusted": 0.3, "verdict": "not shown", "sides": TWO, "sd": 1.5, **changes})
    lines = list(sections._low_power_sentences(results_of(contrasts=[hypothesis_result])))
    assert [line[: len(sentence or "")] for line in lines] == ([] if sentence is None else [sentence])


def test_a_chance_level_limits_hypotheses_but_not_interactions() -> None:
    sides = side("Oil", 12, 1.0, low=-0.1), side("Wax", 12, 1.0)
    for crossed, count in ((False, 1), (True, 0)):
        hypothesis_result = hypothesis(measure="d_prime", sides=sides, is_interaction=crossed)
        lines = list(sections._chance_level_sentences(results_of(contrasts=[hypothesis_result])))
        assert ["mean d′ in Oil includes 0" in line for line in lines] == [True] * count


@pytest.mark.parametrize(
    ("sequence", "changes", "sentence"),
    [
        (["prompt", "rest", "late"], {}, "Hypothesis: all participants completed Prompt before “Quite late”, so the"),
        (
            ["late", "prompt"],
            {},
            "Hypothesis: all participants completed “Quite late” before Prompt, so the difference",
        ),
        (["prompt", "late"], {"groups": ("old", "new")}, None),
        (["prompt", "late"], {"blocks": ("late",)}, None),
        (["prompt", "late", "prompt"], {}, None),
    ],
)
def test_a_fixed_order_of_two_blocks_is_a_limit_of_their_comparison(
    sequence: list[str], changes: dict[str, Any], sentence: str | None
) -> None:
    stated = hypothesis(**{"blocks": ("late", "prompt"), **changes}, compared=("Quite late", "Prompt"))
    case_study = of_people(3, protocol={"sequence": sequence, "blocks": {}, "questionnaires": {}, "study": {}})
    lines = list(sections._fixed_order_sentences(case_study, results_of(contrasts=[stated])))
    assert [line[: len(sentence or "")] for line in lines] == ([] if sentence is None else [sentence])


@pytest.mark.slow
def test_the_limits_of_a_hypothesis_are_its_power_chance_and_order() -> None:
    stated = hypothesis(
        measure="d_prime", blocks=("late", "prompt"), compared=("Late", "Prompt"), p_adjusted=0.3, verdict="not shown",
        sides=(side("Late", 12, 1.0, low=-0.5), TWO[1]), sd=1.5,
    )  # fmt: skip
    case_study = of_people(
        12, protocol={"sequence": ["prompt", "late"], "blocks": {}, "questionnaires": {}, "study": {}}
    )
    lines = list(sections._general_sentences(case_study, results_of(block("b"), contrasts=[stated])))
    assert [line[:40] for line in lines] == [
        "Hypothesis: with twelve participants and", "Hypothesis: the interval of the mean d′ ",
        "Hypothesis: all participants completed P",
    ]  # fmt: skip
    hypothesis_result = hypothesis(measure="d_prime", sides=stated.sides, verdict="shown")
    assert list(sections._chance_level_sentences(results_of(contrasts=[hypothesis_result]))) == []


def test_conclusions_are_all_hypotheses_and_then_all_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    contrasts = [SimpleNamespace(name=name, verdict=f"verdict {name}") for name in ("first", "second")]
    monkeypatch.setattr(sections, "question", lambda contrast: f"{contrast.name}?")
    monkeypatch.setattr(sections, "answer", lambda contrast: f"{contrast.name}!")
    all_answers = (
        Answer(question="distinguished", block="v", title="Videos", verdict="shown", text="two of them"),
        Answer(question="unchanged up to", block="d", title="Delays", verdict="equivalent", text="50 ms"),
    )
    monkeypatch.setattr(sections, "answers", lambda _results: all_answers)
    results = results_of(block("v", kind="views"), block("d", kind="delays"), contrasts=contrasts)
    assert sections.conclusions(results) == [
        ("Hypothesis", "first?", "verdict first", "first!"),
        ("Hypothesis", "second?", "verdict second", "second!"),
        ("Videos", "Which views were distinguished?", "shown", "two of them"),
        ("Delays", "Up to what delay do answers remain practically unchanged?", "equivalent", "50 ms"),
    ]


def test_conclusions_with_and_without_sessions_include_each_task(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sections, "level_findings", lambda level: [f"{level}: found"])
    conclusions = sections._conclusions_by_question(results_of(levels=("Pitch", "Tone")))
    assert conclusions == {"Pitch": "found", "Tone": "found"}


def test_questions_are_answered_only_of_blocks_with_answers_on_several_settings() -> None:
    late = {"kind": "delays", "settings": delays([0, 50])}
    results = results_of(
        block("A", n=0),
        block("B", settings=liquids(1), names=("Thin",)),
        block("C", revealed=False),
        block("D", revealed=False, **late),
        block("E", absent=(NotTested("equivalence test", "of haste"),), **late),
    )
    answers_given = [
        (answer.block, answer.question, answer.verdict, answer.text) for answer in sections.answers(results)
    ]
    sealed = "sealed", "This question is answered after unblinding."
    assert answers_given[:3] == [
        ("C", "distinguished", *sealed),
        ("D", "noticed from", *sealed),
        ("D", "unchanged up to", *sealed),
    ]
    assert [answer[:3] for answer in answers_given[3:]] == [
        ("E", "noticed from", "not shown"),
        ("E", "unchanged up to", "not tested"),
    ]
    assert answers_given[4][3] == "This was not tested, because of haste."


def png(name: str, of: str) -> Picture:
    return Picture(block=of, name=name, caption=f"Figure {name} of {of}.", files={"png": bytes(30)})


def test_a_block_has_its_parts_in_order_with_its_own_figures() -> None:
    block_result = block(
        "A", presentations=(2, 3), sessions=(1, 2), incomplete={"warm": ("P7",)},
        absent=(NotTested("trend", "few"), NotTested("pairs", "so")),
    )  # fmt: skip
    block_result = replace(block_result, findings={"overall": SimpleNamespace(p=None, note="alike")})
    pictures = [png(f"{kind}-x", of) for of in "AB" for kind in ("effects", "liquids", "delays")]
    results = results_of(block_result, block("B"))
    assert lines_of(sections.block(block_result, results, pictures)) == [
        "Block A (liquids)",
        "Each participant rated each liquid 2 to 3 times. The tests use the median of these answers. The answers from "
        "sessions 1 and 2 are compared with each other, and are pooled in all other tests.",
        "Participants excluded from tests across all liquids because an answer is missing: P7 (“Warm”).",
        "Figure effects-x of A.",
        "Figure liquids-x of A.",
        "The test over all statements was not possible (alike).",
        "What could not be computed, and why",
        "The trend was not computed because few.",
        "The pairs was not computed because so.",
    ]
    single = replace(block_result, names=("Thin",), settings=liquids(1))
    assert "What could not be computed, and why" not in lines_of(sections.block(single, results, pictures))
    late = replace(block_result, kind="delays", settings=delays([0, 50]), absent=())
    lines = lines_of(sections.block(late, results, pictures))
    assert [line for line in lines if line.startswith("Figure")] == ["Figure effects-x of A.", "Figure delays-x of A."]
    assert "Participants excluded from tests across all delays because an answer is missing: P7 (“Warm”)." in lines


def test_verdicts_are_explained_with_the_alpha_of_the_study_if_statements_are_tested() -> None:
    decided = replace(DECIDED, alpha=0.04)
    heading, text = lines_of(sections.verdicts_mean(results_of(block("A"), decided=decided)))
    assert heading == "What the verdicts mean"
    assert "the adjusted p value is at most 0.04. Suggested" in text
    assert lines_of(sections.verdicts_mean(results_of(decided=decided))) == []


@pytest.mark.parametrize(
    ("failed", "sentence"), [("A", "the test was not computed because broken."), ("B", "No answers are included yet.")]
)
def test_a_block_without_answers_names_the_failure_in_that_block(failed: str, sentence: str) -> None:
    block_result = block("A", n=0, absent=(NotTested("test", "broken"),))
    failures = (Failure(what="test", error="e", where="w", block=failed),)
    lines = lines_of(sections.block(block_result, results_of(block_result, failures=failures), (), Failures()))
    assert lines == ["Block A (liquids)", sentence]


def count_row(code: str, item: str, counts: tuple[int, ...], **changes: Any) -> dict[str, Any]:
    quartiles = {"median": 4.5, "q1": 3.0, "q3": 6.5, "agree_percent": 62.5}
    levels = {f"count_{level}": count for level, count in enumerate(counts, start=1)}
    return {
        "code": code,
        "item": item,
        "n": sum(counts),
        "missing": 4,
        "cannot_judge": 7,
        **levels,
        **quartiles,
        **changes,
    }


def test_counts_of_answers_are_those_of_each_statement_and_setting() -> None:
    """Answers 1, 2, 2, 7 and 7, 7 have a mean of 4.33 and a variance of (11.1 + 2 · 5.4 + 3 · 7.1) / 5."""
    nothing = dict.fromkeys(("median", "q1", "q3", "agree_percent"))
    rows = (
        count_row("L2", "thick", (1, 0, 0, 0, 0, 0, 0)),
        count_row("L1", "warm", (1, 2, 0, 0, 0, 0, 3)),
        count_row("L2", "warm", (0,) * 7, **nothing),
    )
    lines = lines_of(sections.counts_of_answers(results_of(block("A", measures=rows), block("B"))))
    assert lines == [
        "Counts of answers",
        "Block A (liquids)",
        "Statement | Liquid | 1 | 2 | 3 | 4 | 5 | 6 | 7 | n | missing | mean | SD | median | quartiles | agree %",
        "Warm | Thin | 1 | 2 | 0 | 0 | 0 | 0 | 3 | 6 | 11 | 4.33 | 2.94 | 4.5 | 3.0 – 6.5 | 62",
        "Warm | Wax | 0 | 0 | 0 | 0 | 0 | 0 | 0 | 0 | 11 | – | – | – | – | –",
        "Thick | Wax | 1 | 0 | 0 | 0 | 0 | 0 | 0 | 1 | 11 | 1.00 | – | 4.5 | 3.0 – 6.5 | 62",
    ]


def question_result(where: str, item: str, measure: str, *groups: GroupAnswers, is_form: bool = True) -> QuestionResult:
    return QuestionResult(
        where=where, title=f"Title {where}", is_form=is_form, item=item, text=f"How {item}?", short=item.capitalize(),
        kind="number", measure=measure, figure=None, groups=groups,
    )  # fmt: skip


def spread(n: int, median: float) -> dict[str, Any]:
    return {
        "n": n, "missing": 8, "median": median, "q1": median - 1, "q3": median + 2, "smallest": 0.5, "largest": 9.5,
    }  # fmt: skip


def test_questions_have_their_own_scores_answers_and_figures() -> None:
    def score(where: str, name: str, source: str | None, mean: float, sd: float | None = 3.0) -> ScoreResult:
        numbers = {"n": 9, "mean": mean, "sd": sd, "smallest": 5.0, "largest": 95.5}
        return ScoreResult(
            where=where,
            title="",
            name=name,
            instrument=None,
            source=source,
            groups=(GroupAnswers(None, "All", numbers),),
        )

    texts = [{"n": 1, "texts": [text]} for text in ("P1: dull", "P2: fine")]
    both = [GroupAnswers(code, name, numbers) for code, name, numbers in zip("ab", ("Oil", "Wax"), texts, strict=True)]
    questions = (
        question_result("end", "old", "distribution", GroupAnswers(None, "All", spread(9, 4.0))),
        question_result("start", "new", "distribution", GroupAnswers(None, "All", spread(9, 5.0))),
        question_result("b", "size", "distribution", GroupAnswers(None, "All", spread(9, 6.0)), is_form=False),
        question_result("end", "why", "texts", *both),
        question_result("end", "tired", "distribution", GroupAnswers(None, "All", {"n": 0})),
    )
    scores = [
        score("end", "raw", "Hart 2006", 41.0),
        score("start", "sus", None, 70.0),
        score("end", "all", "L", 2.0, None),
    ]
    of_study: Any = SimpleNamespace(
        others=SimpleNamespace(
            questions=[SimpleNamespace(where=SimpleNamespace(id=q.where), id=q.item) for q in questions]
        ),
        estimator=None,
        levels=(),
    )
    results = results_of(questions=questions, scores=scores)
    pictures = [png(f"question-{name}", "end") for name in ("end-new", "end-old", "start-old")]
    assert lines_of(sections.question_section("end", of_study, results, pictures)) == [
        "Title end: form",
        "Scores",
        "Score | Answers | n | mean | SD | SE | range",
        "raw | All | 9 | 41.0 | 3.0 | 1.00 | 5.0 – 95.5",
        "all | All | 9 | 2.0 | – | – | 5.0 – 95.5",
        "Hart 2006",
        "L",
        "Old",
        "How old?",
        "Answers | n | missing | median | quartiles | range",
        "All | 9 | 8 | 4.0 | 3.0 – 6.0 | 0.5 – 9.5",
        "Figure question-end-old of end.",
        "Why",
        "How why?",
        "Oil:",
        "P1: dull",
        "Wax:",
        "P2: fine",
        "Tired",
        "How tired?",
        "No answers are included yet.",
    ]


@pytest.mark.parametrize(
    ("codes", "blocks", "title"),
    [
        ("ABC", "AB", "Title load, after each block"),  # C has other questions
        ("ABCL", "AB", "Title load, after each block"),
        ("AB", "AB", "Title load"),
        ("ABCD", "AB", "Title load"),
        ("C", "", "Title load"),
    ],
)
def test_a_form_is_said_to_follow_each_block_only_if_it_follows_all_main_blocks(
    codes: str, blocks: str, title: str
) -> None:
    form = question_result("load", "raw", "distribution", *(GroupAnswers(code, code, spread(9, 4.0)) for code in codes))
    others = question_result("C", "size", "distribution", is_form=False), question_result("end", "age", "distribution")
    levels = [SimpleNamespace(block="L")] if "L" in codes else []
    results = results_of(*map(block, blocks), questions=(form, *others), levels=levels)
    assert sections.place_title(form, results) == title


@pytest.mark.parametrize(
    ("summary", "shown", "modulus"), [("settings", False, None), ("mean", True, None), ("geometric mean", True, 8.0)]
)
def test_answers_in_a_block_of_levels_are_shown_unless_starting_levels_differ(
    summary: Any, shown: bool, modulus: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        sections, "level_section", lambda level, _drawn, estimator: [f"<p>{level.block} {estimator}</p>"]
    )
    levels = [
        LevelsResult(
            block=name, title=name, design="d", revealed=True, times=(), summary=summary, counts="correct", vary="x"
        )
        for name in ("c", "b")
    ]
    oil = GroupAnswers("L1", "Oil", spread(9, 4.0))
    questions = (question_result("b", "size", "distribution", oil, is_form=False),)
    placed = SimpleNamespace(where=SimpleNamespace(id="b"), id="size")
    blocks = [SimpleNamespace(id=name, design=SimpleNamespace(first=modulus)) for name in "cb"]
    of_study: Any = SimpleNamespace(
        others=SimpleNamespace(questions=[placed]), estimator="kalman", levels=blocks if modulus else blocks[:1]
    )
    lines = lines_of(sections.question_section("b", of_study, results_of(questions=questions, levels=levels), ()))
    table = ["Condition | n | missing | median | quartiles | range", "Oil | 9 | 8 | 4.0 | 3.0 – 6.0 | 0.5 – 9.5"]
    note = ["The counts include the answers to the modulus."] if modulus else []
    assert lines == ["Title b: levels", "Answers", "How size?", *note, *(table if shown else []), "b kalman"]


def test_groups_are_compared_only_in_their_block_and_tested_only_by_hypotheses(monkeypatch: pytest.MonkeyPatch) -> None:
    def mean(of: str, code: str, value: float) -> Any:
        return SimpleNamespace(block=of, item="warm", code=code, group="old", n=5, mean=value, sd=np.nan)

    monkeypatch.setattr(sections, "group_counts", lambda _study, by: {"old": 5, by: 3})
    monkeypatch.setattr(sections, "group_means", lambda _study, _by: [mean("B", "L1", 2.5), mean("A", "L2", 6.25)])
    results = results_of(block("A"), block("B"), contrasts=[hypothesis(**BETWEEN)])
    by: Any
    for by, name, note in (
        ("group", "Group", "Differences between groups are tested only if a hypothesis states them."),
        ("site", "Site", "Differences between sites are not tested."),
    ):
        lines = lines_of(sections.groups(of_people(3), results, by))
        head = f"Statement | Liquid | {name} | n | mean | SD"
        assert lines[:4] == [f"{name}s", f"{name} | participants", "old | 5", f"{by} | 3"]
        assert lines[4:-1] == [
            "Block A", head, "Warm | Wax | old | 5 | 6.25 | –", "Block B", head, "Warm | Thin | old | 5 | 2.50 | –",
        ]  # fmt: skip
        assert lines[-1].endswith(note)


@pytest.mark.parametrize(
    ("settings", "name"), [({}, "L1"), ({("b", "L1"): Setting(code="L1", condition="thin")}, "thin")]
)
def test_the_sessions_with_lost_trials_are_listed_with_their_settings_up_to_a_number(
    settings: dict[Any, Any], name: str
) -> None:
    lost = [SimpleNamespace(count=n, asked=40, tracks={("b", "L1"): n}, reason_texts=["late"]) for n in range(24)]
    people = pd.DataFrame(
        {
            "participant": [f"P{n}" for n in range(24)],
            "session": 2,
            "counted": [n % 2 for n in range(24)],
            "missing": lost,
        }
    )
    levels = [SimpleNamespace(id="b", title="Pitch")]
    case_study: Any = SimpleNamespace(levels=levels, participants=people, settings=settings, protocol={})
    heading, _, head, *rows, more = lines_of(sections._missing_trials_part(case_study))
    assert (heading, head) == ("Trials that were not delivered", "Session | missing | of which | reason | session")
    assert rows == [
        f"P{n}, session 2 | {n} of 40 | Pitch, {name}: {n} | late | {'included' if n % 2 else 'not included'}"
        for n in range(1, 21)
    ]
    assert more == "report.json lists three more sessions."


def test_limits_are_exceeded_only_by_counted_main_trials() -> None:
    trials = pd.DataFrame(
        {
            "counted": [True, True, False, True],
            "phase": ["main", "main", "main", "practice"],
            "worst_gap_ms": [21.0, 19.0, 22.0, 23.0],
            "lateness_p99_ms": [3.0, np.nan, 4.0, 5.0],
        }
    )
    case_study: Any = SimpleNamespace(trials=trials)
    sentence = sections._violated_limits_sentence(case_study, {"worst_gap_ms": 20.0, "lateness_ms": 2.0})
    assert sentence.startswith("1 of 2 trials exceeded a limit: ")
    assert sentence.count("(1 trial)") == 2


@pytest.mark.parametrize(("count", "last"), [(20, "19"), (21, "and 1 more, listed in report.json")])
def test_long_lists_end_with_the_number_of_the_others(count: int, last: str) -> None:
    lines = sections._first_lines([str(number) for number in range(count)])
    assert lines == [*(str(number) for number in range(20)), *([last] if count > 20 else [])]
    assert lines[-1] == last


def test_reversed_exclusions_of_a_merged_study_name_the_site(monkeypatch: pytest.MonkeyPatch) -> None:
    def reversal(participant: str, rule: str, at: str) -> Any:
        excluded = replace(LATE, participant=participant, rule_or_person=rule)
        return SimpleNamespace(exclusion=excluded, at=at, by="EM", reason="brief")

    later = "2026-03-07T10:00:00"
    by_site = {
        "a": [reversal("P1", "AK", later), reversal("P2", "fast_answers", LATE.excluded_at)],  # kept from the beginning
        "b": [reversal("P1", "fast_answers", later), reversal("P3", "BL", LATE.excluded_at)],
    }
    monkeypatch.setattr(sections, "folders_of", lambda _folder: {"A-": Path("a"), "B-": Path("b")})
    monkeypatch.setattr(sections, "dated_reversals", lambda folder: by_site[folder.name])
    after, before = "EM included it again on 2026-03-07 (brief).", "EM included it again on 2026-03-02 (brief)."
    assert list(sections._reversed_exclusion_sentences(of_people(1))) == [
        f"participant A-P1, session 1: spoke (AK, 2026-03-02). {after}",
        f"participant B-P1, session 1: spoke (fast_answers, 2026-03-02). {after}",
        f"participant B-P3, session 1: spoke (BL, 2026-03-02). {before}",
    ]


def test_planned_rules_are_listed_even_without_exclusions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sections, "rule_sentences", lambda *_: ["A rule.", "Another one."])
    lines = lines_of(sections.conduct(of_people(3), results_of()))
    assert lines[lines.index("Exclusions") + 1 :] == ["There are no exclusions.", "A rule.", "Another one."]


@pytest.mark.parametrize(("count", "verb"), [(1, "1 session was"), (2, "two sessions were")])
def test_exclusions_by_a_rule_of_the_program_are_named_as_such(count: int, verb: str) -> None:
    people = of_people(3).participants
    people = people.assign(counted=[number >= count for number in range(3)])
    by_rule = replace(LATE, participant="P2", rule_or_person="catch")
    case_study = replace(of_people(3), participants=people, exclusions=(LATE, by_rule))
    lines = lines_of(sections.conduct(case_study, results_of()))
    assert lines[lines.index("Exclusions") + 1 :] == [
        "participant P1, session 1: spoke (AK, 2026-03-02T09:00:00)",
        "participant P2, session 1: spoke (rule catch, 2026-03-02T09:00:00)",
        f"{verb} not completed and therefore not analysed",
    ]
