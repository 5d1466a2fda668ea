"""Missing trials: planned trials without an answer, because every presentation violated a limit.

`progress.Progress` finds them in a journal, for windows, commands, tables, the report and exports.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

MISSING_PERCENT: Final = "missing_percent"
"""The key in ``[limits]`` of the percentage of a session's trials that may be missing."""
REASONS: Final[Mapping[str, str]] = {
    "lateness_ms": "the servo was late",
    "worst_gap_ms": "the servo missed ticks",
    "delay_error_ms": "the visual delay deviated too much",
    "frame_gap_ms": "frames were late or missing",
    "withheld_percent": "the safety layer held back too much force",
    "targets_percent": "too few targets were reached",
    "level_error_percent": "the force was not as requested",
    "level_error_ms": "the delays did not differ as requested",
    "pace_error_percent": "the hand did not move at the required speed",
    "force_limit_n": "the force limit was reached",
}
"""The reason why a presentation is invalid, by the key of the violated limit."""
_UNITS: Final = {"percent": "%", "ms": "ms", "n": "N"}


@dataclass(frozen=True, slots=True, kw_only=True)
class MissingTrial:
    """A main trial without an answer; ``broken`` are the keys of the limits that its presentations violated."""

    trial: int
    block: str
    code: str
    broken: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class MissingTrials:
    """The missing trials of a session, out of the ``asked`` main trials of intervals that are over.

    ``limits`` are the study's, as recorded by the session. A session of an earlier program version did not record how
    many trials may be missing, and is never incomplete.
    """

    missing: tuple[MissingTrial, ...] = ()
    asked: int = 0
    limits: Mapping[str, float]

    @property
    def count(self) -> int:
        """The number of missing trials."""
        return len(self.missing)

    @property
    def exceed(self) -> bool:
        """Whether more trials are missing than the study permits."""
        permitted = self.limits.get(MISSING_PERCENT)
        return permitted is not None and 100 * self.count > permitted * self.asked

    @property
    def reasons(self) -> dict[str, int]:
        """The number of missing trials that violated each limit, by its key, the most frequent first."""
        return dict(Counter(limit for trial in self.missing for limit in trial.broken).most_common())

    @property
    def reason_texts(self) -> list[str]:
        """The violated limits as texts, the most frequent first."""
        return [limit_reason(limit, self.limits) for limit in self.reasons]

    @property
    def tracks(self) -> dict[tuple[str, str], int]:
        """The number of missing trials of each block and code, in the order of the trials."""
        return dict(Counter((trial.block, trial.code) for trial in self.missing))

    @property
    def brief(self) -> str:
        """The number of missing trials as a short text: "26 of 40 not delivered"; empty if none is missing."""
        return f"{self.count} of {self.asked} not delivered" if self.missing else ""

    def __str__(self) -> str:
        """Return number and reasons of the missing trials as a sentence without full stop; empty if there are none."""
        return _missing_sentence(self.count, self.asked, self.reasons, self.limits) if self.missing else ""


def _missing_sentence(count: int, asked: int, reasons: Mapping[str, int], limits: Mapping[str, float]) -> str:
    """Return "26 of 40 trials were not delivered: the safety layer held back too much force (limit 25 %)".

    Parameters
    ----------
    count, asked : int
        Numbers of missing trials and of all trials.
    reasons : mapping of str to int
        The number of missing trials that violated each limit, by its key.
    limits : mapping of str to float
        The limits of the study, by their keys.
    """
    phrases = (
        f"{limit_reason(limit, limits)}{f' in {of_limit}' if len(reasons) > 1 else ''}"
        for limit, of_limit in reasons.items()
    )
    was = "trial was" if asked == 1 else "trials was" if count == 1 else "trials were"
    return f"{count} of {asked} {was} not delivered: {', '.join(phrases)}"


def limit_reason(limit: str, limits: Mapping[str, float]) -> str:
    """Return the reason for which a presentation was invalid, with the limit: "frames were late (limit 250 ms)"."""
    reason = REASONS.get(limit, limit)
    unit = _UNITS.get(limit.rpartition("_")[2], "")
    return f"{reason} (limit {limits[limit]:g} {unit})" if limit in limits else reason
