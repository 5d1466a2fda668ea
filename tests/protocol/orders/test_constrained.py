from collections import Counter
from collections.abc import Iterator
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.protocol.randomization.sequences import (
    PROPOSALS,
    Constraint,
    draw_order,
    longest_run,
    propose_order,
    shortest_distance,
)
from study_app.protocol.randomization.streams import stream

Order = tuple[int, ...]

# Codes, repetitions, constraint: small enough to list every order that keeps it.
SMALL = [
    (2, 3, Constraint(max_repeats=2)),
    (2, 6, Constraint(max_repeats=2)),
    (3, 2, Constraint(max_repeats=1)),
    (3, 3, Constraint(max_repeats=1)),
    (3, 3, Constraint(min_distance=2)),
    (4, 2, Constraint(min_distance=3)),
    (4, 2, Constraint(min_distance=4)),
    (2, 4, Constraint(max_repeats=3, min_distance=1)),
    (3, 3, Constraint(max_repeats=2, min_distance=2)),
]
SIZES = st.tuples(st.integers(1, 12), st.integers(1, 12))
CONSTRAINTS = st.builds(Constraint, st.one_of(st.none(), st.integers(1, 12)), st.one_of(st.none(), st.integers(1, 12)))


class Counting:
    """A stream that counts its draws."""

    def __init__(self, seed: int, name: str = "any") -> None:
        self._draw = stream(seed, name).random
        self.draws = 0

    def __call__(self) -> float:
        self.draws += 1
        return self._draw()


def every_order(codes: int, repetitions: int, constraint: Constraint) -> Iterator[Order]:
    """Return by brute force all orders that satisfy a constraint."""

    def longer(order: Order) -> Iterator[Order]:
        if len(order) == codes * repetitions:
            yield order
            return
        for code in range(codes):
            if order.count(code) < repetitions and constraint.permits((*order, code)):
                yield from longer((*order, code))

    return longer(())


def slow_run(order: Order) -> int:
    return max(
        (end - start for start in range(len(order)) for end in range(start + 1, len(order) + 1)
         if len(set(order[start:end])) == 1),
        default=0,
    )  # fmt: skip


def slow_distance(order: Order) -> int | None:
    return min(
        (late - early for late in range(len(order)) for early in range(late) if order[early] == order[late]),
        default=None,
    )


@given(st.lists(st.integers(0, 3), max_size=12).map(tuple))
def test_runs_and_distances_are_measured(order: Order):
    assert longest_run(order) == slow_run(order)
    assert shortest_distance(order) == slow_distance(order)


@pytest.mark.slow
@given(SIZES, CONSTRAINTS, st.integers(0, 2**64))
def test_an_order_keeps_its_constraint_or_is_impossible(size: tuple[int, int], constraint: Constraint, seed: int):
    codes, repetitions = size
    draw = Counting(seed)
    if (impossible := constraint.impossible_key(codes, repetitions)) is not None:
        with pytest.raises(ValueError, match=f"^{impossible[0]} is .*, but it must be at (most|least)"):
            draw_order(range(codes), repetitions, constraint, draw)
        assert draw.draws == 0
        return
    order = draw_order(range(codes), repetitions, constraint, draw)
    assert constraint.permits(order)
    assert Counter(order) == dict.fromkeys(range(codes), repetitions)
    assert draw.draws <= (codes * repetitions + 1) * PROPOSALS + codes


@pytest.mark.parametrize("codes", range(1, 5))
@pytest.mark.parametrize("repetitions", range(1, 4))
def test_a_constraint_is_impossible_exactly_if_no_order_satisfies_it(codes: int, repetitions: int):
    for runs in (None, 1, 2, 3, 4):
        for distance in (None, 1, 2, 3, 4, 5, 6):
            constraint = Constraint(runs, distance)
            impossible_key = constraint.impossible_key(codes, repetitions)
            assert (impossible_key is None) == any(map(bool, every_order(codes, repetitions, constraint))), constraint


def proposals(codes: int, repetitions: int, constraint: Constraint) -> dict[Order, Fraction]:
    """Draw proposals until every order was proposed, and return each with its chance."""
    wanted = set(every_order(codes, repetitions, constraint))
    draw = stream(1, "proposals").random
    chances: dict[Order, Fraction] = {}
    for _ in range(100 * len(wanted) + 1000):
        proposal = propose_order(codes, repetitions, constraint, draw)
        assert proposal is not None
        order, weight = proposal
        assert chances.setdefault(order, 1 / weight) == 1 / weight
        if len(chances) == len(wanted):
            break
    assert chances.keys() == wanted
    return chances


@pytest.mark.parametrize(("codes", "repetitions", "constraint"), SMALL)
def test_every_order_is_proposed_with_its_stated_probability(codes: int, repetitions: int, constraint: Constraint):
    """The stated probabilities of the proposals equal those of all orders and sum to exactly one."""
    chances = proposals(codes, repetitions, constraint)
    assert sum(chances.values()) == 1


@pytest.mark.variants(4)
@pytest.mark.slow
@pytest.mark.parametrize(("codes", "repetitions", "constraint"), SMALL)
def test_the_chain_ends_close_to_all_orders_being_equally_likely(codes: int, repetitions: int, constraint: Constraint):
    """Follow the exact chances of the chain: it starts from one proposal and sees PROPOSALS − 1 more."""
    chances = sorted(float(chance) for chance in proposals(codes, repetitions, constraint).values())
    now = list(chances)
    for _ in range(PROPOSALS - 1):
        later = [0.0] * len(now)
        for here, chance in enumerate(now):
            distance = 0.0
            for there, proposed in enumerate(chances):
                accepted = proposed * min(1.0, chances[here] / proposed)
                later[there] += chance * accepted
                distance += accepted
            later[here] += chance * (1 - distance)
        now = later
    assert sum(abs(chance - 1 / len(now)) for chance in now) / 2 < 1e-4


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize(
    ("codes", "repetitions", "constraint", "bound"),
    [
        (3, 2, Constraint(max_repeats=1), 58.3),  # 30 orders: χ², 29 degrees of freedom, p = 0.001
        (2, 3, Constraint(max_repeats=2), 34.5),  # 14 orders: 13 degrees of freedom
        (4, 2, Constraint(min_distance=4), 49.7),  # 24 orders: 23 degrees of freedom
    ],
)
def test_orders_of_many_participants_are_even(codes: int, repetitions: int, constraint: Constraint, bound: float):
    orders = set(every_order(codes, repetitions, constraint))
    each = 40
    draws = (stream(7, f"order/P{number}").random for number in range(each * len(orders)))
    counts = Counter(draw_order(range(codes), repetitions, constraint, draw) for draw in draws)
    assert counts.keys() == orders
    assert sum((count - each) ** 2 / each for count in counts.values()) < bound


@pytest.mark.parametrize(
    ("codes", "repetitions", "constraint"),
    [
        (12, 10, Constraint(min_distance=11)),
        (12, 10, Constraint(max_repeats=1)),
        (2, 100, Constraint(max_repeats=2)),
        (30, 4, Constraint(min_distance=29)),
        (7, 20, Constraint(min_distance=5)),
        (5, 40, Constraint(min_distance=5)),
    ],
)
def test_large_and_tight_blocks_avoid_dead_ends(codes: int, repetitions: int, constraint: Constraint):
    draw = stream(1, "large").random
    for _ in range(10):
        proposal = propose_order(codes, repetitions, constraint, draw)
        assert proposal is not None
        assert constraint.permits(proposal[0])
        assert Counter(proposal[0]) == dict.fromkeys(range(codes), repetitions)


def test_a_dead_end_is_reported_without_extra_cost():
    draw = Counting(1)
    assert propose_order(2, 2, Constraint(min_distance=3), draw) is None
    assert draw.draws <= 4


def test_the_same_draws_give_the_same_order_on_every_machine():
    order = draw_order(["L1", "L2", "L3"], 4, Constraint(max_repeats=1), stream(1, "order/P001/liquids").random)
    assert " ".join(order) == "L1 L3 L2 L1 L2 L3 L1 L3 L1 L2 L3 L2"
    order = draw_order("abcde", 3, Constraint(min_distance=4), stream(1, "order/P001/liquids").random)
    assert "".join(order) == "cdebadceabdeacb"
