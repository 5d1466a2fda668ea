"""Figures written as files: captions, exclusions, the same bytes each time, nothing hidden."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from study_app import figure_style as style
from study_app.analysis.figures import (
    answer_figures,
    captions,
    movement_plots,
    plotting,
    recognition_matrix,
    small_multiples,
)
from study_app.analysis.tables.study_tables import load_study
from study_app.errors import AnalysisError
from tests.analysis.conftest import HIDDEN, Results, twelve

pytestmark = pytest.mark.slow


def test_captions_say_what_is_missing_left_out_and_beyond_limits(rek: Results) -> None:
    rek.add("P001", lambda *_: 6, changes={"valid": False})
    rek.add("P002", lambda *_: 6, status="withdrawn", trials=3)
    path = rek.responses("P001")
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(line for line in lines if ",immersive," not in line))
    study = load_study(rek.folder)
    caption = captions.caption(study, study.blocks[0])
    assert "not answered: 3" in caption
    assert "1 session is left out" in caption
    assert "3 of 3 trials exceeded the protocol's limits" in caption


def test_captions_say_how_many_are_excluded_and_why(rek: Results) -> None:
    for number in range(1, 6):
        rek.add(f"P{number:03d}", lambda *_: 6)
    rek.exclude("P001", reason="tired")
    rek.exclude("P002", reason="held the\nwrong  handle, " + "very " * 40)
    rek.exclude("P003", reason="tired")
    rek.exclude("P004", trial=rek.trial("P004", "honey"), reason="the phone rang")
    study = load_study(rek.folder)
    liquids, delays = (captions.caption(study, block) for block in study.blocks)
    for caption in (liquids, delays):
        assert "3 sessions are excluded (2 × tired; 1 × held the wrong handle, very very" in caption
        assert " v…)." in caption
        assert "left out, not having been completed" not in caption
    assert "1 trial is excluded, its answers missing here (the phone rang)." in liquids
    assert "n = 1 to 2 of 2 participants in a setting" in liquids
    assert "trial is excluded" not in delays
    assert "n = 2 participants, every setting rated by all" in delays


def test_the_caption_of_opened_delays_says_how_late_they_really_were(rek: Results) -> None:
    rek.add("P001", lambda *_: 4, changes={"delay_error_mean_ms": -2.25})
    rek.add("P002", lambda *_: 4, changes={"delay_error_mean_ms": 4.25})
    study = load_study(rek.folder)
    assert "achieved" not in captions.caption(study, study.blocks[1])
    rek.open()
    study = load_study(rek.folder)
    assert "by +1.0 ms on average (trials: −2.2 to +4.2 ms)" in captions.caption(study, study.blocks[1])


def test_nothing_hidden_is_in_any_blinded_file(small: Results, tmp_path: Path) -> None:
    small.add("A", lambda *_: 3)
    for path in plotting.plot(small.folder, tmp_path / "out"):
        content = path.read_bytes().lower()
        for word in HIDDEN:
            assert word.encode() not in content, path.name
    small.open()
    plotting.plot(small.folder, tmp_path / "out")
    assert b"Lightquorn" not in (tmp_path / "out" / "liquids.svg").read_bytes()
    assert b">Quorn<" in (tmp_path / "out" / "liquids.svg").read_bytes()


def test_without_a_completed_session_plot_says_so_and_writes_nothing(rek: Results, tmp_path: Path) -> None:
    rek.add("P001", lambda *_: 4, status="unfinished", trials=3)
    with pytest.raises(AnalysisError, match="P001 session 1 unfinished"):
        plotting.plot(rek.folder, tmp_path / "out")
    assert not (tmp_path / "out").exists()


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
