"""The TOML writer: comments and style stay, and undo restores every byte."""

import os
import tomllib
from random import Random
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, example, given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule, run_state_machine_as_test

from study_app.designer.document.document import Document
from study_app.designer.document.study import Study
from study_app.designer.document.toml_edits import (
    Duplicate,
    Edit,
    Insert,
    Move,
    Rename,
    Set,
    Unset,
    WriterError,
    apply_edit,
)
from study_app.errors import StudyError
from study_app.protocol.source.document import value_at
from tests.designer.document.grown import texts
from tests.designer.document.random_edits import check_edit, edit_of

EDITS = int(os.environ.get("LIQUID_STUDY_EDITS", "0"))
"""How many random edits are tried; without it about 400."""
TEXTS = texts()
STEPS = 16


@pytest.mark.parametrize(
    ("old", "new", "at", "before", "after"),
    [
        ("thin honey", "thick honey", 3, "n", "ck"), ("honey", "money", 0, "h", "m"), ("abcd", "abcde", 4, "", "e"),
        ("aa", "aaaa", 2, "", "aa"), ("", "honey", 0, "", "honey"), ("aaaa", "aa", 2, "aa", ""),
    ],
)  # fmt: skip
def test_a_typed_text_replaces_only_the_difference(old: str, new: str, at: int, before: str, after: str) -> None:
    study, (((splice,)),) = Study(old).with_text(new)
    assert (study.text, splice.start, splice.before, splice.after) == (new, at, before, after)


class Edited(RuleBasedStateMachine):
    """A state machine of an edited study; ``texts`` are those before each undoable step, and the present one."""

    @initialize(name=st.sampled_from([*TEXTS, *["grown", "grown, \\r\\n"] * 8]))
    def open(self, name: str) -> None:
        self.document = Document(Study(TEXTS[name]))
        self.texts, self.undone = [TEXTS[name]], list[str]()

    @rule(seed=st.integers(0, 2**32))
    def edit(self, seed: int) -> None:
        edit = edit_of(Random(seed), self.texts[-1])  # noqa: S311
        study, step_count = self.document.study, len(self.document.done)
        try:
            self.document.edit("Edit", edit)
        except StudyError:
            return
        check_edit(study.text, self.document.study.text, edit)
        if len(self.document.done) > step_count:
            self.texts.append(self.document.study.text)
            self.undone.clear()

    @precondition(lambda self: len(self.texts) > 1)
    @rule()
    def undo(self) -> None:
        self.document.undo()
        self.undone.append(self.texts.pop())
        assert self.document.study.text == self.texts[-1]

    @precondition(lambda self: self.undone)
    @rule()
    def redo(self) -> None:
        self.document.redo()
        self.texts.append(self.undone.pop())
        assert self.document.study.text == self.texts[-1]

    @rule()
    def type(self) -> None:
        """Add a comment line, as a person who types into the file."""
        text = self.texts[-1]
        newline = "\r\n" if "\r\n" in text else "\n"
        self.document.edit("Type", text=f"{text}{newline}# typed{newline}")
        self.texts.append(self.document.study.text)
        self.undone.clear()
        assert self.document.study.document == Study(text).document

    def teardown(self) -> None:
        """Undo everything."""
        while self.document.done:
            self.document.undo()
        assert self.document.study.text == self.texts[0]


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_edits_change_only_their_target_keep_comments_and_undo_restores_every_byte() -> None:
    run_state_machine_as_test(
        Edited,
        settings=settings(
            max_examples=EDITS // STEPS or 25, stateful_step_count=STEPS, deadline=None, derandomize=not EDITS,
            database=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck),
        ),
    )  # fmt: skip


ANY_TEXT = st.text(st.characters(exclude_categories=["Cs"]))
VALUES = st.recursive(
    ANY_TEXT | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False) | st.booleans() | st.dates(),
    lambda inner: st.lists(inner) | st.dictionaries(ANY_TEXT, inner),
    max_leaves=6,
)


@pytest.mark.slow
@example("\n", "", "\n")
@given(VALUES, st.sampled_from(["", "'a'", '"""\n"""', "[\n  1,\n]"]), st.sampled_from(["\n", "\r\n"]))
def test_written_is_read_back_as_the_same_value(value: Any, like: str, newline: str) -> None:
    for before, path in ((f"key = {like or 0}{newline}", ("key",)), (newline, ("a b", "c"))):
        after = apply_edit(before, Set(path, value))[0]
        assert value_at(tomllib.loads(after), path) == value


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
        pytest.param("a = 1000     # one\n", Set(("a",), 2), "a = 2        # one\n", id="wider column"),
        pytest.param("a = 1  # one\n", Set(("a",), "x" * 9), 'a = "xxxxxxxxx"  # one\n', id="no room for the column"),
        pytest.param("a = 'x'\n", Set(("a",), "y"), "a = 'y'\n", id="quotes"),
        pytest.param("a = { b = 1, c = 2 }\n", Set(("a", "b"), 34), "a = { b = 34, c = 2 }\n", id="value of a pair"),
        pytest.param(
            "[t]\n  a.b = 1\n  c = 2\n",
            Set(("t", "a", "b"), {"long": "x" * 70, "longer": "y" * 60}),
            f'[t]\n  a.b.long = "{"x" * 70}"\n  a.b.longer = "{"y" * 60}"\n  c = 2\n',
            id="a line for each part of a long value",
        ),
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
        pytest.param(
            "# study\n\n[b]\ny = 2\n", Set(("a",), 1), "# study\n\na = 1\n\n[b]\ny = 2\n", id="above the first header"
        ),
        pytest.param("", Set(("a",), 1), "a = 1\n", id="the first line"),
        pytest.param("a = 1", Set(("b",), 2), "a = 1\nb = 2", id="a line after the last one without a line break"),
        pytest.param(
            "x = { a.b = 1, c = 3 }\n", Set(("x", "a", "d"), 2), "x = { a.b = 1, a.d = 2, c = 3 }\n", id="dotted pair"
        ),
        pytest.param("[a]\nx = 1\n", Set(("a", "y", "z"), 3), "[a]\nx = 1\ny = { z = 3 }\n", id="table in a table"),
        pytest.param(
            "x = { a = 1, c = 3 }\n", Duplicate(("x", "a"), "e"), "x = { a = 1, e = 1, c = 3 }\n", id="copy of a pair"
        ),
        pytest.param(
            "a.x = 1\na.y = 2 # two\nb = 3\n",
            Duplicate(("a",), "e"),
            "a.x = 1\na.y = 2 # two\ne.x = 1\ne.y = 2 # two\nb = 3\n",
            id="copy of dotted keys",
        ),
        pytest.param("x = { a = 1, c = 3 }\n", Unset(("x", "c")), "x = { a = 1 }\n", id="remove the last pair"),
        pytest.param("x = { a = 1, c = 3 }\n", Unset(("x", "a")), "x = { c = 3 }\n", id="remove the first pair"),
        pytest.param("l = [1, 2]\n", Insert(("l", 1), 7), "l = [1, 7, 2]\n", id="insert on one line"),
        pytest.param("l = []\n", Insert(("l", 0), 7), "l = [7]\n", id="the first entry"),
        pytest.param("l = [1, 2, 3]\n", Unset(("l", 2)), "l = [1, 2]\n", id="remove the last entry"),
        pytest.param("l = [\n  1,\n  2, # two\n  3\n]\n", Unset(("l", 1)), "l = [\n  1,\n  3\n]\n", id="remove a line"),
        pytest.param(
            "l = [\n  1,\n  2,\n  3\n]\n", Move(("l", 2), 0), "l = [\n  3,\n  1,\n  2\n]\n", id="move the last line up"
        ),
        pytest.param(
            "[[a]]\nx = 1\n\n[b]\n",
            Insert(("a", 1), {"x": 2}),
            "[[a]]\nx = 1\n\n[[a]]\nx = 2\n\n[b]\n",
            id="table after the last one of its list",
        ),
        pytest.param(
            "[[a]]\nx = 1\n", Insert(("a", 0), {"x": 2}), "[[a]]\nx = 2\n\n[[a]]\nx = 1\n", id="table before the first"
        ),
        pytest.param("[a]\nx = 1\n\n[b]\ny = 2\n", Unset(("b",)), "[a]\nx = 1\n", id="no blank line at the end"),
    ],
)
def test_apply_writes_as_the_neighbours_do(before: str, edit: Edit, after: str) -> None:
    assert apply_edit(before, edit)[0] == after


@pytest.mark.parametrize(
    ("edit", "sentence"),
    [
        (Unset(("b",)), "the study no longer contains b"),
        (Set(("a", "b"), 1), "a is not a table"),
        (Set(("c",), None), "a value cannot be empty: remove its key instead"),
        (Set(("c",), {"d": "\ud800"}), "incomplete character"),
        (Duplicate(("a",), "l"), 'the name "l" is already taken'),
        (Rename(("a",), "l"), 'the name "l" is already taken'),
        (Move(("l", 0), 2), "cannot be moved to position 3"),
        (Insert(("l", 4), 1), "cannot be inserted at position 4"),
        (Unset(("l", 7)), "no longer contains entry 8"),
        (Rename(("l", 0), "m"), "entries of an array do not have names"),
        (Insert(("t", 0), 5), "each entry in an array of tables must be a table"),
    ],
)
def test_apply_refuses_impossible_edits(edit: Edit, sentence: str) -> None:
    with pytest.raises(StudyError, match=sentence):
        apply_edit("a = 1\nl = [1, 2]\n[[t]]\nx = 1\n", edit)


def test_apply_refuses_its_own_mistakes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("study_app.designer.document.toml_edits.toml_value", lambda *_: "7")
    with pytest.raises(WriterError, match="did not produce the intended document"):
        apply_edit("a = 1\n", Set(("a",), 2))
