"""A study of dampers felt along a paced swing: rehearsed, computed again, evaluated."""

from pathlib import Path

import numpy as np
import pytest

from study_app.haptics.model.layout import LIMITER_FADE
from study_app.protocol.load import load
from study_app.protocol.trials.tasks import Follow
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.files.folders import StudyFolder
from study_app.store.recordings import read_samples
from tests.compiled import needs_servo
from tests.protocol.edited_studies import text_of
from tests.store.forging import secret_of

pytestmark = [pytest.mark.slow, needs_servo]


@pytest.fixture(scope="module")
def study_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("dampers") / "dampers.toml"
    path.write_text(text_of("dampers"), encoding="utf-8", newline="\n")
    return path


@pytest.fixture(scope="module")
def results(study_file: Path) -> Path:
    return rehearse(study_file, participants=2, seed=1, results=study_file.parent / "results")


def test_the_hand_keeps_the_pace_and_feels_a_damper_faded_in_over_300_ms(study_file: Path, results: Path) -> None:
    protocol = load(study_file)
    task = protocol.tasks["stir"]
    assert isinstance(task, Follow)
    dampings = set()
    for session in StudyFolder(results).sessions():
        # The first trial begins within the fade of the start.
        for path in sorted(session.path.glob("recordings/trial-00[2-4].parquet")):
            samples = read_samples(path, secret_of(path))
            samples = samples[samples.scene != 0]
            since_s = (samples.time_ns - samples.time_ns[0]) * 1e-9
            force_n, velocity_mps = samples.force_n, samples.velocity_mps / protocol.scene.scale
            b_nspm = -np.sum(force_n * velocity_mps) / np.sum(velocity_mps**2)
            assert force_n == pytest.approx(-b_nspm * velocity_mps, abs=1e-3)
            dampings.add(round(float(b_nspm), 2))
            is_judged = (since_s >= task.lead_s) & (since_s <= task.limit_s)
            rms_mps = np.sqrt(np.mean(np.sum(velocity_mps[is_judged] ** 2, axis=1)))
            assert rms_mps == pytest.approx(task.rms_speed_mps, rel=0.1)
            faded_s = since_s[samples.limiters & LIMITER_FADE != 0]
            assert faded_s.max() == pytest.approx(0.3, abs=0.01)
    assert dampings == {4.0, 16.0}
