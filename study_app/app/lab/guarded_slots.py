"""Slots that let no exception out."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Concatenate, ParamSpec, Protocol, TypeVar


class Failing(Protocol):
    """Whoever can end in zero force."""

    def fail(self, error: BaseException) -> None: ...  # noqa: D102


F = TypeVar("F", bound=Failing)
P = ParamSpec("P")


def guarded(slot: Callable[Concatenate[F, P], None]) -> Callable[Concatenate[F, P], None]:
    """Let no exception leave a slot: whatever it is ends in zero force."""

    @wraps(slot)
    def run(self: F, /, *arguments: P.args, **named: P.kwargs) -> None:
        try:
            slot(self, *arguments, **named)
        except Exception as error:  # noqa: BLE001 - whatever it is, the hand comes first
            self.fail(error)

    return run
