"""What figures draw and say of results that were made up by hand: columns, titles, units, bars, points and captions."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from study_app import figure_style as style
from study_app.analysis.data.study_tables import Study
from study_app.analysis.figures import answer_figures, level_figures, question_figures, summary_figures
from study_app.analysis.figures.people_figures import Mean
from study_app.analysis.figures.summary_figures import Numbers, numbers_of, summary_figure_tasks
from study_app.analysis.findings import statement_tests
from study_app.analysis.findings.statement_tests import Effects
from study_app.analysis.levels.answers import LevelAnswers
from study_app.analysis.levels.thresholds import ThresholdEstimate, TrackCourse
from study_app.analysis.page_layout import Drawing, Look
from study_app.analysis.results import ContrastResult, ContrastSide, GroupAnswers, LevelsResult, QuestionResult
from study_app.analysis.statistics.outcome import Interval
from study_app.protocol.model import Contrast, Published
from study_app.protocol.questions import Number
from study_app.store.verification import Discrepancy
from tests.analysis.made_up import DECIDED, ITEMS, delays, everybody, liquids, study

LOOK = Look("Title", [], ["n = 3"], style.FALLBACK_FONTS)
PEOPLE = "P000", "P001", "P002"
MADE = study(liquids(2), list(everybody(liquids(2), 3, lambda *_: 4)))
SAMPLE = "Three participants (SIMULATED, not people)."


class Shown(SimpleNamespace):
    """The arguments of `people_picture` by name."""


@pytest.fixture
def people_figures_drawn(monkeypatch: pytest.MonkeyPatch) -> list[Shown]:
    """Return the figures of people that are drawn during the test."""
    figures: list[Shown] = []
    names = ("study", "block", "name", "title", "caption", "panels", "forms")

    def keep(*given: Any, **titles: Any) -> None:
        figures.append(Shown(**dict(zip(names, given, strict=True)), **titles))

    for module in (summary_figures, statement_tests):
        monkeypatch.setattr(module, "people_picture", keep)
    return figures


def values_of(*values: float) -> dict[str, float]:
    return dict(zip(PEOPLE, values, strict=True))


def side(name: str, *values: float, mean: float, people: Sequence[str] = PEOPLE) -> ContrastSide:
    values_of = dict(zip(people, values, strict=True))
    return ContrastSide(name=name, values=values_of, mean=mean, low=mean / 2, high=2 * mean, sd=1.0)


def hypothesis(sides: tuple[ContrastSide, ...], *, ratio: bool = False, **stated: Any) -> ContrastResult:
    unknown = dict.fromkeys(("statistic", "p", "p_adjusted", "p_bootstrap", "p_skewed", "p_equivalent", "higher"))
    return ContrastResult(
        test="t", n=3, dropped=0, statistic_name="t", effect_name="d", method="m", no_interval="", note="", members=1,
        contrast=Contrast.model_validate(stated), compared=("First", "Second"), ratio=ratio, verdict="shown",
        equivalent=None, not_excluded=None, left_out={}, effect=1.7, sides=sides, measure_name="warmth",
        interval=Interval(low=1.2, high=2.3, level=0.95, method="t"), **unknown,  # type: ignore[arg-type]
    )  # fmt: skip


def columns_of(panel: Any) -> list[tuple[Any, ...]]:
    return [
        (
            column.name,
            dict(column.values),
            column.mean and (column.mean.value, column.mean.low, column.mean.high),
            column.group,
        )
        for column in panel.columns
    ]


def draw(results: Any, numbers: Any = (), made: Study = MADE) -> list[tuple[str, str]]:
    """Draw the figures of the first page; return their blocks and names."""
    tasks = list(summary_figure_tasks(made, results, dict(numbers), ("svg",)))
    for *_, task in tasks:
        task()
    return [(of, name) for of, name, _ in tasks]


def results_of(*contrasts: ContrastResult, levels: Sequence[LevelsResult] = ()) -> Any:
    return SimpleNamespace(contrasts=contrasts, levels=levels)


def test_a_hypothesis_within_participants_has_both_values_and_their_difference(
    people_figures_drawn: list[Shown],
) -> None:
    first, second = side("Wax", 5.0, 3.0, 7.0, mean=5.0), side("Oil", 4.0, 4.5, 1.0, mean=3.5)
    stated = {"measure": "warm", "blocks": ("b",), "conditions": ("c1", "c2"), "bound": 1.5}
    nobody = hypothesis((side("Wax", mean=1.0, people=()),) * 2, **stated)
    assert draw(results_of(nobody, hypothesis((first, second), **stated))) == [("b", "hypothesis-2")]
    (figure,) = people_figures_drawn
    assert (figure.block, figure.name, figure.title, figure.forms) == ("b", "hypothesis-2", "Warmth", ("svg",))
    assert (figure.above, figure.caption) == (
        "Points on the scale",
        "Warmth differs between First and Second in block b, with an equivalence bound of 1.5. Each line connects a "
        "participant's two values. Right: First − Second, for each participant and on average; dashed line: no "
        f"difference. Band: equivalence bounds. {SAMPLE}",
    )
    values, difference = figure.panels
    assert columns_of(values) == [
        ("Wax", values_of(5.0, 3.0, 7.0), (5.0, 2.5, 10.0), ""),
        ("Oil", values_of(4.0, 4.5, 1.0), (3.5, 1.75, 7.0), ""),
    ]  # fmt: skip
    assert (values.joined, values.line, values.bound, values.log) == (True, None, None, False)
    assert columns_of(difference) == [("First − Second", values_of(1.0, -1.5, 6.0), (1.7, 1.2, 2.3), "")]
    assert (difference.joined, difference.line, difference.bound, difference.log) == (False, 0.0, (-1.5, 1.5), False)


def test_a_ratio_of_thresholds_is_logarithmic_with_the_unit_of_its_block(people_figures_drawn: list[Shown]) -> None:
    sides = side("Late", 4.0, 9.0, 2.0, mean=4.0), side("Prompt", 2.0, 3.0, 8.0, mean=2.0)
    level = LevelsResult(
        block="late", title="Late", design="d", revealed=True, times=(), summary="share", counts="correct",
        vary="damping_nspm", quantity="damping at the hand", unit="N·s/m", level_kind="value",
    )  # fmt: skip
    other = replace(level, block="prompt", quantity="mass", unit="kg")
    stated = {"measure": "threshold", "blocks": ("late", "prompt"), "bound": 1.25}
    draw(results_of(hypothesis(sides, ratio=True, **stated), levels=(other, level)))
    (figure,) = people_figures_drawn
    assert (figure.block, figure.above) == ("late", "Damping at the hand [N·s/m]")
    assert "Right: First ÷ Second, for" in figure.caption
    assert "Band: equivalence bounds. Means are weighted as in the test. Three" in figure.caption
    values, ratio = figure.panels
    assert columns_of(ratio) == [("First ÷ Second", values_of(2.0, 3.0, 0.25), (1.7, 1.2, 2.3), "")]
    assert (values.log, ratio.log, ratio.line, ratio.bound) == (True, True, 1.0, (0.8, 1.25))


def test_an_interaction_has_each_group_under_each_condition(people_figures_drawn: list[Shown]) -> None:
    old, new = PEOPLE[:2], PEOPLE[2:]
    sides = side("old", 1.0, 2.0, mean=1.5, people=old), side("new", 6.0, mean=6.0, people=new)
    cells = (
        side("Wax", 5.0, 3.0, mean=4.0, people=old), side("Oil", 4.0, 1.0, mean=2.5, people=old),
        side("Wax", 7.0, mean=7.0, people=new), side("Oil", 1.0, mean=1.0, people=new),
    )  # fmt: skip
    stated = {"measure": "d_prime", "blocks": ("b", "c"), "groups": ("old", "new")}
    crossed = replace(hypothesis(sides, **stated), cells=cells, compared=("old", "new"))
    draw(results_of(crossed))
    (figure,) = people_figures_drawn
    assert (
        "Left: each group under each condition. Each line connects a participant's two values. Middle" in figure.caption
    )
    assert "Middle: each participant's difference. Right: old − new; dashed line" in figure.caption
    by_cell, differences, effect = figure.panels
    assert [(column[0], column[1], column[3]) for column in columns_of(by_cell)] == [
        ("Wax", {"P000": 5.0, "P001": 3.0}, "old"), ("Oil", {"P000": 4.0, "P001": 1.0}, "old"),
        ("Wax", {"P002": 7.0}, "new"), ("Oil", {"P002": 1.0}, "new"),
    ]  # fmt: skip
    assert (by_cell.title, differences.title, by_cell.line, differences.line) == (
        "Values",
        "Difference: Wax − Oil",
        0,
        0,
    )
    assert [(column[0], column[1], column[3]) for column in columns_of(differences)] == [
        ("old", {"P000": 1.0, "P001": 2.0}, "old"), ("new", {"P002": 6.0}, "new"),
    ]  # fmt: skip
    assert (differences.joined, columns_of(effect)) == (False, [("old − new", {}, (1.7, 1.2, 2.3), "")])
    assert (figure.above, draw(results_of(crossed), made=replace(MADE, split="old"))) == ("d′", [])


def threshold(person: str | None, standard: float, value: float, **ends: float | None) -> ThresholdEstimate:
    return ThresholdEstimate(
        participant=person, standard=standard, n=3, threshold=value, **{"low": value / 2, "high": value * 2, **ends}
    )


THRESHOLDS = LevelsResult(
    block="pitch", title="Pitch", design="d", revealed=True, times=(), summary="share", counts="correct", vary="x",
    quantity="frequency", unit="Hz", level_kind="difference", spacing="log", guess_rate=0.5, family="logistic",
)  # fmt: skip


def test_estimates_are_above_their_standards_with_the_means_of_the_group(people_figures_drawn: list[Shown]) -> None:
    """P9 is not included."""
    rows = (
        threshold("P000", 40.0, 2.0), threshold("P001", 40.0, 3.0), threshold("P9", 40.0, 99.0),
        threshold(None, 8.0, 0.6), threshold("P000", 8.0, 0.5), threshold(None, 40.0, 2.5),
    )  # fmt: skip
    assert draw(results_of(levels=(replace(THRESHOLDS, statistics={"thresholds": rows}),))) == [
        ("pitch", "estimates-pitch")
    ]
    alone = tuple(row for row in rows if row.standard == 40.0)
    linear = replace(THRESHOLDS, statistics={"thresholds": alone}, spacing="linear")
    draw(results_of(levels=(linear,)))
    both, single = people_figures_drawn
    (panel,) = both.panels
    assert columns_of(panel) == [
        ("8", {"P000": 0.5}, (0.6, 0.3, 1.2), ""), ("40", {"P000": 2.0, "P001": 3.0}, (2.5, 1.25, 5.0), ""),
    ]  # fmt: skip
    assert [column.ends for column in panel.columns] == [None, None]
    assert (both.title, both.below, panel.log) == ("Pitch: threshold", "Standard: frequency [Hz]", True)
    assert both.above == "Difference in frequency [Hz]"
    assert both.caption == (
        "Pitch: threshold for each participant, and the mean with its 95 % interval. Two participants (SIMULATED, not "
        "people)."
    )
    (panel,) = single.panels
    assert columns_of(panel) == [("", {"P000": 2.0, "P001": 3.0}, (2.5, 1.25, 5.0), "")]
    assert panel.columns[0].ends == {"P000": (1.0, 4.0), "P001": (1.5, 6.0)}
    assert (single.below, panel.log) == ("", False)
    assert "interval. Thin lines: each participant's 95 % interval, sorted by value. Two" in single.caption


def test_scores_and_numeric_answers_have_their_scale_and_the_order_of_the_hypothesis(
    people_figures_drawn: list[Shown], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each answer of P001 about wax counts half; a questionnaire with scores shows these alone."""

    def place(name: str, *codes: str) -> Any:
        settings = tuple(SimpleNamespace(code=code, condition=f"c{code}") for code in codes)
        return SimpleNamespace(
            id=name, title=f"Title {name}", is_form=True, settings=settings, name=lambda setting: f"Name {setting.code}"
        )

    def question(item: str, of: Any, bounds: Any = (1, 9)) -> Any:
        values = {"id": item, "short": item.capitalize(), "where": of, "bounds": bounds, "unit": f"{item} unit"}
        return SimpleNamespace(**values, scale_ends=bounds and (1, 7))

    load, end, pitch = place("load", "L1", "L2"), place("end"), place("pitch")
    questions = (
        question("sure", load), question("age", end), question("why", end, None), question("tone", pitch),
        question("empty", end),
    )  # fmt: skip
    score: Any = SimpleNamespace(where=load, name="raw", title="Raw", bounds=(0.0, 100.0))
    rows = pd.DataFrame(
        [("P000", "L1", 3.0), ("P001", "L2", 5.0), ("P001", "L2", 8.0), ("P002", "L1", None)],
        columns=["participant", "code", "value"],
    )
    empty = rows.assign(value=np.nan)
    monkeypatch.setattr(Study, "answers_to", lambda _study, question: empty if question.id == "empty" else rows)
    monkeypatch.setattr(summary_figures, "scored", lambda *_: rows.rename(columns={"value": "score"}))
    others: Any = SimpleNamespace(questions=questions, scores=(score,))
    levels: Any = (SimpleNamespace(id="pitch"),)
    case_study = replace(MADE, others=others, levels=levels)
    of_l1, of_l2 = ("Name L1", {"P000": 3.0}), ("Name L2", {"P001": 6.5})
    age = Numbers("Age", (1, 7), False, (("", {"P000": 3.0, "P001": 6.5}),), "age", (), (), "age unit")
    numbers = numbers_of(case_study)
    raw = Numbers("Raw", (0.0, 100.0), True, (of_l1, of_l2), "raw", ("L1", "L2"), ("cL1", "cL2"))
    assert numbers == {"load": [raw], "end": [age]}
    reverse: Any = (SimpleNamespace(within=("cL2", "cL1")),)
    (score_of_hypothesis,) = numbers_of(replace(case_study, contrasts=reverse))["load"]
    assert (score_of_hypothesis.by_setting, score_of_hypothesis.codes) == ((of_l2, of_l1), ("L2", "L1"))
    ten = [age._replace(title=f"Age {place}") for place in range(10)]
    assert draw(results_of(), {"end": ten, "load": numbers["load"]}, case_study) == [
        ("end", "answers-end"),
        ("load", "answers-load"),
    ]
    of_end, of_load = people_figures_drawn
    assert [panel.title for panel in of_end.panels] == [f"Age {place} (age unit)" for place in range(9)]
    assert (of_end.title, of_end.above) == ("Title end", "")
    assert of_end.caption == (
        "Title end: the value for each participant, and the mean with its 95 % confidence interval (Student's t). Two "
        "participants (SIMULATED, not people)."
    )
    (panel,) = of_load.panels
    assert [(column.name, column.mean) for column in panel.columns] == [
        ("Name L1", Mean(value=3.0)), ("Name L2", Mean(value=6.5)),
    ]  # fmt: skip
    assert (panel.title, panel.ends) == ("Raw", (0.0, 100.0))


@pytest.mark.parametrize("over_delay", [True, False])
def test_the_figure_of_a_block_has_differences_over_delay_and_answers_about_liquids(
    over_delay: bool, people_figures_drawn: list[Shown]
) -> None:
    """Participant 1 gives one point more than participant 0, and each further setting has two points more."""
    settings = delays((0, 40, 90)) if over_delay else liquids(3)
    points = {item: place for place, item in enumerate(ITEMS)}
    answers = everybody(settings, 2, lambda person, _s, code, item: person + 2 * int(code[1:]) * (1 - points[item]))
    case_study = study(settings, list(answers), replace(DECIDED, alpha=0.05, equivalence_bound=0.5))
    (block,) = case_study.blocks
    block = replace(block, labels=("not at all", *"23456", "fully"))
    names = tuple(f"Name {setting.code}" for setting in settings)
    result: Any = SimpleNamespace(
        id="b", title="Block", kind=block.kind, revealed=True, n=2, settings=settings, names=names, items=block.items,
        delays_ms=(0.0, 40.0, 90.0) if over_delay else (), findings={"effects": (1,)},
    )  # fmt: skip
    results: Any = SimpleNamespace(decided=case_study.decided)
    Effects(result, results).figure(Drawing(case_study, block, result, results, "effects-b", ("svg",)))
    (figure,) = people_figures_drawn
    first, second = figure.panels
    assert (first.title, second.title, figure.shared) == ("Different", "Harder", True)
    if over_delay:
        assert [(column.name, dict(column.values)) for column in first.columns] == [
            ("40", {"P000": 2.0, "P001": 2.0}), ("90", {"P000": 4.0, "P001": 4.0}),
        ]  # fmt: skip
        assert (first.places, first.line, first.bound, first.ends, first.level) == ((40, 90), 0, (-0.5, 0.5), None, 0.9)
        assert (figure.above, figure.below) == ("Difference from 0 ms, in points", "Added delay in ms")
        assert figure.title == "Differences from 0 ms"
        assert figure.caption.startswith("Difference between each participant's answers and those at 0 ms (")
        assert "n = 2). Diamonds: means with 90 % confidence intervals" in figure.caption
        assert figure.caption.endswith("Conclusions are based on the tests. Band: equivalence bounds of ±0.5 points.")
        return
    assert [(column.name, dict(column.values)) for column in first.columns] == [
        (f"Name L{place}", {"P000": 2.0 * place, "P001": 2.0 * place + 1}) for place in (1, 2, 3)
    ]
    assert (first.places, first.line, first.bound, first.ends, first.level) == ((), None, None, (1, 7), 0.95)
    assert (figure.above, figure.below) == ("Points from 1 (not at all) to 7 (fully)", "")
    assert figure.title == "Every participant's answers"
    assert figure.caption.startswith("Each participant's answers about each liquid (")
    assert "n = 2). Diamonds: means with 95 % confidence intervals" in figure.caption
    assert figure.caption.endswith("Conclusions are based on the tests.")


def question(measure: str, *groups: tuple[str, dict[str, Any]]) -> QuestionResult:
    return QuestionResult(
        where="end", title="End", is_form=True, item="it", text="How?", short="It", kind="k", measure=measure,
        figure=measure, groups=tuple(GroupAnswers(name[0], name, numbers) for name, numbers in groups),
    )  # fmt: skip


def question_of_levels(levels: dict[str, str], bounds: Any = None, low: str = "", high: str = "") -> Any:
    view = SimpleNamespace(low=low, high=high)
    kind = SimpleNamespace(view=lambda _number, _context: view)
    return SimpleNamespace(id="it", levels=levels, bounds=bounds, question=kind, context=None, unit="")


def texts_of(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.texts]


@pytest.mark.slow
def test_a_distribution_has_each_answer_the_quartiles_and_the_ends_of_the_scale() -> None:
    numbers = {"n": 4, "values": [2.0, 3.0, 5.0, 9.0], "median": 4.0, "q1": 2.5, "q3": 7.0}
    nothing = {"n": 0, "values": [], "median": None, "q1": None, "q3": None}
    result = question("distribution", ("Wax", nothing), ("Oil", numbers))
    figure = question_figures.draw_distribution(question_of_levels({}, (0, 10), "dull", "sharp"), result, LOOK).figure
    (axes,) = figure.axes
    points = {line.get_gid(): line for line in axes.lines if line.get_gid() in ("W", "O")}
    assert list(points) == ["O"]
    assert np.asarray(points["O"].get_xdata()).tolist() == [2.0, 3.0, 5.0, 9.0]
    assert np.asarray(points["O"].get_ydata()) == pytest.approx([1.0] * 4)
    (band,) = axes.collections
    assert band.get_paths()[0].get_extents().intervalx.tolist() == [2.5, 7.0]
    assert [4.0, 4.0] in [np.asarray(line.get_xdata()).tolist() for line in axes.lines]
    assert axes.get_xlim() == pytest.approx((-0.3, 10.3))
    texts = [text for text in texts_of(figure) if text not in ("Title", "n = 3")]
    assert texts[-6:] == ["Wax", "n = 0", "Oil", "n = 4", "0 dull", "10 sharp"]
    unbounded = question_figures.draw_distribution(
        question_of_levels({}), question("distribution", ("Oil", numbers)), LOOK
    ).figure
    assert {"2", "9"} <= {*texts_of(unbounded)}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("values", "ends", "labels"),
    [
        ((0.5, 8.0, 90.0, 4000.0), (-1.0, 4.0), ["1", "10", "100", "1000", "0.1 Pa", "10000 Pa"]),
        ((20.0, 30.0, 30.0, 60.0), (20.0, 60.0), ["20 Pa", "60 Pa"]),
        ((0.0, 8.0, 90.0, 90000.0), (0.001, 100000.0), ["0.001 Pa", "100000 Pa"]),
    ],
)
def test_the_axis_of_numbers_shows_the_range_of_the_answers(
    values: tuple[float, ...], ends: tuple[float, float], labels: list[str]
) -> None:
    numbers = {"n": 4, "values": list(values), "median": values[1], "q1": values[1], "q3": values[2]}
    number = Number(id="it", text="?", short="It", least=0.001, most=100000)
    placed = question_of_levels({}, (0.001, 100000.0))
    placed.question, placed.unit, placed.context = number, "Pa", SimpleNamespace(text=str)
    figure = question_figures.draw_distribution(placed, question("distribution", ("Oil", numbers)), LOOK).figure
    margin = 0.03 * (ends[1] - ends[0])
    assert figure.axes[0].get_xlim() == pytest.approx((ends[0] - margin, ends[1] + margin))
    assert texts_of(figure)[-len(labels) :] == labels


@pytest.mark.slow
def test_options_have_a_bar_for_those_who_chose_them_beside_one_for_those_who_answered() -> None:
    groups = ("Wax", {"n": 9, "counts": {"y": 7, "n": 2}}), ("Oil", {"n": 6, "counts": {"y": 1, "n": 5}})
    levels = {"y": "Yes", "n": "No"}
    figure = question_figures.draw_options(question_of_levels(levels), question("counts", *groups), LOOK).figure
    (axes,) = figure.axes
    bars = [(bar.get_y() + bar.get_height() / 2, bar.get_width(), str(bar.get_gid())) for bar in axes.patches]
    option_bars = [(y, width) for y, width, name in bars if name.startswith("bar-")]
    answered_bars = [(y, width) for y, width, name in bars if not name.startswith("bar-")]
    assert option_bars == [(pytest.approx(y), width) for y, width in enumerate((7, 2, 1, 5))]
    assert answered_bars == [(pytest.approx(y), width) for y, width in enumerate((9, 9, 6, 6))]
    assert [text.get_text() for text in axes.texts] == ["7", "2", "1", "5"]
    names = ["Wax: Yes", "Wax: No", "Oil: Yes", "Oil: No"]
    assert [text for text in texts_of(figure) if text in names] == names
    single = question_figures.draw_options(question_of_levels(levels), question("counts", groups[0]), LOOK).figure
    assert {"Yes", "No"} <= {*texts_of(single)}


@pytest.mark.slow
def test_ratings_have_a_segment_for_each_point_in_the_colour_of_the_legend() -> None:
    groups = (
        ("Wax", {"n": 10, "counts": {"1": 2, "2": 5, "3": 3}}),
        ("Oil", {"n": 0, "counts": dict.fromkeys("123", 0)}),
    )
    levels = {"1": "never", "2": "often", "3": "always"}
    figure = question_figures.draw_ratings(question_of_levels(levels), question("rating", *groups), LOOK).figure
    (axes,) = figure.axes
    segments = [(bar.get_x(), bar.get_width()) for bar in axes.patches if bar.get_gid() == "W"]
    assert segments == [pytest.approx(pair) for pair in ((0.0, 0.2), (0.2, 0.5), (0.7, 0.3))]
    assert [(text.get_text(), text.get_position()) for text in axes.texts] == [
        ("2", pytest.approx((0.1, 0))), ("5", pytest.approx((0.45, 0))), ("3", pytest.approx((0.85, 0))),
    ]  # fmt: skip
    colours = [to_hex(bar.get_facecolor()) for bar in axes.patches if bar.get_gid() == "W"]
    assert colours == question_figures._point_colours(3)
    assert (colours[0], colours[-1]) == (style.LEVEL_COLOURS[0], style.LEVEL_COLOURS[-1])
    assert [text for text in texts_of(figure) if text in ("never", "often", "always")] == ["never", "always"]


def test_each_answered_question_has_its_figure_caption_and_table(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = pd.DataFrame(
        {"participant": ["P1", "P2"], "session": [1, 2], "code": [None, None], "response": ["7", "3"], "trial": [8, 9]}
    )
    monkeypatch.setattr(Study, "answers_to", lambda *_: rows)
    monkeypatch.setattr(question_figures, "picture_of", lambda *arguments, numbers: (*arguments, numbers))
    numbers = {"n": 2, "participants": 2, "counts": {"3": 1, "7": 1}}
    asked_questions = [
        question("rating", ("All", numbers)),
        replace(question("counts", ("All", numbers)), where="pitch", short="End"),
        replace(question("counts", ("All", {"n": 0, "participants": 0})), item="none"),
        replace(question("texts", ("All", numbers)), figure=None, item="why"),
        replace(question("distribution", ("All", numbers)), where="late", short="End", item="age"),
    ]
    placed = [question_of_levels({"3": "low", "7": "high"}) for _ in asked_questions]
    levels: Any = [
        SimpleNamespace(id="pitch", design=SimpleNamespace(adjusts=False)),
        SimpleNamespace(id="x", design=SimpleNamespace(adjusts=True)),
    ]
    case_study = replace(MADE, others=SimpleNamespace(questions=placed), levels=levels)  # type: ignore[arg-type]
    tasks = list(question_figures.question_figure_tasks(case_study, asked_questions, ("svg",)))
    assert [(of, name) for of, name, _ in tasks] == [("end", "question-end-it"), ("late", "question-late-age")]
    sealed = replace(case_study, settings={})
    assert [of for of, *_ in question_figures.question_figure_tasks(sealed, asked_questions)] == [
        "end",
        "pitch",
        "late",
    ]
    (study_drawn, *names, title, caption, _, forms, table), (*_, other_title, _, _, _, _) = (
        draw_task() for *_, draw_task in tasks
    )
    assert (study_drawn is case_study, names, forms) == (True, ["end", "question-end-it"], ("svg",))
    assert (title, other_title) == ("End: It", "End")
    assert caption == (
        "End: “How?” Each bar shows the proportion of answers at each point of the scale; labels show the number of "
        f"answers. {SAMPLE}"
    )
    assert table.splitlines() == ["participant\tsession\tit", "P1\t1\t7", "P2\t2\t3"]


@pytest.mark.parametrize(
    ("n", "sentence"),
    [
        (9, "Bars show the number of participants who chose each option; grey bars show the number who answered."),
        (14, "Bars show how often each option was chosen; grey bars show the total number of answers."),
    ],
)
def test_bars_show_answers_if_participants_answered_more_than_once(
    n: int, sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        Study, "answers_to", lambda *_: pd.DataFrame(columns=["participant", "session", "code", "response"])
    )
    monkeypatch.setattr(question_figures, "picture_of", lambda *arguments, **_: arguments[4])
    numbers = {"n": n, "participants": 9, "counts": {"3": 5, "7": n - 5}}
    placed: Any = SimpleNamespace(questions=[question_of_levels({"3": "low", "7": "high"})])
    case_study = replace(MADE, others=placed, levels=())
    ((*_, draw_task),) = question_figures.question_figure_tasks(case_study, [question("counts", ("All", numbers))])
    assert draw_task() == f"End: “How?” {sentence} {SAMPLE}"


def answers_at(person: str | None, level: float, value: float, **changes: Any) -> LevelAnswers:
    fields = {"standard": 40.0, "comparison": None, "n": 8, "participants": 2, "count": None, "low": None, "high": None}
    return LevelAnswers(participant=person, level=level, value=value, **{**fields, **changes})


def test_weber_fractions_are_thresholds_over_standards_at_the_published_percentage() -> None:
    rows = (
        threshold("P000", 40.0, 2.0, compared=3.0, compared_low=1.0, compared_high=None),
        threshold("P001", 40.0, 8.0), threshold("P000", 0.0, 1.0), threshold(None, 10.0, 0.5, low=None, compared=2.5),
        threshold(None, 40.0, 6.0, compared=30.0, compared_high=32.0),
    )  # fmt: skip
    result = replace(THRESHOLDS, statistics={"thresholds": rows})
    assert level_figures._weber_fractions(result, "P000") == [(40.0, 0.05, 0.025, 0.1)]
    assert level_figures._weber_fractions(result, None) == [(10.0, 0.05, None, 0.1), (40.0, 0.15, 0.075, 0.3)]
    weber = replace(result, level_kind="weber")
    assert level_figures._weber_fractions(weber, "P001") == [(40.0, 8.0, 4.0, 16.0)]
    assert level_figures._weber_fractions(replace(result, level_kind="value"), "P000") == []
    assert level_figures._percentage_phrase(result) == " at 75 % correct"
    published = Published(block="pitch", measure="threshold", value=6.0, standard=40.0, percent=71.0, source="Kox")
    other = Published(block="pitch", measure="weber", value=0.2, percent=71.0, source="Lam")
    compared = replace(result, published=(published, other))
    assert level_figures._published_fractions(compared) == [(40.0, 0.15), (None, 0.2)]
    assert level_figures._weber_fractions(compared, "P000") == [(40.0, 0.075, 0.025, None)]
    assert level_figures._weber_fractions(compared, None) == [(10.0, 0.25, None, None), (40.0, 0.75, None, 0.8)]
    assert level_figures._percentage_phrase(compared) == " at 71 % correct"
    figure = level_figures._draw_fractions(compared, LOOK).figure
    assert {"Weber fraction at 71 % correct", "Standard for frequency [Hz]", "dotted: published 0.2"} <= {
        *texts_of(figure)
    }


@pytest.mark.slow
def test_the_panels_of_levels_show_all_and_then_each_participant() -> None:
    ratings = replace(
        THRESHOLDS, summary="mean", spacing="linear", level_kind="value", family=None, guess_rate=None, adaptive=False,
        statistics={
            "answers": (
                answers_at(None, 2.0, 3.0, low=2.5, high=3.5), answers_at(None, 4.0, 6.0),
                answers_at("P001", 2.0, 2.0), answers_at("P001", 4.0, 7.0),
                answers_at("P000", 2.0, 4.0, low=3.0, high=5.5), answers_at("P000", 4.0, 5.0),
                answers_at("P000", 2.0, 1.0, catch=True),
            )
        },
    )  # fmt: skip
    figure = level_figures._draw_levels(ratings, {}, LOOK).figure
    assert {"Mean rating", "Frequency [Hz]"} <= {*texts_of(figure)}
    assert [text for text in texts_of(figure) if text in ("All", *PEOPLE)] == ["All", "P000", "P001"]
    panel_lines = [
        [np.asarray(line.get_ydata()).tolist() for line in axes.lines if len(line.get_ydata()) == 2]
        for axes in figure.axes
    ]
    of_all, of_first, of_second = panel_lines
    assert of_all == [[4.0, 5.0], [2.0, 7.0], [3.0, 6.0], [2.5, 3.5]]
    assert of_first == [[4.0, 5.0], [3.0, 5.5]]
    assert of_second == [[2.0, 7.0]]
    crosses = [
        [
            np.asarray(line.get_ydata()).tolist()
            for line in axes.lines
            if line.get_marker() == "x" and len(line.get_ydata())
        ]
        for axes in figure.axes
    ]
    assert crosses == [[], [[1.0]], []]


def test_the_caption_of_levels_describes_the_drawing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(level_figures, "picture_of", lambda _study, *arguments: arguments)
    monkeypatch.setattr(level_figures, "_psychometric_bands", lambda *_: {})
    answers = tuple(answers_at(person, 2.0, 0.5) for person in PEOPLE[:2])
    shares = replace(THRESHOLDS, statistics={"answers": answers})
    (of, name, title, caption, *_) = level_figures._level_picture(MADE, shares, ("svg",), "levels-pitch", pd.DataFrame)  # type: ignore[misc]
    assert (of, name, title) == ("pitch", "levels-pitch", "Pitch")
    assert caption == (
        "Pitch: proportion correct at each level. First panel: mean across participants with its 95 % interval "
        "(Student's t); small points show individual participants. Other panels: one participant each, with 95 % "
        "intervals for the answers. Dashed line: chance (50 %). Two participants (SIMULATED, not people)."
    )
    many = tuple(
        replace(answers_at(person, 2.0, 0.5, comparison=name, catch=person == "P000"), level=None)
        for person in (None, *(f"P{number:03d}" for number in range(25)))
        for name in ("oil", "wax")
    )
    compared = replace(shares, vary=None, guess_rate=None, own_units=True, statistics={"answers": many})
    (*_, caption, _, _) = level_figures._level_picture(MADE, compared, (), "", pd.DataFrame)  # type: ignore[misc]
    assert "Pitch: proportion correct for each comparison. First" in caption
    assert (
        "; thin lines show individual participants after removing differences between participants' units." in caption
    )
    assert "intervals for the answers; crosses: catch trials." in caption
    assert "Two further participants are shown only in the table. 25 participants (SIM" in caption
    assert [level_figures._panels_left_out(further) for further in (-1, 0, 1, 3)] == [
        "", "", " 1 further panel is not shown.", " Three further panels are not shown.",
    ]  # fmt: skip


LABELS = ("not at all", *"23456", "fully")


def study_of_answers(*, is_open: bool = True, over_delay: bool = False) -> Study:
    """Return answers of three participants: P002 did not rate the last setting, and one answer is missing."""
    settings = delays((0, 40)) if over_delay else liquids(2)
    answers_of = {"P000": ((1, 4), (7, 4)), "P001": ((2, 5), (6, None)), "P002": ((4, 6),)}
    rows = [
        (person, 1, setting.code, values)
        for person, of_person in answers_of.items()
        for setting, values in zip(settings, of_person, strict=False)
    ]
    case_study = study(settings, rows)
    if not is_open:
        settings = tuple(replace(setting, condition=None, liquid=None, delay_ms=None) for setting in settings)
    block = replace(case_study.blocks[0], labels=LABELS, settings=settings)
    responses = case_study.responses.assign(response=case_study.responses["response"].astype("Int64"))
    valid = pd.array([True, False, None, True, False], "boolean")
    trials = case_study.trials.assign(delay_error_mean_ms=[-2.0, 1.0, 0.5, 3.0, -0.5], valid=valid)
    trials = pd.concat([trials, trials.assign(block="c", valid=False, delay_error_mean_ms=9.0)])
    return replace(
        case_study, blocks=(block,), responses=responses, trials=trials, settings=case_study.settings if is_open else {}
    )


def test_the_caption_of_answers_counts_participants_missing_answers_exclusions_and_limits() -> None:
    answered_study = study_of_answers()
    (block,) = answered_study.blocks
    assert answer_figures.counts(answered_study, block) == [
        "n = 2 to 3 of 3 participants per liquid, 1 of 10 ratings missing", "n = 2 to 3, 1 of 10 ratings missing",
    ]  # fmt: skip
    people = answered_study.participants
    extra = [people.iloc[[place]].assign(participant=f"P{place}9") for place in (0, 1, 2)]
    extra = [extra[0].assign(counted=False), *(row.assign(counted=False, excluded=True) for row in extra[1:])]
    doubts = [
        Discrepancy(answered_study.folder / f"{name}.csv", "differs", "verify", used=name != "e") for name in "dacbde"
    ]
    damaged = people.iloc[[0]].assign(participant="P39", status="damaged", counted=False)
    limited_study = replace(
        answered_study, participants=pd.concat([people.assign(pilot=True), *extra, damaged]), doubts=tuple(doubts)
    )
    caption = answer_figures._caption(limited_study, block)
    assert caption.startswith(
        "Pilot. Agreement with 2 statements about 2 liquids (simulated participants, not people; n = 2 to 3 of 3 "
        "participants per liquid, 1 of 10 ratings missing). Bars show the number of answers, with disagreement to the "
        "left of the line and agreement to the right;"
    )
    assert caption.endswith(
        "The scale points from 1 to 7 are: not at all, 2, 3, 4, 5, 6, fully. “Cannot judge” answers: 0; missing "
        "answers: 1. 1 session is excluded because it was not completed. 1 damaged session is not included. 2 "
        "sessions are excluded. 2 of 5 trials exceeded the protocol's limits but are included. 4 files are used "
        "although they have changed since recording: a.csv, b.csv, c.csv and 1 more."
    )
    late = study_of_answers(over_delay=True)
    caption = answer_figures._caption(late, late.blocks[0])
    assert "about 2 delays (simulated" in caption
    assert "Thin lines: participants, shifted slightly" in caption
    assert (
        "Answers range from 1 (not at all) to 7 (fully). The axis shows the requested delay; the achieved delay "
        in caption
    )
    assert "differed from it by +0.4 ms on average (range across trials: −2.0 to +3.0 ms)." in caption
    sealed = study_of_answers(is_open=False)
    caption = answer_figures._caption(sealed, sealed.blocks[0])
    assert "about 2 conditions (" in caption
    assert "Conditions appear as codes because the study is blinded; their order has no meaning." in caption
    blocks = answered_study.blocks[0], late.blocks[0], sealed.blocks[0]
    assert [answer_figures.title(shown_block) for shown_block in blocks] == [
        "Agreement for each liquid", "Answers as a function of added delay", "Agreement by condition",
    ]  # fmt: skip


@pytest.mark.slow
def test_bars_have_the_answers_of_each_level_and_n_where_some_are_missing() -> None:
    """One answer to the second statement about the second liquid is missing."""
    answered_study = study_of_answers()
    figure = answer_figures.draw_block(answered_study, answered_study.blocks[0], {}, LOOK).figure
    first, second = figure.axes
    bars = [
        {str(bar.get_gid()): (bar.get_x(), bar.get_width()) for bar in axes.patches if bar.get_gid()}
        for axes in (first, second)
    ]
    edge = bars[0]["L1-row1-level4"][0]
    assert bars[0] == {
        "L1-row1-level1": (-2.0, 1), "L1-row1-level2": (-1.0, 1), "L1-row1-level4": (edge, 1),
        "L1-row2-level5": (0.0, 1), "L1-row2-level6": (1.0, 1), "L1-row2-level4": (edge, 1),
    }  # fmt: skip
    assert bars[1] == {"L2-row1-level6": (0.0, 1), "L2-row1-level7": (1.0, 1), "L2-row2-level4": (edge, 1)}
    texts = texts_of(figure)
    assert [text for text in texts if text in ("n 1", "n 2", "n 3")] == ["n 1"]
    names = [answered_study.blocks[0].name(setting) for setting in answered_study.blocks[0].settings]
    assert [text for text in texts if text in names] == names
    assert [text for text in texts if text in ("Different", "Harder")] == ["Different", "Harder"]


@pytest.mark.slow
def test_answers_over_delay_have_a_plot_for_each_statement_with_its_lowest_delay() -> None:
    answered_study = study_of_answers(over_delay=True)
    figure = answer_figures.draw_block(answered_study, answered_study.blocks[0], {"harder": 40.0}, LOOK).figure
    first, second = figure.axes
    assert [text for text in texts_of(figure) if text in ("Different", "Harder")] == ["Different", "Harder"]
    assert "Added delay in ms.   1 = not at all, 7 = fully." in texts_of(figure)
    lines = [{str(line.get_gid()): line for line in axes.lines} for axes in (first, second)]
    assert np.asarray(lines[0]["item1-median"].get_xydata()).tolist() == [[0.0, 2.0], [40.0, 6.5]]
    assert "item1-lowest" not in lines[0]
    assert np.asarray(lines[1]["item2-lowest"].get_xdata()).tolist() == [40.0, 40.0]
    assert "≤ 40" in {text.get_text() for text in second.texts}


def test_the_labels_of_a_legend_are_shortened_by_the_ending_that_they_share() -> None:
    agree = (
        "Fully disagree",
        "Mostly disagree",
        "Rather disagree",
        "Neither",
        "Fairly well",
        "Quite well",
        "Very well",
    )
    assert answer_figures._legend_labels(agree) == [
        "Fully disagree", "Mostly", "Rather", "Neither", "Fairly", "Quite", "Very well",
    ]  # fmt: skip
    same = ("A b", "C b", "C b", "n", "d e", "f e", "g e")
    assert answer_figures._legend_labels(same) == list(same)
    both_sides = ("Fully disagree", "Disagree", "Rather disagree", "Neither", "Rather agree", "Agree", "Fully agree")
    assert answer_figures._legend_labels(both_sides) == list(both_sides)


@pytest.mark.slow
def test_the_matrix_of_names_has_the_counts_and_outlines_the_correct_one() -> None:
    table = ((5, 1, 2, 0), (0, 6, 0, 0))
    figure = answer_figures.draw_recognition(table, ("Wax", "Oil"), ("like wax", "like oil"), (0, None), LOOK).figure
    columns = [[text.get_text() for text in axes.texts] for axes in figure.axes]
    assert columns == [["5  (62%)", "0"], ["1  (12%)", "6  (100%)"], ["2  (25%)", "0"]]
    outlined = [
        str(cell.get_gid())
        for axes in figure.axes
        for cell in axes.patches
        if cell.get_linewidth() == pytest.approx(1.6)
    ]
    assert outlined == ["name1-setting1"]
    texts = texts_of(figure)
    assert [text for text in texts if text in ("Wax", "Oil")] == ["Wax", "Oil"]
    assert "undecided" in texts
    assert "unanswered" not in texts, "nobody left it unanswered"
    decided = answer_figures.draw_recognition(((5, 1, 0, 0),), ("Wax",), ("like wax", "like oil"), (0,), LOOK).figure
    assert {"undecided", "unanswered"} & {*texts_of(decided)} == {"undecided"}


def course(person: str, standard: float, **changes: Any) -> TrackCourse:
    """Return six trials of two tracks: the third is a catch trial, the fifth presents only the standard."""
    fields = {
        "tracks": np.array([1, 2, 1, 1, 2, 2]), "levels": np.array([4.0, 8.0, 2.0, 5.0, 6.0, 3.0]),
        "successes": np.array([1, 0, 1, 0, 1, 1], bool), "reversals": np.array([0, 0, 0, 1, 0, 0], bool),
        "catches": np.array([0, 0, 1, 0, 0, 0], bool), "noises": np.array([0, 0, 0, 0, 1, 0], bool),
        "low": np.linspace(1, 2, 6), "high": np.linspace(9, 4, 6),
    }  # fmt: skip
    return TrackCourse(participant=person, standard=standard, **{**fields, **changes})


@pytest.mark.slow
def test_tracks_have_a_line_for_each_track_and_a_mark_for_each_answer() -> None:
    linear = replace(THRESHOLDS, spacing="linear", level_kind="value")
    figure = level_figures._draw_tracks(linear, [course("P000", 40.0), course("P000", 80.0)], LOOK).figure
    first, _ = figure.axes
    assert [text for text in texts_of(figure) if text.startswith("standard")] == ["standard 40", "standard 80"]
    assert {"Frequency [Hz]", "Trial number at this standard"} <= {*texts_of(figure)}
    assert [np.asarray(line.get_xydata()).tolist() for line in first.lines] == [
        [[1.0, 4.0], [4.0, 5.0]], [[2.0, 8.0], [6.0, 3.0]],
    ]  # fmt: skip
    marks = [collection.get_offsets().tolist() for collection in first.collections if len(collection.get_offsets())]
    assert [[1.0, 4.0]] in marks, "answered correctly in the first track"
    assert [[4.0, 5.0]] in marks, "answered incorrectly in the first track, and a reversal"
    assert [[3.0, 2.0]] in marks, "a catch trial"
    assert [[5.0, 6.0], [6.0, 3.0]] in marks
    assert [[2.0, 8.0]] in marks
    faces = {
        tuple(map(tuple, collection.get_offsets().tolist())): to_hex(collection.get_facecolor()[0])
        for collection in first.collections
        if len(collection.get_offsets()) and len(collection.get_facecolor())
    }
    assert faces[(1.0, 4.0),] != faces[(4.0, 5.0),] == "#ffffff"
    alone = level_figures._draw_tracks(linear, [course("P000", 40.0)], LOOK).figure
    assert "Trial number" in texts_of(alone)
    assert not [text for text in texts_of(alone) if text.startswith("standard")]


def test_the_caption_of_tracks_lists_the_marks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(level_figures, "picture_of", lambda _study, *arguments: arguments)
    none = np.zeros(6, bool)
    plain = course("P000", 40.0, tracks=np.ones(6, int), reversals=none, catches=none)
    answers = tuple(answers_at(person, 2.0, 0.5) for person in PEOPLE)
    rows = tuple(threshold(person, 40.0, 2.0) for person in PEOPLE)
    result = replace(THRESHOLDS, statistics={"answers": answers, "thresholds": rows}, adaptive=True)
    case_study = replace(MADE, levels=(SimpleNamespace(id="other"), SimpleNamespace(id="pitch")))  # type: ignore[arg-type]

    def caption(people_figures_drawn: LevelsResult, *courses: TrackCourse) -> str:
        monkeypatch.setattr(level_figures, "track_courses", lambda block, *_: courses if block.id == "pitch" else ())
        picture: Any = level_figures._track_picture(
            case_study, people_figures_drawn, ("svg",), "tracks-pitch", pd.DataFrame
        )
        of, name, title, text, *_ = picture
        assert (of, name, title) == ("pitch", "tracks-pitch", "Pitch: tracks")
        return str(text)

    assert caption(result, plain, plain, plain) == (
        "Pitch: the level of each trial. Filled: answered correctly; hollow: other answers. Band: 95 % interval for "
        f"the threshold, given the answers up to that trial. {SAMPLE}"
    )
    marked = caption(replace(result, counts="louder"), course("P000", 40.0), plain)
    catch = "×: catch trial answered correctly; +: catch trial answered incorrectly."
    kinds = f"Colours: tracks. Rings: reversals. {catch}"
    assert f"Filled: answered “louder”; hollow: other answers. {kinds} Band" in marked
    assert " 1 further panel is not shown. Three participants" in marked
    without_catches = caption(result, course("P000", 40.0, catches=none), plain, plain)
    assert "hollow: other answers. Colours: tracks. Rings: reversals. Band" in without_catches


@pytest.mark.slow
def test_a_psychometric_function_passes_its_threshold_with_its_interval_and_areas() -> None:
    """Half of the answers that are neither guesses nor lapses are correct at the threshold: 0.5 + 0.45 / 2."""
    own = threshold("P000", 40.0, 4.0, width=2.0, guess=0.5, lapse=0.05, low=3.0, high=6.0)
    answers = (
        answers_at(None, 2.0, 0.6), answers_at(None, 8.0, 0.9), answers_at("P000", 2.0, 0.625, n=8),
        answers_at("P000", 8.0, 0.9, n=20),
    )  # fmt: skip
    result = replace(THRESHOLDS, spacing="linear", statistics={"answers": answers, "thresholds": (own,)})
    band = {"P000": (np.array([2.0, 8.0]), np.array([0.5, 0.8]), np.array([0.7, 1.0]))}
    figure = level_figures._draw_levels(result, band, LOOK).figure
    assert "Proportion correct" in texts_of(figure)
    _, axes = figure.axes
    curve = next(np.asarray(line.get_xydata()) for line in axes.lines if len(line.get_xdata()) == 120)
    assert np.interp(4.0, *curve.T) == pytest.approx(0.725, abs=0.002)
    interval = [np.asarray(line.get_xydata()).tolist() for line in axes.lines if line.get_linewidth() == 1.2]
    assert interval == [[[3.0, pytest.approx(0.725)], [6.0, pytest.approx(0.725)]]]
    points = next(collection for collection in axes.collections if len(collection.get_offsets()) == 2)
    assert points.get_offsets().tolist() == [[2.0, 0.625], [8.0, 0.9]]
    assert points.get_sizes().tolist() == [16.0, 40.0]
    chance = [line.get_ydata()[0] for line in axes.lines if list(line.get_ydata()) == [0.5, 0.5]]
    assert chance == [0.5]
    assert level_figures._standards(result) == [40.0]
