"""Parts of an evaluation that fail: each is said in its place, and everything else goes on."""

import traceback
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias, TypeVar

T = TypeVar("T")
Progress: TypeAlias = Callable[[str, float], object]
"""Receives what is being done, and which share of all is done (0 to 1); what it raises ends the evaluation."""


def silent(_what: str, _share: float) -> None:
    """Report nothing."""


@dataclass(frozen=True, slots=True)
class Failure:
    """A part (``what``, of a block or of none) that could not be computed: the error, and where it was raised."""

    what: str
    error: str
    where: str
    block: str | None = None

    @property
    def why(self) -> str:
        """What a report says in the place of the part."""
        return f"its computation failed ({self.error}; {self.where}); this is a fault of the program, please report it"

    def __str__(self) -> str:
        return f"{self.what}{f' of block {self.block}' if self.block else ''}: {self.why}"


class Ended(BaseException):
    """The evaluation is to end: what a progress function raised is no failure of the part that called it."""

    def __init__(self, error: BaseException) -> None:
        super().__init__(str(error))
        self.error = error


class Failures:
    """Collects the failures of one report."""

    def __init__(self, found: Iterable[Failure] = ()) -> None:
        self.found = list(found)

    def attempt(self, what: str, compute: Callable[[], T], *, block: str | None = None) -> T | Failure:
        """Return what ``compute`` returns, or the failure, which is kept."""
        try:
            return compute()
        except Exception as error:  # noqa: BLE001 - one part must not take the report with it
            last = traceback.extract_tb(error.__traceback__)[-1]
            failure = Failure(
                what, f"{type(error).__name__}: {error}", f"{Path(last.filename).name}, line {last.lineno}", block
            )
            self.found.append(failure)
            return failure
