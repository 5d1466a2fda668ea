"""People who attend a session by keys and clicks, the windows they look at, and what the session wrote."""

import csv
import json
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PySide6.QtCore import QObject, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from study_app import app
from study_app.gui.home.main_window import MainWindow
from study_app.gui.operator.window import OperatorWindow
from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.load import parse
from study_app.protocol.source.files import source_bytes
from study_app.session.pages import EndPage, PausePage, QuestionnairePage, TaskPage, TextPage, TroublePage
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.recovery import check_resumable


def window(kind):
    """Return the window of that kind that is shown, or None."""
    own = [widget for widget in QApplication.topLevelWidgets() if widget.graphicsProxyWidget() is None]
    visible = [widget for widget in own if isinstance(widget, kind) and widget.isVisible()]
    return visible[0] if visible else None


def place_at_home():
    """Return the main window's home, or None while the window is away."""
    main_window = window(MainWindow)
    return None if main_window is None else main_window.place("home")


class Person(QObject):
    """Does what participant and operator do, with keys and clicks: looks at the windows every 20 ms."""

    def __init__(self, once=None):
        super().__init__()
        self.once = once
        self.answered = None
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.look)
        self._timer.start(20)

    def look(self):
        participant, operator = window(ParticipantWindow), window(OperatorWindow)
        if participant is None or participant.page is None or operator is None:
            return  # on a busy computer one opens, or closes, before the other
        if self.once is not None:
            act, self.once = self.once, None
            act(participant)
            return
        page = participant.page
        if isinstance(page, TextPage):
            QTest.keyClick(participant.widget, Qt.Key.Key_Return)
        elif isinstance(page, QuestionnairePage) and page is not self.answered:
            self.answered = page
            for number in range(len(page.items)):
                QTest.keyClick(participant.focusWidget(), Qt.Key(Qt.Key.Key_1 + number))
            QTest.keyClick(participant.focusWidget(), Qt.Key.Key_Return)
        elif isinstance(page, PausePage):  # the machine stood still
            QTest.keyClick(participant.widget, Qt.Key.Key_Return)
        elif isinstance(page, TroublePage):
            operator.ask("end", "aborted", "cable")
        elif isinstance(page, EndPage):
            QTest.mouseClick(operator.buttons.close_session, Qt.MouseButton.LeftButton)


def run_attended(study, results, person=None, **options):
    """Run P001's session in its windows, attended by a person; return the exit code and what is printed."""
    person, lines = person or Person(), []
    defaults = {"participant": "P001", "seed": 5, "device": "scripted", "windowed": True, "operator": "AK"}
    try:
        return app.run(str(study), **(defaults | {"results": results, "progress": lines.append} | options)), lines
    finally:
        person.deleteLater()


@contextmanager
def poll_windows(look) -> Iterator[None]:
    """Call ``look`` every 20 ms."""
    timer = QTimer(interval=20)
    timer.timeout.connect(look)
    timer.start()
    yield
    timer.stop()


def can_go_on(study: str, results: Path) -> bool:
    """Return whether P001's session has no end and is not refused by resume."""
    source = source_bytes(study)
    check_resumable(results / "data" / "sub-P001" / "ses-01", parse(source, study), source)
    return "session_ended" not in [line["event"] for line in events(results)]


def events(results: Path):
    journal = results / "data" / "sub-P001" / "ses-01" / "journal.jsonl"
    return [json.loads(line) for line in journal.read_text("utf-8").splitlines()]


def rows(results: Path, name: str):
    (path,) = (results / "data" / "sub-P001" / "ses-01").glob(f"*description-{name}_data.csv")
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def receipt_of(results: Path):
    return json.loads((results / "data" / "sub-P001" / "ses-01" / "receipt.json").read_text("utf-8"))


class Leaver(Person):
    """A person who attends until the second trial, when the program disappears and writes nothing more."""

    def __init__(self, monkeypatch):
        super().__init__()
        self._monkeypatch = monkeypatch

    def look(self):
        participant = window(ParticipantWindow)
        if participant is not None and isinstance(participant.page, TaskPage) and participant.page.trial == 2:
            with self._monkeypatch.context() as patched:
                patched.setattr(SessionStore, "finish", lambda *_arguments, **_named: None)
                signal.raise_signal(signal.SIGTERM)
                QTest.qWait(300)
        else:
            super().look()
