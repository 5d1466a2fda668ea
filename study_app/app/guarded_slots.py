"""Decorators for slots: no exception leaves a slot."""

import logging
from collections.abc import Callable
from functools import wraps
from typing import Concatenate, ParamSpec, Protocol, TypeVar

from study_app.errors import SessionError

log = logging.getLogger(__name__)


class Failing(Protocol):
    """An object that handles a failure and ends in zero force."""

    def fail(self, error: BaseException) -> None: ...


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


def guarded_session_slot(slot: Callable[Concatenate[F, P], None]) -> Callable[Concatenate[F, P], None]:
    """As `guarded`, but drop an event that came too late (`SessionError`): it is no failure."""

    @wraps(slot)
    def run(self: F, /, *arguments: P.args, **named: P.kwargs) -> None:
        try:
            slot(self, *arguments, **named)
        except SessionError as error:
            log.info("dropped: %s", error)

    return guarded(run)
