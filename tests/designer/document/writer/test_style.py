"""How edits are written: what a person would have typed there; comments that mention a name."""

import tomllib
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from study_app.designer.document.toml_edits import Duplicate, Edit, Insert, Move, Rename, Set, Unset, WriterError, apply
from study_app.designer.document.toml_text import Refused, comments_naming, tables, wrapped, written

TEXTS = st.text(st.characters(exclude_categories=["Cs"]))
VALUES = st.recursive(
    TEXTS | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False) | st.booleans() | st.dates(),
    lambda inner: st.lists(inner) | st.dictionaries(TEXTS, inner),
    max_leaves=6,
)


@pytest.mark.slow
@example("\n", "", "\n")
@given(VALUES, st.sampled_from(["", "'a'", '"""\n"""', "[\n  1,\n]"]), st.sampled_from(["\n", "\r\n"]))
def test_written_is_read_back_as_the_same_value(value: Any, like: str, newline: str) -> None:
    assert tomllib.loads(f"key = {written(value, like, newline)}{newline}")["key"] == value
    if isinstance(value, dict):
        assert tomllib.loads(tables(("a b", 0, "c"), value, newline)) == {"a b": {"c": value}}


def test_wrapped_fills_lines_and_keeps_paragraphs() -> None:
    text = wrapped("one " * 60 + "\n\ntwo")
    assert max(map(len, text.splitlines())) <= 120
    assert text.endswith("\n\ntwo\n")


BEFORE_A_RULER = """\
[conditions.a]
liquid = "water"

# --- Tasks ---

[tasks.b]
"""


@pytest.mark.parametrize(
    ("before", "edit", "after"),
    [
        pytest.param("a = 1    # one\n", Set(("a",), 100), "a = 100  # one\n", id="column"),
        pytest.param("a = 1 # one\n", Set(("a",), 100), "a = 100 # one\n", id="no column"),
        pytest.param("a = 'x'\n", Set(("a",), "y"), "a = 'y'\n", id="quotes"),
        pytest.param(
            "a.en = 'x' # c\nb = 1\n", Set(("a", "n"), "y"), "a.en = 'x' # c\na.n = 'y'\nb = 1\n", id="dotted"
        ),
        pytest.param('a = { en = "x" } # c\n', Set(("a", "nl"), "y"), 'a = { en = "x", nl = "y" } # c\n', id="pair"),
        pytest.param("a = 'x' # c\n", Set(("a",), {"en": "x"}), 'a = { en = "x" } # c\n', id="languages"),
        pytest.param(
            BEFORE_A_RULER,
            Set(("conditions", "c"), {"liquid": "honey"}, "a"),
            BEFORE_A_RULER.replace("\n\n# ---", '\n\n[conditions.c]\nliquid = "honey"\n\n# ---'),
            id="new table before a ruler",
        ),
        pytest.param(
            BEFORE_A_RULER,
            Unset(("conditions", "a")),
            BEFORE_A_RULER[BEFORE_A_RULER.index("\n# ---") :],
            id="ruler stays",
        ),
        pytest.param(
            "# of a\n[a]\nx = 1 # y\n\n# free\n\n[b]\n",
            Duplicate(("a",), "a_2"),
            "# of a\n[a]\nx = 1 # y\n\n# of a\n[a_2]\nx = 1 # y\n\n# free\n\n[b]\n",
            id="copy with comments",
        ),
        pytest.param(
            "[a.b]\n[a.b.c]\n[d]\ne = 'b'\n",
            Rename(("a", "b"), "x", (("d", "e"),)),
            "[a.x]\n[a.x.c]\n[d]\ne = 'x'\n",
            id="rename",
        ),
        pytest.param(
            "# of 1\n[[a]]\nx = 1\n\n# of 2\n[[a]]\nx = 2",
            Move(("a", 1), 0),
            "# of 2\n[[a]]\nx = 2\n\n# of 1\n[[a]]\nx = 1",
            id="move tables",
        ),
        pytest.param(
            "a = [\n  1, # one\n  # of two\n  2 # two\n]\n",
            Move(("a", 0), 1),
            "a = [\n  # of two\n  2, # two\n  1 # one\n]\n",
            id="move entries",
        ),
        pytest.param("a = [1, 2, 3]\n", Move(("a", 0), 2), "a = [2, 3, 1]\n", id="move on one line"),
        pytest.param("a = [\n  1\n]\n", Insert(("a", 1), 2), "a = [\n  1,\n  2\n]\n", id="append without a comma"),
        pytest.param("a = [1,\n  2]\r\n", Unset(("a", 0)), "a = [\n  2]\r\n", id="remove on the bracket's line"),
        pytest.param("[a]\nx = 1", Set(("b",), {"y": 2}), "[a]\nx = 1\n\n[b]\ny = 2", id="no last line break"),
        pytest.param("[a.b]\n", Set(("a", "x"), 1), "[a]\nx = 1\n\n[a.b]\n", id="a table without a header of its own"),
        pytest.param("a = 1\r\n", Set(("a",), "x\n\ny\n"), 'a = """\r\nx\r\n\r\ny\r\n"""\r\n', id="paragraphs, \\r\\n"),
    ],
)
def test_apply_writes_as_the_neighbours_do(before: str, edit: Edit, after: str) -> None:
    assert apply(before, edit)[0] == after


@pytest.mark.parametrize(
    ("edit", "sentence"),
    [
        (Unset(("b",)), "there is no b in the study any more"),
        (Set(("a", "b"), 1), "a is not a table"),
        (Set(("c",), None), "a value cannot be empty: remove the key"),
        (Set(("c",), {"d": "\ud800"}), "half a character"),
        (Duplicate(("a",), "l"), 'the name "l" is taken'),
        (Rename(("a",), "l"), 'the name "l" is taken'),
        (Move(("l", 0), 2), "cannot move to place 3"),
        (Insert(("l", 4), 1), "has no place 4"),
        (Unset(("l", 7)), "there is no 8"),
    ],
)
def test_apply_refuses_what_makes_no_sense(edit: Edit, sentence: str) -> None:
    with pytest.raises(Refused, match=sentence):
        apply("a = 1\nl = [1, 2]\n", edit)


def test_apply_refuses_its_own_mistakes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("study_app.designer.document.toml_edits.written", lambda *_: "7")
    with pytest.raises(WriterError, match="another document than the one meant"):
        apply("a = 1\n", Set(("a",), 2))


TEXT = '''# "honey" first
a = "# `honey` in a string"  # the [honey, water]
b = """
# `honey` in a text
"""
c = 'honey'  # `honey_2`, "honeyed" and the honey's smell
d = 1  # more of liquids.honey.\r
# The late_60 condition; honey = thick, late_600 and liquids.late_60
# Honey and honey are common words.
'''


def test_comments_are_found_by_whole_names_and_strings_are_none() -> None:
    lines = TEXT.splitlines()
    found = comments_naming(TEXT, "honey")
    assert [comment.line for comment in found] == [1, 2, 7, 8]
    assert found[0].text == lines[0]
    assert found[2].text == "# more of liquids.honey."
    assert [comment.line for comment in comments_naming(TEXT, "late_60")] == [8]
    assert comments_naming(TEXT, "x") == ()
    assert comments_naming(TEXT, "common") == ()  # a plain word of the language names nothing
