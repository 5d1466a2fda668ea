"""What the operator can do with the session: pause, repeat a trial for a reason, end; and the two questions."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QButtonGroup, QHBoxLayout, QLineEdit, QSizePolicy, QWidget

from study_app.gui.theme.theme import Theme, font
from study_app.gui.widgets.cards import Card
from study_app.gui.widgets.controls import ActionButton, Radio
from study_app.gui.widgets.dialogs import Question
from study_app.gui.widgets.labels import label
from study_app.viewmodels.operator import OperatorView


class Actions(Card):
    """The bar of buttons at the bottom."""

    pause_asked = Signal()
    resume_asked = Signal()
    repeat_asked = Signal()
    exclude_asked = Signal()
    end_asked = Signal()
    close_asked = Signal()

    def __init__(self) -> None:
        super().__init__(padding=14)
        self.pause = ActionButton("pause", "Pause", key="P")
        self.repeat = ActionButton("repeat", "Repeat trial …", key="R")
        self.hint = label("", "label", "text2", wraps=True)
        self.hint.setFont(font("label", weight=400))
        self.exclude = ActionButton("flag", "Leave out …", key="X")
        self.end = ActionButton("cross", "End session …", role="danger")
        self.close_session = ActionButton("check", "Close session", role="primary")
        self._resumes = False
        self._signs = True
        row = QHBoxLayout()
        row.setSpacing(10)
        row.addWidget(self.pause)
        row.addWidget(self.repeat)
        row.addWidget(self.exclude)
        row.addStretch()
        row.addWidget(self.end)
        row.addWidget(self.close_session)
        for button in (self.pause, self.repeat, self.exclude, self.end, self.close_session):
            button.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)  # its padding gives way
        self.close_session.hide()
        self.column.addLayout(row)
        self.column.addWidget(self.hint)
        self.pause.clicked.connect(self._pause_or_resume)
        self.repeat.clicked.connect(self.repeat_asked)
        self.exclude.clicked.connect(self.exclude_asked)
        self.end.clicked.connect(self.end_asked)
        self.close_session.clicked.connect(self.close_asked)

    def narrow(self, yes: bool) -> None:
        """Do without the buttons' signs where there is no room for them."""
        self._signs = not yes
        for button, sign in ((self.repeat, "repeat"), (self.exclude, "flag"), (self.end, "cross")):
            button.show_action("" if yes else sign, button.text())
        self._show_pause()

    def _show_pause(self) -> None:
        sign, words = ("play", "Resume") if self._resumes else ("pause", "Pause")
        self.pause.show_action(sign if self._signs else "", words)

    def show_view(self, view: OperatorView) -> None:
        """Offer what is possible now and say what it does."""
        self._resumes = view.may_resume
        self._show_pause()
        self.pause.setEnabled(view.may_pause or view.may_resume)
        self.repeat.setEnabled(view.may_repeat)
        for button in (self.pause, self.repeat, self.end):
            button.setVisible(not view.over)
        self.close_session.setVisible(view.over)
        self.hint.setText(_hint(view))

    def _pause_or_resume(self) -> None:
        (self.resume_asked if self._resumes else self.pause_asked).emit()


def _hint(view: OperatorView) -> str:
    if view.over and view.trouble:
        return ""
    if view.over:
        return "The journal is closed and the tables are written."
    if view.waits:
        return "The force is off. What was answered is kept until the disk takes it."
    if view.state == "trouble":
        return "The force is off. Everything answered before is on disk."
    if view.state == "force off":
        return "The force comes back only when you ask for it."
    if view.state == "paused":
        return "A trial that was under way starts again."
    return "Repeating asks for a reason and keeps both recordings." if view.may_repeat else ""


class RepeatQuestion(Question):
    """Why the trial is to come again."""

    def __init__(self, parent: QWidget, theme: Theme, setting: str) -> None:
        super().__init__(
            parent,
            theme,
            "Repeat this trial?",
            f"{setting} starts again from its beginning. What was recorded stays, with your reason beside it.",
        )
        self.setting = setting
        self.reason = QLineEdit()
        self.reason.setFont(font("body"))
        self.reason.setPlaceholderText("Reason, such as: phone rang")
        self.reason.setAccessibleName("Reason")
        self.column.addWidget(self.reason)
        self.add_buttons("Go on as it is", ActionButton("repeat", "Repeat trial", role="primary"))
        self.go_on.setEnabled(False)
        self.reason.textChanged.connect(lambda text: self.go_on.setEnabled(bool(text.strip())))


class ExcludeQuestion(Question):
    """What is left out of the analysis, and why; ``trial`` is the one under way or the last, None before the first."""

    def __init__(self, parent: QWidget, theme: Theme, trial: int | None, setting: str) -> None:
        super().__init__(
            parent,
            theme,
            "Leave this out of the analysis?",
            "Nothing is deleted: the list of exclusions says what does not count, by whom and why.",
        )
        self._choices = QButtonGroup(self)
        self._trial = trial
        for index, words in enumerate((setting, "The whole session")):
            choice = Radio(words)
            choice.setFont(font("body"))
            choice.setVisible(index == 1 or trial is not None)
            self._choices.addButton(choice, index)
            self.column.addWidget(choice)
        self._choices.button(1 if trial is None else 0).setChecked(True)
        self.reason = QLineEdit()
        self.reason.setFont(font("body"))
        self.reason.setPlaceholderText("Reason, such as: talked during the trial")
        self.reason.setAccessibleName("Reason")
        self.column.addWidget(self.reason)
        self.add_buttons("Let it count", ActionButton("flag", "Leave out", role="primary"))
        self.go_on.setEnabled(False)
        self.reason.textChanged.connect(lambda text: self.go_on.setEnabled(bool(text.strip())))

    @property
    def trial(self) -> int | None:
        """Return the trial to leave out, None for the whole session."""
        return self._trial if self._choices.checkedId() == 0 else None


class EndQuestion(Question):
    """Whether, and why, the session ends now."""

    STATUSES = (
        ("withdrawn", "The participant withdraws"),
        ("aborted", "I end it for another reason"),
    )

    def __init__(self, parent: QWidget, theme: Theme, answers: str) -> None:
        super().__init__(
            parent,
            theme,
            "End this session now?",
            f"{answers} answers are on disk and stay there. The force is switched off when the session ends.",
        )
        self._choices = QButtonGroup(self)
        for index, (_, words) in enumerate(self.STATUSES):
            choice = Radio(words)
            choice.setFont(font("body"))
            self._choices.addButton(choice, index)
            self.column.addWidget(choice)
        self._choices.button(1).setChecked(True)
        self.reason = QLineEdit()
        self.reason.setFont(font("body"))
        self.reason.setPlaceholderText("Reason (may stay empty)")
        self.reason.setAccessibleName("Reason")
        self.column.addWidget(self.reason)
        self.add_buttons("Go on with the session", ActionButton("cross", "End session", role="danger"))
        self.go_on.setDefault(False)
        self.back.setDefault(True)

    @property
    def status(self) -> str:
        """Return "withdrawn" or "aborted"."""
        return self.STATUSES[self._choices.checkedId()][0]
