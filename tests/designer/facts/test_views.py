"""The designer's view of a study: each element once, working repairs, and texts of measures."""

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path as File
from typing import Any

import pytest

from study_app.designer.document.additions import addition_repairs, repairs
from study_app.designer.document.document import template
from study_app.designer.document.elements import CHOSEN, LABEL, OTHER, find_fields
from study_app.designer.document.study import read_study
from study_app.designer.document.toml_edits import Set
from study_app.designer.form.form import form_of
from study_app.designer.measures.cards import Lines
from study_app.designer.measures.measures_view import measures_view
from study_app.designer.measures.simulation import Simulated
from study_app.designer.measures.study_facts import facts
from study_app.designer.outline import addable_elements, outline_rows
from study_app.designer.problems import fault_rows
from study_app.protocol.source.document import value_at
from tests.designer.document.grown import PROTOCOLS
from tests.designer.document.test_commands import edited, elements, studies
from tests.designer.support.designer import DEMO
from tests.golden import check_kept, compare, each_once
from tests.golden_values import one_line, value_lines
from tests.protocol.edited_studies import CASES, cases_of
from tests.protocol.sound import SOUND

GOLDEN = File(__file__).parent / "golden"
SINGLE = ("study", "sequence", "device", "scene", "limits", "analysis")
STUDIES = ("rows", "sound", "every_design", "grouped", "slime")
"""Studies of which each has kinds of elements that none before it has; the first is short."""


@pytest.mark.parametrize("name", [STUDIES[0], *(pytest.param(name, marks=pytest.mark.slow) for name in STUDIES[1:])])
def test_the_outline_shows_each_element_once_with_its_name(name: str) -> None:
    ((_, study),) = studies((name,))
    rows = outline_rows(study, facts(study).steps_s)
    parts = rows[next(at for at, row in enumerate(rows) if row.title == "Elements") :]
    row_counts, in_parts = Counter(row.path for row in rows), Counter(row.path for row in parts)
    for path in elements(study.document):
        if len(path) == 1 and path[0] in {*SINGLE} & {*study.document}:
            assert row_counts[path] == 1, path
        elif path[2:3] == ("items",):
            assert row_counts[path] >= 1, "below each step that asks it"
        elif len(path) == 2 and path[0] not in SINGLE:
            assert in_parts[path] == 1, path
    for row in rows:
        assert row.title, row
        assert row.name.startswith(row.title), row
    steps = [row.step for row in rows if row.step and row.step[0] == "sequence"]
    assert steps == [("sequence", at) for at in range(len(study.document.get("sequence", ())))]


def test_a_search_finds_the_section_of_elements_that_do_not_exist_yet() -> None:
    ((_, study),) = studies(("slime",))
    assert "groups" not in study.document
    assert ("groups",) in {row.path for row in outline_rows(study, {}, "group")}
    assert ("groups",) not in {row.path for row in outline_rows(study, {}, "liquid")}


@pytest.mark.parametrize("words", ["viscosity", "hon", "order"])
def test_found_rows_contain_the_words(words: str) -> None:
    ((_, study),) = studies(("slime",))
    matching_rows = outline_rows(study, facts(study).steps_s, words)
    everything = outline_rows(study, facts(study).steps_s)
    assert {row.path for row in matching_rows} <= {row.path for row in everything}
    assert outline_rows(study, facts(study).steps_s, f"  {words} ") == matching_rows
    assert outline_rows(study, facts(study).steps_s, "  ") == everything
    fields = find_fields(study, words)
    assert matching_rows or fields
    for row in (*matching_rows, *fields):
        assert words in one_line(row).lower() or any(words in one_line(other).lower() for other in matching_rows), row


@pytest.mark.parametrize(("words", "rank"), [("repetitions", LABEL), ("double", CHOSEN), ("ewma", OTHER)])
def test_other_choices_are_found_only_if_neither_label_nor_chosen_value_matches(words: str, rank: int) -> None:
    ((_, study),) = studies(("slime",))
    fields = find_fields(study, words)
    assert fields[0].rank == rank
    assert all(field.rank <= max(rank, CHOSEN) for field in fields)


def card_lines() -> Iterator[str]:
    """Yield the cards of blocks, of studies whose parts are broken, and of one with fewer participants."""
    for name, study in studies(("viscosityjnd", "thickness", "physical2")):
        yield f"== {name}"
        for block in study.document["blocks"]:
            yield from value_lines(measures_view(study, facts(study), ("blocks", block), Simulated()).cards)
    ((_, study),) = studies(("rek2024",))
    breaking = (("device", "force_limit_n"), 0.5), (("blocks", "liquids", "repetitions"), -1)
    for path, value in (*breaking, (("analysis", "participants"), 13)):
        edited, _ = study.with_edits(Set(path, value))
        yield f"== {path[-1]} {value}"
        yield from value_lines(measures_view(edited, facts(edited), ("blocks", "liquids"), Simulated()).cards)


@pytest.mark.slow
def test_texts_of_measures() -> None:
    words = (line.strip() for line in card_lines() if not re.search(r"icon:|path:", line))
    check_kept(File(__file__).with_name("measures.txt"), dict.fromkeys(words))


def test_forces_are_shown_of_liquids_that_blocks_use() -> None:
    ((_, study),) = studies(("demo",))
    spare = edited(study, Set(("liquids", "spare"), {**study.document["liquids"]["thick"], "density_kg_m3": 1300}))

    def forces(*path: str) -> tuple[str, ...]:
        cards = measures_view(spare, facts(spare), path, Simulated()).cards
        lines = next(card.parts[0] for card in cards if card.title == "Force for each liquid")
        assert isinstance(lines, Lines)
        return tuple(line.title for line in lines.lines)

    assert forces("study") == ("Thin", "Thick")
    assert forces("liquids", "spare") == ("Spare",)


FAULTS = ("designs", "formats", "adjustment", "groups", "impossible", "methods", "pace", "questions", "sound")
"""Files of faults that together have each kind of repair; the first two are read fastest."""


@pytest.mark.parametrize("name", [*FAULTS[:2], *(pytest.param(name, marks=pytest.mark.slow) for name in FAULTS[2:])])
def test_each_repair_removes_its_problem_and_undo_gives_the_text_back(name: str, pytestconfig: pytest.Config) -> None:
    words = list[str]()
    for case in cases_of(CASES / f"{name}.txt"):
        study = read_study(case.text.encode(), PROTOCOLS)
        rows = fault_rows(study)
        assert Counter(row.fault for row in rows) == Counter(study.faults)
        assert all(row.line is None or row.line <= study.text.count("\n") + 1 for row in rows)
        for fault in study.faults:
            for repair in (*repairs(study, fault), *addition_repairs(study, fault)):
                after = edited(study, *repair.edits)
                known, left = ({(fault.path, fault.message) for fault in checked.faults} for checked in (study, after))
                assert (fault.path, fault.message) not in left, (case.name, repair.label)
                assert len(left) <= len(known), (case.name, repair.label)
                words.append(repair.label)
    assert words
    compare(GOLDEN / f"repairs_in_{name}.txt", each_once(words), pytestconfig)


@pytest.mark.parametrize(
    ("old", "new", "place", "value"),
    [
        ("[-30, 0, 0]", "[-46, 0, 0]", ("tasks", "reach", "targets_mm", 0, 0), -44),  # 50 mm of tank, 6 mm of radius
        ("[30, 0, 0]", "[30, 24.5, 0]", ("tasks", "reach", "targets_mm", 1, 1), 24),
        ("part = 2", "part = 3", ("blocks", "look", "part"), 1),
        ("force_limit_n = 8", "force_limit_n = 9", ("device", "force_limit_n"), 8),
        ("rate_hz = 1000", "rate_hz = 10", ("device", "rate_hz"), 250),
        ('task = "reach"', 'task = "rech"', ("blocks", "look", "task"), "reach"),
        ("format = 2", "format = 2.0", ("format",), 2),
    ],
)
def test_the_first_repair_writes_the_nearest_permitted_value(old: str, new: str, place: Any, value: Any) -> None:
    assert old in SOUND
    study = read_study(SOUND.replace(old, new, 1).encode())
    (fault,) = study.faults
    after = edited(study, *repairs(study, fault)[0].edits)
    assert value_at(after.document, place) == value
    assert not after.faults


def shown_lines() -> Iterator[str]:
    """Yield the outline, a search, what can be added, and forms with most kinds of rows, without their help."""
    demo, jnd = read_study(DEMO.encode()), template("viscosity-jnd")
    broken, _ = demo.with_edits(Set(("blocks", "liquids", "task"), "gone"), Set(("tasks", "reach", "count"), 0))
    for name, lines in (
        ("outline", outline_rows(broken, facts(demo).steps_s, session_s=190.0)),
        ("found", outline_rows(demo, facts(demo).steps_s, "honey")),
        ("addable", addable_elements(demo, ("pages", "welcome"))[:12]),
    ):
        yield f"== {name}"
        yield from map(one_line, lines)
    for path in (("liquids", "thick"), ("conditions", "late"), ("blocks", "delays"), ("study",)):
        yield f"== measures of {path[-1]}"
        yield from value_lines(measures_view(demo, facts(demo), path, Simulated()).cards)
    for study, paths in ((broken, FORMS), (jnd, FORMS_OF_LEVELS)):
        for path in paths:
            yield f"== {'.'.join(map(str, path))}"
            form = form_of(study, path)
            parts = {field.name: getattr(form, field.name) for field in fields(form) if field.name != "sections"}
            yield one_line(parts)
            for section in form.sections:
                absent = [row.label for row in section.absent]
                yield one_line({"title": section.title, "absent": absent, "faults": section.faults})
                for row in section.rows:
                    chosen: Any = tuple(choice.value for choice in row.choices)
                    yield f"  {one_line(replace(row, help='', choices=chosen, bounds=(), facts=None))[:400]}"
                    if row.facts is not None:
                        yield f"    {one_line(row.facts)[:600]}"


FORMS = (
    ("blocks", "liquids"), ("tasks", "reach"), ("questionnaires", "liquid"), ("questionnaires", "liquid", "items", 1),
    ("conditions", "late"), ("scales", "agreement"), ("study",),
)  # fmt: skip
FORMS_OF_LEVELS = (("stimuli", "damping"), ("designs", "pair"), ("blocks", "viscosity"), ("methods", "adaptive"))


def test_outline_and_forms_show_each_element_with_its_words() -> None:
    check_kept(File(__file__).with_name("shown.txt"), shown_lines())
