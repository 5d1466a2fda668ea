import json
from typing import Any

import pytest

from study_app.protocol.descriptions.protocol_differences import CONDITIONS_DIFFER, differences
from study_app.protocol.load import load, parse
from study_app.protocol.model import Protocol
from study_app.store.receipt import without_conditions
from tests.protocol.sound import ORDER, SOUND

SMALL = parse(SOUND.encode(), "small")


def edited(*edits: tuple[str, str]) -> Protocol:
    text = SOUND
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return parse(text.encode(), "small")


def receipt_protocol(protocol: Protocol) -> dict[str, Any]:
    """Return the protocol as read back from a receipt."""
    return json.loads(json.dumps(without_conditions(protocol)))  # type: ignore[no-any-return]


@pytest.mark.parametrize("protocol", [SMALL, load("rek2024"), load("demo")])
def test_a_protocol_does_not_differ_from_itself_nor_from_its_receipt(protocol: Protocol):
    assert differences(protocol, protocol) == ()
    assert differences(receipt_protocol(protocol), protocol) == ()
    assert differences(protocol, receipt_protocol(protocol)) == ()
    assert differences(receipt_protocol(protocol), receipt_protocol(protocol)) == ()


def test_a_receipt_without_comparisons_has_no_differences():
    earlier = receipt_protocol(SMALL)
    for block in earlier["blocks"].values():
        del block["compares"]
    assert differences(earlier, SMALL) == ()
    assert differences(earlier, receipt_protocol(SMALL)) == ()


@pytest.mark.parametrize(
    ("edits", "expected"),
    [
        ([("repetitions = 2", "repetitions = 3")], ["blocks.feel.repetitions: previously 2, now 3"]),
        ([("force_limit_n = 8", "force_limit_n = 7.5")], ["device.force_limit_n: previously 8, now 7.5"]),
        ([("dwell_s = 0.5", "dwell_s = 0.5000001")], ["tasks.reach.dwell_s: a different text or number"]),
        (
            [('en = "Read this."', 'en = "Read that."')],
            ['pages.hello.body.en: previously "Read this.", now "Read that."'],
        ),
        (
            [(ORDER, 'order = "constrained"\nmax_repeats = 1\nrepetitions = 2')],
            ['blocks.feel.order: previously "shuffled", now "constrained"', "blocks.feel.max_repeats: new: 1"],
        ),
        ([("[30, 0, 0]", "[31, 0, 0]")], ["tasks.reach.targets_mm.2.1: previously 30, now 31"]),
        ([("[30, 0, 0],", "[30, 0, 0], [0, 20, 0],")], ["tasks.reach.targets_mm: previously 2 entries, now 3"]),
        ([('"hello", "warm_up"', '"warm_up", "hello"')], [
            'sequence.1: previously "hello", now "warm_up"',
            'sequence.2: previously "warm_up", now "hello"',
        ]),
        ([('id = "cold"', 'id = "tepid"')], [
            "questionnaires.short.items.cold: removed; previously a table",
            "questionnaires.short.items.tepid: new: a table",
        ]),
        ([('en = "It is cold."', 'en = "It is icy."')], [
            'questionnaires.short.items.cold.text.en: previously "It is cold.", now "It is icy."',
        ]),
    ],
)  # fmt: skip
def test_differences_are_named_with_their_place(edits: list[tuple[str, str]], expected: list[str]):
    assert list(differences(SMALL, edited(*edits))) == expected
    assert list(differences(receipt_protocol(SMALL), receipt_protocol(edited(*edits)))) == expected


def test_items_in_another_order_are_said_to_be_just_that():
    before, warm, cold = SOUND.split("[[questionnaires.short.items]]\n")
    cold, after = cold.split("[pages.hello]", 1)
    parts = (before, cold, warm, f"\n[pages.hello]{after}")
    turned = "[[questionnaires.short.items]]\n".join(parts[:3]) + parts[3]
    assert differences(SMALL, parse(turned.encode(), "small")) == ("questionnaires.short.items: in a different order",)


SECRET = SOUND.replace("1400", "1013.7").replace("is_thick", "spinach").replace("delay_ms = 120", "delay_ms = 137")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("density_kg_m3 = 1013.7", "density_kg_m3 = 1013.8"),
        ("delay_ms = 137", "delay_ms = 138"),
        ('["is_thin", "spinach"]', '["spinach", "is_thin"]'),
        ('conditions = ["on_time", "both"]', 'conditions = ["both", "on_time"]'),
        ("[liquids.other]", "[liquids.more]\ndensity_kg_m3 = 137\n[liquids.other]"),
    ],
)
def test_differing_conditions_are_reported_without_details(old: str, new: str):
    assert SECRET.count(old) == 1
    before, after = (parse(text.encode(), "secret") for text in (SECRET, SECRET.replace(old, new)))
    assert differences(before, after) == (CONDITIONS_DIFFER,)
    assert differences(receipt_protocol(before), after) == ()


def test_conditions_of_an_opened_key_are_compared():
    tables = SMALL.model_dump(mode="json", include={"conditions", "liquids"})
    open_study = {**receipt_protocol(SMALL), **tables}
    assert differences(open_study, SMALL) == ()
    assert differences(open_study, edited(("delay_ms = 120", "delay_ms = 121"))) == (CONDITIONS_DIFFER,)


def test_an_added_condition_is_reported_by_its_code():
    more = edited(('["is_thin", "is_thick"]', '["is_thin", "is_thick", "on_time"]'))
    assert differences(SMALL, more) == ("blocks.feel.codes: previously 2 entries, now 3", CONDITIONS_DIFFER)
    assert differences(receipt_protocol(SMALL), more) == ("blocks.feel.codes: previously 2 entries, now 3",)


def test_unused_keys_missing_from_an_older_receipt_are_not_differences():
    older = receipt_protocol(SMALL)
    for block in older["blocks"].values():
        for key in ("max_repeats", "min_distance", "break_every", "break_page"):
            del block[key]
    assert differences(older, SMALL) == ()
