"""When a question is shown: by the answer to an earlier one."""

from collections.abc import Iterable, Mapping
from typing import Protocol, Self, TypeAlias

from pydantic import ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from study_app.protocol.table import Table
from study_app.protocol.texts import Id

Value: TypeAlias = int | float | str | tuple[str, ...] | None
"""An answer: a number, a text, an option or several; None where the participant could not judge."""


class ShowIf(Table):
    """An answer to an earlier item: one of several values, or a number within bounds."""

    model_config = ConfigDict(serialize_by_alias=True, validate_by_name=True)

    item: Id = Field(description="The earlier item.")
    values: int | float | str | tuple[int | float | str, ...] | None = Field(
        default=None, alias="is", description="The answer, or a list of answers."
    )
    at_least: float | None = Field(default=None, description="Smallest number.")
    at_most: float | None = Field(default=None, description="Largest number.")

    @property
    def permitted(self) -> tuple[int | float | str, ...]:
        """The answers that show the question; empty where bounds do."""
        if self.values is None:
            return ()
        return self.values if isinstance(self.values, tuple) else (self.values,)

    def holds(self, answer: Value) -> bool:
        """Return whether an answer shows the question."""
        if self.values is not None:
            given = answer if isinstance(answer, tuple) else (answer,)
            return any(one in self.permitted for one in given)
        if not isinstance(answer, int | float):
            return False
        return (self.at_least is None or answer >= self.at_least) and (self.at_most is None or answer <= self.at_most)

    @model_validator(mode="after")
    def _values_or_bounds(self) -> Self:
        bounded = self.at_least is not None or self.at_most is not None
        if (self.values is not None) == bounded:
            raise PydanticCustomError("show_if", "needs either is, or at_least or at_most or both", {"place": "is"})
        return self


class Conditional(Protocol):
    """A question, or its view."""

    @property
    def id(self) -> str:
        """Its name."""

    @property
    def show_if(self) -> ShowIf | None:
        """When it is shown."""


def shown(items: Iterable[Conditional], answers: Mapping[str, Value]) -> tuple[str, ...]:
    """Return the ids of the items that are shown, in their order.

    Parameters
    ----------
    items : iterable of Conditional
        The items of a form, in order.
    answers : mapping of str to Value
        The answers given so far; those to items that are not shown count for nothing.
    """
    found: list[str] = []
    for item in items:
        asked = item.show_if
        if asked is None or (asked.item in found and asked.item in answers and asked.holds(answers[asked.item])):
            found.append(item.id)
    return tuple(found)
