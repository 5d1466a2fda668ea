"""What each figure of the thesis states, asserted on the very runs that are drawn; then the files."""

import numpy as np
import pytest

from study_app.errors import StoreError
from study_app.evidence import thesis_figures
from study_app.evidence.thesis_figures import EXPONENTS, FIGURES, LENGTH, figure_3, figure_4, figure_5
from tests.haptics.scenes import COMPILED, WATER_FACTOR, vectors

pytestmark = pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")

INITIAL_N = WATER_FACTOR  # plain drag at 1 m/s


def size(vectors_n):
    """Return lengths (n,)."""
    return np.linalg.norm(vectors_n, axis=1)


def component_along(vectors_n, run):
    """Return the part (n,) of each vector along the motion."""
    return (vectors_n * run.motion.velocity_mps).sum(axis=1)


def force(run):
    """Return the force (n, 3) [N] of a run."""
    return vectors(run.table, "force")


def tick_of(figure, word):
    """Return the row of an event."""
    ((time_s, _),) = [event for event in figure.events if event[1] == word]
    return int(np.searchsorted(figure.runs[0].motion.t_s, time_s))


def test_figure_3_constant_force_against_the_motion_and_none_from_the_stop_on():
    figure = figure_3()
    (run,), stop = figure.runs, tick_of(figure, "stop")
    assert size(force(run))[:stop] == pytest.approx(INITIAL_N)
    assert component_along(force(run), run)[:stop] == pytest.approx(-INITIAL_N)
    assert run.motion.velocity_mps[stop - 1].any()
    assert not force(run)[stop:].any()


def test_figure_4_the_relative_speed_falls_linearly_and_the_force_as_its_square():
    figure = figure_4()
    (run,), stop = figure.runs, tick_of(figure, "stop")
    relative = size(run.motion.velocity_mps - vectors(run.table, "wake"))[:stop]
    slope, start = np.polyfit(np.arange(stop), relative, 1)
    assert (slope * LENGTH, start) == pytest.approx((-0.94, 1.0), abs=0.03)
    assert abs(slope * np.arange(stop) + start - relative).max() < 0.01
    assert size(force(run))[:stop] == pytest.approx(INITIAL_N * relative**2)
    assert (component_along(force(run), run)[:stop] < 0).all()


def test_figure_4_after_the_stop_a_push_along_the_former_motion_that_ends():
    figure = figure_4()
    (run,), stop = figure.runs, tick_of(figure, "stop")
    push = force(run)[stop:]
    assert push[0] @ run.motion.velocity_mps[stop - 1] == pytest.approx(size(push)[0])
    assert 0.85 * INITIAL_N < size(push)[0] < 0.95 * INITIAL_N
    assert (np.diff(size(push)) <= 1e-15).all()
    assert not push[LENGTH:].any()


def test_figure_5_a_jump_above_plain_drag_then_the_fall_after_the_stop():
    figure = figure_5()
    (run,), turn, stop = figure.runs, tick_of(figure, "turn back"), tick_of(figure, "stop")
    force_n = size(force(run))
    assert force_n[turn - 1] < 0.05 * INITIAL_N
    assert force_n[turn] > 3 * INITIAL_N
    assert (component_along(force(run), run)[turn : turn + 500] < 0).all()
    assert force_n[stop] < force_n[stop - 1]
    assert force_n[-1] == 0.0


@pytest.mark.slow
def test_figure_8_the_wake_fills_as_the_power_of_the_share_that_is_filled():
    runs = thesis_figures.figure_8().runs
    fill = np.arange(LENGTH + 1) / LENGTH
    reckoned = slice(LENGTH // 4, LENGTH)
    for run, exponent in zip(runs, EXPONENTS, strict=True):
        share = run.table.wake_x_mps[: LENGTH + 1]
        assert share[reckoned] == pytest.approx(fill[reckoned] ** exponent, rel=0.07)
        assert share[-1] == pytest.approx(0.94, abs=0.005)
        assert size(force(run))[: LENGTH + 1] == pytest.approx(INITIAL_N * (1 - share) ** 2)
    late = runs[-1].table
    assert abs(late.fx_n[2500]) > 0.85 * INITIAL_N
    assert abs(late.fx_n[4900]) < 0.05 * INITIAL_N
    halves = [int(np.argmax(run.table.wake_x_mps > 0.5)) for run in runs]
    assert halves == sorted(halves)


@pytest.mark.slow
def test_every_figure_has_its_number_title_and_caption():
    figures = [make() for make in FIGURES]
    assert [figure.number for figure in figures] == list(range(3, 3 + len(figures)))
    for figure in figures:
        drawn = thesis_figures.draw(figure)
        words = " ".join(text.get_text().replace("\n", " ") for text in drawn.texts)
        assert f"Fig. {figure.number}" in words
        assert figure.title in words
        assert figure.caption in words


def test_a_folder_that_cannot_be_is_named(tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8", newline="\n")
    with pytest.raises(StoreError, match=r"below cannot be written \(there is a file where .*choose another folder"):
        thesis_figures.figures(tmp_path / "file" / "below")
