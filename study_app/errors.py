"""The exceptions a user may meet; every message names the thing, the value, the permitted and what to do.

::

    StudyError                 anything the user can mend: one line, exit code 2, no traceback
    ├── ProtocolError          a protocol or scene file that cannot be used; lists every problem
    ├── DeviceError            what the participant feels with
    │   ├── DeviceNotFound     asked for, but not there or not known
    │   └── DeviceLost         was there, and stopped responding
    ├── ServoFault             the servo stopped itself; the force is zero
    ├── SessionError           an event that the session cannot take in its present state
    ├── OutletError            a stream or port to another program that cannot be used
    ├── StoreError             results that cannot be written or read
    ├── AnalysisError          results that cannot be evaluated
    ├── MissingExtra           what was asked for needs libraries that were not installed
    ├── PlugInError            a plug-in of another package that failed
    ├── WorkerError            a process that computes for this program ended unexpectedly
    └── DisplayError           no screen to open a window on
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import KW_ONLY, dataclass
from pathlib import PurePath
from typing import Any, Final


class StudyError(Exception):
    """A failure that the user can understand and fix.

    It can be pickled, regardless of the parameters of its ``__init__``, so that a worker process can raise it here.
    """

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how to recreate it without ``__init__``, whose parameters are not kept."""
        return _restore_error, (type(self), self.args, self.__dict__)


def _restore_error(kind: type[StudyError], args: tuple[Any, ...], fields: dict[str, Any]) -> StudyError:
    """Return an error from its pickled state."""
    error = kind.__new__(kind, *args)
    error.__dict__.update(fields)
    return error


def as_argument(path: PurePath) -> str:
    """Return a path as an argument of a command that a message suggests: quoted if it has spaces or special signs."""
    return f'"{path}"' if re.search(r"[^\w./\\:~+@=-]", str(path)) else str(path)


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing wrong with a file.

    ``place`` is a dotted path ("blocks.2.order"), ``line`` the line in the file (1-based) or None, ``message`` the
    sentence, ``hint`` what to do (may be empty).
    """

    place: str
    message: str
    line: int | None = None
    _: KW_ONLY
    hint: str = ""

    def __str__(self) -> str:
        where = f"line {self.line}: " if self.line is not None else ""
        hint = f" ({self.hint})" if self.hint else ""
        return f"{where}{self.place}: {self.message}{hint}"


class ProtocolError(StudyError):
    """A protocol, scene or motion file that cannot be used, with every problem found in it."""

    def __init__(self, source: str, problems: tuple[Problem, ...]) -> None:
        self.source = source
        self.problems = problems
        listed = "\n".join(f"  {problem}" for problem in problems)
        count = "1 problem" if len(problems) == 1 else f"{len(problems)} problems"
        super().__init__(f"{source}: {count}\n{listed}")


class DeviceError(StudyError):
    """The device cannot be used."""


class DeviceNotFound(DeviceError):
    """The device does not exist, or none is connected."""


class DeviceLost(DeviceError):
    """The device stopped responding while in use."""


class ServoFault(StudyError):
    """The servo stopped itself and sends zero force."""


class VideoError(StudyError):
    """A camera or footage cannot be shown, or stopped; like a haptic device it can be reconnected in a session."""


class OutletError(StudyError):
    """A stream or port to another program cannot be used; the session continues without it."""


class SessionError(StudyError):
    """The event is not allowed in the session's current state; nothing was changed."""


class StoreError(StudyError):
    """Results cannot be written or read; nothing was half-written."""


class AnalysisError(StudyError):
    """Results cannot be evaluated."""


class MissingExtra(StudyError):
    """The requested function needs libraries that are not installed."""


class PlugInError(StudyError):
    """A plug-in of another package failed."""


ANALYSIS_LIBRARIES: Final = frozenset({"jinja2", "markupsafe", "matplotlib", "pandas", "pyreadstat", "scipy"})
"""What the extra ``analysis`` installs: a computer that only runs sessions does without."""


@contextmanager
def naming_the_extra() -> Iterator[None]:
    """Raise `MissingExtra` if a library of the extra ``analysis`` is imported but not installed."""
    try:
        yield
    except ModuleNotFoundError as error:
        library = (error.name or "").partition(".")[0]
        if library not in ANALYSIS_LIBRARIES:
            raise
        raise MissingExtra(
            f"this needs {library}, which is not installed on this computer: run pip install 'liquid-study[analysis]', "
            "or copy the results folder to a computer on which it is installed"
        ) from error


class WorkerError(StudyError):
    """A process that computes for this program ended unexpectedly."""


class DisplayError(StudyError):
    """No window can be opened here."""
