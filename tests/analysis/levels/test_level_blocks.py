"""Blocks with designs, read from a receipt."""

from pathlib import Path

import pytest

from study_app.analysis.tables.level_blocks import LevelBlock, level_blocks
from study_app.protocol.load import load, parse
from study_app.protocol.trials.tracks import default_design, design_of, stimulus_of
from study_app.store.receipt import without_conditions

SMALLEST = """
format = 2
study.name = "smallest"
[liquids.damper]
drag = { law = "linear", damping_nspm = 8 }
[tasks.stir]
kind = "follow"
[stimuli.damping]
vary = "damping_nspm"
levels = [0.02, 0.6]
[methods.few]
kind = "constant"
[blocks.thicker]
stimulus = "damping"
design = "2ifc"
method = "few"
"""


def test_a_sealed_receipt_without_a_table_of_designs_has_the_default_design(tmp_path: Path) -> None:
    path = tmp_path / "smallest.toml"
    path.write_text(SMALLEST)
    (block,) = level_blocks(without_conditions(load(str(path))), key=None)
    assert (block.id, block.design) == ("thicker", default_design("2ifc"))


@pytest.mark.parametrize(
    ("design", "counts"), [("oddity", "correct"), ("samedifferent", "correct"), ("2ifc", "comparison chosen")]
)
def test_values_count_correct_answers_where_there_are_any(design: str, counts: str) -> None:
    text = SMALLEST.replace("[0.02, 0.6]", '[4, 16]\nlevel = "value"').replace('"2ifc"', f'"{design}"')
    protocol = parse(text.encode(), "values.toml")
    block = protocol.blocks["thicker"]
    found = LevelBlock("thicker", "Thicker", "main", design_of(protocol, block), stimulus_of(protocol, block), ())
    assert found.counts == counts
