"""Format 1 is frozen: what rehearsals of the shipped studies wrote when it was recorded, they write now."""

import csv
import hashlib
import io
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from study_app.devices.hand import HandOrders
from study_app.protocol.trials.tasks import Task
from study_app.session.simulated import rehearsal
from study_app.store.blinded.blinding import Key, open_events, read_key, seal_event
from study_app.store.columns import TABLES
from study_app.store.folders import StudyFolder
from tests.journal_lines import event_from, raw

RECORDED: dict[str, dict[str, Any]] = json.loads((Path(__file__).parent / "format_1.json").read_text("utf-8"))
UNEQUAL = (
    "at",
    "previous",
    "version",
    "receipt_hash",
    "sha256",
    "frames_sha256",
    "opened_sha256",
    "opened_frames_sha256",
)
"""Fields of the journal that differ from run to run or with the program's version."""

ADDED = ("text_sha256", "study_version", "limiter_saturated", "within_limits")
"""Fields that later versions write besides: of the consent that the participant read, a sealed count, the verdict."""

MEASURED = re.compile("path_length|mean_speed|force_|withheld|delivered|limiter_|delay_error")
"""Fields computed from motion and force: their last digits depend on the vector instructions of the processor."""

WALL_CLOCK = {column.name for columns in TABLES.values() for column in columns if column.kind == "time"}


def sha256(content: object) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True, ensure_ascii=False).encode()).hexdigest()


def journal(path: Path, key: Key) -> list[dict[str, Any]]:
    """Return the lines without what differs from run to run; the recorder writes its own lines whenever it is done."""
    lines = raw(
        open_events([event_from(json.loads(line)) for line in path.read_text(encoding="utf-8").splitlines()], key)
    )
    fields = (
        {name: value for name, value in line.items() if name not in UNEQUAL + ADDED and not MEASURED.match(name)}
        for line in lines
    )
    kept = [one if one["event"] == "recorded" else sealed_again(lines[0], one, key) for one in fields]
    told = [line for line in kept if line["event"] != "recorded"]
    saved = [{**line, "t_s": None} for line in kept if line["event"] == "recorded"]
    saved.sort(key=lambda line: (line["trial"], line["attempt"]))
    return [{**line, "n": number} for number, line in enumerate((*told, *saved), start=1)]


def sealed_again(start: dict[str, Any], line: dict[str, Any], key: Key) -> dict[str, Any]:
    """Return a line with its sealed values in one text, whatever is missing of it."""
    fields = seal_event(event_from(start), event_from(line), key).fields()
    of_all = {name: value for name, value in line.items() if name in ("n", "event", "t_s", "at", "previous")}
    return of_all | {name: value for name, value in fields.items() if name in line or name == "sealed"}


def measured(path: Path, key: Key) -> list[float]:
    """Return what was measured in each trial."""
    lines = raw(
        open_events([event_from(json.loads(line)) for line in path.read_text(encoding="utf-8").splitlines()], key)
    )
    return [
        value for line in lines for name, value in sorted(line.items()) if MEASURED.match(name) and value is not None
    ]


def table(path: Path, key: Key) -> list[list[str]]:
    """Return the cells; numbers of samples, which later versions seal, as they are once they are opened."""
    header, *rows = csv.reader(io.StringIO(path.read_text(encoding="utf-8"), newline=""))
    if "samples_recorded" in header:
        text = (path.parent / "journal.jsonl").read_text(encoding="utf-8")
        lines = raw(open_events([event_from(json.loads(line)) for line in text.splitlines()], key))
        counts = {line["recording"]: str(line["samples_recorded"]) for line in lines if line["event"] == "recorded"}
        for row in rows:
            row[header.index("samples_recorded")] = counts[row[header.index("recording")]]
    blank = [name in WALL_CLOCK for name in header]
    return [header, *(["" if hidden else cell for hidden, cell in zip(blank, row, strict=True)] for row in rows)]


def recorded(folder: StudyFolder) -> Iterator[tuple[str, Any]]:
    yield "key", hashlib.sha256(folder.key.read_bytes()).hexdigest()
    for path in sorted(folder.path.rglob("*_data.csv")):
        yield path.relative_to(folder.path).as_posix(), sha256(table(path, read_key(folder.path)))
    for session in folder.sessions():
        place = session.path.relative_to(folder.path).as_posix()
        yield f"{place}/journal", sha256(journal(session.journal, read_key(folder.path)))
        yield f"{place}/measured", pytest.approx(measured(session.journal, read_key(folder.path)), rel=0.01, abs=0.001)
        yield f"{place}/protocol", sha256(json.loads(session.receipt.read_text(encoding="utf-8"))["protocol"])


def rest_without_return(_task: Task, hand: HandOrders) -> None:
    """Rest where the task ended, as the simulated hand did when the results were recorded."""
    hand.rest()


@pytest.mark.parametrize("name", sorted(RECORDED))
@pytest.mark.slow
def test_rehearsal_writes_the_bytes_recorded_for_format_1(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rehearsal, "rest_hand", rest_without_return)
    folder = rehearsal.rehearse(name, participants=2, seed=1, results=tmp_path / name)

    assert dict(recorded(StudyFolder(folder))) == RECORDED[name]


def test_hashes_of_format_1_cover_two_participants_of_each_shipped_study() -> None:
    assert {name: len(found) for name, found in RECORDED.items()} == {"rek2024": 12, "demo": 12, "physical_liquids": 12}
