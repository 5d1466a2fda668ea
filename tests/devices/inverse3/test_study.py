"""The thesis' study on an emulated Inverse3, through all of its driver: the same session as on the scripted hand."""

import json
from typing import Any

import numpy as np
import pytest

from study_app.devices import scripted
from study_app.devices.simulated.hand_commands import HandOrders
from study_app.store.folders import StudyFolder
from study_app.store.verification.verify_study import verify
from tests.compiled import needs_servo
from tests.devices.rehearsed import (
    MAY_DIFFER,
    POSITION,
    assert_every_trial_is_valid_and_simulated,
    assert_mean_forces_agree,
    recordings_of,
    rehearse_on_both,
    table,
)

pytestmark = [pytest.mark.nightly, needs_servo, pytest.mark.slow]

COUNT_M = scripted.QUANTUM_M
LEAD_S = 0.5
LOOK_S = 0.1
"""How often the simulated participant looks: a target reached within a count of its edge may be seen a look later."""
LOOKS_S = 5 * LOOK_S


def follow_from_here(hand: HandOrders, t_s: Any, position_m: Any) -> None:
    """Follow a path, but come onto it from where the hand is: a tied hand would leap, and the force with it."""
    times, places = np.asarray(t_s, np.float64), np.asarray(position_m, np.float64)
    share = np.clip((times - times[0]) / LEAD_S, 0.0, 1.0)
    left = 1.0 - share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    FOLLOW(hand, times, places + left[:, np.newaxis] * (np.array(hand.aim_m) - places[0]))


FOLLOW = HandOrders.follow


@pytest.fixture(scope="module")
def tied(tmp_path_factory: pytest.TempPathFactory) -> list[StudyFolder]:
    return rehearse_on_both(tmp_path_factory, "inverse3-emulated", follow=follow_from_here)


def same(column: str, one: str, other: str) -> bool:
    """Return whether two cells agree: times within some looks, numbers that follow from them within 2 %."""
    try:
        difference = abs(float(one) - float(other))
    except ValueError:
        return one == other
    return difference <= (LOOKS_S if column.endswith("_s") else 0.02 * abs(float(one)))


@pytest.mark.parametrize("name", ["trials", "responses"])
def test_the_study_has_the_same_rows_as_on_the_scripted_hand(tied: list[StudyFolder], name: str) -> None:
    by_script, by_inverse3 = (table(folder, name) for folder in tied)
    assert len(by_script) == len(by_inverse3) > 10
    for one, other in zip(by_script, by_inverse3, strict=True):
        assert list(one) == list(other)
        for column in one.keys() - MAY_DIFFER:
            assert same(column, one[column], other[column]), (column, one[column], other[column])
        if name == "responses":
            assert abs(int(one["response"]) - int(other["response"])) <= 1


def test_the_study_verifies_and_its_receipt_has_the_settings(tied: list[StudyFolder]) -> None:
    folder = tied[1]
    assert verify(folder.path).errors == ()
    receipt = json.loads(folder.sessions()[0].receipt.read_text())["device"]
    assert receipt["name"] == "inverse3-emulated"
    assert receipt["service_settings"]["in_force"]["filters"]["force_gate"] == {"gain": 0.0}
    assert_every_trial_is_valid_and_simulated(folder)


def test_positions_are_those_of_the_path_a_tick_before_within_a_count(tied: list[StudyFolder]) -> None:
    alike = 0
    for by_script, by_inverse3 in recordings_of(tied):
        assert by_inverse3["fresh"].all()
        if len(by_script) != len(by_inverse3):
            assert abs(len(by_script) - len(by_inverse3)) <= 1000 * LOOK_S
            break  # from here on the same tremor meets another part of the path
        alike += 1
        off_m = np.abs(by_inverse3[POSITION].to_numpy()[1:] - by_script[POSITION].to_numpy()[:-1])
        assert off_m.max() <= COUNT_M  # half a count, and what 8 N move a tied hand
    assert alike >= 4


def test_forces_are_those_of_the_path_trial_by_trial(tied: list[StudyFolder]) -> None:
    assert_mean_forces_agree(tied)
