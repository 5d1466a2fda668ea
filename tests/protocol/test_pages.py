"""The examples of the documentation are studies."""

import re
from pathlib import Path

from study_app.protocol.load import parse
from study_app.protocol.orders.block_orders import orders_of
from study_app.protocol.orders.durations import variants
from tests.protocol.groups.grouped import grouped

TRIALS, ADJUSTMENT, DELAYS, QUESTIONS, GROUPS = (
    (Path(__file__).parents[2] / "docs" / f"{name}.md").read_text(encoding="utf-8")
    for name in ("trials", "adjustment", "delays", "questions", "groups")
)


def examples(page: str) -> list[str]:
    return re.findall(r"```toml\n(.*?)```", page, re.DOTALL)


def test_the_example_of_delays_has_two_blocks_in_balanced_order() -> None:
    (example,) = examples(DELAYS)
    study = parse(example.encode(), "example")
    assert [study.design_of(study.blocks[name]).kind for name in study.sequence] == ["2ifc", "yesno"]
    assert orders_of(study).block_order == "balanced"


def test_examples_of_trials_are_studies_and_replace_parts_of_the_first() -> None:
    (example, estimation), (adjustment,) = examples(TRIALS), examples(ADJUSTMENT)
    assert orders_of(parse(example.encode(), "example")).answers == 140
    start, method, end = (example.index(table) for table in ("[stimuli", "[methods", "[blocks"))
    study = parse((example[:start] + example[method:end] + estimation).encode(), "example")
    assert orders_of(study).answers == 140
    assert study.design_of(study.blocks["thickness"]).reply == "number"
    study = parse((example[:start] + adjustment).encode(), "example")
    assert orders_of(study).answers == 10
    assert study.design_of(study.blocks["matching"]).adjusts


def test_example_of_questions_is_a_study() -> None:
    (example,) = (example for example in examples(QUESTIONS) if example.startswith("format = 2"))
    study = parse(example.encode(), "example")
    assert list(study.forms) == ["about_you"]
    assert [item.kind_id for item in study.questionnaires["after"].items] == ["rating", "slider"]


def test_example_of_groups_gives_the_steps_that_it_names() -> None:
    (example,) = examples(GROUPS)
    study = grouped(("[pages.hello]", "[pages.consent]"), groups=example)
    assert [(variant.name, variant.protocol.sequence) for variant in variants(study)] == [
        ("group thin_first", ("consent", "thin", "thick")),
        ("group thick_first, session 1", ("consent", "thick")),
        ("group thick_first, session 2", ("thin",)),
    ]
