"""Why an edit is not made."""

from __future__ import annotations

from study_app.errors import StudyError


class Refused(StudyError):
    """The study cannot be changed in this way; its message says why, and nothing was changed."""
