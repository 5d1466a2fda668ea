"""What accuracy costs in time: a reduced table and its signs, the files made of it, and what the command refuses."""

import csv
import io
import itertools
import math
import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib.backends.backend_agg import FigureCanvasAgg

from study_app.cli import commands
from study_app.cli.evidence.accuracy import motion_along
from study_app.errors import StudyError
from study_app.evaluation.expected_error import error_report, expected, physical_n
from study_app.evaluation.force_error import ROUNDING, Error, error_of
from study_app.evaluation.hand_motions import stir, stroke
from study_app.evaluation.reference_solutions import Case, Truth
from study_app.evaluation.unsteady_law import CONSTANTS
from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.effects.local_wake import LocalWake
from study_app.haptics.model.effects.wake import Wake
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Given, Liquid, MotionBox, Scene
from study_app.protocol.load import load_scene
from study_app.validation.accuracy import candidate_sets
from study_app.validation.accuracy.accuracy_figure import LABEL_PT, draw, duration, spread
from study_app.validation.accuracy.accuracy_report import COLUMNS, csv_text, markdown, write
from study_app.validation.accuracy.candidates import LinearRung, ListRung, TickRung, UnsteadyRung
from study_app.validation.accuracy.comparison import FINE_S, Accuracy, Row, Time, accuracy, front, race, worst
from study_app.validation.cfd import stored_flows
from study_app.validation.cfd.solver_truths import solver_truths
from tests.haptics.scenes import COMPILED

pytestmark = pytest.mark.slow

compiled = pytest.mark.skipif(not COMPILED, reason="measures compiled code")

HONEY = Liquid(id="honey", density_kg_m3=1420, viscosity_pa_s=10, effects="auto")
REAL = Scene(scale=3, liquids=(HONEY,), motion=MotionBox(speed_mps=0.6, acceleration_mps2=6))
WATER = Liquid(
    id="water", density_kg_m3=1000, effects=("drag", "wake"), wake=Wake(length=1000, scaling=1000, exponent=0.75)
)
TANK = Scene(scale=10, liquids=(WATER,))


def first_seconds(motion, seconds):
    rows = motion.t_s < seconds
    return Motion(motion.t_s[rows], motion.position_m[rows], motion.velocity_mps[rows])


@pytest.fixture(scope="module")
def found():
    motion = first_seconds(stir(10, 1000), 6.0)
    return accuracy(TANK, REAL, motion, named="half a stir", repeats=2, batches=3, allowance_s=0.2)


def by_name(found, truth):
    return {row.rung.name: row for row in found.rows if row.truth == truth}


@compiled
def test_the_table_has_its_rows_and_finite_numbers(found):
    assert len(found.rows) >= 16
    for row in found.rows:
        assert 0 < row.time.median_ns <= row.time.p99_ns * (1 + 1e-9)
        assert 0 <= row.error.rms_n <= row.error.most_n
        assert math.isfinite(row.error.direction_deg)
        assert row.memory_bytes > 0


@compiled
def test_all_that_keeps_the_definition_differs_by_rounding(found):
    rows = by_name(found, "definition")
    for name in ("O(1) wake", "O(N) compiled", "O(N) numpy", "O(N) plain Python"):
        assert rows[name].error.rms < 1e-11, name
    assert 1e-9 < rows["O(N) compiled, float32"].error.rms < 1e-4


@compiled
def test_what_leaves_something_out_errs_the_more_it_leaves_out(found):
    rows = {name: row.error.rms for name, row in by_name(found, "definition").items()}
    assert rows["O(1) wake"] < rows["O(1) wake, 500 Hz"] < rows["O(1) wake, 250 Hz"] < rows["O(1) wake, 100 Hz"]
    assert rows["O(N) compiled, tail N/2"] < rows["O(N) compiled, tail N/4"] < rows["drag alone"]
    assert rows["O(1) wake, tail N/4"] == pytest.approx(rows["O(N) compiled, tail N/4"], rel=1e-9)
    assert rows["O(1) wake, resolution 5 mm"] < rows["O(1) wake, resolution 20 mm"]
    by_velocity = {name: rows[f"O(1) wake, velocity by {name} from encoder counts"] for name in ("ewma", "line", "raw")}
    assert by_velocity["line"] < by_velocity["ewma"] < by_velocity["raw"]


@compiled
def test_a_linear_damper_is_compared_with_its_definition_and_costed_as_any_law(tmp_path):
    file = tmp_path / "damper.toml"
    file.write_text('format = 2\n[liquids.damper]\ndrag = { law = "linear", damping_nspm = 8 }\n')
    damper = load_scene(file, "damper")
    found = accuracy(damper, None, first_seconds(stir(1, 1000), 3.0), repeats=1, batches=2, allowance_s=0.1)
    rows = {row.rung.name: row.error.rms for row in found.rows}
    assert {row.truth for row in found.rows} == {"definition"}
    assert rows["drag"] < 1e-11
    assert rows["drag"] < rows["drag, 500 Hz"] < rows["drag, 100 Hz"]
    done = CliRunner().invoke(commands, ["scene", str(file)])
    assert done.exit_code == 0, done.output
    assert "named, law linear" in done.output
    assert "against the definition of drag" in done.output


@compiled
def test_a_list_costs_more_than_running_sums_and_the_interpreter_most(found):
    rows = {name: row.time.median_ns for name, row in by_name(found, "definition").items()}
    assert rows["O(1) wake"] < rows["O(N) compiled"] < rows["O(N) numpy"]
    assert rows["O(N) compiled, tail N/4"] < rows["O(N) compiled"] < rows["O(N) plain Python"]
    slower = by_name(found, "definition")["O(1) wake, 100 Hz"]
    assert slower.ns_per_ms == pytest.approx(slower.time.median_ns / 10)


@compiled
def test_physical_errors_fall_as_rungs_are_added(found):
    steady = {name: row.error.rms for name, row in by_name(found, "steady drag").items()}
    assert steady["Haider–Levenspiel"] < steady["linear viscosity"] < steady["constant C_d"]
    ladder = ("constant C_d", "Haider–Levenspiel", "Haider–Levenspiel + added mass")
    whole = "Haider–Levenspiel + added mass + history"
    assert steady["unsteady drag"] < 0.04  # of experiments, which are above the solver that it is fitted to
    for truth in ("oscillation", "start"):
        errors = [by_name(found, truth)[name].error.rms for name in (*ladder, whole)]
        assert errors == sorted(errors, reverse=True)
        assert errors[-1] < 0.01 < errors[-2]
        assert by_name(found, truth)["unsteady drag"].error.rms < 0.01
    assert steady[whole] == pytest.approx(steady["Haider–Levenspiel"])


@compiled
def test_the_gates_choice_is_marked_once_a_ladder_and_keeps_the_target_where_all_is_known(found):
    chosen = {row.rung for row in found.rows if row.chosen}
    assert {rung.name for rung in chosen} == {"O(1) wake", "Schiller–Naumann + added mass + history"}
    assert candidate_sets.physical(REAL.model_copy(update={"format": 2}))[1].name == "unsteady drag"
    for row in found.rows:
        if row.chosen and row.truth in {"definition", "steady drag", "oscillation", "start"}:
            assert row.error.rms < row.error.target


@compiled
@pytest.mark.parametrize("truth", ["stop at 0.104 m/s", "stop at 0.2 m/s", "stop at 0.6 m/s"])
def test_after_a_sudden_stop_only_unsteady_drag_keeps_the_target(found, truth):
    errors = {row.rung.name: row.error for row in found.rows if row.truth == truth}
    finite = errors.pop("unsteady drag")
    assert finite.rms < 0.04 < finite.target
    (chosen,) = [row.error for row in found.rows if row.truth == truth and row.chosen]
    assert chosen.rms == min(error.rms for error in errors.values())
    drag_and_mass = errors["Haider–Levenspiel + added mass"]
    assert chosen.target < chosen.rms < 0.8 * drag_and_mass.rms < 0.8 * errors["constant C_d"].rms


@compiled
def test_unsteady_drag_is_within_the_target_of_a_motion_left_out_of_its_fit(found):
    errors = {row.rung.name: row.error.rms for row in found.rows if row.truth == "multi-sine at 0.0311 m/s"}
    assert errors.pop("unsteady drag") < 0.02 < min(errors.values())


@compiled
def test_the_constants_of_a_motion_left_out_are_those_that_are_used():
    scene = REAL.model_copy(
        update={"liquids": (HONEY.model_copy(update={"effects": ("unsteady_drag",)}),), "format": 2}
    )
    rung = UnsteadyRung("unsteady drag", "unsteady drag", "effects", scene.model_copy(update={"velocity": Given()}))
    truths = solver_truths(scene)
    held_out = {it.case.title for it in stored_flows.held_out()}
    assert {it.name for it in truths if it.left_out is None} == held_out & {it.name for it in truths}
    own, (truth, *_) = tuple(stored_flows.left_out().values()), truths
    assert truth.left_out in own
    (program,), (without,) = (rung.forces_against(replace(truth, left_out=it)) for it in (None, truth.left_out))
    assert 1e-4 < np.abs(without - program).max() / np.abs(program).max() < 0.05
    (same,) = rung.forces_against(replace(truth, left_out=CONSTANTS))
    np.testing.assert_allclose(same, program, atol=1e-3 * np.abs(program).max())


@compiled
def test_nothing_beats_the_front(found):
    for kind in ("numerical", "physical"):
        points = worst(found.of(kind))
        best = front(points)
        for rung in best:
            row = points[rung]
            assert row.on_front
            for other in points.values():
                truer = other.error.rms < max(row.error.rms, ROUNDING)
                assert not (other.ns_per_ms < row.ns_per_ms and truer and other.error.rms >= ROUNDING)


@compiled
def test_the_table_becomes_files(found, tmp_path):
    written = write(found, tmp_path)
    assert [path.name for path in written] == ["accuracy.csv", "accuracy.md", "accuracy.png", "accuracy.svg"]
    rows = list(csv.DictReader(io.StringIO(csv_text(found))))
    assert list(rows[0]) == list(COLUMNS)
    assert len(rows) == len(found.rows)
    for row in rows:
        assert float(row["ticks_per_s"]) == pytest.approx(1e9 / float(row["median_ns"]), rel=1e-5)
        assert float(row["times_real_time"]) == pytest.approx(float(row["ticks_per_s"]) / float(row["rate_hz"]), 1e-5)
    text = markdown(found)
    assert found.machine in text
    assert text.count("◎") == 1 + 1 + 9  # the legend, and the choice against each truth
    assert "**stop at 0.6 m/s**: fluid solver: liquid-study cfd --solve." in text
    assert written[2].read_bytes().startswith(b"\x89PNG")


@compiled
def test_the_figure_names_every_model_inside_its_column(found):
    figure = draw(found)
    assert figure.get_figwidth() * 25.4 == pytest.approx(85)
    texts = [text for axes in figure.axes for text in axes.texts]
    shown = {text.get_text() for text in texts}
    assert {row.rung.label for row in found.rows} <= shown
    assert {"target 5 %", "1 ms"} <= shown
    renderer, page = FigureCanvasAgg(figure).get_renderer(), figure.bbox
    for text in (*texts, *figure.texts):
        box = text.get_window_extent(renderer)
        assert page.x0 <= box.x0, text
        assert box.x1 <= page.x1, text
        assert text.get_fontsize() >= 6.5


@compiled
def test_a_solvers_time_is_drawn_where_a_table_is_stored(found):
    solver = Truth("start and stop", "fluid solver", (), computing_s=17.0)
    figure = draw(Accuracy(found.rows, (*found.truths, solver), (), found.machine, found.motion))
    (drawn,) = [text.xy[0] for axes in figure.axes for text in axes.texts if text.get_text() == "fluid solver"]
    (box,) = [it.get_extents() for it in figure.axes[-1].patches]
    least, greatest = figure.axes[-1].transData.inverted().transform(box)[:, 0]
    assert greatest == pytest.approx(17e6)
    assert least == pytest.approx(drawn) == pytest.approx(1e6 * min(it.computing_s or 99 for it in found.truths))
    assert figure.axes[-1].get_xlim()[1] > 1.7e10 / 1e3


@compiled
def test_a_liquid_without_wake_has_a_shorter_ladder():
    scene = candidate_sets.drag_and_wake(Scene(liquids=(Liquid(id="honey", density_kg_m3=1400),)))
    rungs, program = candidate_sets.numerical(scene)
    assert program.name == "drag"
    assert not any(isinstance(rung, ListRung) for rung in rungs)


def test_slow_scenes_are_slowed_down_no_further_than_a_scene_may_be():
    rungs, _ = candidate_sets.numerical(candidate_sets.drag_and_wake(TANK.model_copy(update={"rate_hz": 200.0})))
    assert [rung.every for rung in rungs if rung.every > 1] == [2, 4]


@pytest.mark.parametrize(("speed_mps", "expects"), [(1e-3, "no resistance"), (0.6, "+ history")])
def test_the_ladder_has_the_gates_own_choice(speed_mps, expects):
    box = MotionBox(speed_mps=speed_mps, acceleration_mps2=10 * speed_mps)
    rungs, choice = candidate_sets.physical(REAL.model_copy(update={"motion": box}))
    assert choice in rungs
    assert expects in choice.name
    assert isinstance(rungs[0], LinearRung)


@compiled
def test_forces_of_a_slower_rung_are_held_between_its_ticks():
    rung = TickRung("slow", "slow", "rate", TANK.model_copy(update={"rate_hz": 250.0, "velocity": Given()}), every=4)
    forces = rung.forces(first_seconds(stir(10, 1000), 1.0))
    assert len(forces) == 1000
    held = forces.reshape(250, 4, 3)
    assert (held == held[:, :1]).all()
    assert (np.diff(held[:, 0], axis=0) != 0).any()


def one_case(*force_n):
    force = np.array(force_n, float)
    motion = Motion(np.arange(len(force)) / 1000, np.zeros_like(force))
    return Truth("one", "", (Case(motion, force, np.array([True] * (len(force) - 1) + [False])),))


def test_errors_are_of_the_rows_that_count_and_shares_of_the_true_force():
    error = error_of([np.array([[1.0, 0, 0], [0, 2.5, 0], [9, 9, 9]])], one_case((2, 0, 0), (0, 2, 0), (0, 0, 0)))
    assert error.rms_n == pytest.approx(math.sqrt((1 + 0.25) / 2))
    assert error.most_n == 1
    assert error.rms == pytest.approx(error.rms_n / 2)
    assert error.most == 0.5
    assert error.direction_deg == 0
    assert error.target == 0.05


def test_direction_counts_where_the_force_is_felt():
    truth = one_case((2, 0, 0), (0.04, 0, 0), (0, 0, 0))
    error = error_of([np.array([[0, 1.0, 0], [-1, 0, 0], [0, 0, 0]])], truth)
    assert error.direction_deg == pytest.approx(90)
    weak = error_of(
        [np.array([[1e-3, 0, 0], [0, 1e-3, 0], [0, 0, 0]])], one_case((1e-3, 0, 0), (1e-3, 0, 0), (0, 0, 0))
    )
    assert weak.direction_deg == pytest.approx(math.sqrt(90**2 / 2))
    assert weak.target == pytest.approx(50)


def test_the_front_takes_rounding_errors_and_times_within_a_twentieth_as_equal():
    def row(name, ns, rms):
        rung = TickRung(name, name, "tick", TANK)
        return rung, Row(
            "numerical", "water", "t", rung, Error(0, 0, rms, 0, 0, 0.05), Time(ns, ns, 1), 1, chosen=False
        )

    points = dict([row("quick", 10, 0.5), row("dear", 20, 0.6), row("sums", 30, 1e-13), row("list", 900, 1e-16)])
    assert [rung.name for rung in front(points)] == ["quick", "sums"]
    alike = dict([row("quick", 100, 0.5), row("truer", 104, 0.1), row("truest", 150, 0.01)])
    assert [rung.name for rung in front(alike)] == ["truer", "truest"]


class WaitingRung(TickRung):
    """A rung that is kept waiting by another thread, and notes for how long [ns]."""

    def take(self, start, stop):
        other, began = threading.Thread(target=sum, args=(range(1_000_000),)), time.perf_counter_ns()
        other.start()
        other.join()
        self.waited_ns = time.perf_counter_ns() - began


@pytest.mark.skipif(time.get_clock_info("thread_time").resolution > FINE_S, reason="no fine clock of a thread")
def test_what_others_take_is_not_counted():
    rung = WaitingRung("waiting", "waiting", "tick", TANK)
    took = race((rung,), first_seconds(stir(10, 1000), 1.5), 1, 1, 1.0)[rung]
    assert took.median_ns * rung.BATCH < 0.5 * rung.waited_ns


def test_labels_keep_apart_and_below_the_top():
    places = spread([10.0, 11.0, 90.0, 99.0, 99.5], LABEL_PT, 100.0)
    assert all(b - a >= LABEL_PT - 1e-9 for a, b in itertools.pairwise(places))
    assert places[-1] <= 100


@pytest.mark.parametrize(("ns", "said"), [(10, "10 ns"), (1e3, "1 µs"), (1e6, "1 ms"), (1e10, "10 s")])
def test_times_are_said_in_their_own_unit(ns, said):
    assert duration(ns) == said


@compiled
def test_an_exact_model_with_the_true_velocity_is_expected_to_be_right():
    tank = expected(TANK)
    assert tank.cost_ns > 0
    assert tank.known_velocity_share < 1e-10
    assert 0.01 < tank.error_share < 0.5
    assert expected(TANK.model_copy(update={"velocity": Given()})).error_share < 1e-10
    local = LocalWake(length=300, scaling=300)
    places = WATER.model_copy(update={"effects": ("drag", "local_wake"), "local_wake": local})
    assert expected(Scene(liquids=(places,))).known_velocity_share < 0.05


@compiled
def test_what_a_scene_leaves_out_is_expected_to_be_missing():
    named = HONEY.model_copy(update={"effects": ("drag",), "drag": Drag(law="haider-levenspiel")})
    lacking = expected(REAL.model_copy(update={"liquids": (named,)}))
    whole = expected(REAL)
    assert whole.known_velocity_share < 0.05
    assert lacking.known_velocity_share > 0.4
    both = expected(REAL.model_copy(update={"liquids": (HONEY, named.model_copy(update={"id": "other"}))}))
    assert both.error_n == pytest.approx(lacking.error_n)
    assert "drag by experiments" in both.against
    assert expected(Scene()).error_n == 0


@compiled
def test_the_expected_error_is_reported_in_a_line():
    line = error_report(TANK)
    assert "of the force; none if velocities were known exactly; against the definition of drag and wake" in line
    assert "\n" not in line


def test_the_force_of_a_slow_stroke_is_that_of_creeping_flow():
    """Far below Re 1 the drag by experiments is Stokes', within their scatter, and the rest is exact."""
    omega, v = 10.0, 1e-3
    t_s = stroke(v, omega, 1, 1000).t_s
    force = physical_n(REAL, v, omega, t_s)
    radius, mu, rho = 0.034, 10.0, 1420.0
    delta = math.sqrt(2 * mu / (rho * omega))
    at_rest = round(math.pi / omega * 1000)  # v = 0, dv/dt = −ω v
    inertia = 3 * math.pi * radius**2 * math.sqrt(2 * mu * rho / omega) * (1 + 2 * radius / (9 * delta))
    assert force[at_rest, 0] == pytest.approx(inertia * omega * v, rel=0.01)
    fastest = round(math.pi / 2 / omega * 1000)
    damping = 6 * math.pi * mu * radius * (1 + radius / delta)
    assert force[fastest, 0] == pytest.approx(-damping * v, rel=0.12)
    lift = (rho - 1000) * 4 / 3 * math.pi * radius**3 * 9.80665
    assert force[:, 1] == pytest.approx(lift)


def test_what_the_command_cannot_do_is_said_in_a_line():
    for words, said in (
        (["--liquid", "watr"], "there are water"),
        (["rek2024"], "say which --liquid of"),
        (["--liquid", "water", "--path", "circl"], "did you mean 'circle'"),
    ):
        refused = CliRunner().invoke(commands, ["accuracy", *words])
        assert refused.exit_code != 0
        assert said in f"{refused.output}{refused.exception}"


@compiled
def test_a_motion_that_meets_no_force_is_refused():
    rest = Motion(np.arange(100) / 1000, np.zeros((100, 3)))
    with pytest.raises(StudyError, match="along a rest water exerts no force"):
        accuracy(TANK, None, rest, named="a rest")


def test_a_motion_file_of_another_rate_is_brought_to_the_scenes(tmp_path):
    rows = "\n".join(f"{k / 50},{k / 100},0,0" for k in range(21))
    (tmp_path / "slow.csv").write_text(f"t_s,x_m,y_m,z_m\n{rows}\n", encoding="utf-8")
    read = motion_along(str(tmp_path / "slow.csv"), TANK)
    assert read.t_s == pytest.approx(np.arange(401) / 1000)
    assert read.position_m[:, 0] == pytest.approx(read.t_s / 2)


@compiled
def test_the_command_prints_the_table_of_one_liquid(tmp_path):
    small = tmp_path / "small.toml"
    small.write_text("[liquids.gel]\ndensity_kg_m3 = 1000\n", encoding="utf-8")
    rows = "\n".join(f"{k / 1000},{k / 4000},0,0" for k in range(50))
    (tmp_path / "move.csv").write_text(f"t_s,x_m,y_m,z_m\n{rows}\n", encoding="utf-8")
    told = CliRunner().invoke(commands, ["accuracy", str(small), "--path", str(tmp_path / "move.csv")])
    assert told.exit_code == 0, told.output
    assert "gel has no viscosity" in told.output
    assert "central differences" in told.output
    assert "the motion is short: calls, of some µs, count in times of 5 ticks a batch" in told.output
    assert "| drag |" in told.output


def test_the_default_subjects_are_at_hand():
    assert load_scene("rek2024", "water").liquids[0].wake is not None
    assert load_scene("physical_liquids", "honey").liquids[0].viscosity_pa_s is not None
