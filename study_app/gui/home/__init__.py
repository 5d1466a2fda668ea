"""The first window: which studies there are, which sessions were held, and the way into the next."""

from study_app.gui.home.window import HomeWindow

__all__ = ["HomeWindow"]
