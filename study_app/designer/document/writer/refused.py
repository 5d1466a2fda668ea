"""Why an edit is not made."""

from study_app.errors import StudyError


class Refused(StudyError):
    """The study cannot be changed in this way; its message says why, and nothing was changed.

    ``free`` is a name that would be taken in place of the one that is refused, "" where it is about something else.
    """

    def __init__(self, message: str, free: str = "") -> None:
        super().__init__(message)
        self.free = free


def free_in(error: StudyError) -> str:
    """Return the name that a refusal proposes, "" where it proposes none."""
    return error.free if isinstance(error, Refused) else ""
