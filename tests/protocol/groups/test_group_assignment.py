"""Groups are randomised or pre-existing: what `check` warns of and refuses, and what texts say of them."""

import pytest

from study_app.analysis.planning.preregistration import preregistration
from study_app.errors import ProtocolError
from study_app.protocol.descriptions.protocol_text import describe
from study_app.protocol.model import Protocol
from study_app.protocol.orders.balance import balances, numbered_participants
from study_app.protocol.participants.groups import next_group
from study_app.protocol.warnings.study_warnings import warnings
from tests.protocol.groups.grouped import grouped

ALIKE = """
[groups.experts]
sequence = ["hello", "thin", "thick"]

[groups.novices]
sequence = ["hello", "thin", "thick"]

[analysis]
participants = 16
"""


def experts(assignment: str = "") -> Protocol:
    """Return a study of experts and novices whose two main blocks are counterbalanced."""
    head = f'study.name = "grouped"\nstudy.block_order = "balanced"\n{assignment}'
    return grouped(('study.name = "grouped"\n', head), groups=ALIKE)


PREEXISTING = 'study.group_assignment = "pre-existing"\n'


ATTRIBUTES = """
    experts novice patients healthy_controls musicians non_musicians older_adults age_60plus young old
    amputees men women students left_handed righthanders dominant_hand experienced low_experience surgeons
    linkshandigen ouderen ervaren vrouwen frauen laien anfaenger aeltere gauchers femmes etudiants debutants
"""
"""Names of what people are."""
TREATMENTS = """
    trained untrained control experimental training placebo thin_first left_hand short_strokes manual
    no_feedback late long_delay old_recipe blinded group_a a image intervention hard
"""
"""Names of what can be randomised."""


def test_only_group_names_that_suggest_an_attribute_have_a_warning() -> None:
    names = [*ATTRIBUTES.split(), *TREATMENTS.split()]
    tables = "".join(f'[groups.{name}]\nsequence = ["hello", "thin", "thick"]\n' for name in names)
    messages = [
        warning for warning in warnings(grouped(groups=f"\n{tables}"), simulates=False) if warning.startswith("groups.")
    ]
    assert [warning.partition(":")[0].removeprefix("groups.") for warning in messages] == ATTRIBUTES.split()


def test_only_randomised_groups_are_warned_of() -> None:
    sentences = [sentence for sentence in warnings(experts()) if sentence.startswith("groups.")]
    assert [sentence.partition(":")[0] for sentence in sentences] == ["groups.experts", "groups.novices"]
    assert all("groups are assigned at random" in sentence for sentence in sentences)
    assert not [sentence for sentence in warnings(experts(PREEXISTING)) if sentence.startswith("groups.")]
    assert not [sentence for sentence in warnings(grouped()) if sentence.startswith("groups.")]


def test_an_assignment_without_groups_is_refused() -> None:
    edit = ('format = 2\nstudy.name = "grouped"\n', f'format = 2\n{PREEXISTING}study.name = "grouped"\n')
    with pytest.raises(ProtocolError) as error:
        grouped(edit, groups='sequence = ["hello", "thin", "thick"]\n')
    assert "the study does not have groups" in str(error.value.problems)


def test_check_states_the_balance_of_each_group() -> None:
    """Each group has 8 of 16 participants and each of its two orders 4 times."""
    for study, assignment in ((experts(), "randomised in permuted"), (experts(PREEXISTING), "pre-existing: entered")):
        text = describe(study)
        assert text.count("with 8 participants per group, each block occurs in each position 4 times") == 2
        assert assignment in text


@pytest.mark.parametrize("assignment", ["", PREEXISTING])
def test_design_counts_orders_within_each_group(assignment: str) -> None:
    arrangements = list(balances(experts(assignment), numbered_participants(16, "P005"), 1))
    assert [arrangement.participants for arrangement in arrangements] == [8, 8]
    assert [arrangement.blocks[-1].evenness.positions for arrangement in arrangements] == [((4, 4), (4, 4))] * 2


def test_the_preregistration_states_how_groups_are_formed() -> None:
    randomised = "randomised in permuted blocks to the groups experts and novices, with an allocation ratio of 1:1."
    assert randomised in preregistration(experts(), "0" * 64)
    text = preregistration(experts(PREEXISTING), "0" * 64)
    assert "permuted blocks" not in text
    assert "assigned to the groups experts and novices by an existing attribute" in text
    assert "groups are not randomised" in text
    assert "The order of blocks is balanced: 2 orders, assigned by the position in the group" in text


def test_groups_are_dealt_by_their_shares() -> None:
    sizes = {"many": 0, "few": 0}
    for _ in range(9):
        sizes[next_group({"many": 2, "few": 1}, sizes)] += 1
    assert sizes == {"many": 6, "few": 3}
    assert next_group({"a": 1, "b": 1}, {"a": 5}) == "b"
