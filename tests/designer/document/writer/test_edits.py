"""A study under any sequence of edits, undo and redo: comments stay, and undo gives every byte back."""

import os
from random import Random

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule, run_state_machine_as_test

from study_app.designer.document.study import History, Study
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
        self.history = History(Study(TEXTS[name]))
        self.texts, self.undone = [TEXTS[name]], list[str]()

    @rule(seed=st.integers(0, 2**32))
    def edit(self, seed: int) -> None:
        edit = edit_of(Random(seed), self.texts[-1])  # noqa: S311
        study, before = self.history.study, self.history
        try:
            self.history = before.edited("Edit", edit)
        except Refused:
            return
        check_edit(study.text, self.history.study.text, edit)
        if self.history.done != before.done:
            self.texts.append(self.history.study.text)
            self.undone.clear()

    @precondition(lambda self: len(self.texts) > 1)
    @rule()
    def undo(self) -> None:
        self.history = self.history.undo()
        self.undone.append(self.texts.pop())
        assert self.history.study.text == self.texts[-1]

    @precondition(lambda self: self.undone)
    @rule()
    def redo(self) -> None:
        self.history = self.history.redo()
        self.texts.append(self.undone.pop())
        assert self.history.study.text == self.texts[-1]

    @rule()
    def type(self) -> None:
        """Add a comment line, as a person who types into the file."""
        text = self.texts[-1]
        newline = "\r\n" if "\r\n" in text else "\n"
        self.history = self.history.typed("Type", f"{text}{newline}# typed{newline}")
        self.texts.append(self.history.study.text)
        self.undone.clear()
        assert self.history.study.document == Study(text).document

    @rule(seed=st.integers(0, 2**32))
    def try_edit(self, seed: int) -> None:
        """A trial has the document and the faults of the edited text, and changes nothing."""
        study, edit = self.history.study, edit_of(Random(seed), self.texts[-1])  # noqa: S311
        document = repr(study.document)
        try:
            written, tried = study.edited(edit)[0], study.trial.edited(edit)[0]
        except Refused:
            return
        assert tried.document == written.document or holds_nothing(edit)
        assert repr(study.document) == document

    def teardown(self) -> None:
        """Undo everything."""
        while self.history.done:
            self.history = self.history.undo()
        assert self.history.study.text == self.texts[0]


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
