"""Sessions that are changed in transcripts, and what replaying and reproducing them says."""

import ast
import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from study_app.session.replay import replay
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.files.folders import StudyFolder
from study_app.store.verification.reproduction import reproduce_session
from tests.faults.support import short
from tests.protocol import edited_studies
from tests.protocol.trials.matching import text_of
from tests.session.pairs import short_text
from tests.session.replay.recorded_sessions import rewrite, troubled
from tests.store.forging import Lines, change, forge, nothing
from tests.transcripts import Files, Play, acts

NAMES = {"RECEIPT": "receipt.json", "FIRST": "recordings/trial-001.parquet", "SECOND": "recordings/trial-002.parquet"}


def _rehearsed(text: str, seed: int) -> Callable[[Path], object]:
    def make(folder: Path) -> object:
        (folder / "study.toml").write_text(text, encoding="utf-8", newline="\n")
        return rehearse(folder / "study.toml", participants=1, seed=seed, results=folder / "study")

    return make


STARTS: dict[str, Callable[[Path], object]] = {
    "short": lambda folder: rehearse(short.write(folder), participants=1, seed=1, results=folder / "study"),
    "troubled": lambda folder: troubled(folder / "study"),
    "levels": _rehearsed(short_text(), 2),
    "matching": _rehearsed(text_of(("repetitions = 4", "repetitions = 3")), 2),
    "clipped": _rehearsed(edited_studies.text_of("clipped"), 1),
}


class Recorded(Files):
    """A copy of a session with a command for each possible damage."""

    def __init__(self, study: Path) -> None:
        self.study = study
        (session,) = StudyFolder(study).sessions()
        super().__init__(session.path)

    def replay(self) -> Iterator[str]:
        replay_result = replay(self.root)
        yield f"{replay_result.recordings} recordings, {'proved' if replay_result.proved else 'not proved'}"
        for kind in ("differences", "missing", "uncompared"):
            yield from (f"{kind}: {message}" for message in getattr(replay_result, kind))

    def reproduce(self) -> Iterator[str]:
        reproduction = reproduce_session(self.root)
        yield from (f"differs: {difference}" for difference in reproduction.differences)
        yield from (f"followed: {line}" for line in reproduction.followed)

    def nudge(self, recording: str, column: str, amount: float, first: int, last: int | None = None) -> None:
        """Add an amount to rows of a column of a recording."""
        rows = slice(first, last)
        rewrite(
            self.root / recording, lambda columns: columns[column].__setitem__(rows, columns[column][rows] + amount)
        )

    def receipt(self, *gone: str, **changes: Any) -> None:
        """Change fields of the receipt, or take some away."""
        content = json.loads((self.root / "receipt.json").read_text("utf-8")) | changes
        receipt_fields = {name: value for name, value in content.items() if name not in gone}
        self.write("receipt.json", json.dumps(receipt_fields).encode())

    def velocity(self, **estimator: Any) -> None:
        """Let the receipt name another estimator of the velocity."""
        content = json.loads((self.root / "receipt.json").read_text("utf-8"))
        content["protocol"]["scene"]["velocity"] = estimator
        self.write("receipt.json", json.dumps(content).encode())

    def no_recording(self, trial: int, reason: str = "") -> None:
        """Replace the journal line of a recording by a lost recording, or by an unrelated note."""
        line_fields = (
            {"event": "recording_lost", "reason": reason} if reason else {"event": "note", "kind": "mark", "text": ""}
        )

        def lose(lines: Lines) -> None:
            for number, line in enumerate(lines):
                if line["event"] == "recorded" and line["trial"] == trial:
                    lines[number] = {name: line[name] for name in ("n", "t_s", "at", "trial", "attempt")} | line_fields

        forge(self.root / "journal.jsonl", lose)

    def known(self, event: str, trial: int, at: int = 0, /, **fields: Any) -> None:
        """Change a line with the key; ``"*2"`` and ``"+1"`` change its present number."""

        def edit(lines: Lines) -> None:
            line = [line for line in lines if line["event"] == event and line["trial"] == trial][at]
            for name, value in fields.items():
                match str(value)[0]:
                    case "*":
                        line[name] *= ast.literal_eval(value[1:])
                    case "+":
                        line[name] += ast.literal_eval(value[1:])
                    case _:
                        line[name] = value

        change(self.root, edit)

    def answer(self, trial: int, value: Any, *, chosen: bool = True) -> None:
        """Change an answer and its choice with the key."""

        def edit(lines: Lines) -> None:
            for line in (line for line in lines if line.get("trial") == trial):
                if line["event"] == "choice" and chosen:
                    line["value"] = value
                if line["event"] == "responses":
                    line["items"] = [] if value is None else [line["items"][0] | {"value": value}]

        change(self.root, edit)

    def pass_over(self, trial: int) -> None:
        """Replace the lines of a trial by one that records it as passed over."""

        def edit(lines: Lines) -> None:
            first, *rest = [line for line in lines if line.get("trial") == trial]
            line_fields = {"event": "passed_over", "trial": trial, "reason": "track_ended"}
            lines[lines.index(first)] = {name: first[name] for name in ("n", "t_s", "at")} | line_fields
            for line in rest:
                lines.remove(line)

        change(self.root, edit)

    def tamper(self, event: str) -> None:
        """Change a sealed text."""

        def edit(lines: Lines) -> None:
            line = next(line for line in lines if line["event"] == event)
            line["sealed"] = "0000" + line["sealed"][4:]

        change(self.root, nothing, edit)

    def key(self, name: str, to: str) -> None:
        (self.study / "blinding" / name).rename(self.study / "blinding" / to)


def player(made: Callable[[str], Path], folder: Path) -> Play:
    """Return a function that plays transcripts on copies of sessions in a folder."""

    def begun(start: str) -> Recorded:
        shutil.rmtree(folder / "study", ignore_errors=True)
        return Recorded(Path(shutil.copytree(made(start) / "study", folder / "study")))

    return acts(begun, NAMES, lambda said: said.replace(str(folder), "FOLDER"))
