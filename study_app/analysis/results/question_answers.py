"""What was answered to a question that no block of statements holds, and the scores of questionnaires."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class GroupAnswers:
    """The numbers of the answers about one setting, or of all where ``code`` is None."""

    code: str | None
    name: str
    numbers: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class QuestionFound:
    """A question asked after the trials of a block, or in a form: ``where`` is its id, ``title`` what people read.

    ``measure`` and ``figure`` are the ids of what computes and draws its numbers.
    """

    where: str
    title: str
    is_form: bool
    item: str
    text: str
    short: str
    kind: str
    measure: str
    figure: str | None
    groups: tuple[GroupAnswers, ...]

    @property
    def n(self) -> int:
        """How many answers there are."""
        return sum(int(group.numbers["n"]) for group in self.groups)


@dataclass(frozen=True, slots=True)
class ScoreFound:
    """A score of a questionnaire: number, mean, standard deviation and range over its answers, by setting."""

    where: str
    title: str
    name: str
    instrument: str | None
    source: str | None
    groups: tuple[GroupAnswers, ...]
