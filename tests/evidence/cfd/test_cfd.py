"""The fluid solver: its motion and exact linear force, its stored tables, the fits to them, and a coarse flow."""

import csv
import re
import shutil
import sys
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.integrate import quad

from study_app.cli import commands
from study_app.errors import StudyError
from study_app.evidence.cfd import fits as fitted
from study_app.evidence.cfd import solved_cases, solver, stored_flows
from study_app.evidence.cfd.solved_cases import PROFILES, RAMP, STOP, STOPPING, Case
from study_app.evidence.cfd.stored_flows import solver_truths
from study_app.protocol.load import load_scene
from study_app.workers.executors import Workers, open_executor
from tests.evidence.cfd import stand_ins
from tests.haptics.scenes import COMPILED as IS_COMPILED

COMPILED = pytest.mark.skipif(not IS_COMPILED, reason="fits need the compiled tick")
PACKAGE = resources.files("study_app.evidence.cfd")
NAMES = tuple(it.name for it in solved_cases.cases())
CASES = (*solved_cases.cases(), *solved_cases.cases_of((*solved_cases.TRAINING, *solved_cases.HELD_OUT)))
COARSE = replace(solver.COARSE, ahead=15, behind=30, aside=15, ball=0.2, near=0.8, far=6)


@pytest.fixture(scope="module")
def stored():
    tables = (*stored_flows.load_tables(), *stored_flows.training(), *stored_flows.held_out())
    return {it.case.name: it for it in tables}


@pytest.fixture(scope="module")
def fits(stored):
    """Return the stored fits, evaluated again on the tables without fitting."""
    models, judged = {it.name: it for it in fitted.MODELS}, []
    for row in csv.DictReader((PACKAGE / fitted.FITS_FILE).read_text("utf-8").splitlines()):
        table = stored[row["table"]]
        values = {name: float(value) for name, _, value in (it.partition("=") for it in row["parameters"].split())}
        values |= {name: round(value) for name, value in values.items() if name == "length"}
        others = [
            it
            for it in (stored[name] for name in NAMES)
            if it.case.liquid_id == table.case.liquid_id and it is not table
        ]
        judged.append(fitted.evaluate_fit(models[row["model"]], table, values, others))
    return tuple(judged)


def fit_of(fits, name, model):
    (matching_fit,) = [it for it in fits if it.case.name == name and it.model.name == model]
    return matching_fit


# --- The motion and the exact force ---


@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES)
def test_acceleration_is_the_slope_of_the_speed_which_begins_at_rest(profile):
    t = np.linspace(-0.1, profile.end, 4001)
    slopes = (profile.speed(t + 1e-6) - profile.speed(t - 1e-6)) / 2e-6
    np.testing.assert_allclose(profile.acceleration(t), slopes, atol=1e-5)
    assert (profile.speed(t[t <= 0]) == 0).all()
    assert 0.98 <= abs(profile.speed(t)).max() <= 1


@pytest.mark.parametrize("t", [0.05, 0.2, 0.3, 5.0, 10.1, 10.2, 12.0])
@pytest.mark.parametrize("reynolds", [1.0, 100.0])
@pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES)
def test_the_exact_linear_force_equals_plain_quadrature(profile, t, reynolds):
    def acceleration(tau):
        return float(profile.acceleration(np.array(tau)))

    viscosity, steps = 1 / reynolds, [at for step in profile.steps for at in (step.at, step.at + RAMP)]
    ends = sorted(it for it in {*steps, *np.arange(0, t, 1.0).tolist()} if it < t)
    memory = 0.0
    for least, most in zip(ends, [*ends[1:], t], strict=True):
        at_end = {"weight": "alg", "wvar": (0, -0.5)} if most == t else {}
        weight = (lambda _: 1.0) if most == t else (lambda tau: (t - tau) ** -0.5)
        memory += quad(lambda tau, weight=weight: acceleration(tau) * weight(tau), least, most, **at_end)[0]
    expected = 3 * np.pi * viscosity * profile.speed(np.array([t])) + np.pi / 12 * acceleration(t)
    expected += 1.5 * np.sqrt(np.pi * viscosity) * memory
    assert profile.linear_drags(np.array([t]), reynolds) == pytest.approx(expected, rel=1e-6, abs=1e-9)


def test_flows_that_are_not_axisymmetric_are_refused():
    with pytest.raises(StudyError, match="Reynolds number of 241"):
        Case(
            liquid_id="water",
            density_kg_m3=998.2,
            viscosity_pa_s=1.0016e-3,
            diameter_m=0.068,
            speed_mps=241 * 1.0016e-3 / 998.2 / 0.068,
        )


# --- What is stored ---


@pytest.mark.parametrize("expected", CASES, ids=lambda it: it.name)
def test_a_table_describes_the_shipped_liquid_and_its_origin(stored, expected):
    table = stored[expected.name]
    assert (table.case.liquid_id, table.case.profile) == (expected.liquid_id, expected.profile)
    for field in ("density_kg_m3", "viscosity_pa_s", "diameter_m", "speed_mps"):
        assert getattr(table.case, field) == pytest.approx(getattr(expected, field), rel=1e-5)
    assert table.notes["title"] == expected.title
    assert table.notes["command"] == solver.COMMAND
    assert "ngsolve" in table.notes["solver"]
    assert table.notes["machine"]
    assert float(table.notes["computing_s_per_s"]) > 0
    for check in ("from_coarse", "from_exact"):
        at_ramps, elsewhere = (float(it) for it in re.findall(r"([\d.]+)%", table.notes[check])[:2])
        assert at_ramps < (1 if expected.reynolds <= solver.FAST_REYNOLDS else 2), check
        assert elsewhere < 0.2, check


def test_steady_drag_equals_published_values_and_is_independent_of_the_grid():
    reynolds, drag, coarse, narrow = stored_flows.load_steady().columns.values()
    np.testing.assert_allclose(coarse, drag, rtol=4e-3)
    np.testing.assert_allclose(narrow, drag, rtol=2e-3)
    np.testing.assert_allclose([fitted.clift(it) for it in reynolds.tolist()], drag, rtol=0.016)
    for at, published in fitted.MITTAL.items():
        assert drag[reynolds == at] == pytest.approx(published, rel=0.006)
    assert drag[reynolds == 1] > 24 * (1 + 3 / 16) * 0.9  # Oseen's correction, too large by a little
    assert drag[reynolds == 1] < 24 * (1 + 3 / 16)


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


def test_a_stored_table_is_used_only_for_its_own_liquid(tmp_path):
    honey, glycerin = (load_scene("physical_liquids", name) for name in ("honey", "glycerin"))
    (tmp_path / "start-100mmps.csv").write_text(TABLE, encoding="utf-8", newline="\n")
    (tmp_path / "steady.csv").write_text("reynolds,drag_coefficient\n1,27\n", encoding="utf-8", newline="\n")
    (truth,) = solver_truths(honey, tmp_path)
    (case,) = truth.cases
    assert (truth.name, truth.computing_s, truth.machine) == ("start and stop", 1.5, "two cores")
    assert len(case.motion.t_s) == 20
    assert case.motion.velocity_mps[5, 0] == pytest.approx(0.05)
    assert case.force_n[5, 0] == pytest.approx(-0.5)
    assert case.motion.position_m[10, 0] == pytest.approx(0.5e-3)
    assert solver_truths(glycerin, tmp_path) == ()
    with pytest.raises(StudyError, match="does not contain the fluid solver"):
        solver_truths(honey, tmp_path / "absent")


def test_a_table_that_was_damaged_is_named(tmp_path):
    with pytest.raises(StudyError, match="does not contain the fluid solver"):
        stored_flows.load_tables(tmp_path)
    shutil.copy(str(PACKAGE / f"{NAMES[0]}.csv"), tmp_path)
    file = tmp_path / f"{NAMES[0]}.csv"
    file.write_text(file.read_text("utf-8").replace("velocity_mps,", "v,"), "utf-8")
    with pytest.raises(StudyError, match=rf"{NAMES[0]}.*cfd --solve"):
        stored_flows.load_tables(tmp_path)


# --- The fits ---


@pytest.mark.slow
@COMPILED
def test_the_stored_fits_have_the_errors_they_say(fits):
    rows = fitted.fits_csv(fits).splitlines()
    said = (PACKAGE / fitted.FITS_FILE).read_text("utf-8").splitlines()
    assert len(rows) == 1 + len(NAMES) * len(fitted.MODELS)
    for row, other in zip(rows, said, strict=True):
        assert row.split(",")[:2] == other.split(",")[:2]
        if not row.startswith("table"):
            ours, theirs = (np.array([float(it) for it in line.rsplit(",", 6)[1:]]) for line in (row, other))
            np.testing.assert_allclose(ours, theirs, rtol=1e-3, atol=1e-4, err_msg=other)


@COMPILED
def test_a_fit_made_again_is_the_stored_one(stored, fits):
    (model,) = [it for it in fitted.MODELS if it.free == ("coefficient",)]
    values, _ = fitted.fit_one(model, stored["glycerin-600mmps"])
    assert values == pytest.approx(fit_of(fits, "glycerin-600mmps", model.name).values, rel=1e-3)


# --- The solver ---


def test_without_the_library_the_error_names_the_package(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "ngsolve", None)
    finished = CliRunner().invoke(commands, ["cfd", "--solve", "--to", str(tmp_path / "new")])
    assert isinstance(finished.exception, StudyError)
    assert "pip install ngsolve" in str(finished.exception)
    assert CliRunner().invoke(commands, ["cfd", "--solve"]).exit_code == 2


@pytest.fixture
def without_solver(monkeypatch):
    monkeypatch.setattr(solver, "import_ngsolve", lambda: None)
    monkeypatch.setattr(solver, "_solve_case", stand_ins.linear_table)
    monkeypatch.setattr(solver, "steady_table", stand_ins.steady)


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.usefixtures("without_solver")
def test_an_interrupted_solution_keeps_its_tables(tmp_path):
    def until_the_tenth(said):
        if ", 10 of " in said:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), open_executor(Workers(1)) as executor:
        solver.solve(tmp_path, executor, until_the_tenth)
    assert len(list(tmp_path.rglob("*.csv"))) == 9
    with open_executor(Workers(1)) as executor:
        assert len(solver.solve(tmp_path, executor, lambda _: None)) == len(CASES) + 1


@pytest.fixture(scope="module")
def coarse():
    pytest.importorskip("ngsolve", reason="the extra cfd is not installed")
    return solver.flow_of(COARSE)


def test_a_coarse_flow_without_convection_is_the_exact_one(coarse):
    times = STOPPING.solution_times(0.02)
    drag = coarse.unsteady(20.0, times, lambda t: float(STOPPING.speed(np.array(t))), convection=False)
    exact = STOPPING.linear_drags(times, 20.0)
    assert np.abs(drag - exact).max() < 0.05 * np.abs(exact).max()
    held = (times > 1) & (times < STOP)
    np.testing.assert_allclose(drag[held], exact[held], rtol=5e-3)


def test_a_coarse_flow_resists_as_it_should(coarse):
    (slow, fast) = coarse.steady([20.0, 50.0])
    assert slow == pytest.approx(fitted.clift(20.0), rel=0.02)
    assert fast == pytest.approx(fitted.clift(50.0), rel=0.02)


def test_a_solution_that_differs_from_the_coarse_one_is_not_stored(coarse, monkeypatch):
    monkeypatch.setattr(solver, "PERMITTED", 1e-6)
    with pytest.raises(StudyError, match=r"differs from the coarse solution .* nothing was stored"):
        solver.motion_table(solved_cases.cases()[0], coarse, coarse, step=0.025)
