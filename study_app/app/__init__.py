"""The composition root, where device, servo, store, session, analysis and windows meet.

``main_controller`` owns the main window, ``lab_and_designer`` the two places that are loaded in the background;
``session.live_session`` runs one session from its request to the closed journal; ``session.entry`` begins or resumes
one by command.
"""

from study_app.gui.display.display_check import missing_library

try:
    from study_app.app.main_controller import home
    from study_app.app.session.entry import resume, run
    from study_app.app.session.live_session import BUG, CANCELLED, LiveSession
except ImportError as missing:
    raise missing_library(missing) from missing

__all__ = ["BUG", "CANCELLED", "LiveSession", "home", "resume", "run"]
