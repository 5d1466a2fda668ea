"""A session with forms in the participant's window, by keys alone: every event is one that the state machine takes."""

from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from study_app.gui.participant.forms.question_form import FormWidget
from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import build_schedule, draw_key, stream
from study_app.protocol.wording.languages import words
from study_app.session.transitions.commands import ShowPage, Write
from study_app.session.transitions.events import Begin, TaskDone
from study_app.session.transitions.state import Phase
from study_app.session.transitions.table import advance, open_session
from tests.gui.small import ManualClock
from tests.protocol.forms.mixed import mixed_file

ENTERED = {"number": "33", "text": "Fine."}
KEYS = {"choice": (Qt.Key.Key_1,), "rating": (Qt.Key.Key_2,), "slider": (Qt.Key.Key_Home, Qt.Key.Key_Right)}


class Session:
    """The state machine and the window, each telling the other."""

    def __init__(self, study: Any, window: ParticipantWindow) -> None:
        self.window = window
        self.written: list[Write] = []
        key = draw_key(study, stream(1, "key").random)
        self.state = open_session(study, build_schedule(study, "P001", 1), key, "en")
        window.event.connect(self.post)

    def post(self, event: Any) -> None:
        self.state, commands = advance(self.state, event)
        for command in commands:
            if isinstance(command, Write):
                self.written.append(command)
            if isinstance(command, ShowPage) and self.state.phase is not Phase.TASK:
                self.window.show_page(command.page)


@pytest.mark.slow
def test_session_with_forms_is_done_by_keys_alone(tmp_path: Path, qtbot: Any) -> None:
    study = load(mixed_file(tmp_path))
    window = ParticipantWindow(words("en"), clock=ManualClock(), windowed=True)
    qtbot.addWidget(window)
    window.resize(1366, 768)
    window.show()
    window.activateWindow()
    qtbot.waitExposed(window)
    session = Session(study, window)
    session.post(Begin(0.0))
    for _ in range(200):
        QApplication.processEvents()
        if session.state.phase is Phase.COMPLETE:
            break
        if session.state.phase is Phase.TASK:
            session.post(TaskDone(1.0, "complete", {}))
            continue
        assert isinstance(window.widget, FormWidget)
        page, focused = window.widget, QApplication.focusWidget()
        assert focused is not None
        field = next((one for one in page.part if one is focused or one.isAncestorOf(focused)), None)
        if field is None:
            QTest.keyClick(focused, Qt.Key.Key_Return)
            continue
        QTest.keyClicks(focused, ENTERED.get(field.view.widget, ""))
        for key in KEYS.get(field.view.widget, ()):
            QTest.keyClick(focused, key)
        if QApplication.focusWidget() is focused:
            QTest.keyClick(focused, Qt.Key.Key_Down)
    assert session.state.phase is Phase.COMPLETE
    answered = [
        row for one in session.written if one.event in ("form_answered", "responses") for row in one.fields["items"]
    ]
    assert len(answered) == 3 + 2 * 3 + 6 + 10 + 1
    assert all(row["onset_s"] is not None and row["first_s"] is not None for row in answered)
    values = {row["item"]: row["value"] for row in answered}
    assert (values["age"], values["hand"], values["used"]) == (33, "left", ("mouse",))
    assert (values["thickness"], values["pleasant"], values["effort"], values["sus10"]) == (2, 5, 5, 2)
    window.may_close = True
    window.close()
