"""Samples, verdicts and answers of hypotheses for values made up by hand."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from study_app.analysis import contrasts
from study_app.analysis.contrasts import answer, bound_as_tested, question, t_test_name
from study_app.analysis.data.blocks import PlacedQuestion
from study_app.analysis.data.study_tables import Study
from study_app.analysis.levels.thresholds import ThresholdEstimate
from study_app.analysis.results import ContrastResult, ContrastSide, LevelsResult
from study_app.analysis.statistics.effect_sizes import EffectSize
from study_app.analysis.statistics.outcome import Interval
from study_app.protocol.model import Contrast
from study_app.protocol.questions import Context, Number, ShowIf
from tests.analysis.made_up import DECIDED, everybody, liquids, study

MADE = study(liquids(2), list(everybody(liquids(2), 4, lambda *_: 4)))
STATED = {"measure": "warm", "blocks": ("b",), "conditions": ("c1", "c2")}
BLOCKS = {"measure": "threshold", "blocks": ("late", "prompt")}
BETWEEN = {"measure": "warm", "blocks": ("b",), "groups": ("old", "new")}


def side(name: str, mean: float | None, **values: float) -> ContrastSide:
    return ContrastSide(name=name, values=values, mean=mean, low=1.5, high=9.5, sd=1.0, standard_error=0.5)


def result_of(stated: dict[str, Any], **changes: Any) -> ContrastResult:
    """Return a hypothesis that was not shown: 4.25 is higher than 3.75 by 0.5."""
    fields = {
        "test": "t", "n": 12, "dropped": 0, "statistic_name": "t", "effect_name": "d", "method": "m", "no_interval": "",
        "note": "", "members": 1, "compared": ("Wax", "Oil"), "ratio": False, "verdict": "not shown", "statistic": 1.5,
        "p": 0.062, "effect": 0.5, "p_adjusted": 0.062, "p_bootstrap": 0.05, "p_skewed": 0.031, "p_equivalent": None,
        "higher": 7, "interval": Interval(low=-0.25, high=1.25, level=0.95, method="t"), "equivalent": None,
        "not_excluded": None, "left_out": {}, "measure_name": "warmth",
        "sides": (side("Wax", 4.25, P1=4.0, P2=5.0), side("Oil", 3.75, P1=4.0, P2=3.0)),
    }  # fmt: skip
    contrast_result: Any = ContrastResult(contrast=Contrast.model_validate(stated), **{**fields, **changes})
    return contrast_result  # type: ignore[no-any-return]


SIZE = EffectSize(name="d_z", value=0.44, low=-0.1, high=0.9, t=1.5)
MEANS = "(means 4.25 [1.50, 9.5] and 3.75 [1.50, 9.5]; mean difference 0.50, "
CI, COUNTS = (
    "95 % confidence interval [−0.25, 1.25], ",
    " It was higher in Wax for 7 of 12 participants and equal for 1.",
)
ADJUSTED = {"p": 0.041, "p_bootstrap": 0.05, "p_skewed": 0.031, "members": 3, "higher": None}
MISSING = {"P3": "asleep", "P4": "gone", "P5": "asleep"}


@pytest.mark.parametrize(
    ("stated", "changes", "sentence"),
    [
        ({}, {}, f"did not differ significantly between Wax and Oil {MEANS}{CI}p = .062, n = 12).{COUNTS}"),
        ({}, {"verdict": "shown", "standardised": SIZE}, f"was higher in Wax than in Oil {MEANS}{CI}d_z 0.44 [−0.10, "
         f"0.90], p = .062, n = 12).{COUNTS}"),
        ({"expected": "lower"}, ADJUSTED, f"was not significantly lower in Wax than in Oil {MEANS}unadjusted two-"
         f"sided {CI}adjusted one-sided p = .062, n = 12). Before the adjustment for 3 hypotheses, p = .050."),
        ({}, {"verdict": "suggested", "effect": -0.5}, "was lower in Wax than in Oil (means"),
    ],
)  # fmt: skip
def test_an_answer_has_the_numbers_of_its_hypothesis(
    stated: dict[str, Any], changes: dict[str, Any], sentence: str
) -> None:
    text = answer(result_of({**STATED, **stated}, **changes))
    assert (text if sentence.endswith(".") else text[: len(sentence) + 7]) == f"Warmth {sentence}"


def test_an_answer_names_the_participants_who_were_left_out_by_reason() -> None:
    text = answer(result_of(STATED, p_adjusted=None, note="too few", left_out=MISSING))
    assert text == "Not tested: too few. Excluded: P3, P5 (asleep); P4 (gone)."


def test_a_ratio_below_1_is_lower_and_equal_values_have_a_ratio_of_1() -> None:
    sides = side("Late", 4.25, P1=4.0, P2=8.0), side("Prompt", 3.75, P1=4.0, P2=2.0)
    ratio = {"ratio": True, "verdict": "shown", "sides": sides, "measure_name": "", "compared": ("Late", "Prompt")}
    for effect, direction in ((0.5, "lower"), (1.25, "higher")):
        text = answer(result_of(BLOCKS, effect=effect, **ratio))
        assert text.startswith(f"The threshold was {direction} in Late than in Prompt (means")
        assert f"mean ratio {effect:.2f}, " in text
        assert "It was higher in Late for 7 of 12 participants and equal for 1." in text
    assert question(result_of(BLOCKS, **ratio)) == "The threshold differs between Late and Prompt"


LIKELIER = " The data are {} as likely {} (JZS Bayes factor, Cauchy prior with scale 0.707)"


@pytest.mark.parametrize(
    ("factor", "verdict", "sentence"),
    [
        (4.0, "not shown", f"{LIKELIER.format('4 times', 'with a difference as without one')}."),
        (
            0.4,
            "not shown",
            f"{LIKELIER.format('2.5 times', 'without a difference as with one')}, which is weak evidence.",
        ),
        (0.4, "shown", ""),
        (None, "not shown", ""),
    ],
)
def test_the_bayes_factor_is_that_of_the_likelier_hypothesis(factor: float | None, verdict: str, sentence: str) -> None:
    assert contrasts._bayes_text(result_of(STATED, bayes_factor=factor, verdict=verdict)) == sentence


def test_equivalence_is_stated_with_the_share_that_is_not_excluded() -> None:
    within = {"equivalent": True, "p_equivalent": 0.021, "not_excluded": 0.265, "verdict": "equivalent"}
    paired = answer(result_of({**STATED, "bound": 1.5}, **within))
    assert paired.endswith(
        "The mean difference lies within the equivalence bounds (equivalent, p = .021). However, the data do not rule "
        "out the possibility that up to 26 % of people show a difference larger than the bound."
    )
    groups = answer(result_of({**BETWEEN, "bound": 1.5}, **within, higher=None))
    assert groups.endswith("up to 26 % of a group belong to a minority that the sample does not include.")
    unclear = answer(result_of({**STATED, "bound": 1.0}, equivalent=False))
    assert unclear.endswith("The tests do not show that the mean difference lies within the equivalence bounds.")
    too_few = answer(result_of({**STATED, "bound": 1.0}, equivalent=False, n=13, fewest=14))
    assert too_few.endswith("The sample is too small to show equivalence: at least 14 participants are needed.")
    groups = {
        "n": 33,
        "sides": tuple(SimpleNamespace(name=str(n), values=range(n), mean=None) for n in (20, 13)),
        "higher": None,
    }
    for fewest, ends in (
        (13, "within the equivalence bounds."),
        (14, "at least 14 participants in each group are needed."),
    ):
        assert answer(result_of({**BETWEEN, "bound": 1.0}, equivalent=False, fewest=fewest, **groups)).endswith(ends)
    beyond = Interval(low=1.3, high=2.6, level=0.95, method="t")
    for bound, ends in ((1.25, "lies outside the equivalence bounds (not equivalent)."), (1.35, "equivalence bounds.")):
        text = answer(result_of({**BLOCKS, "bound": bound}, ratio=True, effect=1.8, interval=beyond, equivalent=False))
        assert text.endswith(ends), "the interval of the ratio begins at 1.3"
    assert "within" not in answer(result_of({**STATED, "bound": 1.0}, effect=1.8, interval=beyond, equivalent=False))


@pytest.mark.parametrize(
    ("p", "p_equal", "bound", "verdict", "is_equal", "kept"),
    [
        (0.04, 0.9, 1.0, "shown", False, None),
        (0.04, 0.04, 1.0, "shown", True, 0.3),
        (0.041, 0.04, 1.0, "equivalent", True, 0.3),
        (0.041, 0.041, 1.0, "not shown", False, None),
        (None, 0.04, 1.0, "equivalent", True, 0.3),
        (None, None, 1.0, "not tested", False, None),
        (0.041, 0.01, None, "not shown", None, None),
    ],
)
def test_a_difference_is_shown_even_if_it_is_equivalent(
    p: float | None, p_equal: float | None, bound: float | None, verdict: str, is_equal: bool | None, kept: float | None
) -> None:
    """Alpha is 0.04."""
    case_study: Any = replace(MADE, decided=replace(DECIDED, alpha=0.04), contrasts=(1, 2, 3))  # type: ignore[arg-type]
    tested = result_of({**STATED, "bound": bound}, not_excluded=0.3)
    tested_result = contrasts._add_verdict(case_study, tested, p, p_equal)
    assert (tested_result.verdict, tested_result.equivalent, tested_result.not_excluded) == (verdict, is_equal, kept)
    assert (tested_result.p_adjusted, tested_result.p_equivalent, tested_result.members) == (p, p_equal, 3)
    exploratory = replace(case_study, decided=replace(case_study.decided, made=False))
    unplanned = contrasts._add_verdict(exploratory, tested, p, p_equal)
    assert unplanned.verdict == ("suggested" if verdict == "shown" else verdict)


LEVELS = {
    "discrimination": LevelsResult(
        block="late", title="Late part", design="d", revealed=True, times=(), summary="share", counts="correct",
        statistics={
            "sensitivities": tuple(
                SimpleNamespace(participant=person, d_prime=value, comparison=comparison)
                for comparison, values in (("oil", (1.0, 0.5, None)), ("wax", (2.0, None, 1.5)))
                for person, value in zip((None, "P000", "P001"), values, strict=True)
            )
        },
    )
}  # fmt: skip


def test_a_value_of_a_participant_is_the_mean_of_those_that_were_estimated() -> None:
    late = LEVELS["discrimination"]
    stated = Contrast.model_validate({"measure": "d_prime", "blocks": ("late", "prompt")})
    values = contrasts._participant_values(
        MADE, stated, "late", None, (), (replace(late, block="prompt", statistics={}), late)
    )
    assert {person: value.value for person, value in values.items()} == {"P000": 0.5, "P001": 1.5}


@pytest.mark.parametrize(
    ("spacing", "ratio", "factor"), [("log", True, 1.0), ("log", False, 8.0), ("linear", False, None)]
)
def test_the_variance_of_a_threshold_is_on_the_scale_of_the_test(
    spacing: str, ratio: bool, factor: float | None
) -> None:
    """On a logarithmic scale, u is a decimal logarithm, so that d threshold = ln 10 · threshold · du."""
    row = ThresholdEstimate(participant="P1", standard=1.0, n=9, threshold=8.0, low=None, high=None, variance=0.25)
    level = replace(LEVELS["discrimination"], spacing=spacing)
    expected = 0.25 if factor is None else 0.25 * (factor * math.log(10)) ** 2
    assert contrasts._variance_of_estimate(row, level, ratio=ratio) == pytest.approx(expected)
    assert contrasts._variance_of_estimate(replace(row, variance=None), level, ratio=ratio) == 0.0
    mixed = level, replace(level, block="prompt", spacing="linear")
    stated = Contrast.model_validate(BLOCKS)
    assert contrasts._is_ratio(stated, [level, replace(level, block="other", spacing="linear")]) is (spacing == "log")
    assert not contrasts._is_ratio(stated, mixed)


def answers_of(**values: list[float]) -> Any:
    """Return the answers of four participants about c1 and c2."""
    block = SimpleNamespace(
        id="b", settings=[SimpleNamespace(code=code, condition=name) for code, name in (("L1", "c1"), ("L2", "c2"))],
        columns={"L1": 0, "L2": 1},
    )  # fmt: skip
    return SimpleNamespace(block=block, people=tuple(values), values={"warm": np.array([*values.values()])})


NAN = math.nan


def test_differences_are_those_of_participants_with_both_answers_and_the_first_missing_one_is_named() -> None:
    answers = answers_of(P000=[6.0, 2.0], P001=[NAN, 3.0], P002=[5.0, NAN], P003=[NAN, NAN])
    stated = Contrast.model_validate(STATED)
    samples = contrasts._collect_samples(MADE, stated, [answers], ())
    assert [sample.value for sample in samples.samples[0]] == [4.0]
    assert [{who: answer.value for who, answer in values.items()} for values in samples.sides] == [
        {"P000": 6.0},
        {"P000": 2.0},
    ]
    missing = "an answer to warm is missing in"
    assert samples.left_out == {"P001": f"{missing} c1", "P002": f"{missing} c2", "P003": f"{missing} c1"}
    assert (samples.shared, samples.cells, samples.smallest, samples.means(0.05)) == (0.0, (), 1, None)


def test_a_hypothesis_compares_a_replicated_condition_by_itself() -> None:
    """Conditions c1 and c2 have the same delay; P000 rated c1 twice, and P002 did not rate c3."""
    block = SimpleNamespace(
        id="b", settings=[SimpleNamespace(code=f"L{n}", condition=f"c{n}") for n in (1, 2, 3)],
        columns={"L1": 0, "L2": 0, "L3": 1},
    )  # fmt: skip
    rows = [
        ("P000", "L1", 2, 1), ("P000", "L2", 7, 2), ("P000", "L1", 5, 3), ("P000", "L3", 4, 4),
        ("P001", "L3", 1, 1), ("P001", "L1", 6, 2), ("P001", "L2", 3, 3), ("P002", "L1", 4, 1), ("P002", "L2", 6, 2),
    ]  # fmt: skip
    table = pd.DataFrame(rows, columns=["participant", "code", "response", "trial"]).assign(item="warm", session=1)
    answers: Any = SimpleNamespace(
        block=block, people=("P000", "P001", "P002"), values={"warm": np.array([[5.0, 4.0], [4.5, 1.0], [5.0, NAN]])}
    )
    study: Any = SimpleNamespace(answers=lambda _block: table)
    values = {
        condition: {
            who: answer.value for who, answer in contrasts._agreement_values(study, "warm", answers, condition).items()
        }
        for condition in ("c1", "c2", "c3", None)
    }
    assert values == {
        "c1": {"P000": 3.5, "P001": 6.0, "P002": 4.0}, "c2": {"P000": 7.0, "P001": 3.0, "P002": 6.0},
        "c3": {"P000": 4.0, "P001": 1.0}, None: {"P000": 4.5, "P001": 2.75},
    }  # fmt: skip


def test_an_interaction_has_the_differences_of_each_group_and_its_values_under_each_condition() -> None:
    groups = pd.array(["old", "new", "old", "other"], "string")
    case_study = replace(MADE, participants=MADE.participants.assign(group=groups))
    answers = answers_of(P000=[6.0, 2.0], P001=[1.0, 3.0], P002=[5.0, 4.0], P003=[NAN, 1.0])
    crossed = Contrast.model_validate({**STATED, "groups": ("new", "old")})
    samples = contrasts._collect_samples(case_study, crossed, [answers], ())
    assert [[answer.value for answer in sample] for sample in samples.samples] == [[-2.0], [1.0, 4.0]]
    assert samples.left_out == {}, "P003 is in neither group"
    answers_of_samples = [
        {who: value.value for who, value in values.items()} for values in (*samples.sides, *samples.cells)
    ]
    assert answers_of_samples == [
        {"P001": -2.0}, {"P000": 4.0, "P002": 1.0}, {"P001": 1.0}, {"P001": 3.0}, {"P000": 6.0, "P002": 5.0},
        {"P000": 2.0, "P002": 4.0},
    ]  # fmt: skip
    between = Contrast.model_validate(BETWEEN)
    samples = contrasts._collect_samples(case_study, between, [answers], ())
    assert [[answer.value for answer in sample] for sample in samples.samples] == [[4.0, 4.5], [2.0]]
    assert samples.cells == ()


def test_a_statement_differs_by_at_most_6_points_and_an_interaction_by_12() -> None:
    assert Contrast.model_validate(STATED).largest_difference == 6
    assert Contrast.model_validate({**STATED, "groups": ("old", "new")}).largest_difference == 12


def test_the_bound_of_a_ratio_is_tested_as_a_logarithm() -> None:
    assert bound_as_tested(1.5, ratio=False) == 1.5
    assert [bound_as_tested(bound, ratio=True) for bound in (1.5, 1 / 1.5)] == pytest.approx([0.4054651081] * 2)


@pytest.mark.parametrize(
    ("stated", "ratio", "name"),
    [
        (STATED, False, "paired t test"),
        (BLOCKS, True, "paired t test on log-transformed values"),
        (BETWEEN, False, "two-sample t test with unequal variances"),
        ({**BLOCKS, "groups": ("old", "new")}, True, "two-sample t test on within-participant differences of "
         "log-transformed values with unequal variances"),
    ],
)  # fmt: skip
def test_a_t_test_is_named_with_the_values_that_it_uses(stated: dict[str, Any], ratio: bool, name: str) -> None:
    assert t_test_name(Contrast.model_validate(stated), ratio=ratio) == name


def test_the_methods_name_the_tests_and_corrections_of_all_hypotheses() -> None:
    paired, crossed = result_of({**STATED, "bound": 1.0}, standardised=SIZE), {**STATED, "groups": ("old", "new")}
    rows = (
        replace(paired, left_out={"P3": "asleep"}), result_of(crossed),
        result_of({**BLOCKS, "expected": "higher", "bound": 1.2}, ratio=True),
    )  # fmt: skip
    rows = (replace(rows[0], largest=6), replace(rows[1], largest=None), rows[2])
    standards = {level: SimpleNamespace(standard=level) for level in (4, 10)}
    levels = [
        SimpleNamespace(
            block=block, title=title, statistics={"thresholds": [standards[level] for level in given_levels]}
        )
        for block, title, given_levels in (
            ("late", "Late part", (4, 10)),
            ("prompt", "Prompt", (4,)),
            ("else", "Else", (4, 10)),
        )
    ]
    results: Any = SimpleNamespace(
        contrasts=rows,
        levels=levels,
        blocks=(SimpleNamespace(id="b", presentations=(1, 3)),),
        trial_blocks=(),
        questions=(
            SimpleNamespace(where="b", groups=(SimpleNamespace(code="L1", numbers={"n": 9, "participants": 4}),)),
        ),
    )
    lines = list(contrasts.contrast_methods(results))
    assert lines[4].startswith(
        "Each participant contributed one value to each comparison (the median of repeated answers to a statement, the "
        "mean of repeated answers to another question and the mean over the standards in “Late part”). In addition to"
    )
    text = " ".join(lines)
    assert lines[0].endswith(") was tested with a two-sided paired t test.")
    assert lines[2].endswith(") was tested with a one-sided paired t test on log-transformed values.")
    assert lines[0].startswith("Hypothesis 1 (warmth differs between Wax and Oil in block b, with an")
    for sentence in (
        "Comparisons between groups used the degrees of freedom of the smaller group (Hsu 1938).",
        "The reported p value is the largest of the three, Holm-adjusted across 3 hypotheses.",
        "Thresholds are weighted as in the group mean.",
        "two one-sided t tests and the same bootstrap, Holm-adjusted across 2 bounds; both",
        "For ratios, they are calculated from natural logarithms.",
    ):
        assert sentence in text
    assert lines[-1].endswith("with an equivalence bound of 1: P3 (asleep)).")
    single: Any = SimpleNamespace(contrasts=(paired,), levels=(), blocks=(), trial_blocks=(), questions=())
    (alone, *_) = contrasts.contrast_methods(single)
    assert alone.startswith("The hypothesis (")
    assert list(contrasts.contrast_methods(SimpleNamespace(contrasts=()))) == []  # type: ignore[arg-type]


def test_participants_to_whom_a_question_was_not_shown_are_told_apart() -> None:
    rule = ShowIf.model_validate({"item": "used", "is": "yes"})
    answers = pd.DataFrame({"participant": ["P001", "P003"]})
    tables: Any = SimpleNamespace(people=("P001", "P002", "P003"), answers_to=lambda _: answers)
    where: Any = SimpleNamespace(id="load")
    context = Context({}, None, "en")
    for show_if, hidden in ((rule, {"P002"}), (None, set())):
        question = Number(id="hours", text="Hours?", short="Hours", show_if=show_if)
        assert Study.hidden_from(tables, PlacedQuestion(where, question, context)) == hidden
