"""Two settings for comparison, with the history of their edits; one of them is presented.

Nothing here uses a device or a window. Every change returns a new `Workbench`, so undo returns the previous one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from random import Random
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.errors import StudyError
from study_app.haptics.model.effects import Value
from study_app.haptics.model.scene import Scene
from study_app.lab.parameters import sections, the_liquid, value_of, with_parameter

Floats: TypeAlias = NDArray[np.float64]

Side: TypeAlias = Literal["A", "B"]

_MAX_UNDO_STEPS: Final = 500
_PROBABILITY_OF_B: Final = 0.5


@dataclass(frozen=True, slots=True)
class Setting:
    """A liquid as it was chosen (``origin``) and as it has been edited (``scene``); ``name`` is its displayed name."""

    name: str
    origin: Scene
    scene: Scene

    @property
    def is_edited(self) -> bool:
        return self.scene != self.origin

    @property
    def title(self) -> str:
        """The displayed name, with a note if the liquid has been edited."""
        return f"{self.name}, edited" if self.is_edited else self.name

    def value(self, name: str) -> Value:
        return value_of(self.scene, name)

    def chosen_value(self, name: str) -> Value:
        """Return the value that a parameter had when the liquid was chosen; None if it had none."""
        return value_of(self.origin, name)

    def changed_names(self) -> tuple[str, ...]:
        names = (parameter.name for section in sections(self.scene) for parameter in section.parameters)
        return tuple(name for name in names if self.value(name) != self.chosen_value(name))


@dataclass(frozen=True, slots=True)
class Workbench:
    """Settings A and B; ``presented`` is the side that the hand feels.

    In a ``blind`` comparison the assignment is hidden: ``first`` is the side called "Setting 1", and nothing can be
    edited. ``past`` and ``future`` are the pairs of settings for undo and redo. ``held`` is the parameter whose slider
    is being dragged.
    """

    a: Setting
    b: Setting
    presented: Side = "A"
    blind: bool = False
    first: Side = "A"
    past: tuple[tuple[Setting, Setting], ...] = ()
    future: tuple[tuple[Setting, Setting], ...] = ()
    held: tuple[Side, str] | None = None

    def setting(self, side: Side) -> Setting:
        return self.a if side == "A" else self.b

    @property
    def in_hand(self) -> Setting:
        """The presented setting, which edits change."""
        return self.setting(self.presented)

    @property
    def may_undo(self) -> bool:
        return bool(self.past) and not self.blind

    @property
    def may_redo(self) -> bool:
        return bool(self.future) and not self.blind

    def shown_name(self, side: Side) -> str:
        """Return the label of a side; in a blind comparison it hides the assignment."""
        if self.blind:
            return "Setting 1" if side == self.first else "Setting 2"
        return self.setting(side).title

    def changed_names(self, side: Side) -> tuple[str, ...]:
        """Return the names of a side's changed parameters; none in a blind comparison."""
        return () if self.blind else self.setting(side).changed_names()

    def change(self, name: str, value: Value, *, held: bool = False) -> Workbench:
        """Return a copy with one parameter of the presented setting changed.

        All values of a slider while it is ``held``, and the value at its release, are one undo step.

        Raises
        ------
        StudyError
            The value is not permitted, or nothing may be edited now; the message gives the reason.
        """
        self._refuse_blind("edited")
        key = (self.presented, name)
        same_step = self.held == key
        setting = self.in_hand
        edited = replace(setting, scene=with_parameter(setting.scene, name, value))
        if edited == setting:
            return replace(self, held=key if held and same_step else None)
        return self._with_setting(self.presented, edited, held=key if held else None, same_step=same_step)

    def choose(self, side: Side, name: str, scene: Scene) -> Workbench:
        """Return a copy with another liquid on a side.

        Raises
        ------
        StudyError
            The scene does not have exactly one liquid; or nothing may be edited now.
        """
        self._refuse_blind("exchanged")
        the_liquid(scene)
        return self._with_setting(side, Setting(name, scene, scene))

    def copy_to_other(self) -> Workbench:
        self._refuse_blind("copied")
        return self._with_setting(other_side(self.presented), self.in_hand)

    def undo(self) -> Workbench:
        """Return a copy with the last edit undone; the same if there is none."""
        if not self.may_undo:
            return self
        (a, b), past = self.past[-1], self.past[:-1]
        return replace(self, a=a, b=b, past=past, future=(*self.future, (self.a, self.b)), held=None)

    def redo(self) -> Workbench:
        """Return a copy with the last undone edit redone; the same if there is none."""
        if not self.may_redo:
            return self
        (a, b), future = self.future[-1], self.future[:-1]
        return replace(self, a=a, b=b, past=(*self.past, (self.a, self.b)), future=future, held=None)

    def switch(self) -> Workbench:
        return replace(self, presented=other_side(self.presented), held=None)

    def blinded(self, chance: Random) -> Workbench:
        """Return a copy for a blind comparison; setting 1 and the presented setting are drawn at random."""
        if self.blind:
            return self
        sides: tuple[Side, Side] = ("A", "B")
        first, presented = (sides[chance.random() < _PROBABILITY_OF_B] for _ in range(2))
        return replace(self, blind=True, first=first, presented=presented, held=None)

    def revealed(self) -> Workbench:
        return replace(self, blind=False, first="A")

    def _with_setting(
        self, side: Side, setting: Setting, *, held: tuple[Side, str] | None = None, same_step: bool = False
    ) -> Workbench:
        """Return a copy with another setting on a side, as a new undo step or as the ``same_step`` as the last one."""
        past = self.past if same_step else (*self.past, (self.a, self.b))[-_MAX_UNDO_STEPS:]
        a, b = (setting, self.b) if side == "A" else (self.a, setting)
        return replace(self, a=a, b=b, past=past, future=(), held=held)

    def _refuse_blind(self, what: str) -> None:
        if self.blind:
            raise StudyError(f"settings cannot be {what} during a blind comparison: end the comparison first")


def other_side(side: Side) -> Side:
    """Return B for A and A for B."""
    return "B" if side == "A" else "A"
