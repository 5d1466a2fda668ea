"""Numbers of Measures that take simulations: from the worker to their cards, and while a part is broken."""

from concurrent.futures import Executor, Future
from dataclasses import replace
from typing import Any

import pytest

from study_app.analysis.planning.threshold_studies import Precisions, plans, sweep, threshold_markdown
from study_app.designer.document.document import template
from study_app.designer.document.steps import DuplicateElement, RetypeFile, Situation
from study_app.designer.document.study import read_study
from study_app.designer.document.toml_edits import Set, Unset
from study_app.designer.measures.simulation import (
    ENOUGH,
    THRESHOLD_STUDIES,
    Controls,
    Focus,
    Simulation,
    focus_of,
    run_simulation,
    simulate_observers,
    simulation_of,
    start_measure_worker,
)
from study_app.protocol.load import load
from study_app.protocol.source.files import shipped_file
from study_app.protocol.warnings.expected_precision import imprecise, threshold_plan
from study_app.workers.server import Crashed, Stopped
from tests.designer.measures.conftest import Worker, jnd, shown

UNKNOWN, ANEW, FAILED = "–", "simulating …", "simulation failed"


@pytest.mark.slow
def test_slow_numbers_come_are_given_up_and_are_kept(qtbot: Any, designer: Any, worker: Worker) -> None:
    jnd(designer)
    page = designer.place.measures
    qtbot.waitUntil(lambda: bool(worker.orders))
    assert page.numbers.parts[0].number.text() == UNKNOWN
    assert page.numbers.parts[0].note.text() == ANEW
    assert page.numbers.parts[3].number.text() != UNKNOWN  # how long it lasts is known at once
    worker.answer()
    shown(qtbot, designer, 0, "5 – 50")
    shown(qtbot, designer, 1, "± 26")
    shown(qtbot, designer, 2, "93")
    assert designer.place.header.problems.words == "1 warning"  # that of the precision takes simulated observers
    assert page.function.plot.accessibleDescription().startswith("Proportion of answers that are correct")
    assert "19 %" in page.track.plot.accessibleDescription()
    assert page.forces.plot.accessibleDescription().startswith("Force at 31 levels")
    assert not page.grid.isVisible()  # its cards stay below other tabs

    designer.editing.make_step("Change", Set(("methods", "adaptive", "trials"), 60))
    qtbot.waitUntil(lambda: len(worker.orders) == 2)
    assert page.numbers.parts[1].note.text() == ANEW  # grey, with the number of before
    assert page.numbers.parts[1].number.text() == "± 26"
    assert page.function.plot.grey
    designer.editing.make_step("Change", Set(("methods", "adaptive", "trials"), 100))
    qtbot.waitUntil(lambda: worker.stops == 1)  # what was under way is given up
    qtbot.waitUntil(lambda: len(worker.orders) == 3)
    assert worker.orders[2].protocol.methods["adaptive"].trials == 100
    designer.editing.undo()
    designer.editing.undo()
    qtbot.waitUntil(lambda: not page.function.plot.grey)  # kept by what it depends on
    qtbot.wait(120)
    assert len(worker.orders) == 3
    designer.editing.make_step("Change", Set(("pages", "welcome", "title"), "Hello"))
    qtbot.wait(120)
    assert len(worker.orders) == 3  # nothing depends on a text

    designer.window.go("home")
    assert not worker.works  # a session may begin: nothing is simulated any more
    assert not designer.controller.measures.rest.isActive()


@pytest.mark.slow
def test_numbers_say_that_their_simulation_crashed(qtbot: Any, designer: Any, worker: Worker) -> None:
    jnd(designer)
    qtbot.waitUntil(lambda: bool(worker.orders))
    jnds, one, people, _ = designer.place.measures.numbers.parts
    assert {part.note.text() for part in (jnds, one, people)} == {ANEW}
    assert designer.place.measures.function.legend.text().casefold() == ANEW
    worker.given.append((1, Crashed(1)))
    qtbot.waitUntil(lambda: people.note.text() == FAILED)
    assert {part.number.text() for part in (jnds, one, people)} == {UNKNOWN}
    assert people.more.text() == "The process ended with exit code 1; the terminal may show why."
    designer.editing.make_step("Change", Set(("methods", "adaptive", "trials"), 60))
    qtbot.waitUntil(lambda: len(worker.orders) == 2)
    assert people.note.text() == ANEW  # another study, another try


@pytest.mark.slow
def test_without_a_process_the_other_numbers_stay(qtbot: Any, designer: Any) -> None:
    designer.controller.measures.rest.setInterval(10)
    jnd(designer)
    part = designer.place.measures.numbers.parts[1]
    qtbot.waitUntil(lambda: part.note.text() == FAILED)
    assert part.more.text() == "The simulation process does not start."
    assert designer.place.measures.function.legend.text() == FAILED.capitalize()
    assert designer.place.measures.numbers.parts[3].number.text() == "17"


BLOCK = ("blocks", "viscosity")
NO_BREAKS = Unset((*BLOCK, "break_every")), Unset((*BLOCK, "break_page")), Unset(("pages", "rest"))


def order(trials: int, **controls: float) -> Simulation:
    """Return the simulation of the block of a template with so many trials."""
    study, _ = template("viscosity-jnd").with_edits(Set(("methods", "adaptive", "trials"), trials), *NO_BREAKS)
    assert study.protocol is not None
    focus = focus_of(study.protocol, BLOCK)
    found = simulation_of(study.protocol, focus, Controls(**controls))  # type: ignore[arg-type]
    assert found is not None
    return found


@pytest.mark.slow
@pytest.mark.nightly
def test_the_worker_process_simulates_observers_and_studies() -> None:
    client = start_measure_worker()
    client.order(order(20, participants=6, precision=0.5, threshold=0.2))
    found: list[Any] = []
    for _ in range(600):
        found += client.answers(0.5)
        if found:
            break
    client.close()
    ((_, last),) = found
    assert last.observed.threshold == 0.2
    assert 0.0 <= last.group.share <= 1.0
    assert last.group.more_trials > last.group.trials == 20
    assert last.measurable is not None


@pytest.mark.slow
def test_numbers_of_what_is_broken_stay_in_grey(qtbot: Any, designer: Any, worker: Worker) -> None:
    jnd(designer)
    page = designer.place.measures
    qtbot.waitUntil(lambda: bool(worker.orders))
    worker.answer()
    shown(qtbot, designer, 2, "93")
    before = [part.number.text() for part in page.numbers.parts]
    grey = page.grid.theme.text3
    ink = lambda part: part.number.palette().color(part.number.foregroundRole()).name().upper()  # noqa: E731
    designer.editing.make_step("Break", Set(("tasks", "stir", "frequency_hz"), -1))
    qtbot.waitUntil(page.earlier.isVisible)
    assert [part.number.text() for part in page.numbers.parts] == before
    assert {ink(part) for part in page.numbers.parts} == {grey}
    assert page.function.plot.grey  # drawn in grey, too
    assert "last valid state" in page.earlier.text()
    designer.editing.undo()
    qtbot.waitUntil(lambda: not page.earlier.isVisible())
    designer.editing.handle_request(RetypeFile(designer.text.replace("[study]", "[study")))
    qtbot.waitUntil(page.earlier.isVisible)
    assert [part.number.text() for part in page.numbers.parts] == before
    designer.editing.undo()
    qtbot.waitUntil(lambda: not page.earlier.isVisible())
    assert grey not in {ink(part) for part in page.numbers.parts}
    assert not page.function.plot.grey


class Serial(Executor):
    """Computes each case at once."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


@pytest.mark.nightly
@pytest.mark.slow
def test_the_share_of_studies_is_that_of_the_command_power() -> None:
    protocol = template("viscosity-jnd").protocol
    assert protocol is not None
    planned = plans(protocol, (20,))
    ((done, found),) = list(sweep(planned, (6,), THRESHOLD_STUDIES, 1, Serial()))[-1:]
    group = run_simulation(order(20, participants=6, precision=0.5), print, lambda: False).group
    assert group is not None
    assert done == group.studies
    assert group.share == found["viscosity", 20].within(0, 0.5)
    assert 0.0 < group.share < ENOUGH
    enough = []
    for sizes in (range(7, 13), range(13, 25)):
        ((_, found),) = list(sweep(planned, sizes, THRESHOLD_STUDIES, 1, Serial()))[-1:]
        enough += [size for at, size in enumerate(sizes) if found["viscosity", 20].within(at, 0.5) >= ENOUGH]
    assert group.enough == enough[0]


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("bound", [None, 1.25])
def test_what_studies_show_of_a_contrast_is_that_of_the_command_power(bound: float | None) -> None:
    study, _ = template("viscosity-jnd").with_edits(*NO_BREAKS, Set(("methods", "adaptive", "trials"), 20))
    step = DuplicateElement(("blocks", "viscosity")).step(Situation(study))
    contrast = {"measure": "threshold", "blocks": ["viscosity", "viscosity_2"]} | ({"bound": bound} if bound else {})
    protocol = study.with_edits(*step.edits, Set(("analysis", "contrasts"), [contrast]))[0].protocol
    assert protocol is not None
    focus = focus_of(protocol, ("sequence",))
    wanted = simulation_of(protocol, focus, Controls(participants=30))
    assert wanted is not None
    assert wanted.block == "viscosity"
    ((_, said),) = run_simulation(wanted, print, lambda: False).hypotheses
    ((done, found),) = list(sweep(plans(protocol, ()), (30,), 10, 1, Serial()))[-1:]
    (row,) = [
        line
        for line in threshold_markdown(
            Precisions(protocol=protocol, sizes=(30,), studies=done, asked=done, seed=1, found=found)
        ).splitlines()
        if line.startswith("| 20 | 30 | ") and "×/÷" in line
    ]
    shown, planned = (said.split("%")[0], row.split("|")[-2]) if bound else (said.split()[-1], row.split("×/÷ ")[-1])
    assert float(shown) == pytest.approx(float(planned.strip(" |%")), rel=0.05)


@pytest.mark.slow
def test_warnings_that_take_simulated_observers_are_those_of_check() -> None:
    protocol = template("viscosity-jnd").with_edits(Set(("analysis", "participants"), 4))[0].protocol
    assert protocol is not None
    wanted = simulation_of(protocol, Focus(), Controls())
    assert wanted is not None
    warnings = run_simulation(wanted, print, lambda: False).warnings
    assert warnings == tuple(imprecise(protocol, protocol.blocks["viscosity"]))
    assert warnings


def test_what_is_wanted_depends_on_forces_and_tasks_and_on_no_text() -> None:
    study = read_study(shipped_file("rek2024").read_bytes(), shipped_file("rek2024").parent)
    path = ("blocks", "liquids")

    def wanted(*changes: Set) -> Simulation:
        changed, _ = study.with_edits(*changes)
        assert changed.formed is not None
        one = simulation_of(changed.formed, focus_of(changed.formed, path), Controls())
        assert one is not None
        return one

    same = wanted(Set(("blocks", "liquids", "title", "en"), "Other"), Set(("pages", "consent", "title", "en"), "Hello"))
    assert wanted() == same
    assert wanted() != wanted(Set(("liquids", "honey", "density_kg_m3"), 1300))
    assert wanted() != wanted(Set(("tasks", "explore", "max_s"), 61))


def test_an_order_is_given_up_before_its_first_number() -> None:
    with pytest.raises(Stopped):
        run_simulation(order(20), print, lambda: True)


def test_observers_of_evenly_spaced_levels_are_shown() -> None:
    protocol = load("viscosityjnd")
    plan = threshold_plan(protocol, protocol.main_blocks[0])
    assert plan is not None
    even = replace(plan, stimulus=plan.stimulus.model_copy(update={"spacing": "linear"}))
    found = simulate_observers(even, 0.3, 0.02)
    assert 0.5 < found.planted[0] < found.at_threshold < found.planted[-1]
    assert found.observers > 0
