"""A study that sessions were run with, and what tests of versions click and read."""

import json
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import Qt

from study_app.protocol.load import parse
from study_app.protocol.source.files import protocol_hash
from study_app.store.receipt import without_conditions

REPETITIONS = ("blocks", "liquids", "repetitions")


def run(designer: Any, participant: str, source: bytes, study: str = "kitchen", **facts: Any) -> Path:
    """Write the receipt of a session that was run with a content of the study; return its folder."""
    folder: Path = designer.results / study / "data" / f"sub-{participant}" / "ses-01"
    folder.mkdir(parents=True)
    protocol = json.loads(json.dumps(without_conditions(parse(source, "kitchen"))))
    held = {
        "key_hash": "0" * 64, "protocol_hash": protocol_hash(source), "protocol": protocol, "simulated": False,
        "pilot": False, "started_at": "2026-11-20T12:00:00+00:00", **facts,
    }  # fmt: skip
    (folder / "receipt.json").write_text(json.dumps(held))
    return folder


def version_of(designer: Any) -> str:
    return str(designer.editing.opened.study.document["study"]["version"])


@pytest.fixture
def ran(designer: Any, qtbot: Any) -> Any:
    """The designer with a study that two participants and a pilot were run with, version 1.0."""
    source = designer.file.read_bytes()
    run(designer, "P001", source)
    run(designer, "P002", source)
    run(designer, "P001", source, study="kitchen-pilot", pilot=True)
    designer.controller.open("kitchen")
    qtbot.waitUntil(lambda: designer.place.header.version.words == "1.0, run by 2")
    return designer


def click(qtbot: Any, part: Any) -> None:
    qtbot.waitUntil(part.isVisible)
    qtbot.mouseClick(part, Qt.MouseButton.LeftButton)


def lines(designer: Any) -> list[str]:
    """The lines of the difference that is shown, without its context."""
    shown = designer.controller.changes.difference.toPlainText().splitlines()
    return [line.partition("  #")[0].rstrip() for line in shown if line[:1] in {"-", "+"}]
