"""The cards of the first page for results made up by hand, so that each text has its own value."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from study_app.analysis.figures.summary_figures import MOST_PANELS, Numbers
from study_app.analysis.findings.finding import Answer
from study_app.analysis.page_layout import Picture
from study_app.analysis.report import first_page as pages
from study_app.analysis.report.first_page import Card, Presented
from study_app.analysis.results import BlockResult, ContrastResult, ContrastSide, GroupAnswers, QuestionResult
from study_app.protocol.model import Contrast
from tests.analysis.made_up import DECIDED, delays, liquids
from tests.analysis.report.test_sections import block
from tests.golden_values import page_lines

IN = {name: Presented(f"In {name}, oil.", {"": ("“oil”", f"{delay} ms of visual delay", "")}) for name, delay in (
    ("a", 30), ("b", 60), ("c", 90),
)}  # fmt: skip


def results_of(*blocks: BlockResult, **changes: Any) -> Any:
    """Return results without hypotheses, questions and levels."""
    fields = dict.fromkeys(("contrasts", "questions", "levels", "scores", "people"), ())
    return SimpleNamespace(**{**fields, "blocks": blocks, "decided": DECIDED, **changes})


def hypothesis(verdict: str = "shown", **stated: Any) -> ContrastResult:
    """Return a hypothesis that was not computed."""
    unknown = dict.fromkeys(
        ("statistic", "p", "effect", "interval", "p_adjusted", "p_bootstrap", "p_skewed", "p_equivalent", "higher")
    )
    contrast_result: Any = ContrastResult(
        test="t", n=3, dropped=0, statistic_name="t", effect_name="d", method="m", no_interval="", note="", members=1,
        contrast=Contrast.model_validate(stated), compared=("First", "Second"), ratio=False, verdict=verdict,  # type: ignore[arg-type]
        equivalent=None, not_excluded=None, left_out={}, **unknown,
    )  # fmt: skip
    return contrast_result  # type: ignore[no-any-return]


THRESHOLD = {"measure": "threshold", "blocks": ("a", "b")}


def picture(name: str, of: str) -> Picture:
    return Picture(block=of, name=name, caption=f"About {name}.", files={})


def test_a_card_shows_the_first_of_its_figures_that_was_drawn_for_its_block() -> None:
    def card(*figures: str) -> Card:
        return Card(question="", verdict="", sentences=(), block="b", figures=figures)

    pictures = [
        picture("threshold-a", "a"), picture("delays-a", "a"), picture("delays-b", "b"), picture("threshold-b", "b"),
        picture("hypothesis-1", "a"), picture("hypothesis-2", "b"),
    ]  # fmt: skip
    drawn_figures = {
        ("threshold", "delays"): "threshold-b",
        ("effects", "delays"): "delays-b",
        ("hypothesis-1",): "hypothesis-1",
        ("hypothesis-2",): "hypothesis-2",
        ("effects",): None,
    }
    for figures, name in drawn_figures.items():
        figure = card(*figures).figure_of(pictures)
        assert (figure and figure.name) == name
    assert pages.figures_shown([card(*figures) for figures in drawn_figures], pictures) == set(
        drawn_figures.values()
    ) - {None}


def test_each_hypothesis_has_its_number_its_figure_and_the_newly_introduced_blocks(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    contrasts = [
        hypothesis("suggested", **THRESHOLD),
        hypothesis("not shown", measure="threshold", blocks=("b", "c")),
        hypothesis("shown", measure="threshold", blocks=("c", "x")),
    ]
    monkeypatch.setattr(pages, "_question_text", lambda contrast, _presented: f"{contrast.verdict}?")
    monkeypatch.setattr(pages, "answer", lambda contrast: f"{contrast.verdict}!")
    monkeypatch.setattr(pages, "_scale_text", lambda contrast, *_: f" In {contrast.contrast.blocks[0]}.")
    monkeypatch.setattr(pages, "_cell_sentences", lambda contrast: [f"Cells {contrast.contrast.blocks[1]}."])
    cards = list(pages._hypothesis_cards(results_of(contrasts=contrasts), IN))
    assert [(card.question, card.verdict, card.sentences, card.block, card.figures) for card in cards] == [
        ("Hypothesis 1: suggested?", "suggested", ("suggested! In a.", "Cells b.", "In a, oil. In b, oil."), "a",
         ("hypothesis-1",)),
        ("Hypothesis 2: not shown?", "not shown", ("not shown! In b.", "Cells c.", "In c, oil."), "b",
         ("hypothesis-2",)),
        ("Hypothesis 3: shown?", "shown", ("shown! In c.", "Cells x."), "c", ("hypothesis-3",)),
    ]  # fmt: skip
    cards = list(pages._hypothesis_cards(results_of(contrasts=contrasts[:1]), {}))
    assert [(card.question, card.sentences) for card in cards] == [
        ("Hypothesis: suggested?", ("suggested! In a.", "Cells b."))
    ]


@pytest.mark.parametrize(
    ("stated", "compared", "within"),
    [
        (THRESHOLD, ("First (30 ms of visual delay)", "Second (60 ms of visual delay)"), None),
        ({**THRESHOLD, "groups": ("old", "new")}, ("First", "Second"),
         ("Early (30 ms of visual delay)", "Late (60 ms of visual delay)")),
        ({"measure": "threshold", "blocks": ("b",), "groups": ("old", "new")}, ("First", "Second"), ("Early", "Late")),
        ({"measure": "warm", "blocks": ("d",), "conditions": ("wax", "thin")},
         ("First (9 ms of visual delay)", "Second (5 ms of visual delay)"), None),
    ],
)  # fmt: skip
def test_a_hypothesis_says_which_delays_set_its_sides_apart(
    stated: dict[str, Any], compared: tuple[str, str], within: tuple[str, str] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A comparison of groups in one block has the same delays on both sides."""
    of_conditions = {name: ("“oil”", f"{delay} ms of visual delay", "") for name, delay in (("thin", 5), ("wax", 9))}
    presented = {**IN, "d": Presented("", {"": ("“oil”", "", ""), **of_conditions})}
    monkeypatch.setattr(pages, "question", lambda contrast: (contrast.compared, contrast.within_names))
    comparison = replace(hypothesis(**stated), within_names=("Early", "Late") if "groups" in stated else None)
    assert pages._question_text(comparison, presented) == (compared, within)


@pytest.mark.parametrize(
    ("stated", "kind", "scale", "sentence"),
    [
        (THRESHOLD, "value", None, " Values are in N·s/m."),
        ({"measure": "pse", "blocks": ("a", "b")}, "difference", None, " Values are in N·s/m."),
        ({"measure": "d_prime", "blocks": ("a", "b")}, "weber", None, " At chance, d′ is 0."),
        ({"measure": "exponent", "blocks": ("a", "b")}, "weber", None, ""),
        ({"measure": "threshold", "blocks": ("x", "y")}, "value", None, ""),
        (
            {"measure": "raw", "form": "load", "blocks": ("x", "y")},
            "value",
            (0, 100),
            " The scale ranges from 0 to 100.",
        ),
        ({"measure": "age", "form": "load", "blocks": ("x", "y")}, "value", None, ""),
        ({"measure": "raw", "blocks": ("x", "y")}, "value", (-5.0, 5.5), " The scale ranges from −5 to 5.5."),
    ],
)
def test_the_unit_or_scale_of_a_hypothesis_is_that_of_its_measure(
    stated: dict[str, Any], kind: str, scale: tuple[float, float] | None, sentence: str
) -> None:
    levels = [
        SimpleNamespace(block=name, level_kind=of_kind, unit=unit, guess_rate=0.5, counts="correct")
        for name, of_kind, unit in (("z", "value", "mm"), ("b", kind, "N·s/m"), ("a", kind, "N·s/m"))
    ]
    tested = replace(hypothesis(**stated), scale=scale)
    assert pages._scale_text(tested, results_of(levels=levels)) == sentence


def test_each_group_has_its_own_means_of_an_interaction() -> None:
    cells = [
        ContrastSide(name=name, values={}, mean=mean, low=None, high=None, sd=None)
        for name, mean in (("Early", 1.5), ("Late", 2.5), ("Early", 3.5), ("Late", None))
    ]
    comparison: Any = SimpleNamespace(compared=("old", "new"), cells=cells)
    assert list(pages._cell_sentences(comparison)) == [
        "Means in the group old (95 % intervals): 1.50 in Early and 2.50 in Late.",
        "Mean in the group new (95 % intervals): 3.50 in Early.",
    ]


def test_a_block_is_introduced_once_and_a_single_setting_has_a_card_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    def given(question: str, of: str, verdict: str) -> Answer:
        return Answer(question=question, block=of, title=f"Block {of}", verdict=verdict, text=f"{verdict}.")

    answers = (
        given("distinguished", "a", "shown"),
        given("noticed from", "b", "not shown"),
        given("unchanged up to", "b", "equivalent"),
    )
    monkeypatch.setattr(pages, "answers", lambda _results: answers)
    counts = {f"count_{level}": count for level, count in enumerate((1, 0, 2, 0, 3, 0, 4), start=1)}
    measures = tuple({"n": n, "median": 4.5, "q1": 2.0, **counts} for n in (10, 0, 20))
    single = {"settings": liquids(1), "names": ("Thin",)}
    blocks = (
        block("a", kind="views"),
        block("b", kind="delays", settings=delays([0, 9])),
        block("c", measures=measures, **single),
        block("d", n=0, measures=({**measures[0], "n": 0},) * 3, **single),
        block("e", measures=measures, presentations=(1, 2), **single),
    )
    results = results_of(*blocks, contrasts=[hypothesis(measure="warm", blocks=("a",), conditions=("c1", "c2"))])
    cards = list(pages._statement_cards(results, IN))
    assert [(card.question, card.verdict, card.sentences, card.block, card.figures) for card in cards[:3]] == [
        ("Block a: Which views were distinguished?", "shown", ("shown.",), "a", cards[0].figures),
        ("Block b: At what delay do participants begin to notice a difference?", "not shown",
         ("not shown.", "In b, oil."), "b", ("threshold", "delays")),
        ("Block b: Up to what delay do answers remain practically unchanged?", "equivalent", ("equivalent.",), "b",
         ("effects",)),
    ]  # fmt: skip
    ends = "95 % confidence interval [35, 93] %"  # of 7 of 10, Clopper and Pearson 1934
    assert [(card.question, card.sentences, card.block, card.figures) for card in cards[3:]] == [
        ("Block c: statements",
         (f"7 of 10 participants agreed with “Warm” (70 %, {ends}; median 4.5).",
          "7 of 20 participants agreed with “Calm” (35 %, 95 % confidence interval [15, 59] %; median 4.5)."), "c",
         ("liquids",)),
        ("Block e: statements",
         ("7 of 10 answers expressed agreement with “Warm” (70 %; median 4.5).",
          "7 of 20 answers expressed agreement with “Calm” (35 %; median 4.5)."), "e", ("liquids",)),
    ]  # fmt: skip


def estimate(**values: Any) -> Any:
    return SimpleNamespace(**{"low": 0.25, "high": 0.75, "n": 8, **values})


def test_estimates_already_shown_by_a_hypothesis_have_no_card(monkeypatch: pytest.MonkeyPatch) -> None:
    levels = [
        SimpleNamespace(block=name, title=f"Task {name}", revealed=name not in "de", level_kind="value", unit="mm")
        for name in "abcde"
    ]
    measured = {"a": ("threshold", "threshold"), "b": ("pse", "PSE"), "c": ("exponent", "exponent")}

    def estimates_of(level: Any) -> Any:
        attribute, words = measured[level.block]
        group = [estimate(**{attribute: 0.5}, participants=5, standard=None)]
        return SimpleNamespace(attribute=attribute, words=words, group=group)

    monkeypatch.setattr(pages, "estimates_of", estimates_of)
    results = results_of(levels=levels, contrasts=[hypothesis(**THRESHOLD)])
    cards = list(pages._level_cards(results, IN))
    assert [(card.question, card.verdict, card.sentences, card.block, card.figures) for card in cards] == [
        ("Task d and Task e", "sealed", ("The standards, levels and correct answers are shown after unblinding.",),
         "d", ()),
        ("Task b: PSE", "", ("The mean PSE was 0.5 mm (95 % interval [0.25, 0.75], n = 5).", "In b, oil."), "b",
         ("estimates-b",)),
        ("Task c: exponent", "", ("The mean exponent was 0.5 (95 % interval [0.25, 0.75], n = 5).", "In c, oil."), "c",
         ("estimates-c",)),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "attribute", "places", "phrases"),
    [
        ("value", "threshold", (8.0, 12.0), [" at 8 mm was 0.5 mm", " at 12 mm was 0.5 mm"]),
        ("weber", "threshold", (8.0, 12.0), [f" at {at} mm was a Weber fraction of 0.5" for at in (8, 12)]),
        ("weber", "value", (8.0, 12.0), [" at 8 was 0.5", " at 12 was 0.5"]),
        ("value", "value", (8.0, 12.0), [" at 8 mm was 0.5", " at 12 mm was 0.5"]),
        ("value", "d_prime", ("thin_oil", "wax"), [" for thin oil was 0.5", " for wax was 0.5"]),
        ("value", "d_prime", ("thin_oil",), [" was 0.5"]),
    ],
)
def test_estimates_name_their_standard_and_unit(
    kind: str, attribute: str, places: tuple[Any, ...], phrases: list[str]
) -> None:
    level: Any = SimpleNamespace(level_kind=kind, unit="mm")
    group = [estimate(**{attribute: 0.5}, comparison=place, high=None) for place in places]
    assert list(pages._estimate_sentences(level, group, attribute, "size")) == [
        f"The mean size{phrase} (no interval, n = 8)." for phrase in phrases
    ]


def question_result(where: str, item: str, *, n: int = 8, is_form: bool = True, weighs: bool = False) -> QuestionResult:
    group = GroupAnswers(None, "All", {"n": n, "counts": {"yes": n - 1, "no": 1}})
    return QuestionResult(
        where=where, title=f"Title {where}", is_form=is_form, item=item, text="", short=item, kind="choice",
        measure="counts" if item in ("pick", "pair") else "quartiles", figure=None, groups=(group,), weighs=weighs,
    )  # fmt: skip


def test_questions_have_cards_by_place_with_scores_first_and_sample_last(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks come first, then forms with scores, then other forms; questions of levels have no card here."""
    monkeypatch.setattr(pages, "_number_text", lambda entry, presented: f"{entry.title} {len(presented)}")
    monkeypatch.setattr(pages, "_choice_text", lambda result: f"chose {result.item}")
    questions = [
        question_result("sample", "pick"), question_result("sample", "age"), question_result("load", "sure"),
        question_result("load", "pair", weighs=True), question_result("track", "pick", is_form=False),
        question_result("b", "pick", is_form=False), question_result("none", "age", n=0),
        question_result("c", "age", is_form=False),
    ]  # fmt: skip
    single, pair = (("", {"P1": 1.0}),), (("Thin", {"P1": 1.0}), ("Wax", {"P1": 2.0}))
    numbers = {
        "load": [Numbers(f"L{place}", None, True, single) for place in range(MOST_PANELS + 2)],
        "sample": [Numbers("Age", None, False, pair)],
        "c": [Numbers("Old", None, False, pair)],
        "none": [Numbers("Gone", None, False, single)],
    }
    results = results_of(
        questions=questions, levels=[SimpleNamespace(block="track")], scores=[SimpleNamespace(where="load")]
    )
    cards = list(pages._question_cards(results, numbers, IN))
    assert [(card.question, card.sentences, card.figures, card.is_small) for card in cards] == [
        ("Title b", ("chose pick",), ("question-b-pick",), True),
        ("Title c", ("Old 3",), ("answers-c",), False),
        ("Title load", ("L0 3", *(f"L{place} 0" for place in range(1, MOST_PANELS))), ("answers-load",), True),
        ("Title sample", ("Age 3", "chose pick"), ("answers-sample", "question-sample-pick"), True),
    ]
    assert [card.block for card in cards] == ["b", "c", "load", "sample"]


@pytest.mark.parametrize(
    ("form", "measure", "left_out", "is_shown"),
    [
        ("load", "raw", {}, False),
        ("load", "raw", {"P3": "no answer"}, True),
        ("end", "raw", {"P3": "no answer"}, False),
        ("load", "sure", {"P3": "no answer"}, False),
    ],
)
def test_values_of_a_form_are_shown_by_a_hypothesis_with_all_participants(
    form: str, measure: str, left_out: dict[str, str], is_shown: bool
) -> None:
    """P3 has a value after one block only, so the hypothesis names P3 or does not know of this participant."""
    values = {"P1": 1.0, "P2": 2.0}
    contrast = SimpleNamespace(form=form, measure=measure, blocks=("a", "b"), conditions=None)
    comparison = SimpleNamespace(contrast=contrast, left_out=left_out, sides=[SimpleNamespace(values=values)] * 2)
    by_setting = (("After a", {**values, "P3": 3.0}), ("After b", values))
    raw = Numbers("Raw", (0.0, 100.0), True, by_setting, "raw", ("a", "b"), ("a", "b"))
    assert pages._is_in_hypotheses(raw, "load", results_of(contrasts=[comparison])) is is_shown


def test_the_first_page_has_the_look_the_cards_the_limits_and_the_rate_of_false_claims(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cards = [
        Card(
            question="Noticed?", verdict="not shown", sentences=("p = .5, n = 12.", "So."), block="b", figures=("late",)
        ),
        Card(question="Age", verdict="", sentences=("Old.",), block="c", figures=("late",)),
    ]
    monkeypatch.setattr(pages, "cards", lambda *_: cards)
    monkeypatch.setattr(pages, "answers", lambda _results: ("an answer",))
    monkeypatch.setattr(pages, "false_claims_sentence", lambda n: f"Of {n} people.")
    monkeypatch.setattr(pages, "picture", lambda figure, beside=False: f"{figure.name} {beside}")
    pictures = [picture("late-b", "b")]
    results = results_of(block("a", n=7), block("b", n=11, kind="delays"), people=("P1",) * 15)
    page = pages.first_page(results, ["Block b: few.", "No key."], {}, pictures, {})
    assert '<span class="verdict not-shown">not significant</span>' in page
    assert "<p>p\u00a0=\u00a0.5, n\u00a0=\u00a012.</p>" in page
    lines = list(page_lines(page.replace("\u00a0", " ")))
    assert lines == [
        "Noticed?  not significant", "p = .5, n = 12.", "So.", "About the figure", "About late-b.", "late-b True",
        "Age", "Old.", "What this study cannot show", "No key.", "Block b : Few.", "Of 11 people.",
    ]  # fmt: skip
    liquids_alone = results_of(block("a", n=7), people=("P1",) * 15)
    assert "Of 7 people." not in pages.first_page(liquids_alone, [])  # the rate is that of studies with delays
    planned = replace(DECIDED, looks=(15, 30), look=1, planned_alpha=0.05)
    looked = list(page_lines(pages.first_page(SimpleNamespace(**{**vars(results), "decided": planned}), [])))
    assert looked[0].startswith("This is look 1 of 2, planned at 15 and 30 participants.")
    assert not [line for line in looked if line.startswith("Of ")], "it holds for one look"
    monkeypatch.setattr(pages, "answers", lambda _results: ())
    assert "Of 11" not in pages.first_page(results, [])
    monkeypatch.setattr(pages, "cards", lambda *_: [])
    assert list(page_lines(pages.first_page(results, []))) == ["No answers are included yet."]
