"""The base class of all tables of a study file, and its localised texts.

A text is a string (in a study with one language) or a table from language to string. Line breaks in the file do not
matter: a blank line separates paragraphs, and any other white space becomes one space.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from enum import StrEnum
from functools import lru_cache
from typing import Annotated, Any, ClassVar, Final, Generic, Self, TypeAlias, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    StringConstraints,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema, to_jsonable_python

from study_app.discovery import Registry
from study_app.ids import MAX_ID

Id: TypeAlias = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]*$", max_length=MAX_ID)]
Language: TypeAlias = Annotated[str, StringConstraints(pattern=r"^[a-z]{2}$")]

_MAX_TEXT: Final = 500
_MAX_BODY: Final = 20_000
UNPRINTABLE: Final = ("Cc", "Cs", "Co", "Cn")  # control, surrogate, private use, unassigned
VISIBLE: Final = "LNPS"  # letters, numbers, punctuation, symbols
DIRECTIONS: Final = "\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"
"""Characters that change the direction of the following text, so that it may look like another text."""


_JOINER: Final = "\u200d"
_MAX_CLUSTER: Final = 32  # code points, more than any letter of any script has
_ATTACHED: Final = ("Mn", "Mc", "Me")
_REGIONS: Final = range(0x1F1E6, 0x1F200)  # regional indicators; two of them form a flag
_TONES: Final = range(0x1F3FB, 0x1F400)  # skin tones
_TAGS: Final = range(0xE0020, 0xE0080)  # tags, which follow a flag


def characters(text: str) -> list[str]:
    """Return a text's user-perceived characters: letters with accents, whole emoji.

    These are Unicode's extended grapheme clusters, except for decomposed Korean letters.

    Examples
    --------
    >>> [len(characters(text)) for text in ("ét", "👨‍👩‍👧", "🇫🇷🇩🇪")]
    [2, 1, 2]
    """
    clusters: list[str] = []
    for letter in text:
        code = ord(letter)
        previous = clusters[-1] if clusters else ""
        is_attached = unicodedata.category(letter) in _ATTACHED or letter == _JOINER or code in _TONES or code in _TAGS
        is_joined = previous.endswith(_JOINER) or (
            code in _REGIONS and len(previous) == 1 and ord(previous) in _REGIONS
        )
        if previous not in {"", "\n"} and (is_attached or is_joined) and len(previous) < _MAX_CLUSTER:
            clusters[-1] += letter
        else:
            clusters.append(letter)
    return clusters


_PARAGRAPH_BREAK: Final = re.compile(r"\n[ \t]*\n")


def _normalise_spaces(text: str) -> str:
    """Return a text with single spaces, and one blank line between paragraphs."""
    parts = _PARAGRAPH_BREAK.split(text) if "\n" in text else (text,)
    return "\n\n".join(" ".join(part.split()) for part in parts if part.strip())


def _check_each_text(value: Any) -> Any:
    if isinstance(value, str):
        return _checked_text(value)
    if isinstance(value, dict) and value and all(isinstance(text, str) for text in value.values()):
        return {language: _checked_text(text) for language, text in value.items()}
    raise invalid('a text must be a string, or one string per language: {en = "…", nl = "…"}')


@lru_cache(maxsize=16_384)  # saves 17 ms of the validation after each edit in the designer
def _checked_text(text: str) -> str:
    return _normalise_spaces(_check_printable(text))


def unprintable_character(text: str, permitted: str = "") -> str | None:
    """Return the first character that cannot be printed or changes the text direction, except ``permitted`` ones."""
    hidden = (
        character for character in text if unicodedata.category(character) in UNPRINTABLE or character in DIRECTIONS
    )
    return next((character for character in hidden if character not in permitted), None)


def _check_printable(text: str) -> str:
    """Return ``text``; raise an error if it has no visible character, or one that cannot be printed."""
    if (letter := unprintable_character(text, "\t\n\r")) is not None:
        raise invalid(f"contains the character U+{ord(letter):04X}, which cannot be printed: remove it")
    if not any(unicodedata.category(letter)[0] in VISIBLE for letter in text):
        raise invalid("the text is empty: write some text")
    return text


def _limit_length(max_length: int) -> AfterValidator:
    def check_length(value: str | dict[str, str]) -> str | dict[str, str]:
        longest = max(map(len, value.values() if isinstance(value, dict) else (value,)))
        if longest > max_length:
            raise invalid(f"has {longest} characters, but at most {max_length} are permitted: shorten it")
        return value

    return AfterValidator(check_length)


Description: TypeAlias = Annotated[
    str, AfterValidator(lambda text: _check_printable(text) if text else text), StringConstraints(max_length=_MAX_BODY)
]
Brief: TypeAlias = Annotated[
    str, AfterValidator(lambda text: _check_printable(text) if text else text), StringConstraints(max_length=_MAX_TEXT)
]
"""A text of one or two lines, which may be empty."""
Printable: TypeAlias = Annotated[str, AfterValidator(_check_printable), StringConstraints(max_length=_MAX_TEXT)]
_Text: TypeAlias = Annotated[
    str | dict[str, str],
    BeforeValidator(_check_each_text),
    Field(description="A text: one string, or one string per language of the study."),
]
Localised: TypeAlias = Annotated[_Text, _limit_length(_MAX_TEXT)]
"""A short text, such as a title, a statement or a label."""
Body: TypeAlias = Annotated[_Text, _limit_length(_MAX_BODY), Field(json_schema_extra={"lines": "several"})]
"""A text of one or more pages; its JSON Schema states this for the study designer."""


def text_in(value: str | Mapping[str, str], language: str) -> str:
    """Return a localised text in one of the study's languages; raise KeyError for any other."""
    return value if isinstance(value, str) else value[language]


class FormKey(StrEnum):
    """The keys of a table's JSON Schema for forms, each with the value of a class attribute of `Table`."""

    ONE_OF = "alternatives"
    SECTIONS = "sections"
    NOT_WITH = "not with"


def invalid(
    message: str, key: str = "", hint: str = "", use: tuple[str, Any] | None = None, kind: str = ""
) -> PydanticCustomError:
    """Return the error for an invalid table: a sentence, the key concerned, and a hint.

    ``use`` is a key of the table and a value that repairs it; ``kind`` is the kind of the `Fault`.
    """
    stated = {"message": message, "place": key, "hint": hint, "use": use, "kind": kind}
    return PydanticCustomError("invalid", "{message}", {name: detail for name, detail in stated.items() if detail})


class Table(BaseModel):
    """A table of the file: unknown keys are errors, numbers are finite, values never change."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)

    ONE_OF: ClassVar[tuple[tuple[str, str], ...]] = ()
    """Pairs of keys of which exactly one is given."""
    SECTIONS: ClassVar[tuple[tuple[str, tuple[str, ...]], ...]] = ()
    """Headings of the form, each with its keys; other keys come last."""
    NOT_WITH: ClassVar[tuple[tuple[tuple[str, ...], tuple[str, ...]], ...]] = ()
    """Pairs of given keys, and keys that are not permitted with them; the first pair whose keys are given applies."""

    @model_validator(mode="after")
    def _check_alternative_keys(self) -> Self:
        for first, other in self.ONE_OF:
            values: list[Any] = [getattr(self, name) for name in (first, other)]
            if sum(value is not None and value != () for value in values) != 1:
                message = f"specify either {first} or {other}"
                raise invalid(message, first)
        return self

    @classmethod
    def __get_pydantic_json_schema__(cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Return the schema with the pairs of alternative keys, and the sections of its form."""
        node = handler(core_schema)
        stated = {key.value: to_jsonable_python(getattr(cls, key.name)) for key in FormKey}
        handler.resolve_ref_schema(node).update({key: value for key, value in stated.items() if value})
        return node


_K = TypeVar("_K", bound=Table)
RECORDED: Final = {"recorded": True}
"""The validation context of a recorded protocol, in which tables of missing plug-ins are kept unchanged."""


class OfKinds(Generic[_K]):
    """The annotation of the union of a table's kinds; a kind with a colon belongs to a plug-in.

    ``base`` is the common class, ``stand_in`` the class of recorded tables of plug-ins that are not installed.
    """

    def __init__(self, registry: Registry[type[_K]], base: type[_K], stand_in: type[_K]) -> None:
        self.registry, self.base, self.stand_in = registry, base, stand_in

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Return the schema of the union, preceded by its validation function."""
        serialization = core_schema.simple_ser_schema("any")  # each kind writes its own keys
        return core_schema.with_info_wrap_validator_function(
            self._validate, handler(source), serialization=serialization
        )

    def _validate(self, value: Any, validate_union: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        if isinstance(value, self.base):
            return value
        kind = value.get("kind") if isinstance(value, Mapping) else None
        if not isinstance(kind, str) or ":" not in kind:
            return validate_union(value)
        kind_model, recorded = self.registry.get(kind), info.context == RECORDED
        if kind_model is None and not recorded:
            message, hint = self.registry.missing(kind)
            raise invalid(message, "kind", hint)
        return (kind_model or self.stand_in).model_validate(value, strict=not recorded, context=info.context)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Return the schema of the union, with the kinds of plug-ins."""
        node = handler(schema)
        for kind, kind_model in self.registry.others.items():
            part = handler(core_schema.definitions_schema(kind_model.__pydantic_core_schema__, []))
            handler.resolve_ref_schema(part)["title"] = kind  # classes of different packages may have the same name
            node["oneOf"].append(part)
            if "discriminator" in node:
                node["discriminator"]["mapping"][kind] = part["$ref"]
        return node
