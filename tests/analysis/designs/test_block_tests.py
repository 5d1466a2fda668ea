"""What many participants and many statements could show is never cut short by how p was found."""

from dataclasses import replace

import numpy as np
import pytest

from study_app.analysis.designs.block_tests import MANY, Asked, of_tables
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


@pytest.mark.parametrize(("statements", "alpha"), [(5, 0.05), (40, 0.05), (9, 0.001), (100, 0.01)])
@pytest.mark.parametrize("people", [20, MANY + 1])
def test_draws_are_so_many_that_they_decide_nothing(statements: int, alpha: float, people: int) -> None:
    asked = answers(block(statements, settings=3), people, alpha)
    assert statements / (1 + asked.draws) <= alpha / 20
    assert 1 / (1 + asked.draws_over_all) <= alpha / 20
    assert asked.draws >= DRAWS
