"""The composition root, where device, servo, store, session, analysis and windows meet.

``main_controller`` owns the main window, ``lab_and_designer`` the two places that are loaded in the background;
``session.live_session`` runs one session from its request to the closed journal; ``session.entry`` begins or resumes
one by command.
"""

from typing import Any

from study_app.gui.display.display_check import qt_imported

with qt_imported():
    from study_app.app.session.entry import resume, run
    from study_app.app.session.live_session import BUG, CANCELLED, LiveSession


def __getattr__(name: str) -> Any:
    """Load the main window where it is asked for: a session by command begins without it."""
    if name != "home":
        raise AttributeError(name)
    with qt_imported():
        from study_app.app.main_controller import home  # noqa: PLC0415
    return home


__all__ = ["BUG", "CANCELLED", "LiveSession", "home", "resume", "run"]
