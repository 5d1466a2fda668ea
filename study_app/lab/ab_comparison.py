"""Two settings side by side, which of them is felt, and the history of edits, as a frozen value.

Nothing here uses a device or a window. Every change makes a new `Workbench`, so undo returns the previous one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from random import Random
from typing import Final, Literal, TypeAlias

from study_app.errors import StudyError
from study_app.haptics.model.effect import Value
from study_app.haptics.model.scene import Scene
from study_app.lab.changes import changed
from study_app.lab.parameters import sections, the_liquid, value_of

Side: TypeAlias = Literal["A", "B"]

MOST_STEPS: Final = 500
_SWITCHES_BY_CHANCE: Final = 0.5


@dataclass(frozen=True, slots=True)
class Setting:
    """A liquid as it was chosen, and as it is now; ``name`` is what people call it."""

    name: str
    origin: Scene
    scene: Scene

    @property
    def is_edited(self) -> bool:
        """Whether it is another liquid by now than the one chosen."""
        return self.scene != self.origin

    @property
    def title(self) -> str:
        """What it is called now."""
        return f"{self.name}, edited" if self.is_edited else self.name

    def value(self, name: str) -> Value:
        """Return what a parameter is now."""
        return value_of(self.scene, name)

    def chosen_value(self, name: str) -> Value:
        """Return what a parameter was as the liquid was chosen; None where it had none."""
        return value_of(self.origin, name)

    def changed_names(self) -> tuple[str, ...]:
        """Return the parameters that are something else than they were."""
        names = (it.name for section in sections(self.scene) for it in section.parameters)
        return tuple(name for name in names if self.value(name) != self.chosen_value(name))


@dataclass(frozen=True, slots=True)
class Workbench:
    """Settings A and B; ``felt`` is the one in the hand.

    While ``blind`` the assignment is hidden: ``first`` is the one called "setting 1", and nothing can be edited.
    ``held`` is the parameter whose slider is being dragged.
    """

    a: Setting
    b: Setting
    felt: Side = "A"
    blind: bool = False
    first: Side = "A"
    past: tuple[tuple[Setting, Setting], ...] = ()
    future: tuple[tuple[Setting, Setting], ...] = ()
    held: tuple[Side, str] | None = None

    def setting(self, side: Side) -> Setting:
        """Return the setting of a side."""
        return self.a if side == "A" else self.b

    @property
    def in_hand(self) -> Setting:
        """The setting that is felt, which edits go to."""
        return self.setting(self.felt)

    @property
    def may_undo(self) -> bool:
        """Whether there is an edit to take back."""
        return bool(self.past) and not self.blind

    @property
    def may_redo(self) -> bool:
        """Whether an edit was taken back that can be made again."""
        return bool(self.future) and not self.blind

    def shown_name(self, side: Side) -> str:
        """Return what a side may be called now."""
        if self.blind:
            return "Setting 1" if side == self.first else "Setting 2"
        return self.setting(side).title

    def changed_names(self, side: Side) -> tuple[str, ...]:
        """Return the parameters of a side that are something else than they were; while blind, none."""
        return () if self.blind else self.setting(side).changed_names()

    def change(self, name: str, value: Value, *, held: bool = False) -> Workbench:
        """Return this with one parameter of the felt setting changed.

        While a slider is ``held`` its values are one step for undo, including the value at its release.

        Raises
        ------
        StudyError
            It cannot be this, and why; or nothing may be edited now.
        """
        self._refuse_blind("edited")
        key = (self.felt, name)
        goes_on = self.held == key
        it = self.in_hand
        edited = replace(it, scene=changed(it.scene, name, value))
        if edited == it:
            return replace(self, held=key if held and goes_on else None)
        return self._edited(self.felt, edited, held=key if held else None, goes_on=goes_on)

    def put(self, scene: Scene, key: str | None = None) -> Workbench:
        """Return this with another scene selected; changes of one ``key`` after another are one step for undo.

        Raises
        ------
        StudyError
            Nothing may be edited now.
        """
        self._refuse_blind("edited")
        held = None if key is None else (self.felt, key)
        if scene == self.in_hand.scene:
            return replace(self, held=held)
        return self._edited(
            self.felt, replace(self.in_hand, scene=scene), held=held, goes_on=held is not None and self.held == held
        )

    def choose(self, side: Side, name: str, scene: Scene) -> Workbench:
        """Return this with another liquid on a side.

        Raises
        ------
        StudyError
            The scene is not one of one liquid; or nothing may be edited now.
        """
        self._refuse_blind("exchanged")
        the_liquid(scene)
        return self._edited(side, Setting(name, scene, scene))

    def copy_felt_to_other(self) -> Workbench:
        """Return this with the felt setting on the other side too."""
        self._refuse_blind("copied")
        return self._edited(other(self.felt), self.in_hand)

    def undo(self) -> Workbench:
        """Return this without the last edit; the same where there is none."""
        if not self.may_undo:
            return self
        (a, b), past = self.past[-1], self.past[:-1]
        return replace(self, a=a, b=b, past=past, future=(*self.future, (self.a, self.b)), held=None)

    def redo(self) -> Workbench:
        """Return this with the edit that was taken back last; the same where there is none."""
        if not self.may_redo:
            return self
        (a, b), future = self.future[-1], self.future[:-1]
        return replace(self, a=a, b=b, past=(*self.past, (self.a, self.b)), future=future, held=None)

    def switch(self) -> Workbench:
        """Return this with the other setting in the hand."""
        return replace(self, felt=other(self.felt), held=None)

    def blinded(self, chance: Random) -> Workbench:
        """Return this with nothing to be known: which is setting 1, and which of them is felt now, is drawn."""
        if self.blind:
            return self
        drawn = [chance.random() < _SWITCHES_BY_CHANCE for _ in range(2)]
        first, felt = (other("A") if it else "A" for it in drawn)
        return replace(self, blind=True, first=first, felt=felt, held=None)

    def revealed(self) -> Workbench:
        """Return this with everything to be known again."""
        return replace(self, blind=False, first="A")

    def _edited(
        self, side: Side, setting: Setting, *, held: tuple[Side, str] | None = None, goes_on: bool = False
    ) -> Workbench:
        """Return this with another setting on a side; the one before can be had again."""
        past = self.past if goes_on else (*self.past, (self.a, self.b))[-MOST_STEPS:]
        a, b = (setting, self.b) if side == "A" else (self.a, setting)
        return replace(self, a=a, b=b, past=past, future=(), held=held)

    def _refuse_blind(self, what: str) -> None:
        if self.blind:
            raise StudyError(f"no setting can be {what} during a blind comparison: end it first")


def other(side: Side) -> Side:
    """Return the other side."""
    return "B" if side == "A" else "A"
