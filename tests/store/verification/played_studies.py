"""Studies that are changed in transcripts, and what `verify` and others say of them."""

import base64
import hashlib
import json
import re
import shutil
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.store import receipt
from study_app.store.blinded import blinding
from study_app.store.exclusions import exclude, exclusions
from study_app.store.files.folders import StudyFolder
from study_app.store.integrity.folder_lock import lock_folder
from study_app.store.journals import journal_events
from study_app.store.sessions.recovery import check_resumable, rebuild_session, reopen_store
from study_app.store.tables.study_files import write_participants
from study_app.store.unblinding import unblind
from study_app.store.verification.proofs import proof_text
from study_app.store.verification.verify_session import Findings
from study_app.store.verification.whole_study import verify_study
from study_app.store.withdrawals import Tombstone, add_tombstone, describe_session, withdraw
from tests.golden import CHANGING
from tests.journal_lines import event_of
from tests.store.conftest import SOURCE, attended, begun, choose, made_samples, study_tables, summary_of_trial
from tests.store.forging import Lines, cover_up, forge
from tests.studies import rehearsed
from tests.transcripts import Files, Play, acts

MASK = re.compile(
    CHANGING.pattern + r"|\b(?:[a-z0-9]{4}-){2}[a-z0-9]{4}(?:-[a-z0-9]{2})?\b|line \d+ column .*?\)"
    r"|process \d+ on [^,]+|open-[0-9a-f]{8}"
)
"""Dates, versions, hashes, fingerprints, programs, and places in receipts, which are as long as versions are."""
P007 = "data/sub-P007/ses-01"
NAMES = {
    "SESSION": P007,
    "JOURNAL": f"{P007}/journal.jsonl",
    "RECEIPT": f"{P007}/receipt.json",
    "SUMS": f"{P007}/checksums.sha256",
    "RESPONSES": f"{P007}/subject-P007_session-01_task-brackish_description-responses_data.csv",
    "TRIALS": f"{P007}/subject-P007_session-01_task-brackish_description-trials_data.csv",
    "PARTICIPANTS": "data/study-brackish_description-participants_data.csv",
    "RECORDING": f"{P007}/recordings/trial-001.parquet",
    "FRAMES": f"{P007}/recordings/trial-002_attempt-2_frames.parquet",
    "KEY": "blinding/key.sealed",
    "REVEALS": "blinding/reveals.jsonl",
}


def told(found: Findings) -> str:
    return "\n".join(map(str, found.errors))


def warned(found: Findings) -> str:
    return "\n".join(map(str, found.warnings))


def recorded(folder: Path) -> Path:
    """Run two sessions: P007 with recordings and one repeated trial, and P008, who withdrew."""
    store = begun(folder, recordings=True)
    recorder = store.recorder
    assert recorder is not None
    for trial in build_schedule(Protocol.model_validate(study_tables()), "P007", 11).trials:
        trial_fields = {name: getattr(trial, name) for name in ("block", "phase", "part", "index", "of", "code")}
        for attempt in (1, 2) if trial.number == 2 else (1,):
            store.append(journal_events.TrialStarted(trial=trial.number, attempt=attempt, **trial_fields))
            recorder.start(trial.number, attempt, 1000.0)
            recorder.append(made_samples(500 + trial.number))
            recorder.frame(9, 4)
            recorder.stop()
            measured = summary_of_trial()
            store.append(event_of("trial_ended", trial=trial.number, attempt=attempt, outcome="complete", **measured))
        items = [
            {"item": item, "number": n, "value": 4, "onset_s": 1.5, "first_s": 2.25, "last_s": 2.25, "changes": 0}
            for n, item in enumerate(trial.items, start=1)
        ]
        if items:
            choose(store, trial.number, items)
            store.append(event_of("responses", trial=trial.number, attempt=attempt, items=items))
        store.write_tables()
    store.append(journal_events.Note(kind="mark", text='comma, "quote"\nnew line'))
    store.finish("completed")
    begun(folder, "P008").finish("withdrawn", "tired")
    return folder


def answered(folder: Path) -> Path:
    """Hold two sessions without recordings, P007's with all answers."""
    for participant in ("P007", "P008"):
        store = begun(folder, participant, simulated=True)
        attended(store)
        store.finish("completed")
    return folder


def left(folder: Path) -> Path:
    """Run a complete session of P008, then one of P007 with all answers but without an end."""
    begun(folder, "P008").finish("completed")
    with begun(folder) as store:
        attended(store)
    return folder


def proved(folder: Path) -> Path:
    """Rehearse three sessions, one of which is withdrawn, exclude a trial, and open the key."""
    study = rehearsed(folder.parent)
    exclude(study, "P002", 1, trial=2, by="AK", reason="the phone rang")
    withdraw(study, "P003", by="AK", reason="asked by letter")
    unblind(study, "AK", "closed")
    (study.parent / "kept.txt").write_text(proof_text(StudyFolder(study)), encoding="utf-8", newline="\n")
    return study


STARTS: dict[str, Callable[[Path], Path]] = {
    function.__name__: function for function in (recorded, answered, left, proved)
}


def _changed(changes: dict[str, Any]) -> Protocol:
    """Return the study with other values; two underscores in a name separate nested keys."""
    tables: dict[str, Any] = study_tables()
    for name, value in changes.items():
        *above, last = name.split("__")
        place = tables
        for part in above:
            place = place[part]
        place[last] = value
    return Protocol.model_validate(tables)


class Changed(Files):
    """A copy of a study, and a command for whatever may happen to its files."""

    def __init__(self, made: Path, folder: Path) -> None:
        self.study = Path(shutil.copytree(made, folder / "study"))
        kept_proofs = made.parent / "kept.txt"
        self.kept = Path(
            shutil.copy(kept_proofs if kept_proofs.exists() else made / "fingerprints.txt", folder / "kept.txt")
        )
        self.session = P007
        super().__init__(self.study)

    def at(self, session: str) -> None:
        """Change this session from now on."""
        self.session = session

    @property
    def journal(self) -> Path:
        return self.study / self.session / "journal.jsonl"

    def verify(self, *, kept: bool = False) -> Iterator[str]:
        """Yield the findings of the verification, optionally with a separate copy of the fingerprints."""
        verification = verify_study(self.study, self.kept if kept else None)
        soundness = "sound" if verification.is_sound else "not sound"
        yield f"{verification.sessions} sessions, {verification.running} running: {soundness}"
        yield from (f"error: {error}" for error in verification.errors)
        yield from (f"warning: {warning}" for warning in verification.warnings)

    def rebuild(self, session: str = P007) -> Iterator[str]:
        rebuilt = rebuild_session(self.study / session)
        yield f"rebuilt {[path.name for path in rebuilt.rewritten]}, torn {rebuilt.torn_bytes}"

    def go_on(self, comment: bytes = b"", **changes: Any) -> Iterator[str]:
        """Check whether the session can be resumed with a study of other values."""
        check_resumable(self.study / P007, _changed(changes), SOURCE + comment)
        yield "it can go on"

    def reopen(self, comment: bytes = b"", **changes: Any) -> Iterator[str]:
        """Resume the session and leave it; yield the added journal lines."""
        choices: dict[str, Any] = {"operator": "CD", "device": {"name": "mouse"}, "screens": {}}
        with reopen_store(self.study / P007, _changed(changes), SOURCE + comment, **choices) as store:
            yield from (f"{line.event} {getattr(line, 'torn_bytes', '')}" for line in store.lines[-1:])

    def open(self) -> None:
        """Let another program have the session open."""
        self.opening = lock_folder(self.study / self.session)

    def key_for(self, **changes: Any) -> Iterator[str]:
        """Request the study's key with a study of other values, like a starting session."""
        for ask in (blinding.open_or_draw_key, blinding.check_conditions):
            ask(self.study, _changed(changes))
        yield "the key is this study's"

    def swap_codes(self, block: str) -> None:
        """Exchange the conditions of two codes of a block."""
        content = json.loads(base64.b64decode((self.study / NAMES["KEY"]).read_bytes()))
        (first_code, first), (second_code, second) = content["codes"][block].items()
        content["codes"][block] = {first_code: second, second_code: first}
        self.write(NAMES["KEY"], base64.encodebytes(json.dumps(content).encode()))

    def begin(self, participant: str) -> None:
        begun(self.study, participant).finish("completed")

    def unblind(self) -> Iterator[str]:
        yield from (f"left: {file}" for file in unblind(self.study, "AB", "done").left)

    def exclude(self, participant: str, trial: int | None = None, reason: str = "the phone rang") -> None:
        exclude(self.study, participant, 1, trial=trial, by="AB", reason=reason)

    def exclusions(self) -> Iterator[str]:
        yield from map(str, exclusions(self.study))

    def participants(self) -> Iterator[str]:
        """Tell rows of the table of participants, written anew."""
        write_participants(StudyFolder(self.study), "brackish")
        rows = (self.study / NAMES["PARTICIPANTS"]).read_text("utf-8").splitlines()
        yield from (row[:40] for row in rows)

    def reveal(self, by: str = "AB", reason: str = "done") -> None:
        blinding.reveal(self.study, by, reason)

    def reveals(self) -> Iterator[str]:
        """Yield who opened the key and why."""
        yield from (f"{reveal['by']}: {reveal['reason']}" for reveal in blinding.reveals(self.study))

    def seal_changed(self) -> None:
        """Change a digit of a sealed text."""

        def change(lines: Lines) -> None:
            line = next(line for line in lines if "sealed" in line)
            line["sealed"] = f"{line['sealed'][:100]}{'1' if line['sealed'][100] == '0' else '0'}{line['sealed'][101:]}"

        forge(self.journal, change)

    def key_is_open(self) -> Iterator[str]:
        yield str(blinding.revealed_key(self.study) is not None)

    def lines(self, first: int = 0, last: int | None = None, name: str = NAMES["JOURNAL"]) -> None:
        """Leave lines of a file."""
        self.write(name, b"".join((self.study / name).read_bytes().splitlines(keepends=True)[first:last]))

    def without_line(self, number: int) -> None:
        lines = (self.study / NAMES["JOURNAL"]).read_bytes().splitlines(keepends=True)
        self.write(NAMES["JOURNAL"], b"".join(lines[: number - 1] + lines[number:]))

    def only(self, *names: str) -> None:
        """Leave the journal, the receipt and these files of the session."""
        kept_files = {self.study / name for name in (NAMES["JOURNAL"], NAMES["RECEIPT"])}
        kept_files |= {path for name in names for path in (self.study / P007).glob(name)}
        for path in (self.study / P007).rglob("*"):
            if path.is_file() and path not in kept_files:
                path.unlink()

    def receipt(self, *gone: str, **changes: Any) -> None:
        """Change fields of the receipt, or take some away."""
        path = self.study / self.session / "receipt.json"
        session_receipt = receipt.read(path) | changes
        receipt.write(path, {name: value for name, value in session_receipt.items() if name not in gone})

    def never_ended(self) -> None:
        """Remove everything that shows that the session ended, but for its tables."""
        self.receipt(status="unfinished", reason="", ended_at=None)
        self.delete(NAMES["SUMS"], "fingerprints.txt")

    def edit(self, event: str, at: int = 0, /, **fields: Any) -> None:
        """Change a line of the journal and repair everything that depends on it."""

        def change(lines: Lines) -> None:
            [line for line in lines if line["event"] == event][at].update(fields)

        forge(self.journal, change)

    def move(self, at: str) -> None:
        """Let every line but the first be of another moment."""
        forge(self.journal, lambda lines: [line.update(at=at) for line in lines[1:]])

    def exchange(self, other: str) -> None:
        """Exchange the answers of two participants."""
        paths = self.journal, self.study / other / "journal.jsonl"
        content = [[json.loads(line) for line in path.read_text("utf-8").splitlines()] for path in paths]
        values = [[line["value"] for line in lines if line["event"] == "choice"] for lines in content]

        def give(lines: Lines, told: list[int]) -> None:
            rest, fields = iter(told), {}
            for line in lines:
                if line["event"] == "choice":
                    line["value"] = fields[line["trial"], line["item"]] = next(rest)
                for item in line["items"] if line["event"] == "responses" else ():
                    item["value"] = fields[line["trial"], item["item"]]

        for path, value in zip(paths, reversed(values), strict=True):
            forge(path, partial(give, told=value))

    def false_withdrawal(self, participant: str) -> None:
        """Record a withdrawal for a deleted participant."""
        folder = StudyFolder(self.study)
        erased = tuple(describe_session(session) for session in folder.sessions() if session.participant == participant)
        self.delete(f"data/sub-{participant}")
        self.cover_up()
        add_tombstone(
            folder,
            Tombstone(
                participant=participant, at="2026-03-02T09:30:00+01:00", by="AK", reason="asked", sessions=erased
            ),
        )

    def drop(self, event: str, at: int = 0) -> None:
        def change(lines: Lines) -> None:
            lines.remove([line for line in lines if line["event"] == event][at])

        forge(self.journal, change)

    def add(self, **fields: Any) -> None:
        """Add a copy of the last line, with some fields changed, to the journal."""
        forge(self.journal, lambda lines: lines.append(lines[-1] | fields))

    def half(self) -> None:
        def change(lines: Lines) -> None:
            del lines[len(lines) // 2 :]

        forge(self.journal, change)

    def invert(self, *events: str) -> None:
        """Change every answer in lines of these events."""

        def change(lines: Lines) -> None:
            for line in (line for line in lines if line["event"] in events):
                for answer in line.get("items", [line]):
                    answer["value"] = 8 - answer["value"]

        forge(self.journal, change)

    def unchained(self) -> None:
        """Turn the journal into format 1, whose lines are not chained by hashes."""
        forge(self.journal, lambda lines: lines[0].pop("format"), chained=False)

    def late_chain(self) -> None:
        """Let the chain begin with the second line."""
        first, second, *rest = (self.study / NAMES["JOURNAL"]).read_bytes().splitlines(keepends=True)
        line = json.loads(first)
        for name in ("format", "previous", "measures_sealed"):
            del line[name]
        first = json.dumps(line, separators=(",", ":")).encode() + b"\n"
        told_after = json.loads(second)["previous"].encode()
        second = second.replace(told_after, hashlib.sha256(first).hexdigest().encode())
        self.write(NAMES["JOURNAL"], first + second + b"".join(rest))

    def receipt_hash(self) -> None:
        """Set the receipt's hash in the journal to that of the present receipt."""
        self.edit("session_started", receipt_hash=receipt.digest(receipt.read(self.journal.with_name("receipt.json"))))

    def cover_up(self) -> None:
        """Compute tables, checksums and fingerprints anew."""
        cover_up(self.study)

    def elsewhere(self) -> None:
        """Leave the marker of a program of another machine."""
        marker = {"host": "elsewhere", "pid": 1, "began": "x"}
        (self.study / P007 / ".open-0123abcd.json").write_text(json.dumps(marker), encoding="utf-8", newline="\n")


def player(made: dict[str, Path], folder: Path) -> Play:
    """Return a function that plays transcripts on copies of studies in an otherwise empty folder."""

    def begun(start: str) -> Changed:
        for path in folder.iterdir():
            shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()
        return Changed(made[start], folder)

    return acts(begun, NAMES, lambda said: MASK.sub("*", said.replace(str(folder), "FOLDER")))
