"""Cases through the Falcon's driver: what drives the grip, what is measured there, and what is called unstable."""

import dataclasses
import math

import numpy as np
import pytest
from click.testing import CliRunner

from study_app import cli
from study_app.validation.stability import driver_loop
from study_app.validation.stability.driver_loop import BEYOND_SCRIPTED_J, judge_driven
from study_app.validation.stability.stability_cases import Case, parse
from study_app.validation.stability.stability_report import in_words
from tests.haptics.scenes import COMPILED

if not COMPILED:
    pytest.skip("the servo and its devices exist compiled only", allow_module_level=True)

RELEASE = Case(plant="falcon", liquid="light_oil", hand="lets-go", motion="sine", speed_mps=0.37699, release_s=0.7875)


@pytest.mark.parametrize("phase", range(4))
def test_driver_gives_out_no_more_than_the_scripted_device(phase):
    case = dataclasses.replace(RELEASE, release_s=0.6 + phase / 8)
    verdict = judge_driven(case)
    assert verdict.stable, verdict
    assert verdict.balance_j >= verdict.permitted_j


@pytest.mark.slow
def test_driver_that_lets_go_slowly_gives_out_too_much(monkeypatch):
    """The motors go on with what they push for 5 ms."""
    follow = driver_loop.falcon_trace

    def slow(case, falcon):
        trace = follow(case, falcon)
        trace.acting_n[5:] = trace.acting_n[:-5].copy()
        return trace

    monkeypatch.setattr(driver_loop, "falcon_trace", slow)
    case = dataclasses.replace(RELEASE, speed_mps=0.75398, liquid="honey", release_s=0.6625)
    assert judge_driven(case).reasons == ("energy",)


def trembling(trace):
    trace.sent_n[:, 1] += 0.2 * np.sin(2 * np.pi * 100 * trace.t_s)


def lost(trace):
    trace.position_m[100] = math.nan


@pytest.mark.parametrize(("spoil", "reason"), [(trembling, "force"), (lost, "not finite")])
def test_force_that_trembles_and_position_that_is_no_number_are_unstable(monkeypatch, spoil, reason):
    follow = driver_loop.falcon_trace

    def spoilt(case, falcon):
        trace = follow(case, falcon)
        spoil(trace)
        return trace

    monkeypatch.setattr(driver_loop, "falcon_trace", spoilt)
    assert judge_driven(RELEASE).reasons == (reason,)


def test_command_judges_a_case_through_the_driver():
    line = "plant=falcon liquid=light_oil hand=lets-go motion=sine speed_mps=0.37699 release_s=0.7875"
    ran = CliRunner().invoke(cli.commands, ["stability", "--case", line], standalone_mode=False)
    assert ran.exception is None
    case, on = ran.stdout.splitlines()
    assert parse(case) == RELEASE
    assert on == in_words(judge_driven(RELEASE))
    assert "with the scripted device" in on
    assert RELEASE.release_s > 0.6
    assert -judge_driven(RELEASE).permitted_j > BEYOND_SCRIPTED_J
