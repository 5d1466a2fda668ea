"""Before a session: what was found, and whether to begin."""

from study_app.gui.preflight.window import PreflightWindow

__all__ = ["PreflightWindow"]
