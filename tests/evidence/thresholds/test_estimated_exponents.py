"""The exponent of magnitude estimation is known over the varied number and recovered."""

import pytest

from study_app.evidence.thresholds import estimated_exponents
from study_app.evidence.thresholds.estimated_exponents import (
    EXPONENT,
    ExponentsFound,
    KnownExponent,
    exponent_verdicts,
    found_of,
    simulate_estimates,
    spread_of_exponents,
)
from study_app.evidence.thresholds.many_studies import judged, known_value, rehearsed
from study_app.protocol.load import load, parse, source_bytes
from tests.compiled import needs_servo


@pytest.fixture(scope="module")
def one() -> KnownExponent:
    found = known_value("thickness", load("thickness"))
    assert isinstance(found, KnownExponent)
    return found


@pytest.fixture(scope="module")
def studies(one: KnownExponent) -> list[ExponentsFound]:
    return [simulate_estimates(one, number, seed=1) for number in range(12)]


def test_without_noise_the_known_exponent_is_found(one: KnownExponent, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(estimated_exponents, "ESTIMATE_NOISE", 1e-6)
    found = simulate_estimates(one, 0, seed=1, people=3)
    assert found.own == pytest.approx((EXPONENT,) * 3, abs=1e-5)


@pytest.mark.slow
def test_studies_recover_it_and_a_wrong_exponent_is_found(one: KnownExponent, studies: list[ExponentsFound]) -> None:
    judged = list(exponent_verdicts(one, studies))
    assert [row.what for row in judged] == ["exponent over viscosity_pa_s", "coverage of the group's 95 % intervals"]
    assert all(row.holds for row in judged), judged
    assert simulate_estimates(one, 0, seed=1) == studies[0] != simulate_estimates(one, 0, seed=2)
    steeper = [found_of([1.1 * value for value in found.own]) for found in studies]
    assert not next(iter(exponent_verdicts(one, steeper))).holds
    narrow = [ExponentsFound(found.own, found.mean, found.mean, found.mean) for found in studies]
    assert not list(exponent_verdicts(one, narrow))[1].holds
    assert spread_of_exponents(studies, 10) < spread_of_exponents(studies, 3) < 0.05


@pytest.mark.nightly
@pytest.mark.slow
@needs_servo
def test_the_whole_program_recovers_it() -> None:
    text = source_bytes("thickness").decode()
    for old, new in (
        ("levels = 9 ", "levels = 4 "),
        ("repetitions = 4", "repetitions = 2"),
        ("cycles = 4", "cycles = 1"),
    ):
        assert old in text
        text = text.replace(old, new)
    short = known_value("short", parse(text.encode(), "short.toml"))
    assert isinstance(short, KnownExponent)
    spread = spread_of_exponents([simulate_estimates(short, number, seed=1) for number in range(10)], 3)
    rows = list(judged(short, rehearsed(short, text.encode(), seed=1), spread))
    assert [row.holds for row in rows] == [True, True, True], rows
    assert rows[2].what == "exponent of 3 people"
