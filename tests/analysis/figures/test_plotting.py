"""Figures written as files: captions, exclusions, the same bytes each time, nothing hidden."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from study_app.analysis.figures import answer_figures, captions, plotting
from study_app.analysis.tables.study_tables import load_study
from study_app.errors import AnalysisError
from tests.analysis.conftest import HIDDEN, Results, twelve
from tests.analysis.figures.drawn import by_person, gids, panel, segments, words

pytestmark = pytest.mark.slow


@pytest.mark.nightly
def test_plot_writes_both_figures_in_three_forms_with_captions(rek: Results, tmp_path: Path) -> None:
    twelve(rek, people=3)
    written = plotting.plot(rek.folder, tmp_path / "new" / "out")
    assert sorted(path.name for path in written) == sorted(
        f"{name}.{kind}" for name in ("liquids", "delays") for kind in ("png", "svg", "pdf", "txt")
    )
    assert all(path.stat().st_size > 200 for path in written)
    caption = (tmp_path / "new" / "out" / "liquids.txt").read_text()
    assert "nine statements on three settings" in caption
    assert "SIMULATED" in caption
    assert "n = 3 participants" in caption
    assert {path.name for path in (tmp_path / "new" / "out").iterdir()} == {path.name for path in written}


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


def test_of_many_reasons_a_caption_tells_the_most_frequent(rek: Results) -> None:
    reasons = [*"abcdefg", "g"]
    for number, reason in enumerate(reasons, start=1):
        rek.add(f"P{number:03d}", lambda *_: 6)
        rek.exclude(f"P{number:03d}", reason=reason)
    rek.add("P009", lambda *_: 6)
    study = load_study(rek.folder)
    expected = "8 sessions are excluded (2 × g; 1 × a; 1 × b; 1 × c; 1 × d; 2 × other)."
    assert expected in captions.caption(study, study.blocks[0])


def test_an_excluded_trial_is_an_empty_cell_and_shows_in_n(rek: Results) -> None:
    by_person(rek, [3, 4])
    rek.exclude("P002", trial=rek.trial("P002", "delay_75"))
    rek.exclude("P002", trial=rek.trial("P002", "water"))
    rek.open()
    study = load_study(rek.folder)
    axes = panel(answer_figures.delays(study), "item2")
    assert [list(np.isnan(line.get_ydata())) for line in gids(axes, r"participant\d+")] == [
        [False] * 7,
        [delay == 75 for delay in (0, 50, 75, 100, 125, 150, 200)],
    ]
    assert "n 1–2" in [text.get_text() for text in axes.texts]
    figure = answer_figures.liquids(study)
    water = rek.code("water", "liquids")
    assert sorted(segments(panel(figure, water), 1)) == [3]
    assert words(figure).count("n 1") == len(study.blocks[0].items)


def test_the_caption_of_opened_delays_says_how_late_they_really_were(rek: Results) -> None:
    rek.add("P001", lambda *_: 4, changes={"delay_error_mean_ms": -2.25})
    rek.add("P002", lambda *_: 4, changes={"delay_error_mean_ms": 4.25})
    study = load_study(rek.folder)
    assert "achieved" not in captions.caption(study, study.blocks[1])
    rek.open()
    study = load_study(rek.folder)
    assert "by +1.0 ms on average (trials: −2.2 to +4.2 ms)" in captions.caption(study, study.blocks[1])


@pytest.mark.nightly
def test_the_same_results_give_the_same_bytes_in_another_process_too(rek: Results, tmp_path: Path) -> None:
    twelve(rek, people=2)
    first = {path.name: path.read_bytes() for path in plotting.plot(rek.folder, tmp_path / "first")}
    again = f"plot({str(rek.folder)!r}, {str(tmp_path / 'second')!r})"
    code = f"from study_app.analysis.figures.plotting import plot; {again}"
    subprocess.run(
        [sys.executable, "-W", "error", "-c", code], check=True, env={"PYTHONHASHSEED": "7", "HOME": str(tmp_path)}
    )
    assert {path.name: path.read_bytes() for path in (tmp_path / "second").iterdir()} == first


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
