"""Motions of the accuracy table, and its survey of liquids."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.errors import StudyError
from study_app.evidence.accuracy.comparison import accuracy
from study_app.evidence.accuracy.survey import PUBLISHED, Surveyed, survey_evidence, survey_scenes
from study_app.evidence.table import Evidence
from study_app.haptics.model.motion import Motion
from study_app.protocol.load import load_scenes
from tests.evidence.accuracy.scenes import TANK, compiled

pytestmark = pytest.mark.slow


@compiled
def test_a_motion_that_meets_no_force_is_refused():
    rest = Motion(np.arange(100) / 1000, np.zeros((100, 3)))
    with pytest.raises(StudyError, match="water does not exert a force along a rest"):
        accuracy(TANK, None, rest, named="a rest")


def test_a_motion_file_of_another_rate_is_brought_to_the_scenes(tmp_path, monkeypatch):
    rows = "\n".join(f"{k / 50},{k / 100},0,0" for k in range(21))
    (tmp_path / "slow.csv").write_text(f"t_s,x_m,y_m,z_m\n{rows}\n", encoding="utf-8", newline="\n")
    measured = []
    monkeypatch.setattr("study_app.evidence.accuracy.accuracy", lambda *arguments, **_: measured.append(arguments))
    monkeypatch.setattr("study_app.evidence.accuracy.accuracy_evidence", lambda _found: Evidence("", {}))
    words = ["accuracy", "rek2024", "--liquid", "water", "--path", str(tmp_path / "slow.csv"), "--to", str(tmp_path)]
    result = CliRunner().invoke(commands, words)
    assert result.exit_code == 0, result.output
    ((_, _, read, *_),) = measured
    assert read.t_s == pytest.approx(np.arange(401) / 1000)
    assert read.position_m[:, 0] == pytest.approx(read.t_s / 2)


CHOSEN = ("water", "honey", "olive_oil")


@pytest.fixture(scope="module")
def survey():
    scenes = load_scenes("physical2")
    return {it.liquid: it for it in survey_scenes({name: scenes[name] for name in CHOSEN})}


@pytest.mark.parametrize("name", PUBLISHED)
def test_a_published_law_is_stokes_drag_at_rest_and_a_spheres_at_its_end(name):
    """The bounds are those of the spheres' standard drag curve: C_d 1.09 at Re 100, 0.38 to 0.5 from Re 3000 on."""
    law = PUBLISHED[name]
    assert law(1e-9) == pytest.approx(1, abs=1e-5)
    assert law(100.0) * 24 / 100 == pytest.approx(1.09, rel=0.025)
    for reynolds in (3e3, 1e4, 1e5):
        assert 0.38 <= law(reynolds) * 24 / reynolds <= 0.5


@compiled
def test_each_liquid_is_compared_with_its_references(survey):
    assert list(survey) == ["honey", "olive_oil", "water"]
    honey, oil, water = survey.values()
    assert (honey.model, oil.model, water.model) == ("unsteady drag", "unsteady drag", "constant C_d + added mass")
    assert max(honey.creeping, oil.creeping) < 0.01
    assert 0 < honey.solver < 0.04
    assert 0 < honey.steady < 0.05
    assert honey.solver_reynolds[0] == pytest.approx(0.3, rel=0.05)
    assert honey.solver_reynolds[1] == pytest.approx(honey.reynolds, rel=1e-3)
    assert (oil.solver, water.solver, water.creeping) == (None, None, None)
    assert water.reynolds == pytest.approx(998.2 * 0.6 * 0.068 / 1.0016e-3, rel=1e-3)
    for it in survey.values():
        assert it.expected.causes.law < 0.08
        assert 0.04 < it.expected.error_share < 0.16 + it.expected.causes.limits
        assert it.expected.cost_ns > 0


def made_up_survey(name: str, model: str, **keys: Any) -> Surveyed:
    """Return a liquid with 2 m/s at a Reynolds number of 40, and an own value for each column."""
    expected: Any = SimpleNamespace(causes=SimpleNamespace(law=0.021), error_share=0.173, cost_ns=187.4)
    values: dict[str, Any] = {"creeping": 0.011, "steady": 0.12, "solver": 0.034, "solver_reynolds": (1.5, 27.0)}
    return Surveyed(
        liquid=name, speed_mps=2.0, mps_per_reynolds=0.05, model=model, expected=expected, **values | keys
    )  # fmt: skip


def test_each_column_of_the_survey_has_its_own_value() -> None:
    thick = made_up_survey("syrup", "unsteady drag")
    thin = made_up_survey(
        "water", "drag", creeping=None, steady=None, solver=None, solver_reynolds=(math.nan, math.nan)
    )
    lines = [line.split(" | ") for line in survey_evidence((thick, thin)).text.splitlines() if line.startswith("| ")]
    ratios = [law(40.0) for law in PUBLISHED.values()]
    spread = f"{100 * (max(ratios) - min(ratios)) / np.mean(ratios):.2g} %"
    ends = [spread, "2.1 %", "17 %", "187 |"]
    assert lines[2] == [
        "| syrup", "40 (2 m/s)", "unsteady drag", "1.1 %", "12 %", "3.4 % (Re 1.5 to 27)", "2 m/s", *ends,
    ]  # fmt: skip
    assert lines[3] == ["| water", "40 (2 m/s)", "drag", "–", "–", "–", "–", *ends]
    assert lines[4][1:7] == [*PUBLISHED]
    assert lines[6][:4] == ["| 1", "27.6", "27.6", "28.2"]
    drags = [24 / 100 * law(100.0) for law in PUBLISHED.values()]
    assert lines[8][:7] == ["| 100", *(f"{drag:.3g}" for drag in drags)]
    assert float(lines[8][8]) == pytest.approx(1.09, rel=0.05)
    assert lines[8][9] == f"{100 * (max(drags) - min(drags)) / np.mean(drags):.2g} % |"
