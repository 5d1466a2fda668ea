"""Accuracy and computation time: a reduced table and its rankings."""

import re
import shutil

import pytest

from study_app.evidence.accuracy.comparison import accuracy
from study_app.evidence.reference_solutions import stirring_motion
from tests.evidence.accuracy.scenes import REAL, TANK, compiled, first_seconds

pytestmark = [pytest.mark.nightly, pytest.mark.slow]


@pytest.fixture(scope="module")
def table():
    motion = first_seconds(stirring_motion(10, 1000), 6.0)
    return accuracy(TANK, REAL, motion, named="half a stir", repeats=2, batches=3, allowance_s=0.2)


def by_name(table, truth):
    return {row.candidate.name: row for row in table.rows if row.truth == truth}


@compiled
def test_all_that_keeps_the_definition_differs_by_rounding(table):
    rows = by_name(table, "definition")
    for name in ("O(1) wake", "O(N) compiled"):
        assert rows[name].error.rms < 1e-11, name
    assert 1e-9 < rows["O(N) compiled, float32"].error.rms < 1e-4


@compiled
def test_the_whole_tick_is_compared_with_plain_c(table):
    compared = r"A complete servo tick in water, .* takes \d+ ns, \d+\.\d times as long as .* in plain C \(\d+ ns"
    missing = r"The time of a tick relative to plain C was not measured: there is no C compiler \(gcc\)\."
    assert re.match(compared if shutil.which("gcc") else missing, table.plain_c)


@compiled
def test_simplified_models_err_more_the_more_they_omit(table):
    rows = {name: row.error.rms for name, row in by_name(table, "definition").items()}
    assert rows["O(1) wake"] < rows["O(1) wake, 500 Hz"] < rows["O(1) wake, 250 Hz"] < rows["O(1) wake, 100 Hz"]
    assert rows["O(N) compiled, tail N/2"] < rows["O(N) compiled, tail N/4"] < rows["drag alone"]
    assert rows["O(1) wake, tail N/4"] == pytest.approx(rows["O(N) compiled, tail N/4"], rel=1e-9)
    assert rows["O(1) wake, resolution 5 mm"] < rows["O(1) wake, resolution 20 mm"]
    by_velocity = {name: rows[f"O(1) wake, velocity by {name} from encoder counts"] for name in ("ewma", "raw")}
    assert by_velocity["ewma"] < by_velocity["raw"]


@compiled
def test_physical_errors_fall_as_effects_are_added(table):
    steady = {name: row.error.rms for name, row in by_name(table, "steady drag").items()}
    assert steady["Haider–Levenspiel"] < steady["linear viscosity"] < steady["constant C_d"]
    ladder = ("constant C_d", "Haider–Levenspiel", "Haider–Levenspiel + added mass")
    whole = "Haider–Levenspiel + added mass + history"
    assert steady["unsteady drag"] < 0.04  # of experiments, which are above the solver that it is fitted to
    for truth in ("oscillation", "start"):
        errors = [by_name(table, truth)[name].error.rms for name in (*ladder, whole)]
        assert errors == sorted(errors, reverse=True)
        assert errors[-1] < 0.01 < errors[-2]
        assert by_name(table, truth)["unsteady drag"].error.rms < 0.01
    assert steady[whole] == pytest.approx(steady["Haider–Levenspiel"])


@compiled
def test_the_gates_choice_is_marked_once_a_ladder_and_keeps_the_target_where_all_is_known(table):
    chosen = {row.candidate for row in table.rows if row.chosen}
    assert {candidate.name for candidate in chosen} == {"O(1) wake", "Schiller–Naumann + added mass + history"}
    for row in table.rows:
        if row.chosen and row.truth in {"definition", "steady drag", "oscillation", "start"}:
            assert row.error.rms < row.error.target


@compiled
@pytest.mark.parametrize("truth", ["stop at 0.104 m/s", "stop at 0.2 m/s", "stop at 0.6 m/s"])
def test_after_a_sudden_stop_only_unsteady_drag_keeps_the_target(table, truth):
    errors = {row.candidate.name: row.error for row in table.rows if row.truth == truth}
    finite = errors.pop("unsteady drag")
    assert finite.rms < 0.04 < finite.target
    (chosen,) = [row.error for row in table.rows if row.truth == truth and row.chosen]
    assert chosen.rms == min(error.rms for error in errors.values())
    drag_and_mass = errors["Haider–Levenspiel + added mass"]
    assert chosen.target < chosen.rms < 0.8 * drag_and_mass.rms < 0.8 * errors["constant C_d"].rms


@compiled
def test_unsteady_drag_is_within_the_target_of_a_motion_left_out_of_its_fit(table):
    errors = {row.candidate.name: row.error.rms for row in table.rows if row.truth == "multi-sine at 0.0311 m/s"}
    assert errors.pop("unsteady drag") < 0.02 < min(errors.values())
