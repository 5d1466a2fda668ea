from collections import Counter

import pytest

from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.streams import Key, shuffle, stream
from study_app.protocol.trials.presentation import arrangement_text, longest_delay_s, next_level
from study_app.protocol.trials.stimuli import Stimulated
from study_app.protocol.trials.tracks import design_of
from tests.protocol.trials.level_studies import SECRET, answered, key_of, run, study

UNTIL = "until = { right = 4, of = 5 }\n"


def test_each_level_comes_equally_often_with_each_standard():
    protocol = study()
    counts = Counter((due.standard, due.level) for due in run(protocol, key_of(protocol)))
    assert counts == {(standard, level): 8 for standard in (1.0, 2.0) for level in (0.2, 0.4, 0.8)}


def test_every_round_presents_every_level_once():
    protocol = study(("standards = [1, 2]", "standards = [2]"))
    levels = [due.level for due in run(protocol, key_of(protocol))]
    rounds = [tuple(levels[first : first + 3]) for first in range(0, 24, 3)]
    assert {tuple(sorted(one)) for one in rounds} == {(0.2, 0.4, 0.8)}
    assert len(set(rounds)) > 1


def test_intervals_present_standard_and_comparison():
    protocol = study(("standards = [1, 2]", "standards = [2]"))
    for due in run(protocol, key_of(protocol)):
        comparison = Stimulated("oil", "viscosity_pa_s", 2 * (1 + due.level))
        standard = Stimulated("oil", "viscosity_pa_s", 2.0)
        assert due.intervals == ((comparison, standard) if due.arrangement == 0 else (standard, comparison))


def test_the_standard_is_the_present_value_unless_given():
    protocol = study(("standards = [1, 2]\n", ""))
    assert {due.standard for due in run(protocol, key_of(protocol))} == {1.0}


def test_a_block_may_present_some_of_the_standards():
    protocol = study(("design =", "standards = [2]\ndesign ="))
    assert {due.standard for due in run(protocol, key_of(protocol))} == {2.0}


def test_levels_as_a_number_are_spaced_over_the_range():
    protocol = study(("levels = [0.2, 0.4, 0.8]", "levels = 4"))
    assert {round(due.level, 12) for due in run(protocol, key_of(protocol))} == {0.1, 0.2, 0.4, 0.8}


@pytest.mark.parametrize("design", ["oddity", "abx", "samedifferent"])
def test_values_have_correct_answers_where_none_asks_for_more(design: str):
    protocol = study(('design = "2ifc"', f'design = "{design}"'), ("levels = [0.1", 'level = "value"\nlevels = [0.1'))
    key = key_of(protocol)
    trials = answered(protocol, key, build_schedule(protocol, "P001", 1))
    assert {one.correct for _, one in trials} == {True}
    built = design_of(protocol, protocol.blocks["viscosity"])
    for due, _ in trials:
        holds = built.arrangements[due.arrangement]
        assert [one.value for one in due.intervals] == [due.level if held else due.standard for held in holds]
    answers = {built.correct(due.arrangement) for due, _ in trials}
    assert answers == set(built.answers)


def test_values_have_no_correct_answer_in_a_forced_choice():
    protocol = study(("levels = [0.1", 'level = "value"\nlevels = [0.1'))
    trials = answered(protocol, key_of(protocol), build_schedule(protocol, "P001", 1))
    assert {(one.correct, one.success) for _, one in trials} == {(None, True)}


def test_estimation_of_a_value_has_one_interval_and_no_standard():
    protocol = study(
        ('design = "2ifc"', 'design = "estimation"'),
        ("standards = [1, 2]", 'level = "value"'),
        ("[0.1, 0.8]", "[0.1, 9]"),
    )
    presented = run(protocol, key_of(protocol))
    assert {due.standard for due in presented} == {None}
    assert all(due.intervals == (Stimulated("oil", "viscosity_pa_s", due.level),) for due in presented)


def test_the_modulus_comes_first():
    protocol = study(
        ('design = "2ifc"', 'design = "number"'),
        ("standards = [1, 2]", 'level = "value"'),
        more='[designs.number]\nkind = "estimation"\nmodulus = { level = 0.5, number = 10 }\n',
    )
    first, *others = run(protocol, key_of(protocol))
    assert first.level == 0.5
    assert Counter(due.level for due in others) == {0.2: 8, 0.4: 8, 0.8: 8}


def test_a_share_of_yes_no_slots_presents_the_standard_alone():
    protocol = study(('design = "2ifc"', 'design = "yesno"'), ("standards = [1, 2]", "standards = [2]"))
    presented = run(protocol, key_of(protocol))
    noise = [due for due in presented if due.level == 0]
    assert len(noise) == round(24 * 0.3 / 0.7) == len(presented) - 24
    assert all(due.intervals == (Stimulated("oil", "viscosity_pa_s", 2.0),) for due in noise)
    assert Counter(due.level for due in presented if due.level) == {0.2: 8, 0.4: 8, 0.8: 8}


CONDITIONS = (
    'stimulus = "viscosity"\ndesign = "2ifc"\nmethod = "few"',
    'conditions = ["oil", "other", "late"]\nstandard = "oil"\ndesign = "abx"\nrepetitions = 8',
)


def test_conditions_are_compared_with_the_standard():
    protocol = study(CONDITIONS)
    key = key_of(protocol)
    assert set(key.codes["viscosity"]) == {"V1", "V2"}
    assert set(key.codes["viscosity"].values()) == {"other", "late"}
    presented = run(protocol, key)
    assert Counter(frozenset(one.condition for one in due.intervals) for due in presented) == {
        frozenset({"oil", "other"}): 8,
        frozenset({"oil", "late"}): 8,
    }
    assert {due.level for due in presented} == {None}
    assert all(one.vary is None for due in presented for one in due.intervals)


def test_a_block_ends_once_its_criterion_is_met():
    protocol = study(("task =", UNTIL + "task ="))
    assert len(run(protocol, key_of(protocol))) == 4  # four correct answers
    always_first = run(protocol, key_of(protocol), answer="first")
    assert 4 < len(always_first) <= 48


def test_criterion_of_yes_no_counts_correct_answers():
    protocol = study(("task =", UNTIL + "task ="), ('design = "2ifc"', 'design = "yesno"'))
    found = answered(protocol, key_of(protocol), build_schedule(protocol, "P001", 1), answer="yes")
    correct = [due.level > 0 for due, _ in found]
    assert False in correct[:4], "then counting yes gives the same"
    assert sum(correct[-5:]) == 4
    assert all(sum(correct[max(0, end - 5) : end]) < 4 for end in range(len(correct)))


def test_a_criterion_counts_the_last_answers_alone():
    protocol = study(("task =", "until = { right = 5, of = 5 }\ntask ="), ("repetitions = 8", "repetitions = 40"))
    found = answered(protocol, key_of(protocol), build_schedule(protocol, "P001", 1), answer="first")
    right = [heard.success for _, heard in found]
    assert right[-5:] == [True] * 5
    assert all(False in right[end - 5 : end] for end in range(5, len(right)))


def test_what_comes_does_not_depend_on_the_order_of_answers_or_on_later_ones():
    protocol, key = study(), key_of(study())
    schedule = build_schedule(protocol, "P001", 1)
    heard = [one for _, one in answered(protocol, key, schedule)]
    for trial in schedule.trials[::7]:
        shuffled = shuffle(heard, stream(trial.number, "order").random)
        earlier = [one for one in heard if one.trial < trial.number]
        assert next_level(protocol, key, schedule, trial, shuffled) == next_level(
            protocol, key, schedule, trial, earlier
        )


@pytest.mark.parametrize("different", ["secret", "participant", "seed"])
def test_draws_depend_on_secret_participant_and_session(different: str):
    protocol, codes = study(), key_of(study()).codes
    one = run(protocol, Key(codes, SECRET))
    other = run(
        protocol,
        Key(codes, bytes(32) if different == "secret" else SECRET),
        participant="P002" if different == "participant" else "P001",
        seed=2 if different == "seed" else 1,
    )
    assert [due.level for due in one] != [due.level for due in other]
    assert [due.arrangement for due in one] != [due.arrangement for due in other]


@pytest.mark.parametrize(
    ("design", "presented"),
    [
        ("2ifc", "0.4CS 0.2SC 0.8SC 0.8CS 0.2SC 0.4CS 0.2CS 0.8SC"),
        ("yesno", "0S 0.4C 0.2C 0S 0.8C 0.8C 0.2C 0.4C"),
        ("oddity", "0.4CCS 0.2CCS 0.8SCC 0.8CSS 0.2SCS 0.4SSC 0.2CSC 0.8CSC"),
    ],
)
def test_a_secret_draws_what_it_drew_in_earlier_versions(design: str, presented: str):
    """Otherwise a later version could not reproduce a session's levels."""
    protocol = study(('design = "2ifc"', f'design = "{design}"'), ("standards = [1, 2]", "standards = [2]"))
    drawn = run(protocol, key_of(protocol))[:8]
    letters = [arrangement_text(design_of(protocol, protocol.blocks["viscosity"]), due.arrangement) for due in drawn]
    assert " ".join(f"{due.level:g}{of}" for due, of in zip(drawn, letters, strict=True)) == presented


@pytest.mark.parametrize(("direction", "longest_s"), [("up", 0.18), ("down", 0.1)])
def test_pictures_linger_for_the_longest_delay_of_any_trial(direction: str, longest_s: float):
    edits = ('"viscosity_pa_s"', f'"delay_ms"\ndirection = "{direction}"'), ("standards = [1, 2]", "standards = [100]")
    protocol = study(*edits, ("levels = [0.1, 0.8]", "levels = [20, 80]"), ("[0.2, 0.4, 0.8]", "[20, 80]"))
    assert longest_delay_s(protocol, protocol.blocks["viscosity"]) == pytest.approx(longest_s)


def test_nothing_that_tells_a_level_is_printed():
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
    shown = answered(protocol, key, build_schedule(protocol, "P001", 1))
    count = len(design_of(protocol, protocol.blocks["viscosity"]).arrangements)
    for code in key.codes["viscosity"]:
        arrangements = [due.arrangement for due, heard in shown if heard.code == code]
        assert len(arrangements) == 48
        for first in range(0, 48, 2 * count):
            run_of = Counter(arrangements[first : first + 2 * count])
            assert run_of == dict.fromkeys(range(count), 2) or len(arrangements) - first < 2 * count
            assert max(run_of.values()) <= 2
