from collections import Counter

import pytest

from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.presented.presentation import longest_delay_s, next_level
from study_app.protocol.randomization.streams import Key, shuffle, stream
from tests.protocol.trials.level_studies import SECRET, answered, key_of, run, study


def test_the_next_level_depends_neither_on_the_order_of_answers_nor_on_later_ones():
    protocol, key = study(), key_of(study())
    schedule = build_schedule(protocol, "P001", 1)
    results = [result for _, result in answered(protocol, key, schedule)]
    for trial in schedule.trials[::7]:
        shuffled = shuffle(results, stream(trial.number, "order").random)
        earlier = [result for result in results if result.trial < trial.number]
        assert next_level(protocol, key, schedule, trial, shuffled) == next_level(
            protocol, key, schedule, trial, earlier
        )


@pytest.mark.parametrize("different", ["secret", "participant", "seed"])
def test_draws_depend_on_secret_participant_and_session(different: str):
    protocol, codes = study(), key_of(study()).codes
    first = run(protocol, Key(codes, SECRET))
    other = run(
        protocol,
        Key(codes, bytes(32) if different == "secret" else SECRET),
        participant="P002" if different == "participant" else "P001",
        seed=2 if different == "seed" else 1,
    )
    assert [due.level for due in first] != [due.level for due in other]
    assert [due.arrangement for due in first] != [due.arrangement for due in other]


@pytest.mark.parametrize(("direction", "longest_s"), [("up", 0.18), ("down", 0.1)])
def test_pictures_linger_for_the_longest_delay_of_any_trial(direction: str, longest_s: float):
    edits = ('"viscosity_pa_s"', f'"delay_ms"\ndirection = "{direction}"'), ("standards = [1, 2]", "standards = [100]")
    protocol = study(*edits, ("levels = [0.1, 0.8]", "levels = [20, 80]"), ("[0.2, 0.4, 0.8]", "[20, 80]"))
    assert longest_delay_s(protocol, protocol.blocks["viscosity"]) == pytest.approx(longest_s)


def test_printed_objects_do_not_reveal_the_level():
    protocol, key = study(), key_of(study())
    due = run(protocol, key)[0]
    for value in (due, key, due.intervals[0]):
        assert "0." not in repr(value)
        assert "viscosity" not in repr(value)


@pytest.mark.parametrize("kind", ["2ifc", "3ifc", "4ifc", "abx", "oddity", "samedifferent"])
@pytest.mark.parametrize("secret", [SECRET, bytes(32), bytes(range(7, 39))])
def test_each_arrangement_comes_exactly_twice_in_every_2_times_arrangements_slots(kind: str, secret: bytes):
    protocol = study(('design = "2ifc"', f'design = "{kind}"'), ("repetitions = 8", "repetitions = 16"))
    key = key_of(protocol, secret)
    presentations = answered(protocol, key, build_schedule(protocol, "P001", 1))
    count = len(protocol.design_of(protocol.blocks["viscosity"]).arrangements)
    for code in key.codes["viscosity"]:
        arrangements = [due.arrangement for due, result in presentations if result.code == code]
        assert len(arrangements) == 48
        for first in range(0, 48, 2 * count):
            run_of = Counter(arrangements[first : first + 2 * count])
            assert run_of == dict.fromkeys(range(count), 2) or len(arrangements) - first < 2 * count
            assert max(run_of.values()) <= 2
