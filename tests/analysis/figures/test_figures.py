import base64
import math
import struct
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from study_app import figure_style as style
from study_app.analysis import page_layout
from study_app.analysis.data.blocks import Block
from study_app.analysis.data.study_tables import Study, load_study
from study_app.analysis.figures import answer_figures
from study_app.analysis.page_layout import SMALL, Look, Picture, study_marks
from study_app.analysis.report import first_page, study_figures
from study_app.analysis.statistics.outcome import Interval
from study_app.analysis.statistics.thresholds import Threshold
from study_app.errors import AnalysisError
from study_app.protocol.participants import EACH_GROUP
from tests.analysis import made_up
from tests.analysis.conftest import HIDDEN, Results, twelve

pytestmark = pytest.mark.slow


def block_figure(study: Study, block: Block, fonts: tuple[str, ...] = ()) -> Figure:
    words = answer_figures.counts(study, block)
    look = Look(answer_figures.title(block), study_marks(study), words, fonts or style.fonts())
    return answer_figures.draw_block(study, block, {}, look).figure


def liquids(study: Study, **look: Any) -> Figure:
    return block_figure(study, study.blocks_of("liquids")[0], **look)


def delays(study: Study, **look: Any) -> Figure:
    return block_figure(study, study.blocks_of("delays")[0], **look)


def check_texts(figure: Figure) -> None:
    """Check that no text leaves the figure or touches another."""
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


def test_a_short_statement_leaves_room_for_the_title_of_the_counts(rek: Results) -> None:
    twelve(rek, people=5)
    rek.open()
    study = load_study(rek.folder)
    block = study.blocks_of("liquids")[0]
    check_texts(block_figure(study, replace(block, items=(replace(block.items[0], short="Wet"),))))


@pytest.mark.parametrize("fonts", [style.fonts(), style.FALLBACK_FONTS], ids=["screen", "print"])
@pytest.mark.parametrize("opened", [pytest.param(False, marks=pytest.mark.nightly), True], ids=["blinded", "opened"])
@pytest.mark.parametrize("people", [pytest.param(1, marks=pytest.mark.nightly), 30])
def test_no_text_leaves_the_figure_or_touches_another(rek: Results, fonts, opened: bool, people: int) -> None:
    twelve(rek, people=people)
    if opened:
        rek.open()
    study = load_study(rek.folder)
    for figure in (liquids(study, fonts=fonts), delays(study, fonts=fonts)):
        check_texts(figure)
        for text in figure.texts:
            if not text.get_text().startswith("n "):
                assert not any(text.get_window_extent().overlaps(axes.bbox) for axes in figure.axes), text.get_text()


def test_blinded_figures_contain_no_hidden_name(small: Results, tmp_path: Path) -> None:
    small.add("A", lambda *_: 3)
    for path in study_figures.plot(small.folder, tmp_path / "out"):
        content = path.read_bytes().lower()
        for word in HIDDEN:
            assert word.encode() not in content, path.name
    small.open()
    study_figures.plot(small.folder, tmp_path / "out")
    assert b">Lightquorn<" in (tmp_path / "out" / "liquids.svg").read_bytes()


def test_plot_without_a_completed_session_reports_it_and_writes_no_file(rek: Results, tmp_path: Path) -> None:
    rek.add("P001", lambda *_: 4, status="unfinished", trials=3)
    with pytest.raises(AnalysisError, match="P001 session 1 unfinished"):
        study_figures.plot(rek.folder, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_the_median_is_of_all_participants_even_if_only_some_are_drawn() -> None:
    values = np.tile(np.array([1.0, 2.0, 3.0]), (500, 1))
    values[::2] += 1
    look = Look("Answers", [], ["n = 500"], style.FALLBACK_FONTS)
    figure = answer_figures.draw_answers([("Harder", values)], [0.0, 100.0, 200.0], [None], "", look).figure
    gids = {str(line.get_gid()): line for line in figure.axes[0].lines}
    participant_lines = [gid for gid in gids if "participant" in gid]
    assert len(participant_lines) == answer_figures.MOST_LINES
    assert {"item1-participant1", "item1-participant500"} <= set(participant_lines)
    assert np.asarray(gids["item1-median"].get_ydata()).tolist() == [1.5, 2.5, 3.5]
    assert (
        answer_figures.line_text(500) == "60 of the 500 participants, selected at regular intervals from the sorted IDs"
    )
    assert answer_figures.line_text(60) == "participants"


def shown(figure: Figure) -> list[Text]:
    return [text for text in figure.findobj(Text) if text.get_text().strip() and text.get_visible()]


def test_the_threshold_has_its_curve_interval_and_shares_at_their_places() -> None:
    """The curve rises from 10 % to 70 % and passes 40 % at the threshold; nobody was asked at 40 ms."""
    threshold = Threshold(
        test="t", n=2, dropped=0, statistic_name="s", effect_name="e", effect=70.0, levels=(30, 40, 60, 130),
        yes=(1, 0, 4, 6), asked=(4, 0, 5, 8), width=20.0, guess=0.1, lapse=0.3,
        interval=Interval(low=55.0, high=90.0, level=0.95, method="b"),
    )  # fmt: skip
    people = {"A": {30.0: 0.0, 130.0: 1.0}, "B": {60.0: 0.5}}
    look = Look("Threshold", [], ["n = 2"], style.FALLBACK_FONTS)
    figure = answer_figures.draw_threshold(threshold, people, 60.0, look).figure
    check_texts(figure)
    (axes,) = figure.axes
    assert (axes.get_xlim(), axes.get_ylim()) == (pytest.approx((26.0, 134.0)), (-0.08, 1.08))
    points = {str(line.get_gid()): np.array(line.get_xydata()) for line in axes.lines}
    assert points["interval"].tolist() == [pytest.approx([55, 0.4]), pytest.approx([90, 0.4])]
    assert points["threshold"].tolist() == [pytest.approx([70, 0.4])]
    assert points["shares"].tolist() == [[30, 0.25], [60, 0.8], [130, 0.75]]
    assert points["lowest"][:, 0].tolist() == [60, 60]
    xs, ys = points["curve"].T
    assert (xs[0], xs[-1], np.interp(70, xs, ys)) == (30, 130, pytest.approx(0.4, abs=1e-3))
    for person, shares in people.items():
        away = points[f"person-{person}"] - np.array([*shares.items()])
        assert (np.abs(away) <= [10 / 4, 0.06]).all(), "delays are 10 ms apart or more"
    assert "70 ms [55, 90]" in {text.get_text() for text in axes.texts}
    assert replace(threshold, guess=None).half_way is replace(threshold, lapse=None).half_way is None


@pytest.mark.parametrize(
    ("counts", "missing", "room", "sides"),
    [
        ((6, 4, 2), (0, 0), 300.0, (90.0, 60.0, 30.0, 0.0)),
        ((1, 1, 1), (1, 0), 300.0, (32.0, 26.0, 27.0, 17.0)),
        ((1, 1, 1), (0, 1), 300.0, (32.0, 26.0, 27.0, 17.0)),
        ((20, 10, 12), (0, 0), 134.0, (60.0, 30.0, 36.0, 0.0)),
        ((20, 10, 12), (1, 0), 151.0, (60.0, 30.0, 36.0, 17.0)),
    ],
)
def test_an_answer_is_as_wide_as_fits_and_each_side_has_room_for_its_label(
    counts: tuple[int, int, int], missing: tuple[int, int], room: float, sides: tuple[float, ...]
) -> None:
    """An answer has at most 15 pt, and 3 pt in the narrow panels, which have a gap of 8 pt."""
    against, agree, neutral = counts
    unanswered, excluded = missing
    n = sum(counts)
    row = {f"count_{level}": 0 for level in range(1, 8)} | {"count_2": against, "count_6": agree, "count_4": neutral}
    row |= {"n": n, "presented": n + unanswered, "presented_excluded": excluded}
    fewer = dict.fromkeys(row, 0)
    widths = answer_figures._panel_widths([pd.DataFrame([fewer, row]), pd.DataFrame([fewer])], room)
    side_widths = (widths.left, widths.right, widths.neutral, widths.n)
    assert side_widths == pytest.approx(sides, rel=0.01)
    assert widths.total <= room


@pytest.mark.parametrize("beside", [False, True])
def test_a_png_is_shown_at_two_fifths_of_its_width_with_its_caption(beside: bool) -> None:
    png = b"\x89PNG\r\n\x1a\n" + struct.pack(">I4sII", 13, b"IHDR", 500, 300)
    html = first_page.picture(Picture(block="b", name="f", caption="Is <it> so?", files={"png": png}), beside=beside)
    caption = "" if beside else '<figcaption class="soft">Is &lt;it&gt; so?</figcaption>'
    assert html == (
        '<figure><img width="200" alt="Is &lt;it&gt; so?" src="data:image/png;base64,'
        f'{base64.b64encode(png).decode()}">{caption}</figure>'
    )


def test_an_svg_has_the_colours_of_the_page_and_its_size() -> None:
    """A figure of 210 pt has 1.9 pixels for a point and fills half of the width beside an answer."""
    svg = (
        '<?xml version="1.0"?><svg width="210pt" height="90pt" viewBox="0 0 210 90" id="a"><metadata>M</metadata>'
        f'<g fill="{style.ACCENT}" stroke="#FFFFFF"/><text fill="{style.TEXT}">t</text>'
        f'<text fill="#ffffff">{style.TEXT}</text></svg>'
    )
    picture = Picture(block="b", name="f", caption='A "b"', files={"svg": svg.encode()})
    assert first_page.picture(picture, beside=True) == (
        '<figure><svg role="img" aria-label="A &#34;b&#34;" style="width: 399px; --share: 50%; --least: '
        f'{math.ceil(11 / SMALL * 210)}px" viewBox="0 0 210 90" id="a">'
        '<g fill="var(--accent)" stroke="var(--paper)"/><text fill="var(--text)">t</text>'
        f'<text fill="#ffffff">{style.TEXT}</text></svg></figure>'
    )


@pytest.mark.parametrize(
    ("groups", "columns", "lines"),
    [
        (
            ["old", "new"],
            ["code", "participant", "value"],
            ["code participant group value", "L1 B new 5", "L2 A old 7"],
        ),
        (["old", "new"], ["participant", "group"], ["participant group", "B new", "A old"]),
        (["old", "new"], ["code", "value"], ["code value", "L1 5", "L2 7"]),
        ([None, None], ["participant", "value"], ["participant value", "B 5", "A 7"]),
    ],
)
def test_the_numbers_of_a_figure_have_the_group_after_each_participant(
    groups: list[str | None], columns: list[str], lines: list[str]
) -> None:
    case_study = made_up.study(made_up.liquids(1), [(who, 1, "L1", (4, 4)) for who in "AB"])
    case_study = replace(case_study, participants=case_study.participants.assign(group=groups))
    rows = pd.DataFrame({"code": ["L1", "L2"], "participant": ["B", "A"], "group": ["x", "y"], "value": [5, 7]})
    assert page_layout.tab_separated(case_study, rows[columns]).replace("\t", " ").splitlines() == lines


@pytest.mark.parametrize(
    ("shown", "split", "marks"),
    [
        ("simulated", "", [("SIMULATED participants", style.WARN, style.WARN_GROUND)]),
        ("pilot", EACH_GROUP, [("PILOT", style.WARN, style.WARN_GROUND)]),
        ("blinded", "", [("Blinded: conditions appear as codes", style.SEALED, style.SEALED_GROUND)]),
        ("", "experts", [("Only experts", style.SEALED, style.SEALED_GROUND)]),
    ],
)
def test_figures_carry_marks_that_limit_their_interpretation(
    shown: str, split: str, marks: list[tuple[str, str, str]]
) -> None:
    study = made_up.study(made_up.liquids(1), [("A", 1, "L1", (4, 4))])
    participants = study.participants.assign(simulated=shown == "simulated", pilot=shown == "pilot")
    settings = () if shown == "blinded" else study.settings
    study = replace(study, participants=participants, split=split, settings=settings)
    assert [(mark.words, mark.ink, mark.ground) for mark in study_marks(study)] == marks


def test_a_picture_has_its_own_title_participants_and_files(monkeypatch: pytest.MonkeyPatch) -> None:
    picture_study = replace(made_up.study(made_up.liquids(1), [(who, 1, "L1", (4, 4)) for who in "ABC"]), name="oils")
    monkeypatch.setattr(style, "file_bytes", lambda *arguments: arguments)

    def draw(look: Look) -> Any:
        return SimpleNamespace(figure=look)

    for counts, expected_words in ((None, ("three participants",)), (["n = 2"], ["n = 2"])):
        picture = page_layout.picture_of(
            picture_study, "b", "file", "Title", "Caption.", draw, ("svg", "pdf"), counts, "1"
        )
        look = Look("Title", study_marks(picture_study), expected_words, style.fonts())
        files: Any = {form: (look, form, "oils: Title") for form in ("svg", "pdf")}
        assert picture == Picture(block="b", name="file", caption="Caption.", files=files, title="Title", numbers="1")


def test_measures_of_reaches_have_a_scale_each() -> None:
    values = np.array([[0.8, 0.9, 1.0], [0.85, np.nan, 1.1]])
    look = Look("Motion", [], ["n = 2"], style.FALLBACK_FONTS)
    plots = [("Time, s", values), ("Flat", np.ones((2, 3)))]
    first, second = answer_figures.draw_answers(
        plots, [0.0, 100.0, 200.0], [None, None], "", look, own_scales=[values, np.ones((2, 3))]
    ).figure.axes
    gids = {str(line.get_gid()): line for line in first.lines}
    assert np.asarray(gids["item1-participant1"].get_ydata()).tolist() == [0.8, 0.9, 1.0]
    assert np.asarray(gids["item1-median"].get_ydata()).tolist() == pytest.approx([0.825, 0.9, 1.05])
    assert first.get_ylim() == pytest.approx((0.8 - 0.08 * 0.3, 1.1 + 0.08 * 0.3))
    assert [tick.get_text() for tick in second.get_yticklabels()] == ["1"]
    assert second.get_ylim() == (0.5, 1.5)
