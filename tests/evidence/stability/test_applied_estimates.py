"""Loops in which estimates are applied stay stable; one in which values jump does not."""

from typing import Any

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.evidence.stability import applied_estimates
from study_app.evidence.stability.applied_estimates import AppliedCase, evidence, judge_applied
from study_app.evidence.stability.stability_cases import parse
from study_app.lab.estimation.fits import DRAG
from tests.haptics.scenes import COMPILED

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")]

HELD = parse("liquid=dense scale=3 hand=middle speed_mps=0.3 motion=sine")


@pytest.mark.parametrize("factor", [0.4, 2.5])
def test_an_estimate_is_applied_in_a_stable_loop_which_stays_so(factor: float) -> None:
    found = judge_applied(AppliedCase(HELD, factor))
    assert found.stable_before
    assert found.reasons == {"estimated": (), "to and fro": ()}
    assert found.identified
    assert found.last["estimated"] == pytest.approx(0.47 * factor, rel=0.02)
    assert found.steps["to and fro"] > 20
    assert not found.harmed


def test_a_value_that_jumps_is_found_out(monkeypatch: Any) -> None:
    drags = iter([0.05, 9.0] * 500)
    monkeypatch.setattr(applied_estimates, "stepped", lambda *_words: {DRAG: next(drags)})
    found = judge_applied(AppliedCase(HELD, 1.0))
    assert found.harmed
    assert "force" in found.reasons["estimated"]
    assert f"unstable: factor=1 {HELD}" in evidence([found]).text


@pytest.mark.nightly
def test_the_command_prints_what_it_found() -> None:
    result = CliRunner().invoke(commands, ["stability", "--estimation", "3", "--workers", "1"])
    assert result.exit_code == 0, result.output
    assert "3 closed loops of the stability sweep" in result.output
    assert result.output.count("unstable 0 of 3") == 2
