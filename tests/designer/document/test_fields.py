"""Forms from the models of the file format: every key of every model has a row, every fault a field."""

import math
import re
from collections.abc import Iterator, Mapping
from typing import Any

import pytest

from study_app.designer.document.elements import element_of
from study_app.designer.document.fields import Choice, Row, label_of, row_at, rows, unit_of
from study_app.designer.document.steps import AddKey, StepContext
from study_app.designer.document.study import Study, read_study
from study_app.designer.form.form import form_of
from study_app.designer.form.rows import choice_label
from study_app.number_text import exact_text
from study_app.protocol.file_format.json_schema import schema
from study_app.protocol.source.document import Path, entries
from study_app.protocol.source.problems import Fault, rule_of
from study_app.store.workstation import MachineSettings
from tests.designer.document.grown import PROTOCOLS
from tests.protocol.edited_studies import FAULTY, Case, text_of

DEFS = schema()["$defs"]


def with_value(document: Any, path: Path, value: Any) -> Any:
    """Return a document with a value at ``path``, with the tables and entries that it needs."""
    if not path:
        return value
    step, *rest = path
    if isinstance(step, int):
        inner = document[step] if isinstance(document, tuple) and step < len(document) else {}
        return (with_value(inner, tuple(rest), value),)
    table = document if isinstance(document, Mapping) else {}
    return {**table, step: with_value(table.get(step), tuple(rest), value)}


def every_row(document: Any, path: Path = ()) -> Iterator[Row]:
    """Yield the rows of a form and of its nested forms: of each kind, of an entry, of a table with any name."""
    for row in rows(document, path):
        yield row
        if row.kind == "kind" and row.value is None:
            for choice in row.choices:
                if choice.value is not None:
                    yield from every_row(with_value(document, row.path, choice.value), path)
        for alternative in (row, *row.either):
            if alternative.kind == "table":
                yield from every_row(document, row.path)
            elif alternative.kind == "tables":
                yield from every_row(with_value(document, (*row.path, "any"), {}), (*row.path, "any"))
            elif alternative.kind in {"list", "points"}:
                yield from every_row(with_value(document, (*row.path, 0), {}), (*row.path, 0))


def described_keys(node: Any) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """Yield key, description and bounds of everything in the schema that has a description."""
    for definition in (node, *node["$defs"].values()):
        for key, part in definition.get("properties", {}).items():
            bounds = [
                variant[name]
                for variant in (part, *part.get("anyOf", ()))
                for name in ("minimum", "maximum")
                if abs(variant.get(name, math.inf)) < 1e6
            ]
            if "description" in part:
                yield key, part["description"], tuple(map(exact_text, bounds))


@pytest.mark.parametrize(
    ("value", "default", "label"),
    [
        (None, None, "Not set"),
        (None, "random", "Not set"),
        ("force_limit_n", "random", "Force limit"),
        ("force_limit_n", "force_limit_n", "Force limit (default)"),
        ("lab_tools:stir_fast", None, "Stir fast (lab_tools)"),
        ("lab_tools:stir_fast", "lab_tools:stir_fast", "Stir fast (lab_tools) (default)"),
        ("23", None, "23"),
    ],
)
def test_a_choice_has_the_label_of_its_value_with_its_package_and_whether_it_is_the_default(
    value: str | None, default: object, label: str
) -> None:
    assert choice_label(Choice(value), default) == label


def test_every_key_of_every_model_reaches_a_form_with_its_words_and_bounds() -> None:
    bounds_of_rows: dict[tuple[str | int, str], str] = {}
    for row in every_row({}):
        bounds = [*row.bounds, *(text for alternative in row.either for text in alternative.bounds)]
        bounds_of_rows[row.path[-1], row.help] = " ".join(bounds)
        assert row.label
        texts = [row.help, *(choice.sentence for choice in row.choices)]
        assert not [text for text in texts if "\n" in text or "`" in text], row.path
    for key, description, bounds in described_keys(schema()):
        words = re.sub("`(.+?)`", "“\\1”", " ".join(description.replace("``", "").split()))
        assert (key, words) in bounds_of_rows
        assert all(bound in bounds_of_rows[key, words] for bound in bounds), key


def test_every_unit_of_the_models_is_known() -> None:
    for definition in DEFS.values():
        for key, part in definition.get("properties", {}).items():
            for unit in re.findall(r"\[([^\[\]]+)\]", part.get("description", "")):
                if (plain := unit.split(",")[0]) not in {"designs", "methods", "decades"} and " " not in plain:
                    assert unit_of(key) == plain, (key, unit)


def test_bounds_are_words_or_numbers_that_a_person_can_reach() -> None:
    bounds = {bound for row in every_row({}) for bound in row.bounds}
    assert {"at most 8", "at least 0.000001", "at least 1 entry", "at least 2 entries"} <= bounds
    assert not {bound for bound in bounds if "^" in bound or "e+" in bound or "e-" in bound}


def patterns_in(node: Any) -> Iterator[str]:
    """Yield the patterns of texts in a JSON Schema."""
    if isinstance(node, dict) and isinstance(node.get("pattern"), str):
        yield node["pattern"]
    for part in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        yield from patterns_in(part)


def test_every_pattern_of_the_models_has_a_description() -> None:
    patterns = {*patterns_in(schema()), *patterns_in(MachineSettings.model_json_schema())}
    assert len(patterns) >= 11
    assert [pattern for pattern in patterns if rule_of(pattern) == rule_of("^$") or "^" in rule_of(pattern)] == []


def test_every_value_that_can_be_chosen_has_its_sentence() -> None:
    lacking = {
        (row.model, row.path[-1])
        for row in every_row({})
        if row.kind in {"choice", "kind"}
        and len(row.choices) > 1
        and not all(choice.sentence for choice in row.choices)
    }
    assert lacking == set()


def test_an_added_table_is_complete_and_its_required_choice_has_no_default() -> None:
    study = read_study(text_of("sound").encode(), PROTOCOLS)
    item = next(path for path, item in entries(study.document, "questionnaires.*.items.*") if "show_if" not in item)
    liquid = ("liquids", next(iter(study.document["liquids"])))
    kinds = {"region": "everywhere", "current": "uniform", "non_newtonian": "herschel-bulkley"}
    for path in (*((*liquid, key) for key in kinds), (*item, "show_if")):
        step = AddKey(path).step(StepContext(study))
        after, _ = study.with_edits(*step.edits)
        assert [fault for fault in after.faults if fault.path[:-1] == path and fault not in study.faults] == []
        kind = row_at(after.document, (*path, "kind"))
        if path[-1] in kinds:
            assert kind is not None
            assert (kind.value, kind.default, kind.required) == (kinds[path[-1]], None, True)
    assert label_of("herschel-bulkley") == "Herschel–Bulkley"


OF_THE_ELEMENT = {
    "name of a table", "wake called for but missing", "block left out", "page left out", "page named like a block",
    "list for tables", "missing format",
}  # fmt: skip
"""Faults of an element as a whole, which stand above its rows."""


def shown_at(study: Study, fault: Fault) -> str:
    """Return where the form shows a fault: "row", "section", "id", "element", or "" for nowhere.

    A missing text is shown by its empty field.
    """
    form = form_of(study, element_of(study, fault.path))
    if fault.kind == "no text":
        return "row" if any(fault.path[: len(row.path)] == row.path for row in form.rows) else ""
    sentence = f"{fault.message[:1].upper()}{fault.message[1:]}"
    places = (
        ("row", [words for row in form.rows if fault.path[: len(row.path)] == row.path for words in row.faults]),
        ("section", [words for section in form.sections for words in section.faults]),
        ("id", list(form.id_faults)),
        ("element", list(form.faults)),
    )
    return next((place for place, said in places if any(words.startswith(sentence) for words in said)), "")


@pytest.mark.parametrize("case", FAULTY, ids=lambda case: case.name)
def test_every_fault_is_shown_at_a_field(case: Case) -> None:
    study = read_study(case.text.encode())
    if study.is_toml:
        places = [shown_at(study, fault) for fault in study.faults]
        assert "" not in places
        assert "element" not in places or case.name in OF_THE_ELEMENT
