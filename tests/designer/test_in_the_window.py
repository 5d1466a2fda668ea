"""The designer in its window: by keys alone, by mouse alone, with names for everything, and killed while typing."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtWidgets import QApplication

from study_app.store.versions.drafts import draft_of
from tests.designer.support.inputs import QtInput
from tests.designer.support.made_studies import STUDIES, check_file, save
from tests.designer.support.users import USERS

pytestmark = pytest.mark.slow

KILLS = int(os.environ.get("LIQUID_STUDY_DRAFT_KILLS", "2"))


@pytest.mark.parametrize(
    ("kind", "study"),
    [
        ("keys", "twoliquids"),
        ("mouse", "whichwaslate"),
        pytest.param("keys", "whichwaslate", marks=pytest.mark.nightly),
        pytest.param("mouse", "twoliquids", marks=pytest.mark.nightly),
    ],
)
def test_a_study_is_made_from_the_empty_one_by_names_and_saved(designer: Any, kind: str, study: str) -> None:
    user = USERS[kind](designer.window, QtInput())
    STUDIES[study](user)
    file = designer.file.with_name(f"{study}.toml")
    save(user, file)
    assert user.actions < 600
    check_file(file, study)
    assert file.read_text("utf-8") == designer.text


SCRIPT = """
import sys, time
from pathlib import Path
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from study_app.designer.controller import DesignerController
from study_app.gui.application import application_here

application = application_here()
designer = DesignerController(Path(sys.argv[1]))
designer.place.resize(1400, 900)
designer.place.show()
designer.open("kitchen")
designer.editing.select(("study",))
line = next(row for row in designer.place.form.rows if row.row.path[-1] == "version").field.line
line.setFocus()
line.selectAll()
for letters in range(1, 100000):
    QTest.keyClick(line, Qt.Key.Key_1)
    print(letters, time.time(), flush=True)
    QTest.qWait(30)
"""


@pytest.mark.nightly
@pytest.mark.timeout(180 + 30 * KILLS)
@pytest.mark.skipif(os.name != "posix", reason="SIGKILL")
def test_a_kill_while_typing_loses_at_most_the_last_second(designer: Any, tmp_path: Path) -> None:
    before = designer.file.read_bytes()
    for number in range(KILLS):
        typed: dict[int, float] = {}
        command = [sys.executable, "-c", SCRIPT, str(tmp_path / "results")]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
            assert process.stdout is not None
            until = None
            for line in process.stdout:
                letters, moment = line.split()
                typed[int(letters)] = float(moment)
                until = until or time.time() + 1.6 + 0.17 * number % 1.0
                if time.time() > until:
                    break
            killed = time.time()
            process.send_signal(signal.SIGKILL)
        draft = draft_of(designer.file)
        assert draft is not None
        kept = next(line for line in draft.text.splitlines() if line.startswith("version")).split('"')[1]
        assert set(kept) == {"1"}
        lost = [moment for letters, moment in typed.items() if letters > len(kept)]  # the draft may be ahead of `typed`
        assert not lost or killed - lost[0] < 1.0
        assert designer.file.read_bytes() == before


def test_a_pressed_segment_stays_chosen_and_shows_its_page(designer: Any) -> None:
    designer.open("kitchen", "blocks", "liquids")
    place, preview = designer.place, designer.controller.preview
    shows = {
        "Fit": lambda: preview.page.scale_now < 1,
        "100 %": lambda: preview.page.scale_now == 1,
        "Form": lambda: place.form.isVisible() and not place.pane.isVisible(),
        "Views": lambda: place.pane.isVisible() and not place.form.isVisible(),
    }
    for segments in (place.pane.tabs, preview.zoom, preview.moments, place.sides):
        if segments is place.sides:
            designer.window.resize(1024, 640)
        for button in (*segments.buttons[1:], segments.buttons[0]):
            text = button.text()
            button.click()
            QApplication.processEvents()
            assert [other.text() for other in segments.buttons if other.isChecked()] == [text]
            assert text not in shows or shows.pop(text)(), text
    assert not shows
