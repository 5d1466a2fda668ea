"""The device's own dynamics, as receipts record what `devices bench` measured."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from study_app.analysis.results.level_results import OwnDynamics
from study_app.analysis.tables.study_tables import load_study
from study_app.errors import AnalysisError
from study_app.store.folders import StudyFolder

SAMPLE = Path(__file__).resolve().parents[3] / "results" / "sample-rek2024"
BENCH = {"measured": "2026-11-21", "damping_nspm": [0.4, 0.5, 0.6], "friction_n": [0.1] * 3, "mass_kg": [0.2, 0.2, 0.5]}


@pytest.fixture
def sample(tmp_path: Path) -> StudyFolder:
    shutil.copytree(SAMPLE, tmp_path / "study")
    return StudyFolder(tmp_path / "study")


def record(study: StudyFolder, session: int, bench: dict[str, Any]) -> None:
    change(study, session, bench=bench)


def change(study: StudyFolder, session: int, **facts: Any) -> None:
    path = study.sessions()[session].receipt
    receipt = json.loads(path.read_text(encoding="utf-8"))
    receipt["device"] |= facts
    path.write_text(json.dumps(receipt), encoding="utf-8")


@pytest.mark.slow
def test_they_are_means_over_the_sessions_that_know_them(sample: StudyFolder) -> None:
    assert load_study(sample.path).own_dynamics is None
    record(sample, 0, BENCH)
    record(sample, 1, {**BENCH, "damping_nspm": [1.5] * 3})
    assert load_study(sample.path).own_dynamics == OwnDynamics(
        pytest.approx(1.0), pytest.approx(0.1), pytest.approx(0.3), 2, len(sample.sessions())
    )


def test_a_bench_that_lacks_a_value_is_refused_with_the_receipt(sample: StudyFolder) -> None:
    record(sample, 0, {"measured": "2026-11-21"})
    with pytest.raises(AnalysisError, match="does not describe the session"):
        load_study(sample.path)


@pytest.mark.slow
def test_the_estimator_is_the_device_where_it_measured_its_velocity(sample: StudyFolder) -> None:
    assert load_study(sample.path).estimator == "ewma"
    change(sample, 0, estimator="device")
    assert load_study(sample.path).estimator == "ewma or device"
    for session in range(len(sample.sessions())):
        change(sample, session, estimator="device")
    assert load_study(sample.path).estimator == "device"
