"""Intervals of thresholds hold for people: published answers, one fit for each 200 trials."""

import pytest

from tests.benchmarks.analysis import people


@pytest.mark.slow
def test_the_interval_of_a_difference_holds_for_people_and_for_stationary_observers(capsys) -> None:
    assert people.main("2") == 0
    assert capsys.readouterr().out.splitlines()[-1].startswith(people.JUDGED)


@pytest.mark.slow
def test_without_a_spread_between_sessions_it_does_not(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    monkeypatch.setattr(people.analysis_grid, "__defaults__", (0.0,))
    assert people.main("1") == 3
