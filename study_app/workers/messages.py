"""Answers of a worker process to any order, besides the values of its task."""

from dataclasses import dataclass

from study_app.errors import StudyError


@dataclass(frozen=True, slots=True)
class Refused:
    """An order could not be carried out, with the reason and without partial effects. ``stopped``: by request."""

    sentence: str
    stopped: bool = False


@dataclass(frozen=True, slots=True)
class Crashed:
    """The process ended before it had carried out the order.

    ``exit_code`` is negative where a signal ended it, 1 where the terminal shows an exception.
    """

    exit_code: int | None

    @property
    def sentence(self) -> str:
        """The description of the event for the user."""
        if self.exit_code is not None and self.exit_code < 0:
            return f"the process was ended by signal {-self.exit_code}"
        return f"the process ended with exit code {self.exit_code}; the terminal may show why"


class Stopped(StudyError):
    """An order stopped early, by request or because of another order."""
