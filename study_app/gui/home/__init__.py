"""Home: the studies, the recorded sessions, and the start of the next one.

Reading order: main_window, startup_window, study_facts; cards, dialogs; view.
"""

from study_app.gui.home.dialogs import WorkspaceDialog
from study_app.gui.home.main_window import MainWindow, bug_sentence
from study_app.gui.home.study_facts import DraftWords, holds_liquids_alone, is_shipped, known_sources, time_text
from study_app.gui.home.view import HomePlace

__all__ = [
    "DraftWords",
    "HomePlace",
    "MainWindow",
    "WorkspaceDialog",
    "bug_sentence",
    "holds_liquids_alone",
    "is_shipped",
    "known_sources",
    "time_text",
]
