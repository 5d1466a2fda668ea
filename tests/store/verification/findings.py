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


def of_receipt(**changes: Any) -> Callable[[Path], None]:
    def act(path: Path) -> None:
        held = receipt.read(path) | changes
        receipt.write(path, {name: value for name, value in held.items() if value is not ...})

    return act


PARTICIPANTS = "data/study-brackish_description-participants_data.csv"
