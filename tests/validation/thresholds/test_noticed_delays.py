"""The rated and the detected delay of the same simulated people."""

from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.protocol.streams import stream
from study_app.protocol.trials.kinds import default_design
from study_app.session.simulated.design_observer import OBSERVER, Comparison
from study_app.validation.thresholds.noticed_delays import (
    CRITERIA_S,
    JND_S,
    MEAN_CRITERION_S,
    Compared,
    compare,
    markdown,
    people_of,
    rated,
)

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def found() -> Compared:
    return compare(40, 1)


def test_the_forced_choice_finds_the_planted_delay_and_the_rating_the_criterion(found: Compared) -> None:
    middle, low, high = found.detected_ms
    assert low < 1000 * JND_S < high
    assert middle == pytest.approx(1000 * JND_S, rel=0.1)
    plain = [one for one in found.rated if not one.adapted_s]
    thresholds = [float(one.found.effect or 0.0) for one in plain]
    assert thresholds == sorted(thresholds)
    for one, threshold in zip(plain, thresholds, strict=True):
        assert threshold == pytest.approx(1000 * one.criterion_s, abs=20)
        assert one.found.lower is not None
        assert one.found.lower > high
    assert [one.criterion_s for one in plain] == list(CRITERIA_S)


def test_adaptation_moves_the_rating_and_no_forced_choice(found: Compared) -> None:
    people = people_of(400, 2)
    before, after = (rated(people, MEAN_CRITERION_S, adapted, 2).found.effect for adapted in (0.0, 0.03))
    assert before is not None
    assert after is not None
    assert after - before == pytest.approx(30, abs=12)
    attended, design = Comparison(delays=True, smallest=False, observer=OBSERVER), default_design("2ifc")
    for seed in range(50):
        chosen = [
            attended.choose(design, [0.2 - shift, 0.22 - shift], 0.0, stream(seed, "x").random) for shift in (0.0, 0.03)
        ]
        assert chosen[0] == chosen[1]


def test_the_table_has_a_row_for_each_procedure_and_criterion(found: Compared) -> None:
    rows = [line for line in markdown(found).splitlines() if line.startswith("| ")][1:]
    assert len(rows) == 2 + len(CRITERIA_S)
    assert rows[0].startswith("| delaydetect: forced choice, 75 % correct | – | ")
    assert rows[-1].startswith("| rek2024: rating of “different”, half agree, adapted to 30 ms | 130 ms | ")
    nothing = replace(found.rated[0], found=replace(found.rated[0].found, effect=None, lower=None, upper=None))
    assert "| none | – |" in markdown(replace(found, rated=(nothing,)))


@pytest.mark.nightly
def test_the_command_writes_table_and_figure_the_same_each_time(tmp_path: Path) -> None:
    for to in ("one", "two"):
        result = CliRunner().invoke(commands, ["delay-thresholds", "--people", "8", "--to", str(tmp_path / to)])
        assert result.exit_code == 0, result.output
    names = {path.name for path in (tmp_path / "one").iterdir()}
    assert names == {f"delay-thresholds.{end}" for end in ("md", "txt", "png", "svg", "pdf")}
    for name in names:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
