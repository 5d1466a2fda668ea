"""What helps where a study cannot take a series of elements."""

import pytest

from study_app.app.designer.edit_steps import Steps
from study_app.app.designer.series_steps import judged_series
from study_app.authoring.edited_study import Study, read
from study_app.protocol.source.document import value_at
from study_app.viewmodels.designer.prompts import SeriesPlan
from study_app.viewmodels.designer.requests import MakeSeries
from tests.authoring.grown import PROTOCOLS

pytestmark = pytest.mark.slow


WATER, NO_DELAY = ("conditions", "water"), ("conditions", "delay_0")
SYRUP = ("liquids", "syrup")
BASELINE, DELAYS = ((("blocks", name, "conditions")) for name in ("baseline", "delays"))
ALONE, LEFT_OUT = "Leave Baseline as it is", "Leave out 50 ms"


@pytest.fixture(scope="module")
def study() -> Study:
    """A study with a block of liquids, and a condition that a baseline has alone and another block with delays."""
    return read((PROTOCOLS / "rek2024.toml").read_bytes(), PROTOCOLS)


def judged(study: Study, path: tuple[str, str], values: str, key: str = "delay_ms") -> SeriesPlan | None:
    """Return what is shown last of a series of delays, None where it can be made."""
    plans = [one for one in judged_series(study, MakeSeries(path, (*path, key), values)) if one is not None]
    return plans[-1] if plans else None


def words_of(plan: SeriesPlan | None) -> list[str]:
    assert plan is not None
    return [way.words for way in plan.ways]


def made(study: Study, plan: SeriesPlan | None, words: str) -> Study:
    """Return the study after one of the ways of a plan, which causes no problem."""
    assert plan is not None
    way = next(one for one in plan.ways if one.words == words)
    after, _ = study.edited(*Steps().step(study, way.asks).edits)
    assert after.faults == ()
    return after


def listed(study: Study, path: tuple[str, ...]) -> list[str]:
    return list(value_at(study.document, path))


def test_the_block_that_is_the_cause_alone_stays_as_it_is(study: Study) -> None:
    plan = judged(study, NO_DELAY, "0 30 60")
    assert ALONE in words_of(plan)
    after = made(study, plan, ALONE)
    assert listed(after, BASELINE) == ["delay_0"]
    assert listed(after, DELAYS)[:4] == ["delay_0", "delay_30", "delay_60", "delay_50"]


def test_values_that_cause_a_problem_are_named_and_left_out(study: Study) -> None:
    plan = judged(study, NO_DELAY, "0 30 50 60")
    assert plan is not None
    assert plan.refusal == '50 ms: Delay effect, Conditions: "delay_50" presents the same as "delay_50_2".'
    after = made(study, plan, f"{LEFT_OUT}, and leave Baseline as it is")
    assert listed(after, DELAYS)[:4] == ["delay_0", "delay_30", "delay_60", "delay_50"]
    without, _ = study.edited(
        *Steps().step(study, MakeSeries(NO_DELAY, (*NO_DELAY, "delay_ms"), "1 2", kept=(BASELINE,))).edits
    )
    again = judged(without, ("conditions", "delay_2"), "2 30 50")
    assert words_of(again)[0] == LEFT_OUT
    assert "delay_30" in made(without, again, LEFT_OUT).document["conditions"]


@pytest.mark.parametrize(
    ("values", "why", "words"),
    [
        ("900 0.001 950", "0.001 is not permitted: Density is at least 0.01.", "Leave out 0.001 kg/m³"),
        ("900 950 950", "950 is there twice.", "Leave out one 950 kg/m³"),
        ("-1 -2 900 -3 -4 950", "-1 is not permitted: Density is at least 0.01.", "Leave out 4 values"),
        (" ".join(map(str, range(900, 926))), "A series has at most 24 values.", "Leave out 924, 925 kg/m³"),
    ],
)
def test_values_that_are_not_permitted_can_be_left_out(study: Study, values: str, why: str, words: str) -> None:
    plan = judged(study, SYRUP, values, "density_kg_m3")
    assert plan is not None
    assert plan.refusal.splitlines()[0] == why
    assert words_of(plan) == [words]
    made(study, plan, words)


def test_a_series_is_refused_while_the_file_cannot_be_read_or_has_no_such_number(study: Study) -> None:
    broken, _ = study.typed(f"{study.text}\n[")
    for now, key, why in ((broken, "delay_ms", "The file cannot be read"), (study, "nosuch", "Choose a number")):
        plan = judged(now, WATER, "0 60", key)
        assert plan is not None
        assert plan.refusal.startswith(why)
        assert plan.ways == ()
