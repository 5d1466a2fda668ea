"""Receipts of sessions that were run with a study."""

import json
from pathlib import Path
from typing import Any

from study_app.protocol.load import parse
from study_app.protocol.source.files import protocol_hash
from study_app.store.receipt import without_conditions


def run(designer: Any, participant: str, source: bytes, study: str = "kitchen", **facts: Any) -> Path:
    """Write the receipt of a session that was run with a content of the study; return its folder."""
    folder: Path = designer.results / study / "data" / f"sub-{participant}" / "ses-01"
    folder.mkdir(parents=True)
    protocol = json.loads(json.dumps(without_conditions(parse(source, "kitchen"))))
    held = {
        "key_hash": "0" * 64, "protocol_hash": protocol_hash(source), "protocol": protocol, "simulated": False,
        "pilot": False, "started_at": "2026-11-20T12:00:00+00:00", **facts,
    }  # fmt: skip
    (folder / "receipt.json").write_text(json.dumps(held), encoding="utf-8", newline="\n")
    return folder
