"""The main window's stay: its places, one session at a time, and home again after it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QEventLoop, QObject

from study_app.app.live_session import BUG, LiveSession
from study_app.gui.application import application_here
from study_app.gui.choices import NewSession
from study_app.gui.collector import collecting_here
from study_app.gui.ending import ended_from_outside
from study_app.gui.home import HomePlace
from study_app.gui.main_window import MainWindow

if TYPE_CHECKING:
    from study_app.app.results import ResultsDesk
    from study_app.gui.results.place import ResultsPlace


def home(results: Path | None = None) -> int:
    """Open the home window on the results folder (default ``results``); return the exit code when it is closed.

    Raises
    ------
    DisplayError
        A window cannot be opened here.
    """
    application = application_here()
    visit = Visit(results if results is not None else Path("results"))
    with collecting_here(), ended_from_outside(visit.end_by_signal):
        visit.window.show()
        visit.loop.exec()
    application.processEvents()
    return visit.code


class Visit(QObject):
    """The home window's stay: one session at a time, and home again after it."""

    def __init__(self, results: Path) -> None:
        super().__init__()
        self.results = results
        self.window = MainWindow({"home": self._home, "results": self._results})
        self.loop = QEventLoop()
        self.code = 0
        self.live: LiveSession | None = None
        self.desk: ResultsDesk | None = None
        self.window.closed.connect(self._leave)

    def _home(self) -> HomePlace:
        made = HomePlace(self.results)
        made.session_asked.connect(self._start)
        return made

    def _results(self) -> ResultsPlace:
        from study_app.app.results import ResultsDesk  # noqa: PLC0415 - only once it is needed

        self.desk = ResultsDesk(self.results)
        return self.desk.place

    def end_by_signal(self, number: int) -> None:
        """End because the program is being ended from outside."""
        self.code = 128 + number
        if self.live is not None:
            self.live.end_by_signal(number)
        self.window.close()
        self.loop.quit()

    def _start(self, chosen: NewSession) -> None:
        self.live = LiveSession(chosen, self.window.theme, asks=True)
        self.live.over.connect(self._return)
        self.window.rest()
        self.live.open()

    def _return(self) -> None:
        live, self.live = self.live, None
        if self.code or live is None:
            return
        self.window.come_back()
        if live.error is not None:
            self.window.tell("The session did not go to its end", f"{live.error}.")
        elif live.code == BUG:
            self.window.tell("The session was stopped by a mistake in the program", "The terminal shows where.")

    def _leave(self) -> None:
        if self.live is None:
            self.loop.quit()
