"""No suspending while something may push: a program that Ctrl-Z stops leaves its last force on, and its guard asleep.

SIGSTOP cannot be refused. Loads no compiler.
"""

import signal
import threading
from typing import Final

SUSPENDING: Final = ("SIGTSTP", "SIGTTIN", "SIGTTOU")
"""What a terminal stops programs with: by Ctrl-Z, and those behind another that read from it, or write to it."""

_pushing: set[int] = set()
_refused: set[int] = set()


def refuse_suspension(by: object) -> None:
    """Ignore what a terminal suspends programs with until `allow_suspension`, whoever else refuses it meanwhile.

    Handlers that somebody has set stay. Only the main thread can do so; from any other nothing changes.
    """
    _pushing.add(id(by))
    _settle()


def allow_suspension(by: object) -> None:
    """Take back what was refused for ``by``; a second call does nothing."""
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
