"""Data that leave the computer: markers in every setting and typed text are searched for in every shared file.

A session is attended in its windows; then the study is exported, reported, preregistered, sent to support, and so on.
"""

import logging
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from study_app.cli import commands
from study_app.gui.operator.window import OperatorWindow
from study_app.gui.participant.window import ParticipantWindow
from study_app.program_log import log_file, start_log
from study_app.session.pages import EndPage, QuestionnairePage, TaskPage
from study_app.store import workstation
from study_app.store.exclusions import exclude, include
from study_app.store.files.folders import StudyFolder
from study_app.store.sessions.open_session import SessionStore
from study_app.store.support import write_support_archive
from study_app.store.unblinding import unblind
from study_app.store.verification.whole_study import verify_study
from study_app.store.withdrawals import Tombstone, add_tombstone
from study_app.store.workstation import MachineSettings
from tests.app.people import Person, run_attended, window
from tests.compiled import needs_servo
from tests.outlets.collector import Collector

pytest.importorskip("av", reason="the optional extra video is not installed")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.nightly,
    needs_servo,
    pytest.mark.usefixtures("qapp", "nobody_stays", "quick_preflight"),
]

SENDER = Path(__file__).parents[3] / "video" / "camera_process.py"
ANSWER = """
[questionnaires.last]
intro = "zq_intro"
[[questionnaires.last.items]]
id = "comment"
kind = "text"
required = false
text = "zq_question"
short = "zq_short"
"""
STUDY = {"zq_title", "zq_description", "zq_author", "zq_intro", "zq_question", "zq_short", "zq_page", "zq_instruction"}
SETTINGS = {f"zq_{name}" for name in MachineSettings.model_fields} | {"zq_user", "zq_password", "zq_path"}
TYPED = {f"zq_{name}" for name in ("person", "note", "answer", "why", "by", "again", "opened", "withdrawn", "preset")}
"""Needles of the study's texts, of this machine's settings, and of what people typed beside them."""
SHARED = {f"zq_{name}" for name in ("note", "answer", "why", "by", "opened", "title", "author", "question", "short")}
REPORTED = SHARED | {"zq_again", "zq_withdrawn"}
LEAVES = {
    "support": {"zq_screen", "zq_device", "zq_triggers"},
    "log": set[str](),
    "markers": set[str](),
    "receipt": STUDY | {"zq_person"},
    "export": SHARED,
    "psych-ds": REPORTED | STUDY,
    "report": REPORTED | {"zq_intro"},
    "preregistration": {"zq_title", "zq_page", "zq_question"},
    "list": set[str](),
}
"""What each kind of file that is passed on contains of them: reasons and notes of the operator go with the tables."""


class Talker(Person):
    """A person who answers and comments, with an operator who adds a note."""

    noted = False

    def look(self) -> None:
        participant, operator = window(ParticipantWindow), window(OperatorWindow)
        page = None if participant is None else participant.page
        if isinstance(page, TaskPage) and operator is not None and not self.noted:
            self.noted = True
            operator.ask("note", "zq_note")
        if isinstance(page, QuestionnairePage) and page.items[0].id == "comment" and page is not self.answered:
            self.answered = page
            QTest.keyClicks(participant.focusWidget(), "zq_answer")
            QTest.keyClick(participant.widget, Qt.Key.Key_Return)
        elif isinstance(page, EndPage) and operator is not None:
            QTest.mouseClick(operator.buttons.close_session, Qt.MouseButton.LeftButton)
        else:
            super().look()


@pytest.fixture
def camera() -> Iterator[int]:
    """Return the port of a camera that answers one program."""
    words = [sys.executable, str(SENDER), "--size", "64x48", "--seconds", "40"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as sender:
        assert sender.stdout is not None
        yield int(sender.stdout.readline())
        sender.kill()


def texts(path: Path) -> Iterator[bytes]:
    """Yield names and bytes of all files in a folder; archives and tables are opened."""
    for file in filter(Path.is_file, path.rglob("*")):
        yield file.name.encode() + file.read_bytes()
        if file.suffix == ".parquet":
            yield pd.read_parquet(file).to_csv().encode()
        elif zipfile.is_zipfile(file):
            with zipfile.ZipFile(file) as packed:
                yield from map(packed.read, packed.namelist())


def needles_in(path: Path) -> set[str]:
    held = list(texts(path))
    return {needle for needle in STUDY | SETTINGS | TYPED if any(needle.encode() in content for content in held)}


def test_typed_texts_appear_only_in_the_expected_outputs(
    short_demo: str,
    results: Path,
    tmp_path: Path,
    camera: int,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    text = Path(short_demo).read_text("utf-8")
    edits = (
        ('title = "A first look"', 'title = "zq_title"'),
        ('description = "', 'credits.authors = ["zq_author"]\ndescription = "zq_description '),
        ('"delays", "thanks"]', '"delays", "last", "thanks"]'),
        ('title = "The end"', 'title = "zq_page"'),
        ('[conditions.thick]\nliquid = "thick"\n', '[conditions.thick]\nliquid = "thin"\nview = "camera"\n'),
        ('instruction = "', 'instruction = "zq_instruction '),
    )
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new, 1)
    Path(short_demo).write_text(text + ANSWER, encoding="utf-8", newline="\n")
    place = str(tmp_path / "zq_{}" / "x.toml")
    settings = MachineSettings(
        camera=f"tcp://zq_user:zq_password@127.0.0.1:{camera}",
        operator="zq_operator",
        screen="zq_screen",
        firmware=place.format("firmware"),
        recent=(place.format("recent"), place.format("preset")),
        workspace=place.format("workspace"),
        stamp_root=place.format("stamp_root"),
    )
    workstation.save_settings(settings)
    start_log()
    collected, attach = Collector(), SessionStore.attach
    monkeypatch.setattr(SessionStore, "attach", lambda store, _outlets: attach(store, collected))
    code, lines = run_attended(short_demo, results, Talker(), operator="zq_person")
    assert code == 0, lines
    folder = StudyFolder(results)
    exclude(results, "P001", 1, trial=1, by="zq_by", reason="zq_why")
    include(results, "P001", 1, trial=1, by="zq_by", reason="zq_again")
    exclude(results, "P001", 1, trial=2, by="zq_by", reason="zq_why")
    add_tombstone(
        folder,
        Tombstone(participant="P009", at="2026-03-02T09:30:00+01:00", by="zq_by", reason="zq_withdrawn", sessions=()),
    )
    unblind(results, "zq_by", "zq_opened")
    logging.getLogger("study_app").error("failed: %s", "zq_note")
    caplog.clear()
    later = {"triggers": "serial:/dev/zq_triggers", "device": "falcon:zq_device"}
    settings = settings.model_copy(update={**later, "stamps": "https://zq_stamps", "proofs": place.format("proofs")})
    typed = {name for name, value in settings if isinstance(value, str) and name not in ("theme", "lsl_samples")}
    assert all("zq_" in getattr(settings, name) for name in typed), typed
    workstation.save_settings(settings)
    out = tmp_path / "out"
    for name in ("support", "log", "receipt", "list", "markers"):
        (out / name).mkdir(parents=True)
    write_support_archive(out / "support" / "support.zip")
    for words in (
        ("export", str(results), "--to", str(out / "export"), "--wide", "--parquet", "--psych-ds"),
        ("report", str(results), "--to", str(out / "report")),
        ("preregister", short_demo, "--to", str(out / "preregistration")),
    ):
        result = CliRunner().invoke(commands, words)
        assert result.exit_code in (0, 3), result.output
    (out / "export" / "psych-ds").rename(out / "psych-ds")
    for name, path in (("log", log_file()), ("receipt", folder.sessions()[0].receipt), ("list", folder.fingerprints)):
        shutil.copy(path, out / name)
    (out / "markers" / "markers.txt").write_text("\n".join(map(str, collected.markers)), encoding="utf-8", newline="\n")
    assert {path.name: needles_in(path) for path in out.iterdir()} == LEAVES
    assert verify_study(results).errors == ()
