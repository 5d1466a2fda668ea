"""A study under any sequence of edits, undo and redo: comments stay, and undo gives every byte back."""

import os
from random import Random

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule, run_state_machine_as_test

from study_app.designer.document.document import Document
from study_app.designer.document.study import Study
from study_app.designer.document.toml_text import Refused
from tests.designer.document.grown import texts
from tests.designer.document.random_edits import check_edit, edit_of, holds_nothing

EDITS = int(os.environ.get("LIQUID_STUDY_EDITS", "0"))
"""How many random edits are tried; without it about 400. `tests/benchmarks/windows/designer.py` prints their times."""
TEXTS = texts()
STEPS = 16


class Edited(RuleBasedStateMachine):
    """A study that is edited; ``texts`` are those before each step that can be undone, and the one now."""

    @initialize(name=st.sampled_from([*TEXTS, *["grown", "grown, \\r\\n"] * 8]))
    def open(self, name: str) -> None:
        self.document = Document(Study(TEXTS[name]))
        self.texts, self.undone = [TEXTS[name]], list[str]()

    @rule(seed=st.integers(0, 2**32))
    def edit(self, seed: int) -> None:
        edit = edit_of(Random(seed), self.texts[-1])  # noqa: S311
        study, done = self.document.study, len(self.document.done)
        try:
            self.document.edit("Edit", edit)
        except Refused:
            return
        check_edit(study.text, self.document.study.text, edit)
        if len(self.document.done) > done:
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

    @rule(seed=st.integers(0, 2**32))
    def try_edit(self, seed: int) -> None:
        """A trial has the document and the faults of the edited text, and changes nothing."""
        study, edit = self.document.study, edit_of(Random(seed), self.texts[-1])  # noqa: S311
        document = repr(study.document)
        try:
            written, tried = study.edited(edit)[0], study.trial.edited(edit)[0]
        except Refused:
            return
        assert tried.document == written.document or holds_nothing(edit)
        assert repr(study.document) == document

    def teardown(self) -> None:
        """Undo everything."""
        while self.document.done:
            self.document.undo()
        assert self.document.study.text == self.texts[0]


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_edits_change_what_is_meant_keep_comments_and_undo_gives_every_byte_back() -> None:
    run_state_machine_as_test(
        Edited,
        settings=settings(
            max_examples=EDITS // STEPS or 25, stateful_step_count=STEPS, deadline=None, derandomize=not EDITS,
            database=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck),
        ),
    )  # fmt: skip
