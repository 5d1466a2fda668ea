"""The kinds of questions, found by importing the modules of one folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeAlias

from pydantic import Discriminator, SerializeAsAny, Tag, WrapValidator

from study_app.discovery import modules_of
from study_app.protocol import questions
from study_app.protocol.questions.question import Question, kind_id

STATEMENT: Final = "statement"

KINDS: Final[dict[str, type[Question]]] = {
    kind_id(module.KIND): module.KIND for module in modules_of(questions) if hasattr(module, "KIND")
}
"""Every kind by its id; a question of a protocol file is of one of these."""


def _kind_of(value: Any) -> str:
    return str(value.get("kind", STATEMENT)) if isinstance(value, Mapping) else STATEMENT


def _as_it_is(value: Any, validated: Callable[[Any], Question]) -> Question:
    """Return a question that was made in Python as it is, of any kind."""
    return value if isinstance(value, Question) else validated(value)


if TYPE_CHECKING:
    AnyQuestion: TypeAlias = Question
else:
    AnyQuestion = Annotated[
        SerializeAsAny[
            Annotated[
                reduce(or_, [Annotated[kind, Tag(name)] for name, kind in KINDS.items()]),
                Discriminator(
                    _kind_of,
                    custom_error_type="question_kind",
                    custom_error_message="is not a kind of question",
                    custom_error_context={"place": "kind", "permitted": ", ".join(KINDS)},
                ),
            ]
        ],
        WrapValidator(_as_it_is),
    ]


def question_of(table: Mapping[str, Any]) -> Question:
    """Return a question of a receipt.

    Raises
    ------
    KeyError
        No kind has its name.
    ValueError
        It is not a question of its kind.
    """
    return KINDS[_kind_of(table)].model_validate(table)
