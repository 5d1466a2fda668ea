"""The share of force that passivity controller and slew limit withhold in quick motion."""

import itertools

import pytest
from click.testing import CliRunner

from study_app import cli
from study_app.cli.options import EXIT_FOUND
from study_app.validation.stability import withheld_force
from study_app.validation.stability.withheld_force import (
    MODES,
    MOST_AFTER,
    QUICK,
    SECONDS,
    SHAKEN,
    SHOWN_SHAKE,
    STROKES,
    Withheld,
    measure,
    report,
)
from tests.haptics.scenes import COMPILED

compiled = pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")


def row(liquid, quick=0.0, lasting=0.0, mode=MODES[0]):
    after = ((0.3, lasting, 0.0, 0.0), *[(0.0,) * SECONDS] * (len(QUICK) - 1))
    return Withheld(liquid, "ewma", mode, (*(0.0,) * (len(STROKES) - 1), quick), after)


@pytest.mark.slow
@compiled
def test_slow_strokes_lose_nothing_and_shares_lie_between_0_and_1():
    shares = measure(["syrup"])
    assert {(found.estimator, found.mode) for found in shares} == set(itertools.product(("ewma", "kalman"), MODES))
    for found in shares:
        assert found.strokes[0] == pytest.approx(0.0, abs=1e-3)
        assert all(0.0 <= share <= 1.0 for share in (*found.strokes, *sum(found.after, ())))


@pytest.mark.slow
@compiled
def test_a_second_after_the_hand_was_shaken_the_whole_force_arrives():
    """Under the rules before, up to 28 and 56 % are still withheld with `ewma`."""
    found = [one for one in measure(["light_oil", "physical_honey"]) if one.mode == SHAKEN]
    assert len(found) == 4
    assert max(one.after[QUICK.index(SHOWN_SHAKE)][0] for one in found) > 0.1
    assert all(one.lasting < MOST_AFTER for one in found)


def test_goals_are_judged_over_all_liquids_but_tar():
    met, not_met = row("honey", 0.05, 0.004), row("syrup", 0.051)
    assert met.met
    assert not not_met.met
    assert not row("syrup", 0.0, 0.005).met
    assert row("physical_tar", 0.9, 0.9).met
    assert row("honey", 0.9, 0.0, SHAKEN).met
    assert not row("honey", 0.0, 0.005, SHAKEN).met
    text = report((met, row("physical_tar", 0.9, 0.9)))
    assert "at most 5% in every stroke, tar aside: met (5.0%)" in text
    assert "from one second after a shake on, tar aside: met (0.4%)" in text
    assert "not met (5.1%)" in report((met, not_met))


def test_command_prints_the_table_and_ends_with_3_where_a_goal_is_missed(monkeypatch):
    for found, code in ((row("honey"), None), (row("honey", 0.5), EXIT_FOUND)):
        monkeypatch.setattr(withheld_force, "measure", lambda found=found, **_: (found,))
        ran = CliRunner().invoke(cli.commands, ["stability", "--withheld"], standalone_mode=False)
        assert ran.exception is None
        assert (ran.return_value or None) == code
        assert "honey" in ran.stdout
        assert "5 Hz ±30" in ran.stdout
