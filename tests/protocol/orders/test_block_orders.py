import json
from typing import Any

import pytest

from study_app.errors import StudyError
from study_app.protocol.load import load, parse
from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import BlockOrder, orders_of, orders_of_receipt
from study_app.store.receipt import without_conditions
from tests.protocol.sound import EVERY_ORDER, SOUND

PROTOCOLS = [load("rek2024"), load("demo"), parse(SOUND.encode(), "small"), parse(EVERY_ORDER.encode(), "everything")]


def kept(protocol: Protocol) -> dict[str, Any]:
    """Return the protocol as it comes back from a receipt on disk."""
    return json.loads(json.dumps(without_conditions(protocol)))  # type: ignore[no-any-return]


@pytest.mark.parametrize("protocol", PROTOCOLS, ids=["rek2024", "demo", "small", "everything"])
def test_a_receipt_tells_the_same_orders_as_the_protocol(protocol: Protocol):
    assert orders_of_receipt(kept(protocol)) == orders_of(protocol)


def test_orders_hold_all_that_scheduling_needs():
    orders = orders_of(PROTOCOLS[-1])
    assert orders.study == "small"
    assert orders.steps[0] == "hello"
    assert [block.id for block in orders.blocks] == ["warm_up", "feel", "look"]
    assert orders.blocks[1] == BlockOrder(
        id="feel",
        phase="main",
        part=1,
        codes=("L1", "L2"),
        order="constrained",
        max_repeats=1,
        min_distance=2,
        repetitions=3,
        break_every=2,
        break_page="rest",
        items=("warm", "cold"),
        item_order="shuffled",
    )


def test_receipts_from_before_there_were_constraints_and_breaks_are_read():
    protocol = PROTOCOLS[0]
    older = kept(protocol)
    for block in older["blocks"].values():
        for key in ("max_repeats", "min_distance", "break_every", "break_page"):
            del block[key]
    assert orders_of_receipt(older) == orders_of(protocol)


@pytest.mark.parametrize(
    ("place", "value", "told"),
    [
        (("blocks", "feel", "order"), "sorted", "blocks.feel.order: Input should be"),
        (("blocks", "feel", "codes"), [], "blocks.feel.codes"),
        (("blocks", "feel", "codes"), None, "blocks.feel.codes"),
        (("blocks", "feel", "repetitions"), 0, "blocks.feel.repetitions"),
        (("blocks", "feel", "min_distance"), 3, "min_distance: is 3, but with 2 conditions only 1 to 2 is possible"),
        (("blocks", "feel", "questionnaire"), "other", "there is no 'other'"),
        (("sequence",), "feel", "sequence"),
        (("study",), None, "study"),
    ],
)
def test_a_changed_receipt_is_refused_with_the_place(place: tuple[str, ...], value: object, told: str):
    receipt = kept(PROTOCOLS[-1])
    node = receipt
    for step in place[:-1]:
        node = node[step]
    node[place[-1]] = value
    with pytest.raises(StudyError, match="does not state the orders") as caught:
        orders_of_receipt(receipt)
    assert told in str(caught.value)
