"""Exceptions that nothing catches: they go to the program, and if it does not handle them, to the previous hook."""

import sys

import pytest

from study_app.app.failures import UncaughtExceptions
from study_app.errors import DeviceLost


@pytest.mark.parametrize("is_handled", [True, False])
def test_an_uncaught_exception_is_passed_on_unless_it_is_handled(
    monkeypatch: pytest.MonkeyPatch, is_handled: bool
) -> None:
    received, passed_on = list[BaseException](), list[BaseException]()

    def handle(error: BaseException) -> bool:
        received.append(error)
        return is_handled

    def previous_hook(_kind: type[BaseException], error: BaseException, _trace: object) -> None:
        passed_on.append(error)

    error = DeviceLost("the cable is loose")
    monkeypatch.setattr(sys, "excepthook", previous_hook)
    with UncaughtExceptions(handle):
        sys.excepthook(DeviceLost, error, None)
    assert received == [error]
    assert passed_on == ([] if is_handled else [error])
    assert sys.excepthook is previous_hook
