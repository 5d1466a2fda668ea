"""Modules that are loaded in a thread while the home window is shown, so that no click waits for them."""

from __future__ import annotations

import gc
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from study_app.app.lab.initial_settings import InitialSettings


def preload_lab_and_designer() -> InitialSettings:
    """Load the modules of lab and designer, and return the lab's initial settings."""
    import study_app.app.lab.controller  # noqa: PLC0415 - loads pyqtgraph here, not in the window's thread
    import study_app.lab.live  # noqa: PLC0415 - and the compiler
    from study_app.app.lab.initial_settings import prepare_initial_settings  # noqa: PLC0415

    first = prepare_initial_settings()
    import study_app.app.designer.controller  # noqa: F401, PLC0415
    from study_app.protocol.source.json_schema import schema  # noqa: PLC0415

    schema()  # forms are made from it
    gc.freeze()  # the windows' thread need not look through all that was loaded here
    return first
