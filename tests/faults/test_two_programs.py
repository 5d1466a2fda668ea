"""Two programs that unblind, exclude, withdraw, export or verify one study folder at the same moment."""

import contextlib
import io
import json
import multiprocessing
import re
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from study_app.cli import main
from study_app.errors import StoreError
from study_app.store.exclusions import exclusions
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.verification.whole_study import verify_study
from tests import studies
from tests.faults.support.racers import race
from tests.journal_lines import raw
from tests.platforms import needs_fork
from tests.session import small
from tests.studies import once, rehearsed

pytestmark = [pytest.mark.slow, needs_fork]

ROUNDS = 4
ASKED = ("--by", "AB", "--reason", "a test")
COMMANDS = {
    "unblind": ("unblind", *ASKED),
    "exclude P001": ("exclude", "--participant", "P001", *ASKED),
    "exclude P002": ("exclude", "--participant", "P002", *ASKED),
    "withdraw P001": ("withdraw", "--participant", "P001", *ASKED),
    "withdraw P002": ("withdraw", "--participant", "P002", *ASKED),
    "export": ("export", "--to", "exported"),
    "report": ("report", "--to", "exported"),
    "verify": ("verify",),
}
PAIRS = [
    ("unblind", "unblind"),
    ("unblind", "export"),
    ("exclude P001", "exclude P002"),
    ("withdraw P001", "withdraw P002"),
    ("withdraw P001", "unblind"),
    ("withdraw P001", "verify"),
    pytest.param(("exclude P001", "report"), marks=pytest.mark.nightly),
    pytest.param(("withdraw P001", "report"), marks=pytest.mark.nightly),
]


def carry_out(folder: Path, words: tuple[str, ...], start: Any, outcomes: Any) -> None:
    """Run a command on the folder together with the other program; report its exit code and errors."""
    command, *options = words
    to = [str(folder / word) if word == "exported" else word for word in options]
    sys.argv = ["liquid-study", command, str(folder / "study"), *to]
    said, code = io.StringIO(), 0
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        start.wait(60)
        try:
            main()
        except SystemExit as ended:
            code = int(ended.code or 0)
    outcomes.put((words, code, said.getvalue()))


@pytest.mark.parametrize("pair", PAIRS, ids=" and ".join)
def test_two_programs_leave_a_sound_study(
    pair: tuple[str, str], tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    study = once(tmp_path_factory, "two-programs", rehearsed) / "demo"
    # Forks of a process without threads: a fork of a test's worker inherits locks that other tests' threads held.
    forking = multiprocessing.get_context("forkserver")
    forking.set_forkserver_preload([__name__])
    for number in range(ROUNDS):
        folder = tmp_path / str(number)
        shutil.copytree(study, folder / "study")
        start, outcomes = forking.Barrier(2), forking.SimpleQueue()
        programs = [forking.Process(target=carry_out, args=(folder, COMMANDS[name], start, outcomes)) for name in pair]
        for program in programs:
            program.start()
        ended = [outcomes.get() for _ in programs]
        for program in programs:
            program.join(60)
            assert program.exitcode == 0
        codes = sorted(code for _, code, _ in ended)
        assert codes in ([0, 0], [0, 2], [0, 3], [2, 2]), ended  # of two that write, at most one continues
        for words, code, said in ended:
            assert "Traceback" not in said
            assert code == 0 or len(said.splitlines()) == 1 or words[0] in ("export", "report", "verify"), said
        assert verify_study(folder / "study").errors == (), ended
        effects = [words for words, code, _ in ended if code == 0]
        if any(words[0] == "unblind" for words in effects):  # an equal reveal is not recorded again
            (record,) = (folder / "study" / "blinding" / "reveals.jsonl").read_text("utf-8").splitlines()
            assert json.loads(record)["by"] == "AB"
        for words in effects:
            if words[0] == "withdraw":
                assert not list((folder / "study" / "data").glob(f"sub-{words[2]}*"))
            if words[0] == "exclude":
                kept = {exclusion.participant for exclusion in exclusions(folder / "study")}
                assert words[2] in kept or any(other[0] == "withdraw" for other in effects)


def test_of_two_programs_exactly_one_gets_each_id_and_both_have_the_same_key(tmp_path: Path) -> None:
    """Each round uses a new study: both programs compete for the key, then take free IDs and compare keys."""

    @contextmanager
    def begun(program: int, number: int) -> Iterator[str]:
        participant = f"P00{program + 2 if number % 2 else 1}"
        try:
            store = studies.begun(tmp_path / str(number // 2), participant, small.protocol(), b"small")
        except StoreError as error:
            yield f"refused: {error}"
        else:
            yield store.key.hash
            store.close()

    answers = race(begun, 40)
    for number, (raced, free) in enumerate(zip(answers[::2], answers[1::2], strict=True)):
        won, lost = sorted(raced, key=lambda answer: answer.startswith("refused"))
        assert re.match(r"refused: participant P001 already has session 1.*nothing was changed", lost), raced
        assert free == [won, won]
        study = StudyFolder(tmp_path / str(number))
        (line,) = raw(journal.read(study.session("P001", 1).journal))
        assert line["event"] == "session_started"
        table = study.participants("small").read_text(encoding="utf-8").splitlines()
        assert [row.split(",")[1] for row in table[1:]] == ["P001", "P002", "P003"]
        assert not list(study.path.rglob("*.tmp"))
        assert verify_study(study.path).errors == ()
