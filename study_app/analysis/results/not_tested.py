"""What was not tested, and why."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class NotTested:
    """What is not there, and why: while the key is sealed, or for good."""

    what: str
    why: str
