"""The page about trials of intervals: its example is a study, and its table names every design."""

import re
from pathlib import Path

from study_app.protocol.load import parse
from study_app.protocol.orders.block_orders import orders_of
from study_app.protocol.trials.kinds import DESIGN_KINDS
from study_app.protocol.trials.tracks import design_of

PAGE = (Path(__file__).parents[3] / "docs" / "trials.md").read_text(encoding="utf-8")


EXAMPLE, ESTIMATION, ADJUSTMENT = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)


def test_example_of_the_page_is_a_study() -> None:
    assert orders_of(parse(EXAMPLE.encode(), "example")).answers == 140


def test_example_of_estimation_replaces_stimulus_and_block_of_the_first() -> None:
    start, method, end = (EXAMPLE.index(table) for table in ("[stimuli", "[methods", "[blocks"))
    study = parse((EXAMPLE[:start] + EXAMPLE[method:end] + ESTIMATION).encode(), "example")
    assert orders_of(study).answers == 140
    assert design_of(study, study.blocks["thickness"]).reply == "number"


def test_example_of_adjustment_replaces_stimulus_method_and_block_of_the_first() -> None:
    study = parse((EXAMPLE[: EXAMPLE.index("[stimuli")] + ADJUSTMENT).encode(), "example")
    assert orders_of(study).answers == 10
    assert design_of(study, study.blocks["matching"]).adjusts


def test_table_of_the_page_names_every_design() -> None:
    rows = [line for line in PAGE.splitlines() if line.startswith("| `")]
    assert set(DESIGN_KINDS) <= {name for row in rows for name in re.findall(r"`(\w+)`", row.split("|")[1])}
