"""Cases through the Falcon's driver: what drives the grip, and what is measured there."""

import dataclasses
from concurrent.futures import ThreadPoolExecutor

import pytest

from study_app.devices.emulators.falcon import EmulatedFalcon
from study_app.evidence.stability.stability_cases import Case
from study_app.evidence.stability.stability_report import verdicts_on
from tests.haptics.scenes import COMPILED

if not COMPILED:
    pytest.skip("the servo and its devices exist compiled only", allow_module_level=True)

RELEASE = Case(plant="falcon", liquid="light_oil", hand="lets-go", motion="sine", speed_mps=0.37699, release_s=0.7875)


@pytest.mark.parametrize("phase", range(4))
def test_driver_gives_out_no_more_than_the_scripted_device(phase):
    case = dataclasses.replace(RELEASE, release_s=0.6 + phase / 8)
    (verdict,) = verdicts_on(case)
    assert not verdict.reasons, verdict
    assert verdict.balance_j >= verdict.permitted_j


@pytest.mark.parametrize(("late_ticks", "reasons"), [(0, ()), (1, ("energy",))])
def test_a_release_in_honey_differs_by_chance_and_one_with_an_unreported_delay_does_not(
    late_ticks, reasons, monkeypatch
):
    """The released grip swings: 10 to 19 mJ with either device, depending on the tick of the release."""
    original_open = EmulatedFalcon.open

    def open_late(falcon):
        original_open(falcon)
        falcon.hand.state.handle.delay += late_ticks

    monkeypatch.setattr(EmulatedFalcon, "open", open_late)
    in_honey = dataclasses.replace(RELEASE, liquid="physical_honey", scale=3.0, speed_mps=0.75398, release_s=0.6625)
    with ThreadPoolExecutor(1) as executor:  # each thread opens its own Falcon
        (verdict,) = executor.submit(verdicts_on, in_honey).result()
    assert verdict.reasons == reasons, verdict
