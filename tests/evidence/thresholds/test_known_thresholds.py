"""Known thresholds are recovered, and an observer that is wrong is found."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.evidence.thresholds.known_thresholds import (
    KnownThreshold,
    StudyFound,
    known_threshold,
    simulate,
    spread,
    verdicts,
)
from study_app.evidence.thresholds.many_studies import judged, rehearsed
from study_app.protocol.load import load, parse
from study_app.protocol.simulated import OBSERVER, Comparison, Observer
from study_app.protocol.streams import stream
from study_app.protocol.trials.designs import default_design
from tests.compiled import needs_servo
from tests.protocol.trials.level_studies import text_of_damper

pytestmark = pytest.mark.slow

SMALL = text_of_damper(
    "small",
    """
[methods.short]
kind = "questplus"
trials = 20

[blocks.thicker]
stimulus = "damping"
design = "2ifc"
method = "short"
""",
)


@pytest.fixture(scope="module")
def one() -> KnownThreshold:
    return known_threshold("small", parse(SMALL.encode(), "small.toml"))


@pytest.fixture(scope="module")
def studies(one: KnownThreshold) -> list[StudyFound]:
    return [simulate(one, number, seed=1) for number in range(20)]


@pytest.mark.parametrize(
    ("delays", "standard", "threshold"),
    [(False, 8.0, 0.24), (False, 32.0, 0.24), (True, 0.0, 0.025), (True, 0.2, 0.025)],
)
def test_an_observer_is_correct_in_75_percent_at_the_known_threshold(
    delays: bool, standard: float, threshold: float
) -> None:
    attended = Comparison(delays, smallest=False, observer=replace(OBSERVER, lapses=0.0))
    comparison = standard + threshold if delays else standard * (1 + threshold)
    draw, design = stream(3, "observer").random, default_design("2ifc")
    n = 20_000
    correct = sum(attended.choose(design, [standard, comparison], 0.0, draw) == "second" for _ in range(n))
    assert correct / n == pytest.approx(0.75, abs=0.01)


def test_what_has_no_threshold_is_refused() -> None:
    with pytest.raises(ValueError, match="rek2024 has no main block"):
        known_threshold("rek2024", load("rek2024"))
    ran = CliRunner().invoke(commands, ["validate", "rek2024"])
    assert ran.exit_code == 2
    assert "nothing is known of it in advance" in ran.output


def test_studies_are_the_same_in_any_order_and_on_any_number_of_workers(
    one: KnownThreshold, studies: list[StudyFound]
) -> None:
    with ThreadPoolExecutor(2) as executor:
        again = list(executor.map(partial(simulate, one, seed=1), reversed(range(4))))
    assert again[::-1] == studies[:4]
    assert simulate(one, 0, seed=2) != studies[0]
    assert simulate(one, 1, seed=1) != studies[0]


def test_the_threshold_is_recovered(one: KnownThreshold, studies: list[StudyFound]) -> None:
    judged = {row.what: row for row in verdicts(one, studies)}
    assert {what for what, row in judged.items() if not row.holds} <= {
        "studies of 10 within ±15 %"
    }  # 20 trials are few
    assert one.threshold == 0.24
    assert 0.1 < spread(studies, 3) < 0.6
    assert spread(studies, 10) < spread(studies, 3)


@pytest.mark.nightly
@pytest.mark.slow
@needs_servo
def test_the_whole_program_recovers_it_and_another_observer_is_found(one: KnownThreshold) -> None:
    rows = list(judged(one, rehearsed(one, SMALL.encode(), seed=1), 0.25))
    assert [row.holds for row in rows] == [True, True, True], rows
    assert rows[0].what == "intervals delivered as requested"
    dull = replace(one, observer=Observer(weber_fraction=2.0))
    other = list(judged(dull, rehearsed(dull, SMALL.encode(), seed=1), 0.05))
    assert other[2].limit.startswith("2 ± 3 SD")
    assert not other[2].holds, "the levels end at 0.6"
