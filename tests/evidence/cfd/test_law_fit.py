"""The constants of unsteady drag: the program has those that the command fits to the stored motions."""

import numpy as np
import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.evidence.cfd import fits, law_fit, stored_flows
from study_app.evidence.cfd.stored_flows import MOTION, Table
from study_app.evidence.reference_model import CONSTANTS, Constants, unsteady_n
from study_app.haptics.kernels.effects import unsteady_drag
from study_app.haptics.model.scene import Liquid, Scene
from tests.haptics.scenes import COMPILED

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not COMPILED, reason="thousands of ticks are for compiled code")]
PLANTED = Constants(c_m=0.5, c_y=1.4, c_z=5.0, c_s=1.5, beta=2.0, r_0=8.0)


def test_the_programs_constants_equal_the_reference_constants():
    names = ("MEMORY_LOSS", "EXCESS_GAIN", "WAKE_GAIN", "FAR_WAKE_GAIN", "OVERTAKING", "OVERTAKING_REYNOLDS")
    assert tuple(getattr(unsteady_drag, name) for name in names) == tuple(CONSTANTS)


@pytest.mark.nightly
def test_a_fit_to_the_stored_motions_gives_the_programs_constants_within_half_a_percent():
    fitted = law_fit.fit_constants((*stored_flows.load_tables(), *stored_flows.training()))
    assert tuple(fitted) == pytest.approx(tuple(CONSTANTS), rel=5e-3)


def planted_motion(table):
    """Return the motion of a table with the force of the law with other constants."""
    case = table.case
    liquid = Liquid(
        id="any", density_kg_m3=case.density_kg_m3, viscosity_pa_s=case.viscosity_pa_s, effects=("unsteady_drag",)
    )
    scene = Scene(body={"diameter_m": case.diameter_m}, liquids=(liquid,))
    even_s = np.arange(0, case.profile.end, law_fit.STEP) * case.unit_s
    dw = case.profile.acceleration(even_s / case.unit_s) * case.speed_mps / case.unit_s
    w = case.speed_mps * case.profile.speed(even_s / case.unit_s)
    steps = np.full(len(even_s), law_fit.STEP * case.unit_s)
    force_n = unsteady_n(scene, w[:, np.newaxis], dw[:, np.newaxis], steps, PLANTED)[:, 0]
    return Table(table.notes, dict(zip(MOTION, (even_s, w, force_n), strict=True)))


def test_planted_constants_are_found_and_a_motion_left_out_is_met():
    tables = [planted_motion(it) for it in stored_flows.training() if it.case.liquid_id == "gear_oil"]
    refit = law_fit.refit_law(tables)
    assert tuple(refit.constants) == pytest.approx(tuple(PLANTED), rel=1e-3)
    assert max(max(it.fitted) for it in refit.errors) < 1e-4
    assert max(it.left_out[0] for it in refit.errors) < 0.02
    assert min(it.program[0] for it in refit.errors) > 0.01
    text = law_fit.law_fit_evidence(refit).text
    assert "| c_z | 5 | 3.15 |" in text
    assert text.count("gear_oil | ") == len(tables)


def test_the_program_meets_motions_that_no_fit_used():
    (model,) = [it for it in fits.MODELS if it.effects == ("unsteady_drag",)]
    shares = {it.case.name: fits.evaluate_fit(model, it, {}).share for it in stored_flows.held_out()}
    assert not set(shares) & {it.case.name for it in (*stored_flows.load_tables(), *stored_flows.training())}
    assert sum(shares.values()) <= 0.04 * len(shares)
    assert shares.pop("reversal-gear_oil-578mmps") <= 0.082  # through its own wake the law is least true
    assert shares.pop("reversal-gear_oil-347mmps") <= 0.062
    assert max(shares.values()) <= 0.05


@pytest.mark.nightly
@pytest.mark.timeout(900)
def test_each_motion_left_out_of_the_fit_is_met():
    """Within 5.1 %; motions that no fit uses within 6 %, but for the reversal at Re 100."""
    result = CliRunner().invoke(commands, ["cfd", "--refit"])
    assert result.exit_code == 0, result.output
    rows = [line.split(" | ") for line in result.stdout.splitlines() if "m/s |" in line]
    assert len(rows) == sum(map(len, (stored_flows.training(), stored_flows.load_tables(), stored_flows.held_out())))
    assert sum(row[3] == "held out" for row in rows) == len(stored_flows.held_out())
    held_out = {row[0].strip("| "): float(row[4].split("%")[0]) for row in rows if row[3] == "held out"}
    assert all(float(row[4].split("%")[0]) <= 5.1 for row in rows if row[3] != "held out")
    assert held_out.pop("reversal at 0.578 m/s") <= 7.5
    assert all(percent <= 6 for percent in held_out.values())
