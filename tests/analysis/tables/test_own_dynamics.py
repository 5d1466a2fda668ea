"""The device's own dynamics, as receipts record what `devices bench` measured."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import butter, find_peaks, sosfiltfilt

from study_app.analysis.data import blocks
from study_app.analysis.data.blocks import OwnDynamics
from study_app.analysis.data.motion import Targets, performance, reaches, submovements
from study_app.analysis.data.study_tables import load_study, pool_sites
from study_app.errors import AnalysisError
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.blinded.blinding import open_events, read_key
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.journals.journal_events import TrialEnded
from study_app.store.unblinding import unblind
from tests.analysis.conftest import SAMPLE, Results, twelve
from tests.analysis.made_up import delays, study
from tests.compiled import needs_servo

BENCH = {"measured": "2026-11-21", "damping_nspm": [0.4, 0.5, 0.6], "friction_n": [0.1] * 3, "mass_kg": [0.2, 0.2, 0.5]}


@pytest.fixture
def sample(tmp_path: Path) -> StudyFolder:
    shutil.copytree(SAMPLE.path, tmp_path / "study")
    return StudyFolder(tmp_path / "study")


def record(study: StudyFolder, session: int, bench: dict[str, Any]) -> None:
    change(study, session, bench=bench)


def change(study: StudyFolder, session: int, **facts: Any) -> None:
    path = study.sessions()[session].receipt
    receipt = json.loads(path.read_text(encoding="utf-8"))
    receipt["device"] |= facts
    path.write_text(json.dumps(receipt), encoding="utf-8", newline="\n")


@pytest.mark.slow
def test_they_are_means_over_the_sessions_that_know_them(sample: StudyFolder) -> None:
    assert load_study(sample.path).own_dynamics is None
    record(sample, 0, BENCH)
    record(sample, 1, {**BENCH, "damping_nspm": [1.5] * 3})
    assert load_study(sample.path).own_dynamics == OwnDynamics(
        damping_nspm=pytest.approx(1.0),
        friction_n=pytest.approx(0.1),
        mass_kg=pytest.approx(0.3),
        sessions=2,
        of=len(sample.sessions()),
    )


def test_those_of_sites_are_weighted_by_their_sessions() -> None:
    measured_site, unmeasured_site = (
        replace(study(delays([0]), []), own_dynamics=own)
        for own in (OwnDynamics(damping_nspm=1, friction_n=2, mass_kg=3, sessions=1, of=2), None)
    )
    third = replace(measured_site, own_dynamics=OwnDynamics(damping_nspm=4, friction_n=5, mass_kg=9, sessions=2, of=2))
    assert pool_sites(
        Path("nowhere"), {"A": measured_site, "B": unmeasured_site, "C": third}, ()
    ).own_dynamics == OwnDynamics(damping_nspm=3, friction_n=4, mass_kg=7, sessions=3, of=0)


def test_a_session_whose_bench_lacks_a_value_is_not_included(sample: StudyFolder) -> None:
    record(sample, 0, {"measured": "2026-11-21"})
    (doubt,) = load_study(sample.path).doubts
    assert doubt.path == sample.sessions()[0].receipt
    assert (doubt.what.startswith("is missing or damaged"), doubt.used) == (True, False)


TABLE: dict[str, Any] = {
    "alpha": 0.01,
    "equivalence_bound": 0.5,
    "primary": ["a"],
    "names": [],
    "rising": ["a"],
    "falling": ["b"],
    "noticed": None,
}


def test_a_table_binds_and_its_absence_or_change_does_not() -> None:
    decided = blocks.read_decided([TABLE, TABLE])
    assert (decided.binding, decided.alpha, decided.equivalence_bound) == (True, 0.01, 0.5)
    assert [decided.is_primary(item) for item in "ab"] == [True, False]
    assert [decided.direction(item) for item in "abc"] == ["increasing", "decreasing", None]
    assert blocks.read_decided([{**TABLE, "primary": []}]).is_primary("b")
    for tables in ([None], [None, TABLE], [TABLE, None], [TABLE, {**TABLE, "alpha": 0.05}]):
        assert not blocks.read_decided(tables).binding
        assert not blocks.read_decided(tables).is_primary("a")


def test_a_receipt_that_does_not_say_it_is_refused() -> None:
    with pytest.raises(AnalysisError, match="a receipt does not contain the decisions"):
        blocks.read_decided([{"alpha": 0.05}])


@pytest.mark.slow
def test_the_key_holds_which_statement_is_right_for_which_liquid(rek: Results) -> None:
    twelve(rek, people=1)
    study = load_study(rek.folder)
    assert study.decided.names == ("like_honey", "like_water", "like_slime", "like_oil", "like_tar")
    assert {setting.label for block in study.blocks for setting in block.settings} == {None}
    rek.open()
    (liquids, delays) = load_study(rek.folder).blocks
    assert [setting.label for setting in liquids.settings] == ["like_water", "like_honey", "like_oil"]
    assert {setting.label for setting in delays.settings} == {None}


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


def test_a_ball_that_leaves_the_target_overshoots_and_must_enter_it_again() -> None:
    times, positions = line((0, -30), (0.6, -30), (1.2, 45), (1.8, 45), (2.2, 30), (3.0, 30))
    _, second = reaches(times, positions, TWO)
    assert second.overshoot_mm == pytest.approx(9.0)
    assert second.path_mm == pytest.approx(75 + 9, abs=0.2)
    assert second.movement_time_s == pytest.approx(1.8 + 0.4 * 9 / 15 - 0.5, abs=0.002)
    assert second.submovements == 2


@pytest.mark.parametrize(
    ("samples", "rate_hz", "found"),
    [(1000, 1000, 3), (32, 40, 3), (31, 40, 1), (52, 20.4, 3), (41, 20, 1)],
    ids=["peaks", "shortest", "too short", "slowest", "too slow"],
)
def test_peaks_of_speed_are_counted_where_enough_samples_are_fast_enough(
    samples: int, rate_hz: float, found: int
) -> None:
    seconds = 10.0 + np.arange(samples) / rate_hz
    speed = np.sin(3 * np.pi * np.linspace(0, 1, samples)) ** 2 + 0.01
    positions = np.zeros((samples, 3))
    positions[:, 1] = np.cumsum(speed) / rate_hz
    assert submovements(seconds, positions) == found


@pytest.mark.parametrize("rate_hz", [24.0, 125.0, 1000.0, 4000.0])
def test_speed_is_filtered_with_a_butterworth_low_pass_at_10_hz(rate_hz: float) -> None:
    draws = np.random.default_rng(4)
    design = butter(2, 10, fs=rate_hz, output="sos")
    counts = []
    for _ in range(20):
        seconds = np.arange(round(2 * rate_hz)) / rate_hz
        velocities = np.stack([np.interp(seconds, np.linspace(0, 2, 60), draws.normal(size=60)) for _ in "xyz"], axis=1)
        positions = velocities.cumsum(axis=0) / rate_hz
        speed = np.linalg.norm(np.gradient(positions, seconds, axis=0), axis=1)
        smooth = sosfiltfilt(design, speed)
        counts.append(max(1, len(find_peaks(smooth, prominence=0.1 * smooth.max())[0])))
        assert submovements(seconds, positions) == counts[-1]
    assert len(set(counts)) > 3


def test_a_short_dwell_does_not_count_as_a_reach() -> None:
    assert reaches(*line((0, -30), (0.4, -30), (0.6, 30), (1.0, 30)), TWO) == ()
    assert reaches(np.zeros(0, np.int64), np.zeros((0, 3)), TWO) == ()


@pytest.mark.nightly
@pytest.mark.slow
@needs_servo
def test_reaches_are_those_of_the_session_and_missing_recordings_are_reported(tmp_path: Path) -> None:
    folder = rehearse("rek2024", participants=1, seed=3, results=tmp_path / "rek2024")
    (session,) = StudyFolder(folder).sessions()
    sealed = (session.path / "recordings" / "trial-008.parquet").read_bytes()
    unblind(folder, by="AB", reason="a test")
    ended = {
        line.trial: line
        for line in open_events(journal.read(session.journal), read_key(folder))
        if isinstance(line, TrialEnded)
    }
    study = load_study(folder)
    progress_calls: list[tuple[int, int]] = []
    measured = performance(study, lambda done, total: progress_calls.append((done, total)))
    assert (measured.trials, measured.recorded, measured.unread) == (7, 7, ())
    assert progress_calls == [(done_count, 7) for done_count in range(7)]
    for trial in measured.reached:
        decided = ended[trial.trial].reached_s
        assert len(decided) == ended[trial.trial].others["targets_reached"] > 3
        assert [reach.reached_s for reach in trial.found] == pytest.approx(decided[1:], abs=1e-6)
        assert trial.valid is True
    times = [measure.median or 0.0 for measure in measured.moved if measure.measure == "movement_time_s"]
    assert len(times) == 7
    assert times[0] < times[-1]  # the simulated hand waits for the picture

    (session.path / "recordings" / "trial-006.parquet").unlink()
    (session.path / "recordings" / "trial-007.parquet").write_bytes(b"PAR1")
    (session.path / "recordings" / "trial-008.parquet").write_bytes(sealed)
    less = performance(load_study(folder))
    assert (less.trials, less.recorded) == (7, 4)
    assert less.unread == (
        "1 × the recording is missing from the folder",
        "1 × the recording is damaged (liquid-study verify shows which one)",
        "1 × the recording is sealed (liquid-study unblind unseals it)",
    )
