"""The diagnosis of a device: its modes of failure as data, and the report. Loads neither compiler nor driver."""

import sys
import tomllib
from collections.abc import Container
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import Final, Literal

from study_app.errors import DeviceError, DeviceNotFound
from study_app.number_text import counted

State = Literal["ok", "found", "not checked"]
_ORDER: Final[tuple[State, ...]] = ("found", "not checked", "ok")
WIDTH: Final = 100
_NOTHING_WRONG: Final = "No problems were found."


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One failure mode: its ``number`` in the list, and whether it is present.

    The texts are those of its `FailureMode`.
    """

    number: int
    id: str
    tested: str
    symptom: str
    state: State
    cause: str
    cure: str
    known_by: str
    paste: str = ""

    @property
    def words(self) -> str:
        """The symptom if the failure is present, else the tested state."""
        return self.symptom if self.state == "found" else self.tested


@dataclass(frozen=True, slots=True)
class Report:
    """The result of a diagnosis.

    ``seen`` are observations as text, ``findings`` all failure modes in order, ``failure`` the driver's error or None.
    """

    seen: tuple[str, ...]
    findings: tuple[Finding, ...]
    failure: str | None

    @property
    def found(self) -> tuple[Finding, ...]:
        return tuple(finding for finding in self.findings if finding.state == "found")

    @property
    def in_order(self) -> tuple[Finding, ...]:
        """All findings: failures first, then those that could not be checked."""
        return tuple(sorted(self.findings, key=lambda finding: _ORDER.index(finding.state)))

    @property
    def unseen(self) -> tuple[Finding, ...]:
        return tuple(finding for finding in self.findings if finding.state == "not checked")

    @property
    def well(self) -> bool:
        return not self.found and self.failure is None

    @property
    def conclusion(self) -> str:
        if not self.well:
            return f"Found {counted(len(self.found), 'fault')}."
        if self.unseen:
            return f"{_NOTHING_WRONG} Not checked: {'; '.join(finding.tested for finding in self.unseen)}."
        return _NOTHING_WRONG


def report_lines(report: Report) -> list[str]:
    """Return a report as text of 100 columns; commands to paste are on one line."""
    lines = ["", *(f"seen: {observation}" for observation in report.seen), ""]
    for finding in report.in_order:
        word = "FAULT" if finding.state == "found" else finding.state
        lines.append(f"{finding.number:>2}  {word:<13}  {finding.words}")
        if finding.state == "found":
            lines.append(_indent_text(f"cause: {finding.cause}", 19))
            lines.append(_indent_text(f"cure: {finding.cure}", 19))
            lines.append(_indent_text(f"known by: {finding.known_by}", 19))
            if finding.paste:
                lines += ["", finding.paste, ""]  # on one line, to be copied
    lines.append("")
    if report.failure is not None:
        lines.append(_indent_text(report.failure, 0))
    lines.append(_indent_text(report.conclusion, 0))
    return lines


def _indent_text(text: str, indent: int) -> str:
    prefix = " " * indent
    return fill(text, WIDTH, initial_indent=prefix, subsequent_indent=prefix, break_long_words=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class FailureMode:
    """A failure mode: the state without it, its symptom for the user, cause, remedy, and how it is detected.

    ``paste`` is the remedy as a terminal command of this system, "" if there is none.
    """

    id: str
    tested: str
    symptom: str
    cause: str
    cure: str
    known_by: str
    paste: str = ""


class DeviceFailure(DeviceError):
    """A device cannot be used; ``mode`` is the id of its `FailureMode`."""

    def __init__(self, mode: str, message: str) -> None:
        self.mode = mode
        super().__init__(message)


class _DeviceFailureNotFound(DeviceFailure, DeviceNotFound):
    """There is no device, or no software that could find it."""


@dataclass(frozen=True, slots=True)
class FailureTable:
    """The failure modes of ``device`` in test order; ``not_found`` are those of a missing device."""

    device: str
    modes: tuple[FailureMode, ...]
    not_found: frozenset[str]

    def mode(self, mode: str) -> FailureMode:
        return next(entry for entry in self.modes if entry.id == mode)

    def before(self, mode: str) -> set[str]:
        """Return the ids of the modes that are tested before this one."""
        ids = [entry.id for entry in self.modes]
        return set(ids[: ids.index(mode)])

    def sentence(self, mode: str, seen: str = "") -> str:
        """Return symptom, observation (``seen``), cause and remedy of a mode in one line."""
        failure_mode = self.mode(mode)
        detail = f" ({seen})" if seen else ""
        return f"{failure_mode.symptom}{detail}: {failure_mode.cause}; {failure_mode.cure}"

    def failure(self, mode: str, seen: str = "") -> DeviceFailure:
        kind = _DeviceFailureNotFound if mode in self.not_found else DeviceFailure
        return kind(mode, f"{self.device} cannot be used: {self.sentence(mode, seen)}")

    def findings(self, observed: Container[str] = (), passed: Container[str] = ()) -> tuple[Finding, ...]:
        """Return a finding for every mode in order: "found" if ``observed``, "ok" if ``passed``, else "not checked"."""

        def finding(number: int, mode: FailureMode) -> Finding:
            state: State = "found" if mode.id in observed else "ok" if mode.id in passed else "not checked"
            return Finding(
                number=number,
                id=mode.id,
                tested=mode.tested,
                symptom=mode.symptom,
                state=state,
                cause=mode.cause,
                cure=mode.cure,
                known_by=mode.known_by,
                paste=mode.paste,
            )

        return tuple(finding(number, mode) for number, mode in enumerate(self.modes, start=1))


def read_failures(file: Path, platform: str = sys.platform, **phrases: object) -> FailureTable:
    """Return the table in a TOML file.

    Each ``[[mode]]`` has the fields of a `FailureMode` and optionally ``only``, the systems on which it occurs. A text
    that differs between systems is a table with a key per system and ``other`` for the rest. Names in braces in a text
    are replaced by ``phrases`` or by entries of ``[words]``.
    """

    def for_platform(text: str | dict[str, str]) -> str:
        return text if isinstance(text, str) else text.get(platform, text.get("other", ""))

    document = tomllib.loads(file.read_text("utf-8"))
    phrases |= {name: for_platform(text) for name, text in document.get("words", {}).items()}
    modes = [mode for mode in document["mode"] if platform in mode.pop("only", [platform])]
    filled = [
        FailureMode(**{name: for_platform(text).format_map(phrases) for name, text in mode.items()}) for mode in modes
    ]
    return FailureTable(document["device"], tuple(filled), frozenset(document["not_found"]))
