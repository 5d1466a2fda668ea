"""The steps of one session in a study whose groups or sessions differ."""

from collections import Counter

import pytest

from study_app.errors import StudyError
from study_app.protocol.load import load
from study_app.protocol.model import Protocol
from study_app.protocol.orders.balance import balances, numbered_participants
from study_app.protocol.orders.block_orders import orders_of
from study_app.protocol.orders.durations import expected_duration_s, variants
from study_app.protocol.orders.schedule import build_schedule, draw_key
from study_app.protocol.participants.groups import RecordedSessions
from study_app.protocol.randomization.streams import group_of, stream
from tests.protocol.groups.grouped import grouped

SESSIONS = 'sequences = [["hello", "thin"], ["thick", "thin", "end"]]\n'
HEAD = "format = 2\n"


def sessions() -> Protocol:
    """Return the study without groups, with two sessions that differ."""
    return grouped((HEAD, HEAD + SESSIONS), groups="")


def test_a_group_has_its_own_sequence_in_every_session() -> None:
    study = grouped()
    for session in (1, 2, 7):
        assert study.session_steps("first_thin", session) == ("hello", "thin", "thick", "end")
        assert study.session_steps("first_thick", session) == ("hello", "thick", "thin")
    assert study.steps == ("hello", "thin", "thick", "end")
    study.check_session_number(99)


def test_a_group_without_a_sequence_has_that_of_the_study() -> None:
    groups = '[groups.own]\nsequences = [["thick"], ["thin"]]\n[groups.other]\nshare = 2\n'
    study = grouped((HEAD, f'{HEAD}sequence = ["hello", "thin", "end"]\n'), groups=groups)
    assert study.session_steps("other", 3) == ("hello", "thin", "end")
    assert study.session_steps("own", 2) == ("thin",)
    study.check_session_number(3)
    assert study.steps == ("thick", "thin", "hello", "end")


def test_a_session_beyond_the_last_is_refused() -> None:
    study = sessions()
    assert study.session_steps(None, 2) == ("thick", "thin", "end")
    for refused_call in (lambda: study.session_steps(None, 3), lambda: study.check_session_number(3)):
        with pytest.raises(
            StudyError,
            match=r"^session 3 does not exist: .* defines 2 sessions for each participant; permitted: 1 to 2$",
        ):
            refused_call()
    study.check_session_number(2)


@pytest.mark.parametrize(
    ("order", "sequences", "uses", "followed", "is_repeated"),
    [
        ("fixed", [["thin", "end"]], [("thin", 1)], ("thin",), False),
        ("fixed", [["end", "thin", "thick", "end"]], [(None, 1), ("thick", 1)], ("thick",), True),
        ("fixed", [["thin", "end"], ["thick", "end"]], [("thin", 1), ("thick", 2)], ("thin", "thick"), True),
        ("fixed", [["thin", "end"], ["thin", "end"]], [("thin", 1), ("thin", 2)], ("thin",), True),
        ("balanced", [["thin", "thick", "end"]], [("thin", 1), ("thick", 1)], (), False),
        ("balanced", [["thin", "end", "thick", "end"]], [("thin", 1), ("thick", 1)], ("thin", "thick"), True),
    ],
)
def test_a_form_follows_blocks_in_numbered_sessions(
    order: str,
    sequences: list[list[str]],
    uses: list[tuple[str | None, int]],
    followed: tuple[str, ...],
    is_repeated: bool,
) -> None:
    """After the last of two blocks in either order, a form follows each of them only in some sessions."""
    recorded = RecordedSessions.model_validate(
        {"study": {"block_order": order}, "blocks": {"thin": {}, "thick": {}}, "sequences": sequences}
    )
    assert list(recorded.form_uses("end")) == uses
    assert recorded.blocks_followed_by("end") == followed
    assert recorded.is_repeated("end") is is_repeated


def test_a_session_has_its_own_blocks_forms_parts_and_duration() -> None:
    study = sessions()
    first, second = (variant.protocol for variant in variants(study))
    assert [block.id for block in first.blocks_in_order] == ["thin"]
    assert (first.parts, second.parts, study.parts) == (1, 2, 2)
    assert [(block.id, block.part) for block in second.main_blocks] == [("thick", 1), ("thin", 2)]
    assert not first.forms
    assert list(second.forms) == ["end"]
    assert [orders_of(protocol).answers for protocol in (first, second)] == [2, 7]
    assert expected_duration_s(first) < expected_duration_s(second)


def test_the_key_has_the_blocks_of_all_groups_and_sessions() -> None:
    assert set(draw_key(sessions(), stream(1, "key").random)) == {"thin", "thick"}


@pytest.mark.parametrize(("group", "session"), [("first_thin", 1), ("first_thick", 2)])
def test_parts_of_a_session_count_up(group: str, session: int) -> None:
    trials = build_schedule(grouped().for_session(group, session), "P001", 5).trials
    assert [trial.part for trial in trials] == sorted(trial.part or 0 for trial in trials)


def test_a_study_of_one_sequence_is_as_it_was() -> None:
    study = load("demo")
    (variant,) = variants(study)
    assert variant.protocol is study
    assert variant.name == ""
    assert study.steps == study.sequence


def test_design_judges_each_group_over_its_own_participants() -> None:
    arrangements = list(balances(grouped(), numbered_participants(7), 1))
    assert [arrangement.session for arrangement in arrangements] == ["group first_thin", "group first_thick"]
    assert sorted(arrangement.participants for arrangement in arrangements) == [3, 4]
    (alone,) = balances(grouped(), numbered_participants(1), 1)
    assert alone.participants == 1


SECRET = bytes(range(32))


@pytest.mark.parametrize("names", [("a", "b"), ("a", "b", "c"), ("a", "b", "c", "d", "e")])
def test_groups_of_share_1_are_within_1_at_every_number_of_participants(names: tuple[str, ...]) -> None:
    shares = dict.fromkeys(names, 1)
    counts = dict.fromkeys(names, 0)
    for entry in range(1, 201):
        counts[group_of(shares, SECRET, entry)] += 1
        assert max(counts.values()) - min(counts.values()) <= 1, entry


def test_shares_are_kept_exactly_in_every_permuted_block() -> None:
    shares = {"many": 2, "few": 1}
    allocated = [group_of(shares, SECRET, entry) for entry in range(1, 301)]
    assert all(Counter(allocated[first : first + 3]) == shares for first in range(0, 300, 3))
    assert len({tuple(allocated[first : first + 3]) for first in range(0, 300, 3)}) == 3, "blocks are shuffled"


def test_allocation_depends_only_on_the_secret() -> None:
    """Earlier allocations do not reveal the next: other secrets share them but differ in the next one."""
    shares = {"a": 1, "b": 1}
    assert [group_of(shares, SECRET, n) for n in range(1, 9)] == [
        group_of({"b": 1, "a": 1}, SECRET, n) for n in range(1, 9)
    ]
    secrets = [bytes([number % 256, number // 256]) + bytes(30) for number in range(2000)]
    sequences = [[group_of(shares, secret, n) for n in (1, 2, 3)] for secret in secrets]
    alike = [sequence[2] for sequence in sequences if sequence[:2] == ["a", "b"]]
    assert 0.45 < alike.count("a") / len(alike) < 0.55
