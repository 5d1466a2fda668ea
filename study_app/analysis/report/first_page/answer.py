"""An answer of the first page: a sentence, then directions, sizes and intervals.

The p that decide stand in the sections that follow.
"""

from dataclasses import dataclass
from typing import Final

NO_EVIDENCE: Final = "That is not evidence that there is nothing."
FOUND: Final = ("shown", "suggested")


@dataclass(frozen=True, slots=True)
class Answer:
    """An answer to one question (the key of a finding) about one block (its id).

    ``claims`` says whether it claims that settings differ or that a delay is noticed, which would be false in a study
    where nothing differs; ``exploratory`` whether that was not decided on before the study. ``at_ms`` is the shortest
    delay that it says is noticed.
    """

    question: str
    block: str
    title: str
    text: str
    sizes: tuple[str, ...]
    claims: bool = False
    exploratory: bool = False
    at_ms: float | None = None
