"""Figures of people: every number is a point, means stand beside them, and no text covers another."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.text import Text

from study_app import figure_style as style
from study_app.analysis.figures.people_figures import Column, Panel, draw_people, mean_of, numbers_of_panels
from study_app.analysis.page_layout import Look

pytestmark = pytest.mark.slow

PEOPLE = {"A": 1.0, "B": 2.0, "C": 4.0, "D": 5.0}
LOOK = Look("Ratings", [], ["n = 4"], style.fonts())


def columns(count: int, name: str = "Light oil") -> tuple[Column, ...]:
    values = [{person: value + place for person, value in PEOPLE.items()} for place in range(count)]
    return tuple(
        Column(name=f"{name} {place}", values=one, mean=mean_of(one.values())) for place, one in enumerate(values)
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
        next(one for one in ends if sum(one) == pytest.approx(6.0)), abs=1e-5
    )


def test_numbers_can_be_pasted_into_a_table() -> None:
    rows = [line.split("\t") for line in numbers_of_panels([Panel(title="Heavy", columns=columns(1))]).splitlines()]
    assert rows[0] == ["participant", "Heavy Light oil 0"]
    assert rows[1:5] == [[person, str(value)] for person, value in PEOPLE.items()]
    assert rows[5] == ["mean", "3.0"]
    assert [row[0] for row in rows[6:]] == ["lower end of the 95 % interval", "upper end of the 95 % interval"]


@pytest.mark.parametrize("panels", [1, 2, 5, 9])
@pytest.mark.parametrize("shared", [True, False])
def test_no_text_leaves_the_figure_or_touches_another(panels: int, shared: bool) -> None:
    made = [Panel(title=f"Statement {place} of many", columns=columns(3)) for place in range(panels)]
    figure = draw_people(made, LOOK, above="Points of the scale", below="Liquid", shared=shared).figure
    figure.canvas.draw()
    texts = [text for text in figure.findobj(Text) if text.get_text().strip() and text.get_visible()]
    boxes = [(text.get_text(), text.get_window_extent().padded(-1)) for text in texts]
    width, height = figure.bbox.size
    for words, box in boxes:
        assert 0 <= box.x0 <= box.x1 <= width, words
        assert 0 <= box.y0 <= box.y1 <= height, words
    for (words, box), (other, beside) in combinations(boxes, 2):
        assert not box.overlaps(beside), (words, other)
