"""Pre-flight: the checks before a session, and whether to begin."""

from study_app.gui.preflight.window import PreflightWindow

__all__ = ["PreflightWindow"]
