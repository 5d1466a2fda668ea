"""The thesis' study on the emulated device, through the driver's ticks: the same session as on the scripted hand."""

from __future__ import annotations

import csv
import json
from typing import Any

import numpy as np
import pyarrow.parquet
import pytest

from study_app.devices import scripted
from study_app.session.simulated import rehearsal
from study_app.store.blinded.unblinding import unblind
from study_app.store.folders import StudyFolder
from study_app.store.verification.verify_study import verify
from tests.compiled import needs_servo

pytestmark = [pytest.mark.nightly, needs_servo, pytest.mark.slow]

STUDY = "rek2024"
POSITION = [f"position_{axis}_m" for axis in "xyz"]


def table(folder: StudyFolder, name: str) -> list[dict[str, str]]:
    with folder.sessions()[0].table(STUDY, name).open(newline="", encoding="utf-8") as lines:
        return list(csv.DictReader(lines))


@pytest.fixture(scope="module")
def studies(tmp_path_factory: pytest.TempPathFactory) -> list[StudyFolder]:
    """Return the study on either device with the same seed, and a hand that hardly any force moves off its path."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LIQUID_STUDY_CONFIG", str(tmp_path_factory.mktemp("settings")))
        patch.setattr(scripted, "STIFFNESS_NPM", 1e6)
        patch.setattr(scripted, "DAMPING_NSPM", 2e3)
        folders = []
        for device in ("scripted", "force-dimension-emulated"):
            folder = tmp_path_factory.mktemp("results") / device
            rehearsal.rehearse(STUDY, participants=1, seed=3, device=device, results=folder)
            unblind(folder, "AB", "to compare what was measured")
            folders.append(StudyFolder(folder))
    return folders


def recordings(folder: StudyFolder) -> list[Any]:
    session = folder.sessions()[0]
    return [pyarrow.parquet.read_table(session.path / row["recording"]) for row in table(folder, "trials")]


def test_the_study_verifies_and_its_receipt_names_the_device(studies: list[StudyFolder]) -> None:
    assert verify(studies[1].path).errors == ()
    receipt = json.loads(studies[1].sessions()[0].receipt.read_text())["device"]
    assert (receipt["name"], receipt["system"]) == ("force-dimension-emulated", "emulated")
    trials = table(studies[1], "trials")
    assert len(trials) == 12
    assert {(row["valid"], row["simulated"], row["outcome"]) for row in trials} == {("true", "true", "complete")}


def test_responses_are_those_on_the_scripted_hand(studies: list[StudyFolder]) -> None:
    one, other = (table(folder, "responses") for folder in studies)
    assert len(one) == len(other) == 62
    for row, twin in zip(one, other, strict=True):
        assert row["item"] == twin["item"]
        assert abs(int(row["response"]) - int(twin["response"])) <= 1


def test_positions_are_the_same_within_a_count(studies: list[StudyFolder]) -> None:
    alike = 0
    for one, other in zip(*map(recordings, studies), strict=True):
        places = [np.column_stack([rows[name] for name in POSITION]) for rows in (one, other)]
        if len(places[0]) != len(places[1]):
            break  # a target was reached a look later: from here on the same tremor meets another part of the path
        alike += 1
        assert np.abs(places[0] - places[1]).max() <= 1.01 * scripted.QUANTUM_M
    assert alike >= 4


def test_forces_are_the_same_trial_by_trial(studies: list[StudyFolder]) -> None:
    for row, twin in zip(*(table(folder, "trials") for folder in studies), strict=True):
        force_n = float(row["force_mean_n"])
        assert float(twin["force_mean_n"]) == pytest.approx(force_n, abs=max(0.05 * force_n, 0.05))
