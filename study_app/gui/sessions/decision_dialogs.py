"""Decisions about a study, each with a name and a reason: leaving a session or a trial out, opening the sealed key."""

from collections.abc import Mapping, Sequence

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QLineEdit, QWidget

from study_app.gui.theme.theme import Theme, font
from study_app.gui.widgets.boxes import add_layout, hbox, insert_layout
from study_app.gui.widgets.cards import Icon
from study_app.gui.widgets.controls import ActionButton, Choice
from study_app.gui.widgets.dialogs import Question
from study_app.gui.widgets.labels import label, set_ink
from study_app.viewmodels.sessions import SessionFacts

WIDTH = 560


class Decision(Question):
    """A question that wants a name and a reason before it goes on."""

    def __init__(self, parent: QWidget, theme: Theme, title: str, explanation: str) -> None:
        super().__init__(parent, theme, title, explanation)
        self.setModal(True)
        self.setMinimumWidth(WIDTH)
        self.form = QGridLayout()
        self.form.setHorizontalSpacing(16)
        self.form.setVerticalSpacing(10)
        self.form.setColumnStretch(1, 1)
        add_layout(self.column, self.form)
        self.by = _line("Your name or initials, such as AK")
        self.reason = _line("")
        self.missing = label("", "label", "bad", wraps=True)
        self.missing.hide()

    def add_field(self, name: str, field: QWidget) -> None:
        """Put a field under those before, with its name at its left."""
        said = label(name, "label", "text2")
        field.setAccessibleName(name)
        field.setFont(font("body"))
        row = self.form.rowCount()
        self.form.addWidget(said, row, 0, Qt.AlignmentFlag.AlignVCenter)
        self.form.addWidget(field, row, 1)

    def finish(self, by: str, reason: str, go_on: ActionButton) -> None:
        """Put name, reason and the buttons below everything else."""
        self.add_field(by, self.by)
        self.add_field(reason, self.reason)
        self.column.addWidget(self.missing)
        self.add_buttons("Cancel", go_on)

    def accept(self) -> None:
        """Go on, or say what is missing and lead there."""
        for field, what in ((self.by, "a name"), (self.reason, "a reason")):
            if not field.text().strip():
                self.missing.setText(f"Please enter {what}; it is recorded.")
                self.missing.show()
                field.setFocus()
                return
        super().accept()


class UnblindDialog(Decision):
    """Asks who opens the key and why, and says what it means."""

    def __init__(self, parent: QWidget, theme: Theme, study: str, *, running: int) -> None:
        super().__init__(
            parent,
            theme,
            f"Unblind {study}?",
            "Everyone who opens this study will see which setting was which, here and in every table, figure and "
            "report. This cannot be undone. Your name, the reason and the time are stored with the data.",
        )
        if running:
            many = "1 session is" if running == 1 else f"{running} sessions are"
            row = hbox((Icon("warning", "warn", 20), 0, Qt.AlignmentFlag.AlignTop), spacing=10)
            warns = label(
                f"{many} not complete. Operators of the remaining sessions will no longer be blind.",
                "label",
                "warn",
                wraps=True,
            )
            row.addWidget(warns, 1)
            insert_layout(self.column, 2, row)
        self.reason.setPlaceholderText("For example: collection closed")
        self.finish("Name", "Reason", ActionButton("eye", "Unblind", role="danger"))
        self.by.setFocus()


class LeaveOutDialog(Decision):
    """Asks which session, or which trial of it, by whom and why.

    Parameters
    ----------
    sessions
        Those that are not left out yet.
    trials
        Of each session (participant, number) the main trials and the words for them.
    chosen
        The session to begin with.
    """

    def __init__(
        self,
        parent: QWidget,
        theme: Theme,
        sessions: Sequence[SessionFacts],
        trials: Mapping[tuple[str, int], tuple[tuple[int, str], ...]],
        chosen: SessionFacts | None,
    ) -> None:
        super().__init__(
            parent,
            theme,
            "Exclude from the analysis",
            "It no longer counts in measures, figures and tests. Nothing is deleted: exclusions.csv and every "
            "report state what was excluded, by whom and why.",
        )
        self._trials = trials
        self.session = Choice()
        self.trial = Choice()
        for facts in sessions:
            self.session.addItem(facts.name, (facts.participant, facts.session))
            if chosen is not None and facts.folder == chosen.folder:
                self.session.setCurrentIndex(self.session.count() - 1)
        self.session.currentIndexChanged.connect(self._show_trials)
        self.add_field("Session", self.session)
        self.add_field("Scope", self.trial)
        self.by.setPlaceholderText("Your initials, or the rule's name")
        self.reason.setPlaceholderText("For example: fell asleep")
        self._show_trials()
        self.finish("By", "Reason", ActionButton("minus", "Exclude", role="primary"))
        set_ink(self.missing, "bad")
        self.session.setFocus()

    @property
    def chosen(self) -> tuple[str, int, int | None]:
        """Participant, session and trial; None for the whole session."""
        participant, session = self.session.currentData()
        return participant, session, self.trial.currentData()

    def _show_trials(self) -> None:
        self.trial.clear()
        self.trial.addItem("Whole session", None)
        for number, words in self._trials.get(tuple(self.session.currentData() or ("", 0)), ()):
            self.trial.addItem(f"Trial {number}: {words}", number)


class TakeBackDialog(Decision):
    """Asks who takes an exclusion back and why."""

    def __init__(self, parent: QWidget, theme: Theme, what: str, reason: str) -> None:
        super().__init__(
            parent,
            theme,
            f"Include again: {what}",
            f"It was excluded for this reason: “{reason}”. It will count again in measures, figures and tests. Your "
            "name, the reason and the time are stored in exclusions_reversed.jsonl.",
        )
        self.reason.setPlaceholderText("For example: wrong participant")
        self.finish("By", "Reason", ActionButton("undo", "Include again", role="primary"))
        self.by.setFocus()


def _line(placeholder: str) -> QLineEdit:
    made = QLineEdit()
    made.setPlaceholderText(placeholder)
    return made
