from study_app.protocol.describe import describe
from study_app.protocol.load import load, parse
from tests.protocol.trials.level_studies import study
from tests.protocol.trials.test_due import CONDITIONS


def test_a_block_of_levels_is_described_by_design_levels_and_comparisons() -> None:
    lines = describe(study()).splitlines()
    rows = {line.split("  ")[1].strip(): " ".join(line.split()) for line in lines if line.startswith("  ")}
    assert rows["Design"] == "Design 2IFC of viscosity_pa_s, standard 1, 2: 2 intervals, 0.6 s apart"
    assert rows["Levels"] == "Levels Weber fraction 0.2 to 0.8 (constant), 24 trials per standard"
    assert rows["Comparisons"] == "Comparisons viscosity_pa_s from 1.2 to 3.6 Pa·s"
    assert "None" not in describe(study())


def test_a_paced_damper_is_described_by_its_strongest_force_and_the_slope_limit_of_the_device() -> None:
    protocol = load("viscosityjnd")
    assert protocol.blocks["viscosity"].stimulus == "damping"
    said = " ".join(describe(protocol).split())
    assert "Force at the pace 0.5 to 6.4 N at 0.126 m/s, at most 7.7 N at 1.2 times the pace" in said
    assert "Damping at most 51.2 N·s/m at the hand; the slope limit is 53 " in said
    assert "the slope limit is 20.6 " in " ".join(describe(protocol, delay_ticks=2).split())


def test_compared_conditions_are_described_by_their_standard() -> None:
    assert "ABX against oil: 3 intervals, 0.6 s apart" in describe(study(CONDITIONS))


def test_levels_that_are_values_have_no_standard() -> None:
    text = """
format = 2
study.name = "thickness"
scene.scale = 3
liquids.oil = { density_kg_m3 = 1260, viscosity_pa_s = 4, drag.law = "haider-levenspiel" }
tasks.stir.kind = "follow"
stimuli.viscosity = { vary = "viscosity_pa_s", level = "value", levels = [0.5, 20] }
methods.nine = { kind = "constant", levels = 9, repetitions = 4 }
blocks.thickness = { stimulus = "viscosity", design = "estimation", method = "nine" }
"""
    said = " ".join(describe(parse(text.encode(), "thickness")).split())
    assert "Levels value 0.5 to 20 (constant), 36 trials Comparisons" in said
