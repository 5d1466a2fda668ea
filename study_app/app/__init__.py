"""The composition root, which connects device, servo, store, session, analysis and windows.

Read first: ``main_controller`` owns the main window and creates its pages; ``session.live_session`` begins or resumes a
session and runs it until the journal is closed; ``session.bridge`` connects the session with its two windows.

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
def _collection_disabled() -> Iterator[None]:
    """Disable garbage collection during imports, where it takes a tenth of the start-up time and frees nothing."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
        gc.freeze()
    finally:
        if was_enabled:
            gc.enable()


if TYPE_CHECKING:
    from study_app.app.main_controller import run_home_window
    from study_app.app.session.live_session import resume, run

_MODULES = {"run_home_window": "main_controller", "run": "session.live_session", "resume": "session.live_session"}


def __getattr__(name: str) -> Any:
    """Import the main window or the session on first access, since neither needs the other."""
    if name not in _MODULES:
        raise AttributeError(name)
    with report_missing_library(), _collection_disabled():
        return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)


__all__ = ["resume", "run", "run_home_window"]
