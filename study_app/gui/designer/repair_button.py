"""The button that makes a repair, at a field and in the list of problems."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QFocusEvent, QMouseEvent

from study_app.gui.theme.theme import font
from study_app.gui.widgets.controls import ActionButton
from study_app.viewmodels.designer.problem_rows import ProblemRow


class RepairButton(ActionButton):
    """Makes a repair of ``problem``; ``by_keys`` says whether a key led to it, not a click."""

    def __init__(self, problem: ProblemRow, words: str, where: str) -> None:
        super().__init__("", words, height=32)
        self.problem = problem
        self.setProperty("dense", "true")
        self.setFont(font("label"))
        self.setAccessibleName(f"{words}: {where}")
        self.by_keys = False

    def focusInEvent(self, event: QFocusEvent) -> None:  # noqa: N802 - Qt's name
        """Note what led here."""
        super().focusInEvent(event)
        self.by_keys = event.reason() != Qt.FocusReason.MouseFocusReason

    def mousePressEvent(self, event: QMouseEvent) -> None:  # noqa: N802 - Qt's name
        """Note that a click leads here, also where a key did before."""
        self.by_keys = False
        super().mousePressEvent(event)
