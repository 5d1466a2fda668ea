"""Rows of a study: its outline and problems, the form of an element, the file with what is marked in it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.authoring.edited_study import Study, read
from study_app.authoring.study_facts import facts
from study_app.authoring.writer.edits import Set
from study_app.protocol.source.document import Path
from study_app.protocol.source.files import shipped_file
from study_app.viewmodels.designer.file_text import file_text, retyped, shown
from study_app.viewmodels.designer.finding import SENTENCE, found_fields
from study_app.viewmodels.designer.outline_rows import SECTIONS, outline_rows
from study_app.viewmodels.designer.problem_rows import element_of, problem_rows


@pytest.fixture(scope="module")
def study() -> Study:
    return read(shipped_file("rek2024").read_bytes(), shipped_file("rek2024").parent)


def test_the_session_comes_in_order_with_its_times(study: Study) -> None:
    times = facts(study).steps_s
    rows = outline_rows(study, times)
    headings = [row.title for row in rows if not row.path]
    assert headings == list(SECTIONS)
    assert [row.path or row.title for row in rows[:3]] == [("study",), SECTIONS[0], ("pages", "consent")]
    assert [row.path for row in rows].count(("study",)) == 1
    end = next(at for at, row in enumerate(rows) if row.title == SECTIONS[1])
    steps = [row for row in rows[2:end] if row.depth == 1]
    assert [row.path[-1] for row in steps] == list(study.document["sequence"])
    assert all(row.note for row in steps)
    counts = {row.title: row.note for row in rows[end:] if row.depth == 1}
    assert (counts["Liquids"], counts["Groups"]) == ("4", "none")


@pytest.mark.parametrize("words", ["vloeistof", "  SLIJM ", "delay_150"])
def test_find_leaves_elements_that_hold_the_words(study: Study, words: str) -> None:
    rows = [row for row in outline_rows(study, {}, words) if row.path]
    assert rows
    every = [row for row in outline_rows(study, {}) if row.path]
    assert len(rows) < len(every)
    assert outline_rows(study, {}, "no such words anywhere") == ()


def test_what_is_chosen_comes_before_what_could_be_chosen(study: Study) -> None:
    def fields(study: Study) -> set[Path]:
        return {row.field for row in outline_rows(study, {}, "williams") if row.path}

    blocks = {("blocks", name, "order") for name in study.document["blocks"]}
    assert fields(study) == blocks
    chosen, _ = study.edited(Set(("blocks", "liquids", "order"), "williams"))
    assert fields(chosen) == {("blocks", "liquids", "order")}
    assert {one.label for one in found_fields(chosen, "design")} == {"Trial design"}
    assert {one.rank for one in found_fields(study, "anew in each")} == {SENTENCE}


def test_problems_are_those_of_check_in_the_order_of_lines(study: Study) -> None:
    broken, _ = study.edited(
        Set(("questionnaires", "liquid", "items", 1, "kind"), "raiting"),
        Set(("conditions", "honey", "liquid"), "hony"),
        Set(("blocks", "liquids", "order"), "shufled"),
    )
    rows = problem_rows(broken)
    assert [row.line for row in rows] == [problem.line for problem in broken.problems]
    assert [row.message.lower() for row in rows] == [problem.message.lower() for problem in broken.problems]
    assert [row.element for row in rows] == [
        ("conditions", "honey"),
        ("questionnaires", "liquid", "items", 1),
        ("blocks", "liquids"),
    ]
    assert [row.name for row in rows] == [
        "Condition Honey, Liquid",
        "Question Immersive, Kind",
        "Block Baseline settings, Order",
    ]
    assert [row.place for row in rows] == [f"{problem.place} · line {problem.line}" for problem in broken.problems]


def test_a_place_belongs_to_the_nearest_element(study: Study) -> None:
    assert element_of(study, ("scene", "body", "radius_m")) == ("scene",)
    assert element_of(study, ("sequence", 3)) == ("sequence",)
    assert element_of(study, ()) == ("study",)


ENDS = st.sampled_from(["\n", "\r\n"])


@pytest.mark.slow
@given(st.lists(st.tuples(st.sampled_from(["a", "b = 1", "# é😀\u00a0", ""]), ENDS), max_size=8), st.data())
def test_typing_changes_no_end_of_line_elsewhere(lines: list[tuple[str, str]], data: st.DataObject) -> None:
    text = "".join(line + end for line, end in lines)
    pane = shown(text)
    first = data.draw(st.integers(0, len(pane)))
    last = data.draw(st.integers(first, len(pane)))
    typed = pane[:first] + data.draw(st.sampled_from(["", "x", "new\nline", "\n"])) + pane[last:]
    after = retyped(text, typed)
    assert shown(after) == typed
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
    found = file_text(read(text.encode()), "x.toml", ("blocks", "liquids"))
    lines = found.text.split("\n")
    (first, last), *others = found.selected
    assert not others
    assert lines[first] == "[blocks.liquids]"
    assert lines[last].startswith("questionnaire = ")
    assert [lines[line] for line in found.faulty] == ['order = "shufled"']


def test_a_file_that_is_not_toml_is_shown_with_its_line() -> None:
    found = file_text(read(b"format = 1\nbroken =\n"), "x.toml", ("study",))
    assert (found.text, found.selected, found.faulty) == ("format = 1\nbroken =\n", (), (1,))
