"""Prevents suspension while a device may exert force: Ctrl-Z would leave the last force on and stop the guard.

SIGSTOP cannot be refused. Loads no compiler.
"""

import signal
import threading
from typing import Final

SUSPENDING: Final = ("SIGTSTP", "SIGTTIN", "SIGTTOU")
"""Signals by which a terminal stops programs: Ctrl-Z, and access to the terminal from the background."""

_pushing: set[int] = set()
_refused: set[int] = set()


def refuse_suspension(by: object) -> None:
    """Ignore the terminal's stop signals until `allow_suspension` is called for all callers of this function.

    Handlers already set stay. Only the main thread can do so; from any other thread nothing changes.
    """
    _pushing.add(id(by))
    _settle()


def allow_suspension(by: object) -> None:
    """End the refusal for ``by``; a second call does nothing."""
    _pushing.discard(id(by))
    _settle()


def _settle() -> None:
    if threading.current_thread() is not threading.main_thread():
        return
    for name in SUSPENDING:
        number = getattr(signal, name, None)  # of POSIX
        if number is None:
            continue
        if _pushing and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, signal.SIG_IGN)
            _refused.add(number)
        elif not _pushing and number in _refused:
            _refused.discard(number)
            if signal.getsignal(number) is signal.SIG_IGN:
                signal.signal(number, signal.SIG_DFL)
