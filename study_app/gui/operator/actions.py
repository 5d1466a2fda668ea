"""What the operator can do with the session: pause, repeat a trial for a reason, end; and the two questions."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QButtonGroup, QLineEdit, QSizePolicy, QWidget

from study_app.gui.theme.theme import Theme, font
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox
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
        self.exclude = ActionButton("flag", "Exclude …", key="X")
        self.end = ActionButton("cross", "End session …", role="danger")
        self.close_session = ActionButton("check", "Close session", role="primary")
        self._resumes = False
        self._signs = True
        row = hbox(self.pause, self.repeat, self.exclude, STRETCH, self.end, self.close_session, spacing=10)
        for button in (self.pause, self.repeat, self.exclude, self.end, self.close_session):
            button.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)  # its padding gives way
        self.close_session.hide()
        add_parts(self.column, row, self.hint)
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
        if view.over and self.close_session.isHidden():
            self.close_session.show()
            self.close_session.setFocus()
        self.hint.setText(_hint(view))

    def _pause_or_resume(self) -> None:
        (self.resume_asked if self._resumes else self.pause_asked).emit()


def _hint(view: OperatorView) -> str:
    if view.over and view.trouble:
        return ""
    if view.over:
        return "The journal is closed and the tables are written."
    if view.waits:
        return "The force is off. The answers are kept in memory until the disk accepts them."
    if view.state == "trouble":
        return "The force is off. All answers so far are on disk."
    if view.state == "force off":
        return "The force returns only when you turn it on again."
    if view.state == "paused":
        return "An interrupted trial starts again."
    return "You will be asked for a reason; both recordings are kept." if view.may_repeat else ""


class RepeatQuestion(Question):
    """Why the trial is to come again."""

    def __init__(self, parent: QWidget, theme: Theme, setting: str) -> None:
        super().__init__(
            parent,
            theme,
            "Repeat this trial?",
            f"{setting} starts again from the beginning. The first recording is kept, together with your reason.",
        )
        self.setting = setting
        self.reason = QLineEdit()
        self.reason.setFont(font("body"))
        self.reason.setPlaceholderText("Reason, for example: phone rang")
        self.reason.setAccessibleName("Reason")
        self.column.addWidget(self.reason)
        self.add_buttons("Cancel", ActionButton("repeat", "Repeat trial", role="primary"))
        self.go_on.setEnabled(False)
        self.reason.textChanged.connect(lambda text: self.go_on.setEnabled(bool(text.strip())))


class ExcludeQuestion(Question):
    """What to exclude from the analysis, and why; ``trial`` is the one under way or the last, None before the first."""

    def __init__(self, parent: QWidget, theme: Theme, trial: int | None, setting: str) -> None:
        super().__init__(
            parent,
            theme,
            "Exclude this from the analysis?",
            "Nothing is deleted. The list of exclusions records what was excluded, by whom and why.",
        )
        self.choices = QButtonGroup(self)
        self._trial = trial
        for index, words in enumerate((setting, "Whole session")):
            choice = Radio(words)
            choice.setFont(font("body"))
            choice.setVisible(index == 1 or trial is not None)
            self.choices.addButton(choice, index)
            self.column.addWidget(choice)
        self.choices.button(1 if trial is None else 0).setChecked(True)
        self.reason = QLineEdit()
        self.reason.setFont(font("body"))
        self.reason.setPlaceholderText("Reason, for example: talked during the trial")
        self.reason.setAccessibleName("Reason")
        self.column.addWidget(self.reason)
        self.add_buttons("Cancel", ActionButton("flag", "Exclude", role="primary"))
        self.go_on.setEnabled(False)
        self.reason.textChanged.connect(lambda text: self.go_on.setEnabled(bool(text.strip())))

    @property
    def trial(self) -> int | None:
        """Return the trial to leave out, None for the whole session."""
        return self._trial if self.choices.checkedId() == 0 else None


class EndQuestion(Question):
    """Whether, and why, the session ends now."""

    STATUSES = (("withdrawn", "The participant withdrew"), ("aborted", "Another reason"))

    def __init__(self, parent: QWidget, theme: Theme, answers: str) -> None:
        super().__init__(
            parent,
            theme,
            "End this session now?",
            f"{answers} answers are on disk and are kept. The force is turned off when the session ends.",
        )
        self.choices = QButtonGroup(self)
        for index, (_, words) in enumerate(self.STATUSES):
            choice = Radio(words)
            choice.setFont(font("body"))
            self.choices.addButton(choice, index)
            self.column.addWidget(choice)
        self.choices.button(1).setChecked(True)
        self.choices.button(1).setFocus()
        self.reason = QLineEdit()
        self.reason.setFont(font("body"))
        self.reason.setPlaceholderText("Reason (optional)")
        self.reason.setAccessibleName("Reason")
        self.column.addWidget(self.reason)
        self.add_buttons("Continue the session", ActionButton("cross", "End session", role="danger"))
        self.go_on.setDefault(False)
        self.back.setDefault(True)

    @property
    def status(self) -> str:
        """Return "withdrawn" or "aborted"."""
        return self.STATUSES[self.choices.checkedId()][0]
