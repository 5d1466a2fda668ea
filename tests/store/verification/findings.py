"""What verification said, and damage done to files by hand."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from study_app.store import receipt
from study_app.store.verification.verify_session import Findings

SESSION = "data/sub-P007/ses-01"


def told(findings: Findings) -> str:
    return "\n".join(map(str, findings.errors))


def warned(findings: Findings) -> str:
    return "\n".join(map(str, findings.warnings))


def replace(old: str, new: str, count: int = 1) -> Callable[[Path], None]:
    def act(path: Path) -> None:
        text = path.read_bytes()
        assert old.encode() in text
        path.write_bytes(text.replace(old.encode(), new.encode(), count))

    return act


def append(content: bytes) -> Callable[[Path], None]:
    return lambda path: path.write_bytes(path.read_bytes() + content)


def without_line(number: int) -> Callable[[Path], None]:
    def act(path: Path) -> None:
        lines = path.read_bytes().splitlines(keepends=True)
        path.write_bytes(b"".join(lines[: number - 1] + lines[number:]))

    return act


def of_receipt(**changes: Any) -> Callable[[Path], None]:
    def act(path: Path) -> None:
        held = receipt.read(path) | changes
        receipt.write(path, {name: value for name, value in held.items() if value is not ...})

    return act


RESPONSES = f"{SESSION}/subject-P007_session-01_task-brackish_description-responses_data.csv"


TRIALS = f"{SESSION}/subject-P007_session-01_task-brackish_description-trials_data.csv"


PARTICIPANTS = "data/study-brackish_description-participants_data.csv"


def only_the_journals_lines(count: int) -> Callable[[Path], None]:
    def act(path: Path) -> None:
        path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:count]))

    return act
