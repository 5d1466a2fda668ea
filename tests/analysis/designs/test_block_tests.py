"""What many participants and many statements could show is never cut short by how p was found."""

from dataclasses import replace

import numpy as np
import pytest

from study_app.analysis.designs.block_tests import MANY, Asked, of_tables
from study_app.analysis.findings.other_assumptions import asked_again
from study_app.analysis.findings.over_all_statements import over_all
from study_app.analysis.findings.settings_differ import compared
from study_app.analysis.statistics.outcome import DRAWS
from study_app.analysis.tables.compared_blocks import Block, Item, Setting
from study_app.analysis.tables.planned_analysis import NOTHING

pytestmark = pytest.mark.slow

DECIDED = replace(NOTHING, made=True)


def block(statements: int, settings: int = 4) -> Block:
    items = tuple(Item(f"s{number}", f"Statement {number}.", f"S{number}") for number in range(statements))
    codes = tuple(Setting(f"L{number}") for number in range(1, settings + 1))
    return Block("liquids", "Liquids", "liquids", codes, items, tuple("1234567"), None)


def answers(block_: Block, people: int, alpha: float = 0.05, *, gaps: bool = False) -> Asked:
    """Return random answers of so many people; settings differ in the first statement alone."""
    rng = np.random.default_rng(3)
    values = {item.id: rng.integers(1, 8, (people, len(block_.codes))).astype(float) for item in block_.items}
    values["s0"] += np.arange(len(block_.codes))
    if gaps:
        for rows in values.values():
            rows[rng.random(rows.shape) < 0.05] = np.nan
    names = tuple(f"P{number:04d}" for number in range(people))
    single = {item: rows[:, :, None] for item, rows in values.items()}
    return of_tables(block_, replace(DECIDED, alpha=alpha), names, single)


@pytest.mark.nightly
def test_in_a_large_family_of_many_people_nothing_is_out_of_reach() -> None:
    asked = answers(block(40), MANY + 50, gaps=True)
    omnibus, _ = compared(asked)
    assert omnibus[0].verdict == "shown"
    assert {one.verdict for one in omnibus[1:]} <= {"shown", "not shown"}
    assert omnibus[0].outcome.n < MANY
    assert "Monte Carlo" in omnibus[0].outcome.method
    whole, _ = compared(answers(block(40), MANY + 50))
    assert "chi-square approximation" in whole[0].outcome.method
    assert {one.verdict for one in whole} <= {"shown", "not shown"}
    again = asked_again(asked, None, "the settings")[0].incomplete
    assert {one.verdict for one in again} <= {"suggested", "not shown"}
    assert again[0].outcome.p is not None
    assert again[0].outcome.p < 1e-4
    together = over_all(asked)
    assert together is not None
    assert together.p is not None
    assert together.p <= 0.05 / 20


@pytest.mark.parametrize(("statements", "alpha"), [(5, 0.05), (40, 0.05), (9, 0.001), (100, 0.01)])
@pytest.mark.parametrize("people", [20, MANY + 1])
def test_draws_are_so_many_that_they_decide_nothing(statements: int, alpha: float, people: int) -> None:
    asked = answers(block(statements, settings=3), people, alpha)
    assert statements / (1 + asked.draws) <= alpha / 20
    assert 1 / (1 + asked.draws_over_all) <= alpha / 20
    assert asked.draws >= DRAWS
