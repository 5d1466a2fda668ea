"""Facts about a study, sound or not: uses of elements, forms, the marked file, measures."""

import pathlib
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.designer.document.additions import repairs
from study_app.designer.document.document import template
from study_app.designer.document.elements import outline, usage_text
from study_app.designer.document.fields import all_references
from study_app.designer.document.steps import RetypeFile, StepContext
from study_app.designer.document.study import Study, read_study
from study_app.designer.document.toml_edits import Edit, Set, Unset
from study_app.designer.file import file_text
from study_app.designer.form.form import form_of
from study_app.designer.measures.measures_view import measures_view
from study_app.designer.measures.simulation import Simulated
from study_app.designer.measures.study_facts import facts, restored_part
from study_app.designer.outline import outline_rows
from study_app.designer.participant.playable import NotPlayableError, find_first_step, part_to_play
from study_app.designer.problems import problem_rows
from study_app.designer.templates import FOLDER, templates
from study_app.protocol.source.document import Path, entries, value_at
from study_app.protocol.source.files import shipped, shipped_file
from tests.designer.document.grown import PROTOCOLS


def study_of(file: pathlib.Path) -> Study:
    return read_study(file.read_bytes(), file.parent)


@pytest.mark.parametrize(
    ("name", "path", "words"),
    [
        ("delaydetect", ("conditions", "water"), "used by 1 stimulus"),
        ("delayjnd", ("tasks", "reach"), "used by 1 block"),
        ("delayjnd", ("liquids", "water"), "used by 1 stimulus"),
    ],
)
def test_the_only_element_is_used_where_its_name_is_omitted(name: str, path: Path, words: str) -> None:
    assert usage_text(study_of(PROTOCOLS / f"{name}.toml").document, path) == words


def test_liquids_are_used_as_conditions_of_a_study_without_conditions() -> None:
    document = {"liquids": {"water": {}, "oil": {}}, "blocks": {"one": {"conditions": ("water",)}}}
    assert [usage_text(document, ("liquids", name)) for name in ("water", "oil")] == ["used by 1 block", "not used"]


@pytest.mark.parametrize("file", [*PROTOCOLS.glob("*.toml"), *FOLDER.glob("*.toml")], ids=lambda file: file.stem)
def test_a_reference_names_its_target_or_is_left_out(file: pathlib.Path) -> None:
    document = study_of(file).document
    references = list(all_references(document))
    assert len(set(references)) == len(references)
    for place, target in references:
        name = value_at(document, target)["id"] if isinstance(target[-1], int) else target[-1]
        assert value_at(document, place) in (name, None), place
        assert target not in (place[: len(target)], place[:2]), f"{place} names the element that it is in"


@pytest.mark.parametrize("file", [*PROTOCOLS.glob("*.toml"), *FOLDER.glob("*.toml")], ids=lambda file: file.stem)
def test_unused_elements_can_be_deleted(file: pathlib.Path) -> None:
    study = study_of(file)
    elements = (path for path, _ in entries(study.document, "*.*"))
    for path in [element for element in elements if usage_text(study.document, element) == "not used"]:
        assert study.with_edits(Unset(path))[0].faults == study.faults, path


ITEM = ("questionnaires", "remarks", "items", 0)
WRONG: tuple[tuple[str, Path, tuple[Any, ...]], ...] = (
    ("viscosity-jnd", ("study",), ("x",)),
    ("viscosity-jnd", ("study", "languages"), (5, "x", [{}])),
    ("viscosity-jnd", ("blocks",), (None, 5)),
    ("viscosity-jnd", ("sequence",), ("x", [])),
    ("questionnaire-only", (*ITEM, "id"), (5, [], {})),
    ("questionnaire-only", (*ITEM, "kind"), ([], {})),
    ("questionnaire-only", ITEM[:3], ("x", [])),
    ("rate-realism", ("blocks", "liquids", "order"), (5, {})),
    ("delay-detection", ("designs", "pair", "kind"), (5, {})),
)


@pytest.mark.parametrize(
    ("name", "path", "value"), [(name, path, value) for name, path, values in WRONG for value in values]
)
def test_a_value_of_a_wrong_type_is_a_fault_that_every_view_shows(name: str, path: Path, value: Any) -> None:
    sound = template(name)
    edit: Edit = Unset(path) if value is None else Set(path, value)
    study, _ = sound.with_edits(edit)
    assert study.faults
    known = facts(study)
    outline_rows(study, known.steps_s, "")
    problems = problem_rows(study)
    assert len(problems) == len(study.faults)
    for fault in study.faults:
        repairs(study, fault)
    protocol = restored_part(study, sound.document).protocol
    for selected in {("study",), path[:2], path[:4]}:
        if not isinstance(value_at(study.document, selected), dict):
            continue
        form_of(study, selected)
        measures_view(study, known, selected, Simulated())
        if protocol is not None:
            find_first_step(protocol, selected)
        with pytest.raises(NotPlayableError):
            part_to_play(study, selected)


@pytest.fixture(scope="module")
def study() -> Study:
    return read_study(shipped_file("rek2024").read_bytes(), shipped_file("rek2024").parent)


def as_shown(text: str) -> str:
    """Return a text with line ends as in the pane, one character each."""
    return text.replace("\r\n", "\n")


ENDS = st.sampled_from(["\n", "\r\n"])


@pytest.mark.slow
@given(st.lists(st.tuples(st.sampled_from(["a", "b = 1", "# é😀\u00a0", ""]), ENDS), max_size=8), st.data())
def test_typing_changes_no_end_of_line_elsewhere(lines: list[tuple[str, str]], data: st.DataObject) -> None:
    text = "".join(line + end for line, end in lines)
    pane = as_shown(text)
    first = data.draw(st.integers(0, len(pane)))
    last = data.draw(st.integers(first, len(pane)))
    typed = pane[:first] + data.draw(st.sampled_from(["", "x", "new\nline", "\n"])) + pane[last:]
    after = RetypeFile(typed).step(StepContext(Study(text), ())).text
    assert as_shown(after) == typed
    if typed == pane:
        assert after == text
    shortest = 0
    while shortest < min(len(pane), len(typed)) and pane[shortest] == typed[shortest]:
        shortest += 1
    before = pane[:shortest].count("\n")
    kept = text.splitlines(keepends=True)[:before]
    assert after.startswith("".join(kept))


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_the_selected_element_and_faulty_lines_are_marked(newline: str) -> None:
    text = shipped_file("rek2024").read_text(encoding="utf-8").replace("\n", newline)
    text = text.replace('order = "shuffled"', 'order = "shufled"', 1)
    shown_file = file_text(read_study(text.encode()), "x.toml", ("blocks", "liquids"))
    lines = shown_file.text.split("\n")
    (first, last), *others = shown_file.selected
    assert not others
    assert lines[first] == "[blocks.liquids]"
    assert lines[last].startswith("questionnaire = ")
    assert [lines[line] for line in shown_file.faulty] == ['order = "shufled"']


FILES = [*(shipped_file(name) for name in shipped()), *(FOLDER / f"{name}.toml" for name in templates())]


def leaves(value: Any, path: tuple[Any, ...] = ()) -> set[tuple[Any, ...]]:
    """Return the keys of an element and of its tables; entries of lists are forms of their own."""
    if isinstance(value, dict) and (value or not path):
        return {leaf for key, inner in value.items() for leaf in leaves(inner, (*path, key))}
    return {path}


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_every_key_of_every_element_is_in_its_form_with_its_value(file: pathlib.Path) -> None:
    study = read_study(file.read_bytes(), file.parent)
    listed_rows = outline(study)
    for element in {row.path for row in (*listed_rows.session, *listed_rows.parts, *listed_rows.study)}:
        if len(element) == 1 and element[0] not in {"study", "device", "scene", "limits", "analysis"}:
            continue
        if value_at(study.document, element) is None:
            continue
        form = form_of(study, element)
        rows = {row.path: row.value for row in form.rows}
        for leaf in leaves(value_at(study.document, element), element):
            if leaf[-1] == "id" and len(leaf) > 3:
                assert form.id is not None
                continue
            around = next((leaf[:length] for length in range(len(leaf), 0, -1) if leaf[:length] in rows), None)
            assert around is not None, leaf
            assert rows[around] == value_at(study.document, around)


def test_the_form_of_an_unreadable_file_names_the_line_of_the_problem() -> None:
    form = form_of(Study("format = 1\n\n[study\nname = 5\n"), ("pages", "welcome"))
    (sentence,) = form.faults
    assert sentence.startswith("Line 3: ")
    assert sentence[len("Line 3: ")].isupper()
    assert (form.path, form.kind, form.unreadable) == (("study",), "Correct the text in the File tab", True)


def test_hypotheses_compare_every_number_that_is_asked_after_trials() -> None:
    text = (PROTOCOLS.parent / "tests" / "protocol" / "studies" / "mixed.toml").read_text(encoding="utf-8")
    text += '[questionnaires.after.scores.both]\nitems = ["thickness", "pleasant"]\n[analysis]\ncontrasts = []\n'
    rows = {row.path: row for row in form_of(Study(text), ("analysis",)).rows}
    thin, thick = rows["analysis", "contrasts"].facts.items
    assert [(item.key, item.name, item.block) for item in (thin, thick)] == [
        ("conditions", "thin", "stir"), ("conditions", "thick", "stir"),
    ]  # fmt: skip
    assert thin.measures == thick.measures == (
        ("feels_liquid", "Liquid"), ("thickness", "Thickness"), ("pleasant", "Pleasant"), ("both", "Both score"),
    )  # fmt: skip
