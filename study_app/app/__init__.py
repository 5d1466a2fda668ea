"""The composition root, where device, servo, store, session, analysis and windows meet.

``main_controller`` owns the main window and makes its places, two of which take long to load;
``session.live_session`` begins or resumes a session and runs it to the closed journal, ``session.bridge`` between its
two windows; read these first.

Reading order: awake, compilation, timing; failures; lab_controller, session; delay_session, main_controller.

Public modules: delay_session.
"""

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from study_app.gui.display_check import naming_missing_library


@contextmanager
def _without_collections() -> Iterator[None]:
    """Import without garbage collection, which takes a tenth of the start-up time and frees nothing."""
    before = gc.isenabled()
    gc.disable()
    try:
        yield
        gc.freeze()
    finally:
        if before:
            gc.enable()


with naming_missing_library(), _without_collections():
    from study_app.app.session.live_session import BUG, CANCELLED, LiveSession, resume, run


def __getattr__(name: str) -> Any:
    """Load the main window on first access, since sessions started by a command do not need it."""
    if name != "run_home_window":
        raise AttributeError(name)
    with naming_missing_library(), _without_collections():
        from study_app.app.main_controller import run_home_window  # noqa: PLC0415
    return run_home_window


__all__ = ["BUG", "CANCELLED", "LiveSession", "resume", "run", "run_home_window"]
