"""Truths of the fluid solver: taken for their own liquid alone, and damaged tables are named."""

import pytest

from study_app.errors import StudyError
from study_app.validation.cfd.solver_truths import solver_truths
from tests.evaluation.test_reference_solutions import HONEY, scene

TABLE = """# title: start and stop
# density_kg_m3: 1420
# viscosity_pa_s: 10
# diameter_m: 0.068
# computing_s_per_s: 1.5
# command: solve it
# machine: two cores
t_s,velocity_mps,force_n
0,0,0
0.01,0.1,-1
0.02,0.1,-0.9
"""


def test_a_stored_table_is_taken_for_its_own_liquid_alone(tmp_path):
    (tmp_path / "start-100mmps.csv").write_text(TABLE, encoding="utf-8")
    (tmp_path / "steady.csv").write_text("reynolds,drag_coefficient\n1,27\n", encoding="utf-8")
    (truth,) = solver_truths(scene(), tmp_path)
    (case,) = truth.cases
    assert (truth.name, truth.computing_s, truth.machine) == ("start and stop", 1.5, "two cores")
    assert len(case.motion.t_s) == 20
    assert case.motion.velocity_mps[5, 0] == pytest.approx(0.05)
    assert case.force_n[5, 0] == pytest.approx(-0.5)
    assert case.motion.position_m[10, 0] == pytest.approx(0.5e-3)
    assert solver_truths(scene(HONEY.model_copy(update={"viscosity_pa_s": 1.41})), tmp_path) == ()
    with pytest.raises(StudyError, match="holds no tables"):
        solver_truths(scene(), tmp_path / "absent")


@pytest.mark.parametrize("broken", [TABLE.replace("0.9", "?"), TABLE.replace("# diameter_m: 0.068\n", "")])
def test_a_stored_table_that_is_broken_is_named(tmp_path, broken):
    (tmp_path / "start-100mmps.csv").write_text(broken, encoding="utf-8")
    with pytest.raises(StudyError, match=r"start-100mmps\.csv cannot be used"):
        solver_truths(scene(), tmp_path)
