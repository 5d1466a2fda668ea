"""Blocks: trials that share a task and a questionnaire, and the order in which their conditions come."""

from __future__ import annotations

from typing import Literal, Self, TypeAlias

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from study_app.protocol.order_constraint import Constraint
from study_app.protocol.table import Table
from study_app.protocol.texts import Id, Localised

Phase: TypeAlias = Literal["main", "practice", "baseline"]
Order: TypeAlias = Literal["fixed", "shuffled", "constrained", "williams", "latin"]
Compared: TypeAlias = Literal["liquids", "delays"]


class Block(Table):
    """Trials that share a task and a questionnaire.

    A condition of a main block is shown under a code, L1 … Ln with ``code_prefix`` L; which condition a code stands for
    is drawn by ``schedule.draw_key``. Practice and baseline are announced for what they are, and have one condition.
    """

    id: Id = Field(description="The name of the block's table.")
    phase: Phase = Field(default="main", description="Only main trials are analysed.")
    part: int | None = Field(default=None, ge=1, le=20, description="Part of the study that the block belongs to.")
    title: Localised = Field(description="Name of the block.")
    setting_label: Localised = Field(description="Neutral name of its trials; a number follows: Liquid setting 1.")
    code_prefix: str | None = Field(default=None, pattern=r"^[A-Z]$", description="Letter of the block's codes.")
    conditions: tuple[Id, ...] = Field(min_length=1, description="What is presented.")
    compares: Compared | None = Field(
        default=None,
        description="What the conditions of a main block differ in; left out: delays if all have one liquid and their "
        "delays differ, otherwise liquids.",
    )
    replicates: bool = Field(
        default=False,
        description="Whether conditions of equal delay are meant, in a block that compares delays: they are analysed "
        "as replicates of one.",
    )
    order: Order = Field(
        default="fixed",
        description="fixed: as written; shuffled: anew in each repetition; constrained: all trials together, within "
        "max_repeats and min_distance; williams, latin: rows of a square, dealt by the number in the participant's id.",
    )
    max_repeats: int | None = Field(
        default=None, ge=1, le=100, description="How often a condition may come in a row; order constrained only."
    )
    min_distance: int | None = Field(
        default=None,
        ge=1,
        le=1000,
        description="Trials from one presentation of a condition to its next: 2 is never twice in a row, 3 leaves two "
        "others between; order constrained only.",
    )
    repetitions: int = Field(default=1, ge=1, le=100, description="How often each condition comes.")
    break_every: int | None = Field(
        default=None, ge=1, le=10_000, description="Trials between two breaks; left out: no breaks."
    )
    break_page: Id | None = Field(default=None, description="The page shown in a break, of kind break.")
    task: Id = Field(description="What the participant does.")
    questionnaire: Id | None = Field(default=None, description="What is answered after each trial; left out: nothing.")

    @property
    def trials(self) -> int:
        """How many trials a participant does."""
        return len(self.conditions) * self.repetitions

    @property
    def breaks(self) -> int:
        """How many breaks come between its trials."""
        return 0 if self.break_every is None else (self.trials - 1) // self.break_every

    @model_validator(mode="after")
    def _codes_where_blinded(self) -> Self:
        if self.phase == "main":
            if self.code_prefix is None:
                raise PydanticCustomError(
                    "codes", "a main block needs a code_prefix, a capital letter", {"place": "code_prefix"}
                )
            if self.part is None:
                raise PydanticCustomError("part", "a main block needs a part: 1, 2, …", {"place": "part"})
        elif self.compares is not None:
            raise PydanticCustomError(
                "compares",
                "a {phase} block compares nothing: leave it out",
                {"phase": self.phase, "place": "compares"},
            )
        elif self.code_prefix is not None:
            raise PydanticCustomError(
                "codes",
                "a {phase} block is not blinded and has no code_prefix",
                {"phase": self.phase, "place": "code_prefix"},
            )
        elif len(self.conditions) > 1:
            raise PydanticCustomError(
                "codes",
                "a {phase} block has one condition, this one {count}: use one block for each",
                {"phase": self.phase, "count": len(self.conditions), "place": "conditions"},
            )
        return self

    @model_validator(mode="after")
    def _constraint_is_possible(self) -> Self:
        given = [name for name in ("max_repeats", "min_distance") if getattr(self, name) is not None]
        if self.order != "constrained":
            if given:
                raise PydanticCustomError(
                    "constraint", 'belongs to order = "constrained", this is "{order}"', _at(given[0], order=self.order)
                )
            return self
        if not given:
            raise PydanticCustomError(
                "constraint", '"constrained" needs max_repeats, min_distance or both', _at("order")
            )
        if self.repetitions == 1:
            raise PydanticCustomError(
                "constraint",
                'is 1: every condition comes once and none can come again, which order = "shuffled" says',
                _at("repetitions"),
            )
        constraint = Constraint(self.max_repeats, self.min_distance)
        if (impossible := constraint.impossible(len(self.conditions), self.repetitions)) is not None:
            key, sentence = impossible
            raise PydanticCustomError("constraint", "{sentence}", _at(key, sentence=sentence))
        return self

    @model_validator(mode="after")
    def _breaks_have_a_page(self) -> Self:
        keys = {"break_every": self.break_every, "break_page": self.break_page}
        missing = [name for name, value in keys.items() if value is None]
        if len(missing) == 1:
            raise PydanticCustomError("breaks", "is missing: break_every and break_page need each other", _at(*missing))
        if self.break_every is not None and not self.breaks:
            raise PydanticCustomError(
                "breaks",
                "is {every}, and the block has {trials}: no break would come",
                _at("break_every", every=self.break_every, trials=_trials(self.trials)),
            )
        return self


def _at(place: str, **values: str | int) -> dict[str, str | int]:
    return {"place": place, **values}


def _trials(count: int) -> str:
    return "1 trial" if count == 1 else f"{count} trials"
