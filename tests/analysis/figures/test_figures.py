import re
from collections.abc import Mapping
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.text import Text

from study_app import figure_style as style
from study_app.analysis.data.blocks import Block
from study_app.analysis.data.study_tables import Study, load_study
from study_app.analysis.figures import answer_figures, study_figures
from study_app.analysis.figures.page_layout import Look, study_marks
from study_app.errors import AnalysisError
from tests.analysis.conftest import HIDDEN, Answer, Results, twelve

pytestmark = pytest.mark.slow


def drawn(study: Study, block: Block, fonts: tuple[str, ...] = (), lowest: Mapping[str, float] | None = None) -> Figure:
    words = answer_figures.counts(study, block)
    look = Look(answer_figures.title(block), study_marks(study), words, fonts or style.screen_fonts())
    return answer_figures.draw_block(study, block, lowest or {}, look).figure


def liquids(study: Study, **look: Any) -> Figure:
    return drawn(study, study.blocks_of("liquids")[0], **look)


def delays(study: Study, **look: Any) -> Figure:
    return drawn(study, study.blocks_of("delays")[0], **look)


def test_disagreement_ends_and_agreement_begins_at_the_line_and_neutral_stands_apart(rek: Results) -> None:
    by_person(rek, [1, 2, 2, 3, 4, 4, 5, 6, 6, 6, 7])
    axes = panel(liquids(load_study(rek.folder)), "L1")
    found = segments(axes, 1)
    assert {level: width for level, (_, width, _) in found.items()} == {1: 1, 2: 2, 3: 1, 4: 2, 5: 1, 6: 3, 7: 1}
    assert [found[level][0] for level in (1, 2, 3)] == [-4, -3, -1]
    assert [found[level][0] for level in (5, 6, 7)] == [0, 1, 4]
    assert found[4][0] > 5
    assert {level: colour for level, (_, _, colour) in found.items()} == dict(
        zip(range(1, 8), style.LEVEL_COLOURS, strict=True)
    )


def test_blinded_panels_are_titled_by_code_and_opened_ones_by_name(rek: Results) -> None:
    by_person(rek, [4, 5])
    blinded = words(liquids(load_study(rek.folder)))
    assert [word for word in blinded if word in ("L1", "L2", "L3", "Water", "Honey", "Light oil")] == ["L1", "L2", "L3"]
    assert "Blinded: by code" in blinded
    rek.open()
    opened = words(liquids(load_study(rek.folder)))
    assert [word for word in opened if word in ("L1", "L2", "L3", "Water", "Honey", "Light oil")] == [
        "Water",
        "Honey",
        "Light oil",
    ]
    assert "Blinded: by code" not in opened


@pytest.mark.parametrize("draw", [liquids, delays])
def test_simulated_participants_are_called_so_in_the_heading_and_real_ones_are_not(
    rek: Results, small: Results, draw, tmp_path: Path
) -> None:
    by_person(rek, [4])
    assert "SIMULATED participants" in words(draw(load_study(rek.folder)))


def test_delays_lie_on_a_true_scale_with_a_line_per_participant_and_the_median(rek: Results) -> None:
    levels = {0: 1, 50: 2, 75: 2, 100: 3, 125: 5, 150: 6, 200: 7}

    def answer(shift: int):
        def given(condition: str, item: str) -> Answer:
            delay = int(condition.removeprefix("delay_")) if condition.startswith("delay_") else 0
            return min(7, levels[delay] + shift)

        return given

    for number, shift in enumerate((0, 0, 1), start=1):
        rek.add(f"P{number}", answer(shift))
    rek.open()
    axes = panel(delays(load_study(rek.folder)), "item1")
    lines = gids(axes, r"participant\d+")
    assert len(lines) == 3
    for line in lines:
        assert list(line.get_xdata()) == list(levels)
    assert np.abs(lines[0].get_ydata() - list(levels.values())).max() < 0.2
    (median,) = gids(axes, "median")
    assert list(median.get_xdata()) == list(levels)
    assert list(median.get_ydata()) == list(levels.values())
    (band,) = gids(axes, "quartiles")
    corners = {tuple(corner) for path in band.get_paths() for corner in path.vertices.tolist()}
    assert {(0.0, 1.0), (0.0, 1.5), (125.0, 5.0), (125.0, 5.5), (200.0, 7.0)} <= corners
    labels = [label.get_text() for label in axes.get_xticklabels()]
    assert labels == ["0", "50", "100", "150", "200"]
    assert axes.transData.transform((100, 0))[0] - axes.transData.transform((0, 0))[0] == pytest.approx(
        axes.transData.transform((200, 0))[0] - axes.transData.transform((100, 0))[0]
    )


def test_blinded_delays_are_bars_by_code_in_code_order(rek: Results) -> None:
    by_person(rek, [2, 2, 2, 5])
    figure = delays(load_study(rek.folder))
    codes = [f"D{number}" for number in range(1, 8)]
    assert [axes.get_label() for axes in figure.axes] == codes
    for code in codes:
        assert {level: width for level, (_, width, _) in segments(panel(figure, code), 1).items()} == {2: 3, 5: 1}


@pytest.mark.parametrize("fonts", [style.screen_fonts(), style.PRINT_FONTS], ids=["screen", "print"])
@pytest.mark.parametrize("opened", [pytest.param(False, marks=pytest.mark.nightly), True], ids=["blinded", "opened"])
@pytest.mark.parametrize("people", [pytest.param(1, marks=pytest.mark.nightly), 30])
def test_no_text_leaves_the_figure_or_touches_another(rek: Results, fonts, opened: bool, people: int) -> None:
    twelve(rek, people=people)
    if opened:
        rek.open()
    study = load_study(rek.folder)
    for figure in (liquids(study, fonts=fonts), delays(study, fonts=fonts)):
        figure.canvas.draw()  # tick labels have their places only then
        boxes = [(text.get_text(), text.get_window_extent().padded(-1)) for text in shown(figure)]
        width, height = figure.bbox.size
        for word, box in boxes:
            assert box.x0 >= 0, word
            assert box.y0 >= 0, word
            assert box.x1 <= width, word
            assert box.y1 <= height, word
        for (word, box), (other, beside) in combinations(boxes, 2):
            assert not box.overlaps(beside), (word, other)
        for text in figure.texts:
            if not text.get_text().startswith("n "):
                assert not any(text.get_window_extent().overlaps(axes.bbox) for axes in figure.axes), text.get_text()


def test_nothing_hidden_is_in_any_blinded_file(small: Results, tmp_path: Path) -> None:
    small.add("A", lambda *_: 3)
    for path in study_figures.plot(small.folder, tmp_path / "out"):
        content = path.read_bytes().lower()
        for word in HIDDEN:
            assert word.encode() not in content, path.name
    small.open()
    study_figures.plot(small.folder, tmp_path / "out")
    assert b"Lightquorn" not in (tmp_path / "out" / "liquids.svg").read_bytes()
    assert b">Quorn<" in (tmp_path / "out" / "liquids.svg").read_bytes()


def test_without_a_completed_session_plot_says_so_and_writes_nothing(rek: Results, tmp_path: Path) -> None:
    rek.add("P001", lambda *_: 4, status="unfinished", trials=3)
    with pytest.raises(AnalysisError, match="P001 session 1 unfinished"):
        study_figures.plot(rek.folder, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def texts(figure: Figure, label: str) -> list[str]:
    return [text.get_text() for axes in figure.axes if axes.get_label() == label for text in axes.texts]


@pytest.mark.parametrize("lowest_ms", [50.0, 200.0])
def test_the_lowest_delay_is_marked_at_its_place_on_the_true_scale(rek: Results, lowest_ms: float) -> None:
    twelve(rek, people=3)
    rek.open()
    figure = delays(load_study(rek.folder), lowest={"different": lowest_ms})
    marks = [line for axes in figure.axes for line in axes.lines if str(line.get_gid()).endswith("-lowest")]
    (mark,) = marks
    assert np.asarray(mark.get_xdata()).tolist() == [lowest_ms, lowest_ms]
    assert mark.get_gid() == "item1-lowest"
    assert f"≤ {lowest_ms:g}" in texts(figure, "item1")


def test_of_many_participants_some_are_drawn_and_the_median_is_of_all() -> None:
    values = np.tile(np.array([1.0, 2.0, 3.0]), (500, 1))
    values[::2] += 1
    look = Look("Answers", [], ["n = 500"], style.PRINT_FONTS)
    figure = answer_figures.draw_answers([("Harder", values)], [0.0, 100.0, 200.0], [None], "", look).figure
    gids = {str(line.get_gid()): line for line in figure.axes[0].lines}
    drawn = [gid for gid in gids if "participant" in gid]
    assert len(drawn) == answer_figures.MOST_LINES
    assert {"item1-participant1", "item1-participant500"} <= set(drawn)
    assert np.asarray(gids["item1-median"].get_ydata()).tolist() == [1.5, 2.5, 3.5]
    assert answer_figures.line_words(500) == "60 of the 500 participants, evenly chosen in the order of their ids"
    assert answer_figures.line_words(60) == "participants"


def words(figure: Figure) -> list[str]:
    return [text.get_text() for text in shown(figure)]


def shown(figure: Figure) -> list[Text]:
    return [text for text in figure.findobj(Text) if text.get_text().strip() and text.get_visible()]


def panel(figure: Figure, name: str) -> Axes:
    return next(axes for axes in figure.axes if axes.get_label() == name)


def segments(axes: Axes, row: int) -> dict[int, tuple[float, float, str]]:
    """Level → left edge, width, colour of the bars of a row (from 1)."""
    found = {}
    for patch in axes.patches:
        match = re.fullmatch(rf".*-row{row}-level(\d)", patch.get_gid() or "")
        if match:
            found[int(match[1])] = (patch.get_x(), patch.get_width(), to_hex(patch.get_facecolor()))
    return found


def gids(axes: Axes, ending: str) -> list:
    return [artist for artist in axes.get_children() if re.fullmatch(rf".*-{ending}", artist.get_gid() or "")]


def by_person(results: Results, levels: list[int]) -> None:
    for number, level in enumerate(levels, start=1):
        results.add(f"P{number:03d}", lambda condition, item, level=level: level)


def test_measures_of_reaches_have_a_scale_each() -> None:
    values = np.array([[0.8, 0.9, 1.0], [0.85, np.nan, 1.1]])
    look = Look("Motion", [], ["n = 2"], style.PRINT_FONTS)
    plots = [("Time, s", values), ("Flat", np.ones((2, 3)))]
    first, second = answer_figures.draw_answers(
        plots, [0.0, 100.0, 200.0], [None, None], "", look, own_scales=True
    ).figure.axes
    gids = {str(line.get_gid()): line for line in first.lines}
    assert np.asarray(gids["item1-participant1"].get_ydata()).tolist() == [0.8, 0.9, 1.0]
    assert np.asarray(gids["item1-median"].get_ydata()).tolist() == pytest.approx([0.825, 0.9, 1.05])
    low, high = first.get_ylim()
    assert low < 0.8
    assert high > 1.1
    assert [tick.get_text() for tick in second.get_yticklabels()] == ["1"]
    assert second.get_ylim() == (0.5, 1.5)
