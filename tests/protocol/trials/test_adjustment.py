"""The method of adjustment: where settings start, where steps lead, and what check refuses."""

import math

import pytest

from study_app.protocol.load import parse
from study_app.protocol.trials.methods import Adjustment
from study_app.protocol.trials.stimuli import Stimulus
from tests.protocol.edited_studies import text_of
from tests.protocol.trials.matching import matching

LOW, HIGH = math.log10(2), math.log10(18)


@pytest.mark.parametrize("level", ["value", "difference"])
@pytest.mark.parametrize("direction", ["up", "down"])
def test_steps_lead_to_more_of_the_number_and_stop_at_the_ends(level: str, direction: str) -> None:
    stimulus = Stimulus.model_validate(
        {"vary": "b", "level": level, "levels": (1.0, 5.0), "spacing": "linear", "direction": direction}
    )
    setting = Adjustment.model_validate({"step_size": 0.3}).adjusting(stimulus, None if level == "value" else 9.0, 2.0)
    after_step, before_step = setting.comparison(setting.moved(0, 1)), setting.comparison(0)
    assert after_step == pytest.approx(before_step + 0.3)
    ends = sorted(setting.comparison(setting.moved(0, way * 1000)) for way in (-1, 1))
    assert ends == pytest.approx(sorted(stimulus.comparison(setting.standard, end) for end in (1.0, 5.0)))


def test_steps_beyond_an_end_are_ignored_and_steps_back_count_from_the_end() -> None:
    stimulus = Stimulus.model_validate({"vary": "b", "level": "value", "levels": (2.0, 18.0)})
    setting = Adjustment().adjusting(stimulus, 6.0, 2.1)
    assert setting.level(setting.place_after([-1000])) == 2.0
    assert setting.place_after([-5, -5, 4, 2]) == setting.place_after([-100, 6]) != setting.place_after([-4])
    assert setting.level(setting.place_after([1000])) == 18.0
    back = setting.level(setting.place_after([1000, -1]))
    assert back < 18.0 < back * 9 ** (1 / 40) * (1 + 1e-9)
    assert setting.level(0) == 2.1
    assert setting.level(20) == pytest.approx(2.1 * 9 ** (20 / 40))


def test_a_step_is_a_fortieth_of_the_span_or_a_factor_on_log_spacing() -> None:
    stimulus = Stimulus.model_validate({"vary": "b", "level": "value", "levels": (2.0, 18.0)})
    assert Adjustment().step(stimulus) == pytest.approx((HIGH - LOW) / 40)
    assert Adjustment(step_size=1.1).step(stimulus) == pytest.approx(math.log10(1.1))


def test_a_setting_task_lasts_for_the_longest_setting() -> None:
    protocol = matching()
    method = protocol.method_of(protocol.blocks["matching"])
    assert isinstance(method, Adjustment)
    followed = protocol.tasks["stir"].lasting(method.most_s)
    assert followed.limit_s == 60.0
    assert followed.start_m == protocol.tasks["stir"].start_m


@pytest.mark.parametrize("name", ["explore", "reach"])
def test_a_setting_task_ends_only_by_time(name: str) -> None:
    task = parse(text_of("sound").encode(), "file.toml").tasks[name].lasting(47.5)
    assert (task.limit_s, task.expected_s, task.shortest_s, task.wanted) == (47.5, 47.5, 47.5, None)
