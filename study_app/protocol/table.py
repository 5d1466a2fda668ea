"""The base of everything that is a table of a protocol file."""

from typing import Any, ClassVar, Final, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    GetJsonSchemaHandler,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError

ALTERNATIVES: Final = "alternatives"
"""Where the JSON Schema of a table keeps `Table.ONE_OF`, for forms."""

SECTIONS: Final = "sections"
"""Where it keeps `Table.SECTIONS`, for forms."""
NOT_WITH: Final = "not with"
"""Where it keeps `Table.NOT_WITH`, for forms."""


class Table(BaseModel):
    """A table of the file: unknown keys are errors, numbers are finite, values never change."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    ONE_OF: ClassVar[tuple[tuple[str, str], ...]] = ()
    """Pairs of keys of which exactly one is given."""
    SECTIONS: ClassVar[tuple[tuple[str, tuple[str, ...]], ...]] = ()
    """Headings of a form, each with its keys; keys in none come last."""
    NOT_WITH: ClassVar[tuple[tuple[tuple[str, ...], tuple[str, ...]], ...]] = ()
    """Keys that are given, and the keys that do not belong to the table then; the first pair that applies counts."""

    @model_validator(mode="after")
    def _gives_one_of_two(self) -> Self:
        for one, other in self.ONE_OF:
            given: list[Any] = [getattr(self, name) for name in (one, other)]
            if sum(value is not None and value != () for value in given) != 1:
                message = f"give either {one} or {other}, one of the two"
                raise PydanticCustomError("one_of", message, {"place": one})
        return self

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Return the schema with the pairs of which one is given, and the sections of its form."""
        node = handler(core_schema)
        if cls.ONE_OF:
            handler.resolve_ref_schema(node)[ALTERNATIVES] = [list(pair) for pair in cls.ONE_OF]
        if cls.SECTIONS:
            handler.resolve_ref_schema(node)[SECTIONS] = [[words, list(keys)] for words, keys in cls.SECTIONS]
        if cls.NOT_WITH:
            handler.resolve_ref_schema(node)[NOT_WITH] = [[list(given), list(keys)] for given, keys in cls.NOT_WITH]
        return node


class ExtendedTable(Table):
    """A table with keys that format 1 does not have.

    They are not written at their defaults: receipts and sealed keys of format 1 keep their bytes.
    """

    LATER: ClassVar[frozenset[str]] = frozenset()
    """The keys that format 1 does not have."""

    @model_serializer(mode="wrap")
    def _omit_unused_keys(self, serialized: SerializerFunctionWrapHandler) -> dict[str, Any]:
        fields = type(self).model_fields
        unused = {
            name for name in self.LATER if getattr(self, name) == fields[name].get_default(call_default_factory=True)
        }
        return {name: value for name, value in serialized(self).items() if name not in unused}
