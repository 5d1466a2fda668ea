"""Texts that people read, in one language or in several.

A text is a string (a study in one language) or a table from language to string. Where lines break in the file does not
matter: a blank line divides paragraphs, every other run of white space becomes one space.
"""

from __future__ import annotations

import re
from typing import Annotated, Any, TypeAlias

from pydantic import BeforeValidator, Field, StringConstraints
from pydantic_core import PydanticCustomError

Id: TypeAlias = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]*$")]
Language: TypeAlias = Annotated[str, StringConstraints(pattern=r"^[a-z]{2}$")]


def tidy(text: str) -> str:
    """Return ``text`` with single spaces, and one blank line between paragraphs."""
    return "\n\n".join(" ".join(part.split()) for part in re.split(r"\n[ \t]*\n", text) if part.strip())


def _tidy_each(value: Any) -> Any:
    if isinstance(value, str):
        value = tidy(value)
        empty = not value
    elif isinstance(value, dict) and value and all(isinstance(text, str) for text in value.values()):
        value = {language: tidy(text) for language, text in value.items()}
        empty = not all(value.values())
    else:
        raise PydanticCustomError("text_type", 'a text is a string, or one string per language: {{en = "…", nl = "…"}}')
    if empty:
        raise PydanticCustomError("text_empty", "the text is empty")
    return value


Localised: TypeAlias = Annotated[
    str | dict[str, str],
    BeforeValidator(_tidy_each),
    Field(description="A text: one string, or one string per language of the study."),
]


def text_in(value: str | dict[str, str], language: str) -> str:
    """Return a localised text in one of the study's languages (KeyError in any other)."""
    return value if isinstance(value, str) else value[language]
