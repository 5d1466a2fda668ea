"""The thesis' study on the emulated device, through the driver's ticks: the same session as on the scripted hand."""

import json

import numpy as np
import pytest

from study_app.devices import scripted
from study_app.store.folders import StudyFolder
from study_app.store.verification.verify_study import verify
from tests.compiled import needs_servo
from tests.devices.rehearsed import (
    POSITION,
    assert_every_trial_is_valid_and_simulated,
    assert_mean_forces_agree,
    recordings_of,
    rehearse_on_both,
    table,
)

pytestmark = [pytest.mark.nightly, needs_servo, pytest.mark.slow]


@pytest.fixture(scope="module")
def studies(tmp_path_factory: pytest.TempPathFactory) -> list[StudyFolder]:
    return rehearse_on_both(tmp_path_factory, "force-dimension-emulated", exact=False)


def test_the_study_verifies_and_its_receipt_names_the_device(studies: list[StudyFolder]) -> None:
    assert verify(studies[1].path).errors == ()
    receipt = json.loads(studies[1].sessions()[0].receipt.read_text())["device"]
    assert (receipt["name"], receipt["system"]) == ("force-dimension-emulated", "emulated")
    assert_every_trial_is_valid_and_simulated(studies[1])


def test_responses_are_those_on_the_scripted_hand(studies: list[StudyFolder]) -> None:
    one, other = (table(folder, "responses") for folder in studies)
    assert len(one) == len(other) == 62
    for row, twin in zip(one, other, strict=True):
        assert row["item"] == twin["item"]
        assert abs(int(row["response"]) - int(twin["response"])) <= 1


def test_positions_are_the_same_within_a_count(studies: list[StudyFolder]) -> None:
    alike = 0
    for one, other in recordings_of(studies):
        places = [rows[POSITION].to_numpy() for rows in (one, other)]
        if len(places[0]) != len(places[1]):
            break  # a target was reached a look later: from here on the same tremor meets another part of the path
        alike += 1
        assert np.abs(places[0] - places[1]).max() <= 1.01 * scripted.QUANTUM_M
    assert alike >= 4


def test_forces_are_the_same_trial_by_trial(studies: list[StudyFolder]) -> None:
    assert_mean_forces_agree(studies)
