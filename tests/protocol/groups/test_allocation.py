"""Allocation to groups: even at every number of participants, and known to nobody without the secret."""

from collections import Counter

import pytest

from study_app.protocol.groups.allocation import group_of

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


def test_allocation_depends_on_the_secret_alone() -> None:
    """Whoever knows every earlier allocation still needs the secret: other secrets agree on these, not on the next."""
    shares = {"a": 1, "b": 1}
    assert [group_of(shares, SECRET, n) for n in range(1, 9)] == [
        group_of({"b": 1, "a": 1}, SECRET, n) for n in range(1, 9)
    ]
    secrets = [bytes([number % 256, number // 256]) + bytes(30) for number in range(2000)]
    sequences = [[group_of(shares, secret, n) for n in (1, 2, 3)] for secret in secrets]
    alike = [one[2] for one in sequences if one[:2] == ["a", "b"]]
    assert 0.45 < alike.count("a") / len(alike) < 0.55
