"""Blocks with designs, read from a receipt."""

from __future__ import annotations

from pathlib import Path

from study_app.analysis.tables.level_blocks import level_blocks
from study_app.protocol.load import load
from study_app.protocol.trials.tracks import default_design
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
