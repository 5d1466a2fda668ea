"""Rows of a study: its outline and problems, the form of an element, the file with what is marked in it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.designer.document.elements import element_of
from study_app.designer.document.study import Study, read
from study_app.designer.document.toml_text import retyped, shown
from study_app.designer.place.file import file_text
from study_app.protocol.source.files import shipped_file


@pytest.fixture(scope="module")
def study() -> Study:
    return read(shipped_file("rek2024").read_bytes(), shipped_file("rek2024").parent)


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
