"""Home: which studies there are, which sessions were held, and the way into the next."""

from study_app.gui.home.place import HomePlace

__all__ = ["HomePlace"]
