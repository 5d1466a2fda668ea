"""The program's log: a file in the user's folder that shows where something failed, without data of a study.

The arguments of a message may be anything: an id, an answer, a liquid's value. So a record is written as its format
string without arguments, except the message of a device's failure. An exception is written as its type and source
locations, without its message.
"""

import logging
import re
import traceback
from contextlib import suppress
from logging.handlers import RotatingFileHandler
from pathlib import Path
from typing import Any, Final

from study_app.errors import DeviceError, ServoFault
from study_app.user_folder import user_folder

_MOST_BYTES: Final = 250_000
_KEPT: Final = 2  # files besides the newest
_OMITTED: Final = "…"
DEVICE_FAILED: Final = "the device failed: %s"  # support needs it as an error; the session reports it and continues
_ERROR: Final = re.compile(rf"\S+ \S+ (ERROR|CRITICAL|\S+ \S+ {DEVICE_FAILED.partition('%')[0]})")


class _PlainFormatter(logging.Formatter):
    """Format log records without their arguments."""

    def __init__(self) -> None:
        super().__init__("%(asctime)s %(levelname)s %(name)s: %(message)s")

    def format(self, record: logging.LogRecord) -> str:
        """Return the record as lines; those after the first are indented."""
        record = logging.makeLogRecord(record.__dict__)
        given = record.args if isinstance(record.args, tuple) else ()
        record.args = tuple(map(_plain_argument, given))
        record.msg = str(record.msg).replace("%r", "%s").replace("%d", "%s") if given else _message_format(record.msg)
        record.exc_text = record.stack_info = None
        return super().format(record)

    def formatException(self, ei: Any) -> str:  # noqa: N802 - logging's name
        """Return the type of an exception and its source locations, outermost first."""
        kind, _, trace = ei
        places = [
            f"    {source_place(frame.filename)}:{frame.lineno} in {frame.name}"
            for frame in traceback.extract_tb(trace)
        ]
        return "\n".join((*places, f"    {getattr(kind, '__name__', kind)}"))


class _Quiet(RotatingFileHandler):
    """A log file whose write errors do not disturb a session, and that several programs may write."""

    def rotate(self, source: str, dest: str) -> None:
        """Rename the file; keep writing to it while another program has it open, since Windows then refuses."""
        with suppress(PermissionError):
            super().rotate(source, dest)

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802 - logging's name
        """Do nothing."""


def log_file() -> Path:
    """Return the path of the log, which may not exist."""
    return user_folder() / "log.txt"


def start_log() -> None:
    """Start writing the program's log to `log_file`; warnings still go to the terminal."""
    logger = logging.getLogger("study_app")
    if any(isinstance(handler, _Quiet) for handler in logger.handlers):
        return
    with suppress(OSError):
        log_file().parent.mkdir(parents=True, exist_ok=True)
        handler = _Quiet(log_file(), maxBytes=_MOST_BYTES, backupCount=_KEPT, encoding="utf-8", delay=True)
        handler.setFormatter(_PlainFormatter())
        logger.addHandler(handler)
        if logging.lastResort is not None:
            logger.addHandler(logging.lastResort)
        logger.setLevel(logging.INFO)


def read_log() -> str:
    """Return the log of all readable files, oldest line first."""
    newest = log_file()
    files = [newest.with_name(f"{newest.name}.{number}") for number in range(_KEPT, 0, -1)]
    return "".join(map(_read, (*files, newest)))


def last_error(log: str) -> str:
    """Return the last error in a log, or failure of a device, with the lines that belong to it; "" if there is none."""
    records = re.split(r"\n(?! )", log.strip("\n"))
    return next((record for record in reversed(records) if _ERROR.match(record)), "")


def source_place(path: str) -> str:
    """Return the path of a source file relative to its package: the installation's path may contain the user's name."""
    parts = Path(path).parts
    for root in ("study_app", "site-packages"):
        if root in parts:
            return "/".join(parts[parts.index(root) :])
    return parts[-1]


def _read(path: Path) -> str:
    with suppress(OSError):
        return path.read_text(encoding="utf-8", errors="replace")
    return ""


def _plain_argument(given: object) -> str:
    if isinstance(given, DeviceError | ServoFault):
        return str(given)
    return type(given).__name__ if isinstance(given, BaseException) else _OMITTED


def _message_format(message: object) -> str:
    return message if isinstance(message, str) else _OMITTED
