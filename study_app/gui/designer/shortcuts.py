"""The shortcuts of the designer, made from the table of its keys."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtWidgets import QWidget

from study_app.viewmodels.designer.keys import keys_of


def make_shortcuts(place: QWidget, acts: Mapping[str, Callable[[], object]]) -> None:
    """Let the keys of actions act anywhere in the window while the place is shown."""
    for action, act in acts.items():
        for keys in keys_of(action):
            made = QShortcut(QKeySequence(keys), place)
            made.setContext(Qt.ShortcutContext.WindowShortcut)
            made.activated.connect(act)
