"""Cases through the Falcon's driver: what drives the grip, and what is measured there."""

import dataclasses

import pytest

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
