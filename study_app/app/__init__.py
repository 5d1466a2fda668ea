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
from importlib import import_module
from typing import TYPE_CHECKING, Any

from study_app.gui.display_check import report_missing_library


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


if TYPE_CHECKING:
    from study_app.app.main_controller import run_home_window
    from study_app.app.session.live_session import resume, run

_MODULES = {"run_home_window": "main_controller", "run": "session.live_session", "resume": "session.live_session"}


def __getattr__(name: str) -> Any:
    """Load the main window or the session on first access: neither needs the other to open."""
    if name not in _MODULES:
        raise AttributeError(name)
    with report_missing_library(), _without_collections():
        return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)


__all__ = ["resume", "run", "run_home_window"]
