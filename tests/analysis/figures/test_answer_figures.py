from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from study_app import figure_style as style
from study_app.analysis.figures import answer_figures, captions
from study_app.analysis.tables.study_tables import load_study
from tests.analysis.conftest import CANNOT_JUDGE, Answer, Results, twelve
from tests.analysis.figures.drawn import by_person, gids, panel, segments, shown, words

pytestmark = pytest.mark.slow


def test_disagreement_ends_and_agreement_begins_at_the_line_and_neutral_stands_apart(rek: Results) -> None:
    by_person(rek, [1, 2, 2, 3, 4, 4, 5, 6, 6, 6, 7])
    axes = panel(answer_figures.liquids(load_study(rek.folder)), "L1")
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
    blinded = words(answer_figures.liquids(load_study(rek.folder)))
    assert [word for word in blinded if word in ("L1", "L2", "L3", "Water", "Honey", "Light oil")] == ["L1", "L2", "L3"]
    assert "Blinded: by code" in blinded
    rek.open()
    opened = words(answer_figures.liquids(load_study(rek.folder)))
    assert [word for word in opened if word in ("L1", "L2", "L3", "Water", "Honey", "Light oil")] == [
        "Water",
        "Honey",
        "Light oil",
    ]
    assert "Blinded: by code" not in opened


@pytest.mark.parametrize("draw", [answer_figures.liquids, answer_figures.delays])
def test_simulated_participants_are_called_so_in_the_heading_and_real_ones_are_not(
    rek: Results, small: Results, draw, tmp_path: Path
) -> None:
    by_person(rek, [4])
    assert "SIMULATED participants" in words(draw(load_study(rek.folder)))


def test_a_row_with_missing_answers_tells_its_own_n(small: Results) -> None:
    small.add("A", lambda condition, item: 3 if item == "smooth" else CANNOT_JUDGE)
    small.add("B", lambda condition, item: 5)
    study = load_study(small.folder)
    figure = answer_figures.liquids(study)
    assert words(figure).count("n 2") == 2
    assert "n = 2 participants, 4 missing" in words(figure)
    told = captions.caption(study, study.blocks[0])
    assert "n = 2 participants, 4 presentations of a setting, 4 of 16 ratings missing" in told
    assert "Cannot judge: 4; not answered: 0." in told


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
    axes = panel(answer_figures.delays(load_study(rek.folder)), "item1")
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


def test_blinded_delays_are_dots_by_code_in_code_order_without_lines(rek: Results) -> None:
    by_person(rek, [2, 2, 2, 5])
    axes = panel(answer_figures.delays(load_study(rek.folder)), "item1")
    codes = [f"D{number}" for number in range(1, 8)]
    assert [label.get_text() for label in axes.get_xticklabels()] == codes
    for place, code in enumerate(codes):
        (dots,) = gids(axes, code)
        assert dots.get_linestyle() == "None"
        assert len(dots.get_xdata()) == 4
        assert np.abs(np.asarray(dots.get_xdata()) - place).max() < 0.5
        assert sorted(np.round(dots.get_ydata())) == [2, 2, 2, 5]
    grid = [line for line in axes.lines if len(line.get_xdata()) == 2 and list(line.get_xdata()) == [0, 1]]
    assert [
        line for line in axes.lines if line not in grid and line.get_linestyle() != "None" and len(line.get_xdata()) > 1
    ] == []


def test_a_missing_answer_breaks_a_line_and_shows_in_n(rek: Results) -> None:
    by_person(rek, [3, 4])
    code = rek.code("delay_75", "delays")
    path = rek.responses("P002")
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(line for line in lines if f",{code},harder," not in line))
    rek.open()
    axes = panel(answer_figures.delays(load_study(rek.folder)), "item2")
    assert [np.isnan(line.get_ydata()).sum() for line in gids(axes, r"participant\d+")] == [0, 1]
    assert "n 1–2" in [text.get_text() for text in axes.texts]


@pytest.mark.parametrize("fonts", [style.screen_fonts(), style.PRINT_FONTS], ids=["screen", "print"])
@pytest.mark.parametrize("opened", [pytest.param(False, marks=pytest.mark.nightly), True], ids=["blinded", "opened"])
@pytest.mark.parametrize("people", [pytest.param(1, marks=pytest.mark.nightly), 30])
def test_no_text_leaves_the_figure_or_touches_another(rek: Results, fonts, opened: bool, people: int) -> None:
    twelve(rek, people=people)
    if opened:
        rek.open()
    study = load_study(rek.folder)
    for figure in (answer_figures.liquids(study, fonts=fonts), answer_figures.delays(study, fonts=fonts)):
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
