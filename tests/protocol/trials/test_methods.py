"""Levels that methods choose, in closed form: 1 to 100 on a logarithmic scale, and where tracks begin and end."""

import pytest

from study_app.protocol.trials.designs import default_design
from study_app.protocol.trials.methods import Adjustment, Constant, QuestPlus, TrackSetting, TrialResult, UpDown
from study_app.protocol.trials.stimuli import Stimulus

LOG = Stimulus.model_validate({"vary": "b", "level": "value", "levels": (1.0, 100.0)})
LINEAR = Stimulus.model_validate({"vary": "b", "level": "value", "levels": (10.0, 50.0), "spacing": "linear"})


def setting(stimulus: Stimulus = LOG, number: int = 1) -> TrackSetting:
    return TrackSetting(stimulus=stimulus, number=number, design=default_design("2ifc"))


def heard_answers(*answers: tuple[float, bool], noise: tuple[int, ...] = ()) -> list[TrialResult]:
    """Return answers with their levels; trials in ``noise`` presented only the standard."""
    return [
        TrialResult(trial=number, code="A1", level=level, success=success, correct=success, noise=number in noise)
        for number, (level, success) in enumerate(answers, start=1)
    ]


@pytest.mark.parametrize(
    ("rule", "answers", "exponent"),
    [
        ("1down1up", [], 2.0),
        ("1down1up", [(100.0, True)], 2.0 - 0.5 * 0.2),
        ("2down1up", [(100.0, True)], 2.0),
        ("2down1up", [(100.0, True), (100.0, True)], 2.0 - 0.5 * 0.2),
        ("2down1up", [(10.0, True), (10.0, False)], 1.2),
        ("2down1up", [(10.0, False), (10.0, True)], 1.0),
        ("3down1up", [(10.0, True)] * 2, 1.0),
        ("3down1up", [(10.0, True)] * 3, 1.0 - 0.5 * 0.2),
        ("4down1up", [(10.0, True)] * 3, 1.0),
        ("4down1up", [(10.0, True)] * 4, 1.0 - 0.5 * 0.2),
        ("1down1up", [(100.0, False)], 2.0),
        ("1down1up", [(1.0, True)], 0.0),
    ],
)
def test_a_staircase_goes_down_after_successes_and_up_after_a_failure(
    rule: str, answers: list[tuple[float, bool]], exponent: float
) -> None:
    """A step up is a fifth of a decade, a step down half of that; neither leaves the range."""
    method = UpDown.model_validate({"rule": rule, "step_up": 10**0.2, "ratio": 0.5})
    assert method.after(setting(), heard_answers(*answers)) == pytest.approx(10**exponent)
    assert method.level(setting(), 7, heard_answers(*answers), ()) == method.after(setting(), heard_answers(*answers))


def test_a_staircase_steps_a_tenth_of_the_range_from_its_stated_start() -> None:
    method = UpDown.model_validate({"rule": "1down1up", "tracks": 2, "begin": (20.0, 30.0), "trials": 60})
    assert [method.after(setting(LINEAR, number), []) for number in (1, 2)] == pytest.approx([20.0, 30.0])
    assert method.after(setting(LINEAR), heard_answers((20.0, False))) == pytest.approx(24.0)
    assert method.after(setting(LINEAR), heard_answers((20.0, False), (24.0, True), noise=(2,))) == pytest.approx(24.0)
    assert (method.presentations(LINEAR), UpDown().presentations(LINEAR)) == (30, 60)
    assert UpDown(begin=25.0).after(setting(LINEAR, 2), []) == pytest.approx(25.0)
    assert UpDown().after(setting(LINEAR), []) == 50.0


def test_a_staircase_ends_after_its_reversals_and_answers_and_averages_the_last_ones() -> None:
    answers = [(50.0, True), (40.0, False), (44.0, True), (34.0, False)]
    more = [*answers, (38.0, True), (28.0, False)]
    method = UpDown.model_validate({"rule": "1down1up", "average": 2})
    assert method.reversals(setting(LINEAR), answers) == (1, 2, 3)
    assert method.reversal_mean(setting(LINEAR), more) == pytest.approx((38 + 28) / 2)
    assert method.reversal_mean(setting(LINEAR), answers) is None, "the first two turns do not count"
    for reversals, after, ended in ((3, 1, True), (4, 1, False), (3, 4, True), (3, 5, False)):
        stop = {"reversals": reversals, "after": after}
        stops = UpDown.model_validate({"rule": "1down1up", "stop": stop})
        assert stops.ended(setting(LINEAR), heard_answers(*answers)) == ended
    assert not method.ended(setting(LINEAR), heard_answers(*answers * 9))


@pytest.mark.parametrize(
    ("rule", "percent", "ratio"),
    [
        ("1down1up", "77.9", 0.2845),
        ("2down1up", "80.4", 0.5488),
        ("3down1up", "83.2", 0.7393),
        ("4down1up", "85.8", 0.8415),
    ],
)
def test_a_staircase_converges_as_published(rule: str, percent: str, ratio: float) -> None:
    """The ratios of García-Pérez (1998); an equal ratio of 1 converges to the root of a half."""
    method = UpDown.model_validate({"rule": rule})
    assert method.target(0.5, "correct") == f"converges to {percent} % correct"
    assert f"({rule}, steps down {ratio:g} times the steps up; García-Pérez 1998)" in method.paper_name
    equal = UpDown.model_validate({"rule": rule, "ratio": 1.0, "tracks": 2})
    assert equal.target_percent == pytest.approx(100 * 0.5 ** (1 / int(rule[0])))
    ((key, sentence),) = equal.warnings()
    assert (key, f"ratio = {ratio:g} converges to {percent} % with steps of any size" in sentence) == ("ratio", True)
    assert [key for key, _ in method.warnings()] == ["tracks"]


def test_settings_begin_alternately_near_both_ends_of_the_range() -> None:
    """At most an eighth of the range from an end; the first draw decides which end is the first."""
    for draw, first in ((0.49, 0), (0.5, 1)):
        draws = [lambda drawn=draw: drawn, lambda: 0.25, lambda: 1.0]
        starts = [Adjustment().level(setting(LINEAR), number, (), draws) for number in (0, 1, 2)]
        near = 10.0 + 40.0 / 8 * draw, 50.0 - 40.0 / 8 * draw
        assert starts[0] == pytest.approx(near[first])
        assert starts[1] == pytest.approx(50.0 - 40.0 / 32 if first == 0 else 10.0 + 40.0 / 32)
        assert starts[2] == pytest.approx(15.0 if first == 0 else 45.0)
    assert (Adjustment(repetitions=7).presentations(LOG), Adjustment(most_s=50.0).setting_s) == (7, 25.0)
    assert [key for key, _ in Adjustment(repetitions=7).warnings()] == ["repetitions"]
    assert list(Adjustment(repetitions=8).warnings()) == []


def test_each_round_of_constant_stimuli_has_every_level_once() -> None:
    method = Constant.model_validate({"levels": (2.0, 3.0, 5.0), "repetitions": 2})
    assert (method.presentations(LOG), method.rounds(LOG), method.levels_of(LOG)) == (6, 2, (2.0, 3.0, 5.0))

    def level(number: int) -> float:
        values = [[0.1, 0.9, 0.4], [0.7, 0.2, 0.6]]
        sources = [iter(values_of_round).__next__ for values_of_round in values]
        return method.level(setting(), number, (), sources)

    levels = [level(number) for number in range(6)]
    assert sorted(levels[:3]) == sorted(levels[3:]) == [2.0, 3.0, 5.0]
    assert levels[:3] != levels[3:]
    assert (method.setting_s, UpDown().setting_s, UpDown().rounds(LOG)) == (0.0, 0.0, 0)
    assert Constant.model_validate({"levels": 3}).levels_of(LINEAR) == pytest.approx((10.0, 30.0, 50.0))


def test_quest_begins_at_the_level_of_the_grid_nearest_to_the_stated_one() -> None:
    method = QuestPlus.model_validate({"begin": 24.0, "trials": 40, "tracks": 2})
    first = method.after(setting(LINEAR), [])
    assert first == min(LINEAR.grid, key=lambda level: abs(level - 24.0))
    assert method.target(0.5, "correct") == "threshold at 75 % correct"
    assert (method.target(None, "yes"), method.presentations(LINEAR)) == (None, 20)
    assert "the threshold (Watson 2017; Prins 2013)" in method.paper_name
    assert QuestPlus(learn="all").paper_name.endswith("all parameters (Watson 2017)")
