"""Undo and redo: one stack of steps for a study, each with words and what was selected."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from study_app.designer.document.edited_study import Study
from study_app.designer.document.writer.edits import Edit
from study_app.designer.document.writer.splices import Splices, reverted
from study_app.protocol.source.document import Path

MOST_STEPS: Final = 500


@dataclass(frozen=True, slots=True)
class Step:
    """One step: its words ("Move Honey up"), its splices, and what was selected before and after it."""

    words: str
    splices: tuple[Splices, ...]
    before: Path = ()
    after: Path = ()


@dataclass(frozen=True, slots=True)
class History:
    """A study with the steps that led to it, newest last, and those that were undone, next to be redone last."""

    study: Study
    selected: Path = ()
    done: tuple[Step, ...] = ()
    undone: tuple[Step, ...] = ()

    def edited(self, words: str, *edits: Edit, select: Path | None = None, joins: bool = False) -> History:
        """Return the history after a step of some edits.

        Parameters
        ----------
        words : str
            What the step does.
        *edits : Edit
            Made one after the other.
        select : tuple of str or int or None
            What is selected after it; None leaves the selection.
        joins : bool
            Whether it continues the last step, as letters of one text do.

        Raises
        ------
        Refused
            An edit makes no sense; nothing is changed.
        """
        return self._after(*self.study.edited(*edits), words, select, joins=joins)

    def typed(self, words: str, text: str, *, joins: bool = False) -> History:
        """Return the history after a step that gives the file another text: typed, reverted or read again."""
        return self._after(*self.study.typed(text), words, None, joins=joins)

    def _after(
        self, study: Study, splices: tuple[Splices, ...], words: str, select: Path | None, *, joins: bool
    ) -> History:
        selected = self.selected if select is None else select
        if not splices:
            return replace(self, selected=selected)
        step = Step(words, splices, self.selected, selected)
        done = self.done
        if joins and done and not self.undone:
            last, done = done[-1], done[:-1]
            step = Step(words, (*last.splices, *splices), last.before, selected)
        return History(study, selected, (*done, step)[-MOST_STEPS:])

    def undo(self) -> History:
        """Return the history before its last step; the same where there is none."""
        if not self.done:
            return self
        *done, step = self.done
        study = self.study.spliced(tuple(reverted(splices) for splices in reversed(step.splices)))
        return History(study, step.before, tuple(done), (*self.undone, step))

    def redo(self) -> History:
        """Return the history after the step that was undone last; the same where there is none."""
        if not self.undone:
            return self
        *undone, step = self.undone
        return History(self.study.spliced(step.splices), step.after, (*self.done, step), tuple(undone))
