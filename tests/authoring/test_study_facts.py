import itertools

import pytest

from study_app.authoring.edited_study import Study, read
from study_app.authoring.study_facts import facts
from study_app.protocol.describe import describe
from study_app.protocol.levels.presented_levels import levels
from study_app.protocol.load import load, shipped
from study_app.protocol.orders.schedule import FormStep, Trial, build_schedule
from tests.authoring.grown import PROTOCOLS


def study_of(name: str, *changes: tuple[str, str]) -> Study:
    text = (PROTOCOLS / f"{name}.toml").read_text(encoding="utf-8")
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return read(text.encode(), PROTOCOLS)


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


def test_facts_count_the_texts_that_each_language_lacks() -> None:
    study = study_of(
        "rek2024",
        ('title = { en = "Welcome", nl = "Welkom" }', 'title = { en = "Welcome" }'),
        ('short = { en = "Immersive", nl = "Meeslepend" }', 'short = { en = "Immersive" }'),
    )
    assert facts(study).missing == {"nl": 2}
    assert facts(study).expected_s == pytest.approx(facts(study_of("rek2024")).expected_s, rel=0.01)


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
