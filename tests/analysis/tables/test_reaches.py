"""Reaches out of samples: against paths whose numbers are known, and against what the session itself decided."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from study_app.analysis.tables.performance import performance
from study_app.analysis.tables.reaches import Targets, path_length_m, reaches, submovements
from study_app.analysis.tables.study_tables import load_study
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.blinded.unblinding import unblind
from study_app.store.folders import StudyFolder
from tests.compiled import needs_servo

SAMPLE = Path(__file__).resolve().parents[3] / "results" / "sample-rek2024"
TWO = Targets(np.array([[-0.03, 0, 0], [0.03, 0, 0]]), 0.006, 0.5)


def line(*places_mm: tuple[float, float]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return a path along x through (seconds, mm), straight in between, 1000 samples a second."""
    seconds, places = np.array(places_mm).T
    times = np.arange(0, round(seconds[-1] * 1000) + 1)
    positions = np.zeros((len(times), 3))
    positions[:, 0] = np.interp(times / 1000, seconds, places) / 1000
    return times.astype(np.int64) * 1_000_000, positions


def test_a_straight_reach_has_the_numbers_of_its_line() -> None:
    times, positions = line((0, -30), (0.6, -30), (1.2, 30), (2.0, 30))
    first, second = reaches(times, positions, TWO)
    assert (first.target, first.lit_s, first.reached_s, first.movement_time_s) == (0, 0.0, 0.5, 0.0)
    assert (second.target, second.lit_s) == (1, 0.5)
    assert second.movement_time_s == pytest.approx(0.1 + 0.6 * 54 / 60, abs=0.002)
    assert second.reached_s == pytest.approx(second.lit_s + second.movement_time_s + 0.5, abs=0.002)
    assert second.path_mm == pytest.approx(54, abs=0.2)
    assert (second.overshoot_mm, second.submovements) == (0.0, 1)


def test_what_leaves_the_target_is_entered_anew_and_overshoots() -> None:
    times, positions = line((0, -30), (0.6, -30), (1.2, 45), (1.8, 45), (2.2, 30), (3.0, 30))
    _, second = reaches(times, positions, TWO)
    assert second.overshoot_mm == pytest.approx(9.0)
    assert second.path_mm == pytest.approx(75 + 9, abs=0.2)
    assert second.movement_time_s == pytest.approx(1.8 + 0.4 * 9 / 15 - 0.5, abs=0.002)
    assert second.submovements == 2


def test_a_dwell_that_is_too_short_is_no_reach() -> None:
    assert reaches(*line((0, -30), (0.4, -30), (0.6, 30), (1.0, 30)), TWO) == ()
    assert reaches(np.zeros(0, np.int64), np.zeros((0, 3)), TWO) == ()


def test_humps_of_speed_are_counted_and_noise_is_not() -> None:
    seconds = np.arange(1500) / 1000
    for humps in (1, 2, 3):
        speed = np.abs(np.sin(np.pi * humps * seconds / 1.5)) ** 2
        positions = np.zeros((1500, 3))
        positions[:, 0] = np.cumsum(speed) / 1e5
        quantum = np.rint(positions / 38e-6) * 38e-6
        assert submovements(seconds, positions) == humps
        assert submovements(seconds, quantum) == humps
    assert submovements(seconds[:20], np.zeros((20, 3))) == 1


def test_a_circle_has_the_length_of_its_circumference() -> None:
    angle = np.linspace(0, 2 * np.pi, 2001)
    assert path_length_m(np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)) == pytest.approx(2 * np.pi, 1e-5)


@pytest.mark.nightly
@pytest.mark.slow
@needs_servo
def test_reaches_are_those_that_the_session_decided_and_absent_recordings_are_told(tmp_path: Path) -> None:
    folder = rehearse("rek2024", participants=1, seed=3, results=tmp_path / "rek2024")
    unblind(folder, by="AB", reason="a test")
    (session,) = StudyFolder(folder).sessions()
    lines = [json.loads(text) for text in session.journal.read_text().splitlines()]
    study = load_study(folder)
    told: list[tuple[int, int]] = []
    measured = performance(study, lambda done, total: told.append((done, total)))
    assert (measured.trials, measured.recorded, measured.unread) == (7, 7, ())
    assert told == [(done, 7) for done in range(7)]
    for trial in measured.reached:
        decided = [one["t_task_s"] for one in lines if one["event"] == "target_reached" and one["trial"] == trial.trial]
        assert [reach.reached_s for reach in trial.found] == pytest.approx(decided[1:], abs=1e-9)
        assert trial.valid is True
    block = study.blocks_of("delays")[0]
    times = measured.by_participant(study.people, block, "movement_time_s")
    assert times.shape == (1, 7)
    assert times[0, 0] < times[0, -1]  # the simulated hand waits for the picture

    (session.path / "recordings" / "trial-006.parquet").unlink()
    (session.path / "recordings" / "trial-007.parquet").write_bytes(b"PAR1")
    less = performance(load_study(folder))
    assert (less.trials, less.recorded) == (7, 5)
    assert less.unread == (
        "1 × recording is not in the folder",
        "1 × recording is damaged (liquid-study verify says which)",
    )


@pytest.mark.slow
def test_without_recordings_there_are_measures_of_trials_alone(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(SAMPLE, tmp_path / "rek2024"))
    unblind(folder, by="AB", reason="a test")
    measured = performance(load_study(folder))
    assert (measured.recorded, measured.unread) == (0, ("84 × no recording was kept",))
    assert {one.measure for one in measured.moved} == {
        *("duration_s", "path_m", "force_mean_n", "force_peak_n", "at_limit_percent")
    }
    assert all(one.median is not None and one.n == 12 for one in measured.moved)
