"""The first page: what it answers in studies of every kind, how often it is wrong, and what a claim needs."""

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom, binomtest

from study_app.analysis.data.blocks import AFTER, AT_THE_START, Block, Decided, Item, LevelBlock, Setting
from study_app.analysis.evaluate import evaluate, evaluate_block
from study_app.analysis.figures.summary_figures import Numbers, place_of
from study_app.analysis.findings.delays import ContrastsWithControl, DetectionThreshold, LowestDelay, LowestTrend
from study_app.analysis.findings.finding import answers_from_tables
from study_app.analysis.findings.recognition import LiquidRecognition, RecognitionResult, recognised
from study_app.analysis.findings.statement_tests import DelayTrend, Effects, Pairs, add_gates
from study_app.analysis.page_layout import Drawing
from study_app.analysis.report import first_page as pages
from study_app.analysis.report import motion_section, sections
from study_app.analysis.report.first_page import Card, Presented, first_page, presented_in
from study_app.analysis.report.sections import CLAIMS, answers, false_claims_sentence
from study_app.analysis.results import GroupAnswers, QuestionResult, Results, lead_phrase
from study_app.analysis.statistics.recognition_tests import recognition
from study_app.protocol.trials.designs import default_design
from tests.analysis.made_up import DECIDED, ITEMS, delays, everybody, liquids, study
from tests.analysis.report.sentences import ReportNumbers, check
from tests.golden_values import page_lines

pytestmark = pytest.mark.slow

DELAYS = (0.0, 50.0, 100.0, 150.0)
ONE_LIQUID = "Block presents only one liquid, so its ratings are not compared."
Said = Callable[[int, int, str, str], int]


def of_delays(answer: Said, decided: Decided = DECIDED) -> Results:
    return evaluate(study(delays(DELAYS), list(everybody(delays(DELAYS), 20, answer)), decided))


def of_liquids(answer: Said, people: int = 12, decided: Decided = DECIDED) -> Results:
    return evaluate(study(liquids(3), list(everybody(liquids(3), people, answer)), decided))


def rising_answer(from_code: int) -> Said:
    """Return answers that rise to one statement and fall to the other by 4 points from a setting (D1 …) on."""
    rng = np.random.default_rng(2)

    def answer(_person: int, _session: int, code: str, item: str) -> int:
        up = 4 * (int(code[1:]) >= from_code)
        return int(np.clip((2 + up if item == ITEMS[0] else 6 - up) + rng.integers(-1, 2), 1, 7))

    return answer


def rising(from_code: int, **decided: Any) -> Results:
    """Return the results of a study with these answers."""
    return of_delays(rising_answer(from_code), replace(DECIDED, **decided))


def ordered(people: int, **decided: Any) -> Results:
    """Return a study of three liquids that everybody puts in the same order in the second statement."""
    results = of_liquids(
        lambda _p, _s, code, i: 2 * int(code[1:]) if i == ITEMS[1] else 4, people, replace(DECIDED, **decided)
    )
    return replace(results, blocks=(LiquidRecognition.add_to(results.blocks[0], None),))


def primary_later() -> Results:
    """Return a study whose primary statement changes from 150 ms on, and the exploratory one from 50 ms on."""
    high = {("D4", "harder"), ("D2", "different"), ("D3", "different"), ("D4", "different")}
    noise = np.random.default_rng(1).integers(0, 2, (20, 4, 2))

    def answer(person: int, _session: int, code: str, item: str) -> int:
        up = 4 * ((code, item) in high)
        return (6 - up if item == "harder" else 1 + up) + int(noise[person, int(code[1:]) - 1, ITEMS.index(item)])

    return of_delays(answer, replace(DECIDED, primary=ITEMS[1:]))


def with_changed_entries(results: Results, finding: Any, change: Callable[[int, Any], Any]) -> Results:
    """Return results in which each entry of a finding is changed, or left out where that gives None."""
    (block,) = results.blocks
    entries = (change(number, entry) for number, entry in enumerate(finding.value_in(block)))
    return replace(results, blocks=(finding.add_to(block, tuple(entry for entry in entries if entry is not None)),))


def with_verdict(verdict: str) -> Callable[[int, Any], Any]:
    return lambda number, entry: entry if number else replace(entry, tested=replace(entry.tested, verdict=verdict))


def threshold_alone(**decided: Any) -> Results:
    results = with_changed_entries(
        with_changed_entries(rising(3), LowestDelay, lambda *_: None), ContrastsWithControl, lambda *_: None
    )
    return replace(results, decided=replace(results.decided, **decided))


def without_harder(_number: int, entry: Any) -> Any:
    return None if entry.item == "harder" else entry


def studies() -> Iterator[tuple[str, Results]]:
    """Yield the verdicts of the answers of a study, and its results."""
    yield "shown, equivalent", rising(3)
    yield "suggested, equivalent", rising(3, changed=True)
    yield "not shown, equivalent", of_delays(lambda person, *_: 3 + person % 2)
    right = {("L1", ITEMS[0]): 7, ("L2", ITEMS[1]): 7}
    yield "shown", of_liquids(lambda _p, _s, code, item: right.get((code, item), 2))
    wrong = {("L1", ITEMS[0]): 7, ("L2", ITEMS[1]): 2, ("L3", ITEMS[1]): 2}
    yield "shown", of_liquids(lambda _p, _s, code, i: wrong.get((code, i), 4 + (i == ITEMS[0])))
    yield "shown", ordered(5)
    yield "suggested", ordered(5, primary=ITEMS[:1])
    yield "shown", ordered(7)
    yield "shown", with_changed_entries(ordered(7), Pairs, lambda _, entry: with_verdict("not shown")(0, entry))
    yield "shown", with_changed_entries(ordered(8), Pairs, with_verdict("suggested"))
    yield "shown, inconclusive", primary_later()
    exploratory = with_changed_entries(primary_later(), LowestDelay, without_harder)
    yield "suggested, inconclusive", with_changed_entries(exploratory, ContrastsWithControl, without_harder)
    yield "shown, not tested", threshold_alone()
    yield "suggested, not tested", threshold_alone(changed=True)
    yield "suggested, not tested", threshold_alone(primary=ITEMS[1:])
    yield "shown, not tested", threshold_alone(primary=ITEMS[:1])


@pytest.mark.parametrize(("primary", "said"), [((), []), (ITEMS[:1], [ONE_LIQUID])])
def test_a_single_liquid_is_a_limit_only_of_statements_that_are_planned_to_differ(
    primary: tuple[str, ...], said: list[str]
) -> None:
    case_study = study(liquids(1), list(everybody(liquids(1), 12, lambda *_: 4)), replace(DECIDED, primary=primary))
    assert [line for line in sections.limits(case_study, evaluate(case_study)) if "one liquid" in line] == said


def test_the_first_page_names_the_conditions_of_each_block() -> None:
    def presented(*conditions: tuple[str, float | None], link: str = "") -> Setting:
        (liquid, delay_ms), *_ = conditions
        return Setting(code="L1", condition="c", liquid=liquid, delay_ms=delay_ms, link=link)

    settings = (presented(("slime", 73.0)),)
    late = LevelBlock("late", "Liquids late", "main", default_design("abx"), None, settings)
    blocks = [
        replace(late, id="e", settings=(Setting(code="L1"),)),
        replace(late, reference=presented(("gear_oil", 73.0))),
        replace(late, id="b", settings=(presented(("slime", 0.0)), presented(("slime", 41.0)))),
        replace(late, id="c", title="On time", settings=(presented(("slime", 0.0), link="force 20 ms late"),)),
        replace(
            late,
            id="d",
            design=default_design("2ifc"),
            settings=(Setting(code="L1", condition="8/1", of=presented(("slime", None))),),
        ),
    ]
    had = [*["late"] * 3, *["b"] * 2, "c"], [*["late"] * 3, *["b"] * 4, "c", "late"]
    trials = pd.DataFrame(
        [(who, block) for who, of in enumerate(had) for block in of], columns=["participant", "block"]
    )
    trials["counted"] = trials.index < len(trials) - 1
    study: Any = SimpleNamespace(trial_blocks=(), levels=blocks, trials=trials)
    assert {block: presented.sentence for block, presented in presented_in(study).items()} == {
        "late": (
            "In the block “Liquids late” (ABX, 3 trials per participant), the liquids were “slime” and “gear oil”, "
            "with a visual delay of 73 ms."
        ),
        "b": (
            "In the block “Liquids late” (ABX, 2 to 4 trials per participant), the liquid was “slime”, with visual "
            "delays of 0 and 41 ms."
        ),
        "c": (
            "In the block “On time” (ABX, 1 trial per participant), the liquid was “slime”, with no visual delay, "
            "force 20 ms late."
        ),
        "d": (
            "In the block “Liquids late” (two-interval forced choice), the liquid was “slime”, with a varied visual "
            "delay."
        ),
    }


_OF_DELAYS = (("“oil”", "60 ms of visual delay", ""), ("“oil”", "no visual delay", ""))


@pytest.mark.parametrize(
    ("names", "presented", "added"),
    [
        (("Late", "160 ms"), _OF_DELAYS, [" (60 ms of visual delay)", " (no visual delay)"]),
        (("Oil 60 ms late", "Without delay"), _OF_DELAYS, ["", ""]),
        (("60 g", "1.0 ms late"), _OF_DELAYS, [" (60 ms of visual delay)", " (no visual delay)"]),
        (("A", "Water"), (("“oil”", "", "force 9 ms late"), ("“water”", "", "")), [" (“oil”, force 9 ms late)", ""]),
        (("Sealed", "Late"), ((), _OF_DELAYS[0]), ["", ""]),
    ],
)
def test_a_comparison_states_the_difference_of_its_sides_unless_their_names_do(
    names: tuple[str, str], presented: tuple[tuple[str, ...], ...], added: list[str]
) -> None:
    assert pages._distinguish_names(names, presented) == added


@pytest.mark.parametrize(
    ("measure", "rates", "said"),
    [
        (
            "threshold",
            (0.5, 0.5),
            " Values are Weber fractions at 75 % correct; lower values mean better discrimination.",
        ),
        ("threshold", (1 / 3, 0.5), " Values are Weber fractions; lower values mean better discrimination."),
        ("pse", (None, None), " Values are Weber fractions."),
    ],
)
def test_the_explanation_of_weber_fractions_states_a_single_criterion(
    measure: str, rates: tuple[float | None, ...], said: str
) -> None:
    levels = [
        SimpleNamespace(block=block, level_kind="weber", guess_rate=rate, counts="correct")
        for block, rate in zip("ab", rates, strict=True)
    ]
    contrast: Any = SimpleNamespace(contrast=SimpleNamespace(blocks=("a", "b"), measure=measure), scale=None)
    results: Any = SimpleNamespace(levels=levels)
    assert pages._scale_text(contrast, results) == said


_ASKED_AFTER = {"a": {"P1": 40.0, "P2": 50.0}, "b": {"P1": 20.0, "P2": 40.0}, "c": {"P1": 10.0, "P2": 20.0}}


@pytest.mark.parametrize(("blocks", "people", "n"), [("ab", 2, 0), ("abc", 2, 1), ("ab", 1, 1)])
def test_a_form_has_a_card_only_if_it_says_more_than_a_hypothesis(blocks: str, people: int, n: int) -> None:
    answers_of_blocks = [dict(list(_ASKED_AFTER[block].items())[:people]) for block in "ab"]
    of_form = SimpleNamespace(form="load", measure="raw", blocks=("a", "b"), conditions=None)
    tested = SimpleNamespace(
        contrast=of_form, left_out={}, sides=[SimpleNamespace(values=values) for values in answers_of_blocks]
    )
    question = SimpleNamespace(where="load", title="Load", is_form=True, item="i", n=2, measure="quartiles", groups=())
    results: Any = SimpleNamespace(questions=[question], levels=[], blocks=[], scores=[question], contrasts=[tested])
    by_setting = tuple((f"After {block}", _ASKED_AFTER[block]) for block in blocks)
    raw = Numbers("raw", (0.0, 100.0), True, by_setting, "raw", tuple(blocks), tuple(blocks))
    presented = {block: Presented("", {"": of}) for block, of in zip("ab", _OF_DELAYS, strict=True)}
    question_cards = list(pages._question_cards(results, {"load": [raw]}, presented))
    assert len(question_cards) == n
    if blocks == "ab" and question_cards:
        assert "after a (60 ms of visual delay) and 30.0 [" in question_cards[0].sentences[0]


@pytest.mark.parametrize(
    ("numbers", "words"),
    [
        (
            Numbers("Age", None, False, (("", {"P1": 20.0, "P2": 31.0, "P3": 24.0}),)),
            "The mean of “Age” was 25.0 (SD 5.57, range 20 to 31, n = 3).",
        ),
        (Numbers("Age", None, False, (("", {"P1": 20.0}),)), "The mean of “Age” was 20.0 (range 20 to 20, n = 1)."),
        (
            Numbers("Years", None, False, (("", {"P1": 29.714, "P2": 35.047, "P3": 12.0}),)),
            "The mean of “Years” was 25.6 (SD 12.1, range 12 to 35.0, n = 3).",
        ),
        (
            Numbers("SUS", None, True, (("", {"P1": 2.0, "P2": 6.0}),)),
            "The mean SUS score was 4.00 [−21.4, 29.4] (95 % confidence interval, n = 2).",
        ),
        (
            Numbers("Warm", (1.0, 7.0), False, (("Water", {"P1": 2.0, "P2": 6.0, "P3": 4.0}), ("Oil", {"P1": 1.0}))),
            "The mean of “Warm” was 4.00 [−0.97, 8.97] for water and 1.00 for oil on a scale from 1 to 7 (95 % "
            "confidence intervals, n = 3).",
        ),
        (
            Numbers("Raw", (1.0, 7.0), True, ((f"{AFTER}Oil", {"P1": 2.0, "P2": 6.0}), ("Wax", {"P2": 3, "P1": 1}))),
            "The mean Raw score was 4.00 [−21.4, 29.4] after Oil and 2.00 [−10.7, 14.7] for wax on a scale from 1 to 7 "
            "(95 % confidence intervals, n = 2). The mean difference (after Oil − wax) was 2.00 [−10.7, 14.7].",
        ),
        (
            Numbers("Raw", None, True, (
                (f"{AFTER}Thick oil, session 2", {"P1": 2.0}), (f"{AT_THE_START} of session 1", {"P1": 1.0}),
            )),
            "The mean Raw score was 2.00 after “Thick oil” in session 2 and 1.00 at the start of session 1 (n = 1).",
        ),
        (
            Numbers("Real", (1.0, 5.0), False, (("Oil", {"P1": 3.0, "P2": 3.0}),)),
            "The mean of “Real” was 3.00 for oil on a scale from 1 to 5 (n = 2; no confidence interval because all "
            "values are equal).",
        ),
        (
            Numbers("Warm", (1.0, 7.0), False, (("L1", {"P1": 2.0, "P2": 6.0}), ("Utrecht-L2", {"P2": 3, "P1": 1}))),
            "The mean of “Warm” was 4.00 [−21.4, 29.4] for L1 and 2.00 [−10.7, 14.7] for Utrecht-L2 on a scale from 1 "
            "to 7 (95 % confidence intervals, n = 2). The mean difference (L1 − Utrecht-L2) was 2.00 [−10.7, 14.7].",
        ),
    ],
)  # fmt: skip
def test_an_answer_states_the_mean_of_each_setting_and_the_mean_difference_of_two(numbers: Numbers, words: str) -> None:
    """Student's t(1) is 12.706 and t(2) 4.303; the standard errors are 2 or 1, and 2 / √3."""
    assert pages._number_text(numbers) == words


@pytest.mark.parametrize(
    ("places", "place"),
    [((None, None, 8.0), 8.0), ((None, 0.0, 8.0), 0.0), (("oil", 0.5, 8.0), "oil"), ((None, None, None), None)],
)
def test_an_estimate_is_for_its_comparison_its_level_or_its_standard(places: tuple[Any, ...], place: Any) -> None:
    assert place_of(SimpleNamespace(**dict(zip(("comparison", "level", "standard"), places, strict=True)))) == place


@pytest.mark.parametrize(("revealed", "words"), [(True, "Block (liquids)"), (False, "Block")])
def test_sentences_on_a_block_name_its_conditions_once_they_are_known(revealed: bool, words: str) -> None:
    (block,) = ordered(2).blocks
    assert lead_phrase(replace(block, revealed=revealed)) == words


def test_all_limits_are_shown_by_subject() -> None:
    lines = [
        f"{subject}: {words.format(len(subject))}"
        for words in ("few (P1).", "late (P{}).", "no key.")
        for subject in ("Block", "Levels")
    ]
    results: Any = replace(rising(3), levels=tuple(SimpleNamespace(title=title) for title in ("Levels", "Tasks")))
    assert pages._limits_by_subject([*lines, *map(str, range(9)), "Tasks: old."], results) == [
        *(("", [str(place)]) for place in range(9)),
        ("Block and Levels", ["Few (P1).", "Late (Block: P5; Levels: P6).", "No key."]),
        ("Tasks", ["Old."]),
    ]


def test_each_answer_has_its_verdict_and_is_true_of_its_numbers() -> None:
    for verdicts, results in studies():
        without_answers: Any = None  # these sentences follow from the results
        all_answers = answers(results)
        assert ", ".join(answer.verdict for answer in all_answers) == verdicts
        for answer in all_answers:
            assert answer.claims == (answer.verdict in {"shown", "suggested"})
            check(answer.text, ReportNumbers(without_answers, results))


def test_the_limit_on_a_differing_minority_covers_the_delays_up_to_the_stated_one() -> None:
    """None of twenty differs up to 100 ms: the exact upper limit is 1 − 0.025 ** (1 / 20) = 16.8 %."""
    results = of_delays(lambda person, _session, code, _item: 3 + person % 2 + 3 * (code == "D4"))
    (text,) = [answer.text for answer in answers(results) if answer.text.startswith("Up to ")]
    assert text.startswith("Up to 100 ms, ")
    assert "up to 17 % of people show" in text


def test_lowest_delays_are_stated_per_statement_and_the_shortest_in_the_threshold_figure() -> None:
    def with_surer_steps(number: int, lowest: LowestTrend) -> LowestTrend:
        """Return the first two steps of one statement, and the first of the other, with a p that six digits keep."""
        steps = [
            replace(step, trend=replace(step.trend, p=1e-9)) if at < 2 - number else step
            for at, step in enumerate(lowest.steps.steps)
        ]
        return replace(lowest, members=10**6, steps=replace(lowest.steps, steps=tuple(steps)))

    case_study = study(delays(DELAYS), list(everybody(delays(DELAYS), 20, rising_answer(2))))
    results = with_changed_entries(evaluate(case_study), LowestDelay, with_surer_steps)
    (block,) = results.blocks
    lines = list(page_lines("".join(LowestDelay(block, results).section())))
    at = next(at for at, line in enumerate(lines) if line.startswith("Statement | shortest | uncorrected | "))
    assert [line.split(" | ")[:3] for line in lines[at + 1 : at + 3]] == [
        ["Different", "≤ 100 ms", "≤ 50 ms"],
        ["Harder", "≤ 150 ms", "≤ 50 ms"],
    ]
    picture = DetectionThreshold(block, results).figure(
        Drawing(case_study, case_study.blocks[0], block, results, "threshold", ())
    )
    assert picture is not None
    assert picture.caption.endswith("the shortest delay at which any statement shows a trend, 100 ms.")


@pytest.mark.parametrize("alpha", [0.05, 0.02])
def test_the_figure_of_differences_has_the_intervals_of_the_equivalence_tests(alpha: float) -> None:
    case_study = study(
        delays(DELAYS), list(everybody(delays(DELAYS), 20, rising_answer(3))), replace(DECIDED, alpha=alpha)
    )
    results = evaluate(case_study)
    (block,) = results.blocks
    picture = Effects(block, results).figure(Drawing(case_study, case_study.blocks[0], block, results, "effects", ()))
    assert picture is not None
    rows = {line.split("\t")[0]: line.split("\t")[1:] for line in picture.numbers.splitlines()}
    level = f"{100 - 200 * alpha:.0f} %"
    lows, highs = (rows[f"{end} end of the {level} interval"] for end in ("lower", "upper"))
    tested = ContrastsWithControl.value_in(block)
    assert len(lows) == len(tested) == 6
    for contrast, low, high in zip(tested, lows, highs, strict=True):
        ends = contrast.found.interval
        assert (ends is None) == (low == "")
        assert ends is None or [float(low), float(high)] == pytest.approx([ends.low, ends.high])
    assert f"means with {level} confidence intervals" in picture.caption


@pytest.mark.parametrize(("participants", "n"), [(1, 5), (8, 5), (9, 12), (18, 12), (19, 24), (200, 24)])
def test_the_measured_rate_is_that_of_the_nearest_size_with_wilsons_interval(participants: int, n: int) -> None:
    claims, studies = CLAIMS[n]
    ends = binomtest(claims, studies).proportion_ci(method="wilson")
    share, low, high = (f"{100 * value:.1f}" for value in (claims / studies, *ends))
    assert false_claims_sentence(participants) == (
        f"In {studies} simulated studies with {n} participants, three liquids, seven delays and no true effect, "
        f"{share} % of the reports claimed a difference or a noticed delay ({claims} reports, 95 % confidence interval "
        f"{low} to {high} %; liquid-study validate-report)."
    )


def test_a_claim_needs_the_test_over_all_statements_corrected_over_the_blocks() -> None:
    """A small rise of one statement is significant by itself but not over all, because the others scatter."""
    rng = np.random.default_rng(4)
    items = tuple(Item(id=name, text=name, short=name) for name in (*ITEMS, *"abcdefgh"))
    block = Block(
        id="b",
        title="Block",
        kind="delays",
        settings=delays(DELAYS),
        items=items,
        labels=tuple("1234567"),
        cannot_judge=None,
    )
    single = {item.id: rng.integers(1, 8, (14, 4, 1)).astype(float) for item in items}
    single[ITEMS[0]] = np.clip(np.arange(1, 5)[:, None] + rng.integers(0, 3, (14, 4, 1)), 1, 7).astype(float)
    decided = replace(DECIDED, primary=ITEMS[:1])
    block_result = answers_from_tables(block, decided, tuple(map(str, range(14))), single)
    (gated,) = add_gates([block_result])
    two = add_gates([replace(block_result, values={ITEMS[1]: block_result.values[ITEMS[1]]}), block_result])[1]
    assert gated.over_all is not None
    assert gated.gate == gated.over_all.p
    assert two.gate > gated.gate  # Holm, over both blocks
    for gate, verdict in ((0.05, "shown"), (0.051, "not shown")):
        (tested,) = (
            trend
            for trend in DelayTrend.value_in(evaluate_block(None, replace(block_result, gate=gate)))
            if trend.primary
        )
        assert (tested.verdict, tested.p_adjusted) == (verdict, gate)


def recognition_of(names: np.ndarray) -> RecognitionResult:
    """Return the recognition of three liquids by names 0, 1 and 2 (participants, liquids)."""
    liquids = ("water", "honey", "oil")
    return RecognitionResult(
        labels=liquids,
        settings=("L1", "L2", "L3"),
        right=liquids,
        found=recognition(names, [0, 1, 2], 3),
        verdict="shown",
    )


def test_a_liquid_is_recognised_where_its_name_is_used_more_often_than_for_each_other() -> None:
    # Honey is known by all; water and oil are answered alike by 8, and told from each other by 4 of 12.
    names = np.column_stack([[0] * 8 + [0] * 4, [1] * 12, [0] * 8 + [2] * 4])
    recognition = recognition_of(names)
    water, honey, oil = recognition.found.rates
    assert (water.rival, water.p) == (2, 2**-4)  # four used it for water and not for oil, nobody the other way round
    assert (honey.p, honey.p_adjusted) == (pytest.approx(2**-12), pytest.approx(3 * 2**-12))
    assert oil.p == 2**-4
    assert water.p_adjusted == oil.p_adjusted == 2 * 2**-4
    assert recognised(recognition, 0.05) == (1,)
    assert recognised(recognition, 0.13) == (0, 1, 2)
    assert recognised(replace(recognition, verdict="suggested"), 0.05) == (1,)
    assert recognised(replace(recognition, verdict="not shown"), 0.05) == ()


@pytest.mark.slow
@pytest.mark.parametrize("n", [12, 24, 60])
@pytest.mark.parametrize("bias", [0.5, 0.8])
def test_confused_liquids_are_rarely_called_recognised(n: int, bias: float) -> None:
    """All know honey; water and oil are called water by so many, whichever they are."""
    rng, studies, false = np.random.default_rng(n), 300, 0
    for _ in range(studies):
        names = np.where(rng.random((n, 3)) < bias, 0, 2)
        names[:, 1] = 1
        false += bool({0, 2} & {*recognised(recognition_of(names), 0.05)})
    assert false <= binom.ppf(0.999, studies, 0.05)


@pytest.mark.slow
@pytest.mark.parametrize("n", [12, 24, 60])
def test_known_liquids_are_called_recognised(n: int) -> None:
    rng = np.random.default_rng(n)
    known = [
        recognised(recognition_of(np.where(rng.random((n, 3)) < 0.8, [0, 1, 2], rng.integers(0, 3, (n, 3)))), 0.05)
        for _ in range(100)
    ]
    assert sum(labels == (0, 1, 2) for labels in known) >= (75 if n == 12 else 99)


@pytest.mark.parametrize(
    ("reaching", "recorded", "said"),
    [((), "", 0), (("reach",), "", 1), (("reach",), "reach", 2), (("reach",), "other", 1)],
)
def test_a_block_without_reaching_measures_states_the_reason(
    reaching: tuple[str, ...], recorded: str, said: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    sentences = "This block does not contain a reaching task", "Without readable recordings of this block"
    measured = SimpleNamespace(reaching=(*reaching, "other"), recorded_in=lambda block: block == recorded)
    blocks = [SimpleNamespace(id=name, title=name, settings=("L1", "L2")) for name in ("reach", "other")]
    results: Any = SimpleNamespace(trial_blocks=blocks, performance=measured, delivered=())
    sections_of_block = {
        "_movement_measures": [],
        "_motion_rows": [["thin", "1", "2"]],
        "_recordings_sentence": "",
        "settings_noun": "setting",
    }
    for name, value in sections_of_block.items():
        monkeypatch.setattr(motion_section, name, lambda *_, value=value, **__: value)
    page = "".join(motion_section.motion_section(results))
    of_block = page.partition(">other<")[0]
    assert [sentence in of_block for sentence in sentences] == [said == 0, said == 1]
    assert ("overshoot, mm: " in page) is bool(recorded), "of any block"


def test_successive_short_cards_are_placed_side_by_side_in_pairs(monkeypatch: pytest.MonkeyPatch) -> None:
    """A short card without a neighbour would leave half of the page empty."""
    kinds = "S SS L SSS L S L S TT T".replace(" ", "")  # figures of T have two rows of panels
    cards = [
        Card(
            question=f"{place}",
            verdict="",
            sentences=("n = 12", *"abc" * (kind == "T")),
            block="b",
            figures=(),
            is_small=kind != "L",
        )
        for place, kind in enumerate(kinds)
    ]
    monkeypatch.setattr(pages, "cards", lambda *_: cards)
    page = first_page(rising(5), ())
    assert ["S" if small else "-" for small in re.findall(r'<article class="card( small)?">', page)] == list(
        "SS--SS-----SS-"
    )
    assert page.count("n\u00a0=\u00a012") == len(cards)


@pytest.mark.parametrize(
    ("counts", "sentence", "repeated_sentence"),
    [
        (
            {"tea": 2, "milk": 5, "rum": 0},
            "5 of 8 participants chose “milk” (62 %",
            "5 of 8 answers by 5 participants were “milk” (62 %)",
        ),
        (
            {"tea": 3, "milk": 1, "rum": 3},
            "3 of 8 participants chose “tea”, and as many chose “rum” (38 %",
            "“tea” and “rum” were each chosen in 3 of 8 answers by 5 participants (38 %)",
        ),
        (
            {"tea": 2, "milk": 2, "rum": 2},
            "2 of 8 participants chose “tea”, and as many chose “milk” and “rum” (25 %",
            "“tea”, “milk” and “rum” were each chosen in 2 of 8 answers by 5 participants (25 %)",
        ),
    ],
)
def test_a_choice_names_each_of_the_most_frequent_options(
    counts: dict[str, int], sentence: str, repeated_sentence: str
) -> None:
    answered = GroupAnswers(code=None, name="", numbers={"n": 8, "participants": 8, "counts": counts})
    result = QuestionResult(
        where="form", title="Form", is_form=True, item="drink", text="Which drink?", short="Drink", kind="choice",
        measure="counts", figure=None, groups=(answered,),
    )  # fmt: skip
    assert pages._choice_text(result).startswith(f"“Drink”: {sentence}, 95 % confidence interval [")
    with_options = replace(result, options={"milk": "Warm milk", "tea": "Green tea", "rum": "Rum"})
    with_text = sentence.replace("“milk”", "“Warm milk”").replace("“tea”", "“Green tea”").replace("“rum”", "“Rum”")
    assert pages._choice_text(with_options).startswith(f"“Drink”: {with_text}, ")
    repeated = replace(answered, numbers={**answered.numbers, "participants": 5})
    assert pages._choice_text(replace(result, groups=(repeated,))) == f"“Drink”: {repeated_sentence}."
    about_wax = tuple(replace(repeated, name=name) for name in ("Wax", "Oil"))
    text = pages._choice_text(replace(result, groups=about_wax))
    assert text == f"“Drink”: for wax, {repeated_sentence}; for oil, {repeated_sentence}."
