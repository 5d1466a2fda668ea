"""A zip file for support: versions, settings, log, last error, and the report on a device.

It contains no participant's ID, no answer, no value of a liquid and no part of a key. From a study it contains only the
source locations in crash traces.
"""

import io
import json
import re
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from study_app.program_log import last_error, read_log, source_place
from study_app.store import receipt, workstation
from study_app.store.files.atomic import write_file
from study_app.workspace import workspace

NAME: Final = "liquid-study-support.zip"
_MAX_CRASHES: Final = 3
_DRIVERS: Final = ("pyusb", "libusb-package", "hidapi")
_PRIVATE: Final = frozenset({"operator", "firmware", "workspace", "recent", "camera", "proofs", "stamps", "stamp_root"})
"""Settings with initials, paths that may name a person, or an address that may contain a password."""
_SOURCE_LOCATION: Final = re.compile(r'^ *(File "[^"]*", line \d+ in \S+|<no Python frame>)$')
_HEADING: Final = re.compile(
    r"^(Fatal Python error: [\w \-]+|(Current thread|Thread) 0x[0-9a-f]+ \(most recent call first\):)$"
)
_README: Final = """Information about this machine and liquid-study, for support.

versions.json    versions of the program, Python, the system and libraries
settings.json    this machine's settings, without initials, folders or the camera's address
log.txt          the program's log: messages, source lines, device failures
last-error.txt   the last error in the log
diagnosis.txt    findings about the device, if it was examined
crash-N.txt      source lines at the time of a crash, newest crash first

These files do not contain participant IDs, answers, liquid parameters or keys.
"""


def write_support_archive(path: Path, diagnosis: str = "") -> None:
    """Write the support archive (zip) to ``path`` atomically; ``diagnosis`` is the text of a device's diagnosis.

    Raises
    ------
    StoreError
        The archive cannot be written.
    """
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in _zip_files(diagnosis):
            archive.writestr(name, text.replace(str(Path.home()), "~"))
    write_file(path, content.getvalue())


def _zip_files(diagnosis: str) -> Iterator[tuple[str, str]]:
    settings, problem = workstation.load_or_default()
    log = read_log()
    yield "README.txt", _README
    yield "versions.json", _json_text(receipt.versions() | {name: receipt.library_version(name) for name in _DRIVERS})
    yield (
        "settings.json",
        _json_text(
            _settings_without_private_values(settings) | ({"problem": "the file cannot be used"} if problem else {})
        ),
    )
    yield "log.txt", log
    yield "last-error.txt", last_error(log)
    if diagnosis:
        yield "diagnosis.txt", diagnosis
    for number, trace in enumerate(_crash_traces(workspace().results), start=1):
        yield f"crash-{number}.txt", trace


def _settings_without_private_values(settings: workstation.MachineSettings) -> dict[str, object]:
    """Return the settings; for private ones only whether they are set."""
    values = settings.model_dump(mode="json", exclude={"benches": {"__all__": {"report"}}})
    return {name: bool(value) if name in _PRIVATE else value for name, value in values.items()}


def _crash_traces(results: Path) -> Iterator[str]:
    """Yield the lines with source locations of the newest crash traces of the sessions in ``results``."""
    traces = []
    for path in results.glob("*/data/sub-*/ses-*/crash.txt"):
        try:
            traces.append((path.stat().st_mtime_ns, path.read_text(encoding="utf-8", errors="replace")))
        except OSError:
            continue
    for _, trace in sorted(traces, reverse=True)[:_MAX_CRASHES]:
        lines = [line for line in trace.splitlines() if _SOURCE_LOCATION.match(line) or _HEADING.match(line)]
        yield re.sub(r'(?<=File ")[^"]*', lambda path: source_place(path[0]), "\n".join(lines))


def _json_text(value: object) -> str:
    return json.dumps(value, indent=2, ensure_ascii=False) + "\n"
