"""Figures of people: every number is a point, means stand beside them, and no text covers another."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.lines import Line2D
from matplotlib.text import Text

from study_app import figure_style as style
from study_app.analysis.figures import answer_figures, people_figures
from study_app.analysis.figures.people_figures import Column, Mean, Panel, draw_people, mean_of, numbers_of_panels
from study_app.analysis.page_layout import POINT, Look
from study_app.protocol.participants import EACH_GROUP
from tests.analysis.made_up import liquids, study

pytestmark = pytest.mark.slow

PEOPLE = {"A": 1.0, "B": 2.0, "C": 4.0, "D": 5.0}
LOOK = Look("Ratings", [], ["n = 4"], style.fonts())


def columns(count: int, name: str = "Light oil") -> tuple[Column, ...]:
    values = [{person: value + place for person, value in PEOPLE.items()} for place in range(count)]
    return tuple(
        Column(name=f"{name} {place}", values=column_values, mean=mean_of(column_values.values()))
        for place, column_values in enumerate(values)
    )


def test_each_participant_is_a_point_of_the_group_and_the_mean_has_its_interval() -> None:
    members = {"A": "experts", "B": "experts", "C": "novices", "D": "novices"}
    figure = draw_people([Panel(columns=columns(2), line=0.0, bound=(-1, 1))], LOOK, above="Points", members=members)
    (axes,) = figure.figure.axes
    points = {str(line.get_gid()): line for line in axes.lines if str(line.get_gid()).startswith("person-")}
    assert {gid: np.asarray(line.get_ydata()).tolist() for gid, line in points.items()} == {
        f"person-{person}": [value, value + 1] for person, value in PEOPLE.items()
    }
    assert points["person-A"].get_color() == points["person-B"].get_color() != points["person-C"].get_color()
    assert points["person-A"].get_marker() != points["person-C"].get_marker(), "not by colour alone"
    assert [line.get_ydata()[0] for line in axes.lines if line.get_gid() == "mean"] == [3.0, 4.0]
    # Student: SD √(10 / 3), four participants, t(3) = 3.182.
    half = 3.182446 * np.sqrt(10 / 3) / 2
    ends = [np.asarray(line.get_ydata()).tolist() for line in axes.lines if line.get_linewidth() == 1.5]
    assert [3.0 - half, 3.0 + half] == pytest.approx(
        next(end for end in ends if sum(end) == pytest.approx(6.0)), abs=1e-5
    )


def test_numbers_can_be_pasted_into_a_table() -> None:
    rows = [line.split("\t") for line in numbers_of_panels([Panel(title="Heavy", columns=columns(1))]).splitlines()]
    assert rows[0] == ["participant", "Heavy Light oil 0"]
    assert rows[1:5] == [[person, str(value)] for person, value in PEOPLE.items()]
    assert rows[5] == ["mean", "3.0"]
    assert [row[0] for row in rows[6:]] == ["lower end of the 95 % interval", "upper end of the 95 % interval"]


def test_means_of_an_equivalence_test_have_its_90_percent_interval() -> None:
    """t(3) at 95 % is 2.353363; the SD of 1, 2, 4 and 5 is √(10 / 3)."""
    panel = Panel(columns=(Column(name="Late", values=PEOPLE),), level=0.9).split(dict.fromkeys(PEOPLE, "all"), ["all"])
    rows = dict(line.split("\t") for line in numbers_of_panels([panel]).splitlines())
    half = 2.353363 * np.sqrt(10 / 3) / 2
    ends = [float(rows[f"{end} end of the 90 % interval"]) for end in ("lower", "upper")]
    assert ends == pytest.approx([3 - half, 3 + half], abs=1e-5)
    texts = [text.get_text() for text in draw_people([panel], LOOK, above="Points").figure.findobj(Text)]
    assert "mean, 90 % interval" in texts


@pytest.mark.parametrize("panels", [1, 2, 5, 9])
@pytest.mark.parametrize("shared", [True, False])
def test_no_text_leaves_the_figure_or_touches_another(panels: int, shared: bool) -> None:
    drawn_panels = [Panel(title=f"Statement {place} of many", columns=columns(3)) for place in range(panels)]
    figure = draw_people(drawn_panels, LOOK, above="Points of the scale", below="Liquid", shared=shared).figure
    figure.canvas.draw()
    texts = [text for text in figure.findobj(Text) if text.get_text().strip() and text.get_visible()]
    boxes = [(text.get_text(), text.get_window_extent().padded(-1)) for text in texts]
    width, height = figure.bbox.size
    for words, box in boxes:
        assert 0 <= box.x0 <= box.x1 <= width, words
        assert 0 <= box.y0 <= box.y1 <= height, words
    for (words, box), (other, beside) in combinations(boxes, 2):
        assert not box.overlaps(beside), (words, other)


@pytest.mark.parametrize("shared", [True, False])
def test_a_panel_alone_in_the_last_row_is_as_wide_as_those_above_it(shared: bool) -> None:
    figure = draw_people([Panel(columns=columns(2))] * 4, LOOK, above="Points", shared=shared).figure
    assert [axes.get_position().width for axes in figure.axes] == pytest.approx(
        [figure.axes[0].get_position().width] * 4
    )


RATIOS = {"A": 0.5, "B": 2.0, "C": 3.0, "D": 12.0, "E": 6.0}
MEMBERS = {"A": "experts", "B": "experts", "C": "novices", "D": "novices", "E": "novices"}
GROUPS = ("experts", "novices")


def split_panel(*, log: bool) -> Panel:
    doubled = {person: 2 * value for person, value in RATIOS.items()}
    group_columns = (Column(name="Thin", values=RATIOS), Column(name="Thick", values=doubled))
    return Panel(columns=group_columns, log=log).split(MEMBERS, GROUPS)


@pytest.mark.parametrize(("log", "means"), [(False, [1.25, 7.0]), (True, [1.0, 6.0])])
def test_groups_are_side_by_side_with_the_mean_of_their_own_participants(log: bool, means: list[float]) -> None:
    """The geometric means of 0.5 and 2, and of 3, 12 and 6, are 1 and 6."""
    figure = draw_people([split_panel(log=log)], LOOK, above="Points", members=MEMBERS).figure
    (axes,) = figure.axes
    mean_lines = [line for line in axes.lines if line.get_gid() == "mean"]
    assert [line.get_ydata()[0] for line in mean_lines] == pytest.approx([*means, *(2 * mean for mean in means)])
    points = {str(line.get_gid()): line for line in axes.lines if str(line.get_gid()).startswith("person-")}
    colours = [points[f"person-{person}"].get_color() for person in ("A", "B", "C", "D", "E")]
    assert colours == [mean_lines[0].get_color()] * 2 + [mean_lines[1].get_color()] * 3
    assert [text.get_text() for text in axes.get_xticklabels()] == ["Thin", "Thick"]
    xs = {person: points[f"person-{person}"].get_xdata() for person in MEMBERS}
    for column in (0, 1):
        assert max(xs[person][column] for person in "AB") < min(xs[person][column] for person in "CDE")


@pytest.mark.parametrize(
    ("split", "means", "legend"), [("", 0, {*GROUPS}), (EACH_GROUP, 4, {*GROUPS}), ("novices", 4, set())]
)
def test_a_picture_has_its_titles_at_their_places_and_the_groups_of_its_own_participants(
    split: str, means: int, legend: set[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A third group has nobody in the panels."""
    case_study = study(liquids(1), [(person, 1, "L1", (4, 4)) for person in "ABCDEF"])
    people = case_study.participants.assign(group=[*MEMBERS.values(), "others"])
    case_study = replace(case_study, participants=people, split=split)
    monkeypatch.setattr(people_figures, "picture_of", lambda *arguments: arguments)
    values = {"Thin": RATIOS, "Thick": dict(list(RATIOS.items())[:4])}
    panels = [Panel(columns=tuple(Column(name=name, values=own) for name, own in values.items()), level=0.9)]
    picture: Any = people_figures.people_picture(
        case_study, "b", "file", "Title", "Caption.", panels, ("svg",), above="Points", below="Liquid"
    )
    of_study, *words, draw, forms, counts, numbers = picture
    assert of_study is case_study
    assert (*words[:3], forms, counts) == ("b", "file", "Title", ("svg",), ("n = 5",))
    interval_note = " Diamonds show group means with 90 % confidence intervals (Student's t)."
    assert words[3] == f"Caption.{interval_note if split else ''}"
    assert [line.split("	")[:2] for line in numbers.splitlines()[1:6]] == [[*member] for member in MEMBERS.items()]
    figure = draw(LOOK).figure
    figure.canvas.draw()
    (axes,) = figure.axes
    assert sum(line.get_gid() == "mean" for line in axes.lines) == means
    texts = {text.get_text(): text.get_window_extent() for text in figure.texts}
    assert texts["Points"].y0 > axes.bbox.y1 > axes.bbox.y0 > texts["Liquid"].y1
    assert {*GROUPS, "others"} & {*texts} == legend


def test_numbers_of_groups_name_the_group_of_each_participant_and_mean() -> None:
    panel = split_panel(log=False)
    rows = [line.split("\t") for line in numbers_of_panels([panel], MEMBERS).splitlines()]
    assert rows[0] == ["participant", "group", "Thin", "Thick"]
    assert rows[1:6] == [[who, MEMBERS[who], str(value), str(2 * value)] for who, value in RATIOS.items()]
    assert rows[6:8] == [["mean", "experts", "1.25", "2.5"], ["mean", "novices", "7.0", "14.0"]]
    alone = numbers_of_panels([panel.split(MEMBERS, ["novices"])], {})
    assert [line.split("\t")[0] for line in alone.splitlines()[1:4]] == ["C", "D", "E"]


def test_a_wide_bound_is_within_the_scale() -> None:
    """Qt draws no clip path, so that a band beyond the axes would cover the heading."""
    (axes,) = draw_people([Panel(columns=columns(1), bound=(-7, 8))], LOOK, above="Points").figure.axes
    low, high = axes.get_ylim()
    assert low < -7
    assert high > 8


def _left_of(text: Text, parts: Iterable[Any], left_of: Callable[[Any], float]) -> Any:
    """Return the part of a legend that is nearest to the left of a text."""
    right = text.get_window_extent().x0
    return min((part for part in parts if left_of(part) < right), key=lambda part: right - left_of(part))


def test_the_legend_names_each_group_beside_the_marker_and_in_the_colour_of_its_participants() -> None:
    members = {"A": "experts", "B": "novices", "C": "others", "D": "novices"}
    figure = draw_people([Panel(columns=columns(2))], LOOK, above="Points", members=members).figure
    (axes,) = figure.axes
    points = {str(line.get_gid()).removeprefix("person-"): line for line in axes.lines}
    texts = {text.get_text(): text for text in figure.texts}
    keys = [line for line in figure.artists if isinstance(line, Line2D)]
    for person, group in members.items():
        key = _left_of(texts[group], keys, lambda line: line.get_window_extent().x0)
        assert texts[group].get_color() == key.get_color() == points[person].get_color(), (person, group)
        assert key.get_marker() == points[person].get_marker(), (person, group)
    assert "participant" not in texts, "no participant is grey"


def test_an_interval_beyond_the_scale_ends_at_its_edge_with_an_arrow() -> None:
    mean, within = Mean(value=6.5, low=0.1, high=12.9), Mean(value=4.0, low=3.2, high=4.9)
    two = [Column(name="a", values={}, mean=mean), Column(name="b", values={}, mean=within)]
    (axes,) = draw_people([Panel(columns=two, ends=(1.0, 7.0))], LOOK, above="Points").figure.axes
    bottom, top = axes.get_ylim()
    interval_lines = [list(line.get_ydata()) for line in axes.lines if line.get_gid() == "interval"]
    arrows = {line.get_marker(): line.get_ydata()[0] for line in axes.lines if line.get_marker() in {"v", "^"}}
    assert (interval_lines, arrows) == ([[bottom, top], [3.2, 4.9]], {"v": bottom, "^": top})


def test_the_legend_of_levels_has_the_colours_of_the_bars() -> None:
    settings = liquids(1)
    levels_given = [level for level in range(1, 8) for _ in range(level)]
    case_study = study(settings, [(f"P{place:03d}", 1, "L1", (level, 4)) for place, level in enumerate(levels_given)])
    figure = answer_figures.draw_block(case_study, case_study.blocks[0], {}, LOOK).figure
    figure.canvas.draw()
    labels = [text for text in figure.texts if text.get_text() in set("1234567")]
    colours = {
        to_hex(
            _left_of(label, figure.artists, lambda part: part.get_window_extent().x0).get_facecolor()
        ): label.get_text()
        for label in labels
    }
    bars = [bar for bar in figure.axes[0].patches if "row1" in bar.get_gid()]
    assert {colours[to_hex(bar.get_facecolor())]: bar.get_width() for bar in bars} == {
        str(level): level for level in range(1, 8)
    }


@pytest.mark.parametrize("panels", [1, 6])
def test_participants_with_equal_numbers_are_drawn_apart(panels: int) -> None:
    values = {f"P{number:02d}": 50.0 if number < 9 else 5.0 * number for number in range(16)}
    equal_panels = [Panel(columns=(Column(name="", values=values),), ends=(0.0, 100.0))] * panels
    figure = draw_people(equal_panels, LOOK, above="").figure
    for axes in figure.axes:
        points = [axes.transData.transform(line.get_xydata())[0] * 72 / figure.dpi for line in axes.lines
                  if str(line.get_gid()).startswith("person-")]  # fmt: skip
        assert (
            min(float(np.hypot(*(point - other_point))) for point, other_point in combinations(points, 2))
            >= POINT["markersize"]
        )
