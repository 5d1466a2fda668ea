"""Simulations of the tab Measures: their process, their power is that of the command, and when they are repeated."""

from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.designer.document.document import template
from study_app.designer.document.study import Study, read_study
from study_app.designer.document.toml_edits import Set, Unset
from study_app.designer.measures.simulation import (
    Simulated,
    Simulation,
    run_simulation,
    simulation_of,
    start_measure_worker,
)
from study_app.protocol.source.files import shipped_file
from study_app.protocol.warnings.expected_precision import imprecise
from study_app.workers.server import Stopped

BLOCK = ("blocks", "viscosity")
SHORT = Unset((*BLOCK, "break_every")), Unset((*BLOCK, "break_page")), Unset(("pages", "rest")), Set(
    ("methods", "adaptive", "trials"), 4)  # fmt: skip


def short_study() -> Study:
    """Return a study whose power is simulated in seconds."""
    return template("viscosity-jnd").with_edits(*SHORT)[0]


def order(study: Study, *, power: bool = True) -> Simulation:
    assert study.protocol is not None
    wanted = simulation_of(study.protocol, power=power)
    assert wanted is not None
    return wanted


@pytest.mark.slow
@pytest.mark.nightly
def test_the_process_shows_the_output_of_the_command_power(tmp_path: Path) -> None:
    file = tmp_path / "short.toml"
    study = short_study()
    file.write_bytes(study.text.encode())
    client = start_measure_worker()
    client.order(order(study))
    answers: list[Any] = []
    while not answers or answers[-1].waiting:
        answers += [answer for _, answer in client.answers(0.5)]
    client.close()
    printed = CliRunner().invoke(commands, ["power", str(file), "--workers", "1"], catch_exceptions=False).output
    assert answers[-1].table == printed
    tables = [answer.table for answer in answers if answer.table]
    assert len(tables) > 5
    assert "200 studies" in tables[-1]


@pytest.mark.slow
def test_warnings_by_simulated_observers_equal_those_of_check() -> None:
    study = template("viscosity-jnd").with_edits(Set(("analysis", "participants"), 4))[0]
    protocol = study.protocol
    assert protocol is not None
    warnings = run_simulation(order(study, power=False), print, lambda: False).warnings
    assert warnings == tuple(imprecise(protocol, protocol.blocks["viscosity"]))
    assert warnings


@pytest.mark.slow
def test_a_simulation_ends_between_two_batches() -> None:
    sent: list[Simulated] = []
    with pytest.raises(Stopped):
        run_simulation(order(short_study()), sent.append, lambda: any(answer.table for answer in sent))
    assert [answer.waiting for answer in sent] == [
        "predicting which trials can be delivered…",
        "simulating observers…",
        "10 of 200 studies simulated per sample size",
    ]
    assert [bool(answer.table) for answer in sent] == [False, False, True]
    assert "**Preliminary: 10 of 200 studies were simulated.**" in sent[-1].table


def test_a_simulation_depends_on_forces_tasks_and_titles_but_on_no_other_text() -> None:
    study = read_study(shipped_file("rek2024").read_bytes(), shipped_file("rek2024").parent)

    def changed(*changes: Set) -> Simulation:
        return order(study.with_edits(*changes)[0])

    assert changed() == changed(Set(("pages", "consent", "title", "en"), "Hello"))
    assert changed() != changed(Set(("blocks", "liquids", "title", "en"), "Other")), "the table of power names it"
    assert changed() != changed(Set(("liquids", "honey", "density_kg_m3"), 1300))
    assert changed() != changed(Set(("tasks", "explore", "max_s"), 61))


def test_an_order_is_given_up_before_its_first_number() -> None:
    with pytest.raises(Stopped):
        run_simulation(order(short_study()), print, lambda: True)
