"""Herschel–Bulkley drag: the law against the fluid solver's stored table, and the solver on a coarse grid."""

from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.errors import StudyError
from study_app.evidence.cfd import solver, yield_flow
from study_app.evidence.cfd.yield_flow import BINGHAM, INDICES, PERMITTED, YieldFlow, errors, stored_materials


def test_the_law_is_within_4_percent_of_the_solver_at_every_index_and_bingham_number():
    table = stored_materials()
    points = set(zip(table["flow_index"].tolist(), table["bingham"].tolist(), strict=True))
    assert points == {(index, bingham) for index in INDICES for bingham in BINGHAM}
    assert (min(INDICES), max(INDICES), min(BINGHAM), max(BINGHAM)) == (0.3, 1.0, 0.1, 30.0)
    assert np.abs(errors(table)).max() <= PERMITTED == 0.04


def test_the_solution_depends_little_on_grid_and_smoothing():
    table = stored_materials()
    for name, most in (("drag_coarse", 0.04), ("drag_smooth", 0.01)):  # the coarse grid has edges twice as long
        assert np.abs(table[name] / table["drag"] - 1).max() <= most


def test_the_command_writes_the_text_that_it_prints(tmp_path):
    printed = CliRunner().invoke(commands, ["cfd", "--materials"], catch_exceptions=False).output
    written = CliRunner().invoke(commands, ["cfd", "--materials", "--to", str(tmp_path)], catch_exceptions=False)
    assert (tmp_path / "materials.md").read_text("utf-8") == printed
    assert written.output == f"{tmp_path / 'materials.md'}\n"


def test_a_table_that_is_missing_is_named(tmp_path):
    with pytest.raises(StudyError, match=r"herschel_bulkley\.csv cannot be used"):
        stored_materials(tmp_path)


@pytest.mark.slow
def test_the_solver_on_a_coarse_grid_finds_the_stored_drag(monkeypatch):
    pytest.importorskip("ngsolve", reason="the extra cfd is not installed")
    monkeypatch.setattr(yield_flow, "SMOOTHING", (0.03, 0.001))
    coarse = YieldFlow(replace(solver.COARSE, ahead=10, behind=21, aside=10, ball=0.2, near=0.8, far=4))
    ((drag, _),) = coarse.drags(1.0, (10.0,))
    table = stored_materials()
    (row,) = np.flatnonzero((table["flow_index"] == 1.0) & (table["bingham"] == 10.0))
    assert drag == pytest.approx(table["drag"][row], rel=0.02)
