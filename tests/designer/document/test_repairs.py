"""Repairs of the known faults, each of which removes its fault; what the facts of a study count."""

import itertools

import pytest

from study_app.designer.document.additions import repairs
from study_app.designer.document.study import Study, read
from study_app.designer.document.toml_edits import Set
from study_app.designer.measures.study_facts import facts
from study_app.designer.new_study.new_study import template
from study_app.protocol.describe import describe
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import FormStep, Trial, build_schedule
from study_app.protocol.source.files import shipped
from study_app.protocol.trials.presented_levels import levels
from tests.designer.document.grown import PROTOCOLS
from tests.protocol.faulty_protocols import CASES, Case


def study_of(name: str, *changes: tuple[str, str]) -> Study:
    text = (PROTOCOLS / f"{name}.toml").read_text(encoding="utf-8")
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return read(text.encode(), PROTOCOLS)


@pytest.mark.slow
def test_each_repair_of_the_known_faults_removes_its_fault() -> None:
    repaired = {case.name for case in CASES if _repaired(case)}
    assert len(repaired) >= 30, sorted(repaired)


def _repaired(case: Case) -> int:
    study = read(case.text.encode())
    count = 0
    for fault in study.faults:
        for repair in repairs(study, fault):
            after, _ = study.edited(*repair.edits)
            assert (fault.path, fault.message) not in {(one.path, one.message) for one in after.faults}
            count += 1
    return count


@pytest.mark.slow
def test_a_level_beyond_the_slope_limit_is_repaired_by_the_highest_that_passes() -> None:
    study = study_of("viscosityjnd", ("levels = [0.02, 0.6]", "levels = [0.02, 3]"))
    (fault,) = study.faults
    (repair,) = repairs(study, fault)
    assert repair.words.startswith("Highest level ")
    after, _ = study.edited(*repair.edits)
    assert after.protocol is not None
    highest = after.document["stimuli"]["damping"]["levels"][1]
    above = study.text.replace("levels = [0.02, 3]", f"levels = [0.02, {highest * 1.01}]")
    assert read(above.encode()).protocol is None


@pytest.mark.slow
@pytest.mark.parametrize(
    ("standard", "frequency_hz", "limit", "most"),
    [(40, 1.0, "the slope limit", 0.324), (30, 1.3, "device.force_limit_n", 0.36)],
)
def test_the_highest_level_is_that_of_fixed_levels_too(
    standard: float, frequency_hz: float, limit: str, most: float
) -> None:
    edits = Set(("stimuli", "damping", "standards"), [standard]), Set(("tasks", "stir", "frequency_hz"), frequency_hz)
    study, _ = template("viscosity-jnd").edited(*edits)
    (fault,) = study.faults  # one for both blocks
    assert limit in fault.message
    (repair,) = repairs(study, fault)
    assert repair.words == f"Highest level {most:g}"
    after, _ = study.edited(*repair.edits)
    assert after.document["stimuli"]["damping"]["levels"] == (0.02, most)
    assert after.document["methods"]["easy"]["levels"] == (most,)


def test_a_fault_of_a_table_that_two_blocks_name_counts_once() -> None:
    changes = Set(("stimuli", "damping", "level"), "value"), Set(("stimuli", "damping", "levels"), [9, 40])
    study, _ = template("viscosity-jnd").edited(*changes, Set(("methods", "easy", "levels"), [12]))
    assert [fault.path for fault in study.faults].count(("designs", "pair", "feedback")) == 1


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped())
def test_facts_are_those_of_the_session_and_of_check(name: str) -> None:
    study = study_of(name)
    assert study.protocol is not None
    found = facts(study)
    steps = build_schedule(study.protocol, "P001", 1).steps
    assert found.trials == sum(isinstance(step, Trial) for step in steps)
    assert found.answers == sum(len(step.items) for step in steps if isinstance(step, Trial | FormStep))
    assert found.expected_s == pytest.approx(sum(found.steps_s.values()))
    words = describe(study.protocol)
    assert f"about {found.expected_s / 60:.0f} min" in words
    assert all(warning in words for warning in found.warnings)
    assert set(found.forces_n) == set(study.protocol.liquids)
    assert found.missing == {}


@pytest.mark.parametrize(
    ("name", "block"), [("viscosityjnd", "viscosity"), ("delayjnd", "delay"), ("thickness", "thickness")]
)
def test_no_level_of_a_shipped_study_is_clipped(name: str, block: str) -> None:
    found = levels(load(name), block)
    assert found
    assert not [level for level in found if level.clipped_by]
    assert all(later.level > level.level for level, later in itertools.pairwise(found)
               if level.standard == later.standard)  # fmt: skip


def test_levels_say_which_limit_clips_them() -> None:
    protocol = load("viscosityjnd")
    slow = protocol.device.model_copy(update={"rate_hz": 500.0})
    weak = protocol.device.model_copy(update={"force_limit_n": 2.0})
    by = {
        device: {level.clipped_by for level in levels(protocol.model_copy(update={"device": one}), "viscosity")}
        for device, one in (("slow", slow), ("weak", weak))
    }
    assert "slope" in by["slow"]
    assert "norm" in by["weak"]
    clipped = [level for level in levels(protocol.model_copy(update={"device": weak}), "viscosity") if level.clipped_by]
    assert all(level.asked_n > level.sent_n == 2.0 for level in clipped)  # type: ignore[operator]
    assert levels(load("demo"), "liquids") == ()
