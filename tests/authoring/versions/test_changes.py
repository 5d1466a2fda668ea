import json
import random
import tomllib
from typing import Any

import pytest

from study_app.authoring.edited_study import Study
from study_app.authoring.versions.changes import UNKNOWN_CONDITIONS, changes, changes_from_receipt
from study_app.protocol.load import load, parse
from study_app.protocol.source.files import shipped
from study_app.store.receipt import without_conditions
from tests.authoring.grown import PROTOCOLS

TEXT = (PROTOCOLS / "demo.toml").read_text(encoding="utf-8")


def changed(*pairs: tuple[str, str]) -> str:
    text = TEXT
    for old, new in pairs:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def held(protocol: Any) -> Any:
    """Return the protocol of a receipt on disk."""
    return json.loads(json.dumps(without_conditions(protocol)))


@pytest.mark.parametrize(
    ("old", "new", "effect"),
    [
        ('title = "Now reach"', 'title = "Reach"', "comparable"),
        ('version = "1.0"', 'version = "1.1"', "comparable"),
        ('short = "Task harder"', 'short = "Harder"', "comparable"),
        ("delay_ms = 200", "delay_ms = 300", "measured"),
        ("count = 6", "count = 8", "measured"),
        ('order = "shuffled"\nrepetitions = 1\ntask = "reach"', 'order = "fixed"\ntask = "reach"', "measured"),
        ('text = "What I saw made the task harder."', 'text = "It was harder."', "measured"),
        ('id = "harder"', 'id = "difficult"', "tables"),
        ('code_prefix = "D"', 'code_prefix = "E"', "tables"),
        ("lateness_ms = 2 ", "lateness_ms = 3 ", "measured"),
    ],
)
@pytest.mark.parametrize("of_receipt", [False, True])
def test_changes_are_sorted_by_what_they_do(old: str, new: str, effect: str, *, of_receipt: bool) -> None:
    after = changed((old, new))
    if of_receipt:
        *found, conditions = changes_from_receipt(held(parse(TEXT.encode(), "demo")), parse(after.encode(), "demo"))
        assert (conditions.sentence, conditions.revert) == (UNKNOWN_CONDITIONS, ())
        assert {one.effect for one in found} == (set() if old.startswith("delay_ms") else {effect})
        return
    found = list(changes(TEXT, Study(after)))
    assert {one.effect for one in found} == {effect}, found


def test_changes_of_the_same_study_are_none() -> None:
    assert changes(TEXT, Study(f"# more\n{TEXT}")) == ()


@pytest.mark.parametrize("name", shipped())
def test_a_study_does_not_differ_from_its_own_receipt(name: str) -> None:
    protocol = load(name)
    assert [one.sentence for one in changes_from_receipt(held(protocol), protocol)] == [UNKNOWN_CONDITIONS]


def test_keys_that_state_their_default_keep_answers_comparable() -> None:
    after = Study(changed(('task = "reach"', 'task = "reach"\nreplicates = false')))
    assert [(one.sentence, one.effect) for one in changes(TEXT, after)] == [
        ("blocks.delays.replicates: new, false", "comparable")
    ]


@pytest.mark.parametrize(
    ("was", "now"), [("demo", "physical_liquids"), ("viscosityjnd", "demo"), ("thickness", "delaydetect")]
)
@pytest.mark.slow
def test_reverting_each_difference_in_any_order_makes_the_version_again(was: str, now: str) -> None:
    version = (PROTOCOLS / f"{was}.toml").read_text(encoding="utf-8")
    study = Study((PROTOCOLS / f"{now}.toml").read_text(encoding="utf-8"))
    draw, steps = random.Random(1), 0  # noqa: S311
    while found := changes(version, study):
        study, _ = study.edited(*draw.choice(found).revert)
        steps += 1
        assert steps < 300, found
    assert tomllib.loads(study.text) == tomllib.loads(version)
    assert steps > 20


def test_items_are_reverted_to_their_order_and_a_removed_one_to_its_place() -> None:
    head, first, second, *_ = TEXT.split("[[questionnaires.liquid.items]]\n")
    tail = second.partition("\n[")
    second, rest = tail[0] + "\n", "".join(tail[1:]).lstrip("\n")
    item = "[[questionnaires.liquid.items]]\n"
    turned = Study("".join([head, item, second, "\n", item, first, rest]))
    (order,) = changes(TEXT, turned)
    assert order.sentence == "questionnaires.liquid.items: in another order"
    assert changes(TEXT, turned.edited(*order.revert)[0]) == ()
    without = Study("".join([head, item, second, "\n", rest]))
    (gone,) = changes(TEXT, without)
    assert gone.effect == "tables"
    assert changes(TEXT, without.edited(*gone.revert)[0]) == ()
