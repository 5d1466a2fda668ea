"""Figures of a report: what stands in the recognition matrix, over which delays, and where the step-down mark is."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from study_app import figure_style as style
from study_app.analysis.figures import answer_figures, movement_plots, recognition_matrix, small_multiples
from study_app.analysis.tables.study_tables import load_study
from tests.analysis.conftest import Results, twelve

pytestmark = pytest.mark.slow

TABLE = ((0, 4, 0, 0, 0, 1, 0), (3, 0, 0, 0, 1, 1, 0), (0, 3, 0, 0, 0, 1, 1))


def matrix(table: tuple[tuple[int, ...], ...] = TABLE) -> Figure:
    return recognition_matrix.draw(
        table,
        ["Water", "Honey", "Light oil"],
        ["Like honey", "Like water", "Like slime", "Like oil", "Like tar"],
        [1, 0, 3],
        title="Names",
        marks=[],
        counts=["n = 5"],
        foot="",
        fonts=style.PRINT_FONTS,
    ).figure


def texts(figure: Figure, label: str) -> list[str]:
    return [text.get_text() for axes in figure.axes if axes.get_label() == label for text in axes.texts]


def test_every_count_stands_in_its_cell_with_its_share_of_the_row() -> None:
    figure = matrix()
    assert texts(figure, "name2") == ["4  (80%)", "0", "3  (60%)"]
    assert texts(figure, "name6") == ["1  (20%)"] * 3
    assert texts(figure, "name7") == ["0", "0", "1  (20%)"]


def test_columns_without_any_answer_are_left_out_but_names_and_undecided_stay() -> None:
    figure = matrix(tuple((*row[:6], 0) for row in TABLE))
    assert [axes.get_label() for axes in figure.axes] == [f"name{place}" for place in range(1, 7)]


def test_the_right_name_is_framed_in_every_row() -> None:
    framed = {
        (axes.get_label(), patch.get_gid())
        for axes in matrix().axes
        for patch in axes.patches
        if patch.get_linewidth() > 1
    }
    assert framed == {("name2", "name2-setting1"), ("name1", "name1-setting2"), ("name4", "name4-setting3")}


@pytest.mark.parametrize("lowest_ms", [50.0, 200.0])
def test_the_lowest_delay_is_marked_at_its_place_on_the_true_scale(rek: Results, lowest_ms: float) -> None:
    twelve(rek, people=3)
    rek.open()
    figure = answer_figures.delays(load_study(rek.folder), lowest={"different": lowest_ms})
    marks = [line for axes in figure.axes for line in axes.lines if str(line.get_gid()).endswith("-lowest")]
    (mark,) = marks
    assert np.asarray(mark.get_xdata()).tolist() == [lowest_ms, lowest_ms]
    assert mark.get_gid() == "item1-lowest"
    assert f"≤ {lowest_ms:g}" in texts(figure, "item1")


def test_motion_is_drawn_for_every_participant_with_its_own_scale() -> None:
    values = np.array([[0.8, 0.9, 1.0], [0.85, np.nan, 1.1]])
    figure = movement_plots.draw(
        [movement_plots.Measured("Time, s", values), movement_plots.Measured("Flat", np.ones((2, 3)))],
        [0.0, 100.0, 200.0],
        title="Motion",
        marks=[],
        counts=["n = 2"],
        foot="",
        fonts=style.PRINT_FONTS,
    ).figure
    first, second = figure.axes
    gids = {str(line.get_gid()): line for line in first.lines}
    assert np.asarray(gids["measure1-participant1"].get_ydata()).tolist() == [0.8, 0.9, 1.0]
    assert np.asarray(gids["measure1-median"].get_ydata()).tolist() == pytest.approx([0.825, 0.9, 1.05])
    low, high = first.get_ylim()
    assert low < 0.8
    assert high > 1.1
    assert [tick.get_text() for tick in second.get_yticklabels()] == ["1"]
    assert second.get_ylim() == (0.5, 1.5)


def test_of_many_participants_some_are_drawn_and_the_median_is_of_all() -> None:
    values = np.tile(np.array([1.0, 2.0, 3.0]), (500, 1))
    values[::2] += 1
    figure = movement_plots.draw(
        [movement_plots.Measured("Time, s", values)],
        [0.0, 100.0, 200.0],
        title="Motion",
        marks=[],
        counts=["n = 500"],
        foot="",
        fonts=style.PRINT_FONTS,
    ).figure
    gids = {str(line.get_gid()): line for line in figure.axes[0].lines}
    drawn = [gid for gid in gids if "participant" in gid]
    assert len(drawn) == small_multiples.MOST_LINES
    assert {"measure1-participant1", "measure1-participant500"} <= set(drawn)
    assert np.asarray(gids["measure1-median"].get_ydata()).tolist() == [1.5, 2.5, 3.5]
    assert small_multiples.line_words(500) == "60 of the 500 participants, evenly chosen in the order of their ids"
    assert small_multiples.line_words(60) == "participants"
