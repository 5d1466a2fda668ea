"""What can wait is done between two frames of the participant's picture, never before one that is due.

The operator's plots take as long as a frame of a fast screen. Drawn by timers of their own they come between the moment
a frame is of and its painting; drawn here they wait for a frame to be painted and for one after which there is room.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

MOST_PERIODS: Final = 4  # so long a work waits for room; then it is done without
MOST_SHARE: Final = 0.15  # of the time that a work may take: what takes longer is done less often
FORGETS: Final = 0.9  # what a work took at worst is forgotten by so much each time


@dataclass(slots=True)
class DeferredTask:
    """A recurring task; ``took_ns`` is its longest recent duration."""

    do: Callable[[], object]
    period_ns: int
    done_ns: int | None = None
    took_ns: int = 0

    def waits_ns(self, now_ns: int) -> int:
        """Return how long it is overdue; negative where it is not due."""
        if self.done_ns is None:
            return self.period_ns
        return now_ns - self.done_ns - max(self.period_ns, round(self.took_ns / MOST_SHARE))


class FrameBudget:
    """Does works when they are due and there is room for them.

    Parameters
    ----------
    works : what is to be done and how often [s], the most urgent first
    """

    def __init__(
        self, works: Sequence[tuple[Callable[[], object], float]], now_ns: Callable[[], int] = time.perf_counter_ns
    ) -> None:
        self.tasks = [DeferredTask(do, round(period_s * 1e9)) for do, period_s in works]
        self._now_ns = now_ns

    def use(self, until_ns: int) -> None:
        """Do what is due and will be done by ``until_ns``; of what has waited too long for that, one thing."""
        hurried = False
        for work in self.tasks:
            now_ns = self._now_ns()
            waited_ns = work.waits_ns(now_ns)
            if waited_ns < 0:
                continue
            if now_ns + work.took_ns > until_ns:
                if hurried or waited_ns < MOST_PERIODS * work.period_ns:
                    continue
                hurried = True
            self._do(work, now_ns)

    def _do(self, work: DeferredTask, began_ns: int) -> None:
        work.done_ns = began_ns
        work.do()
        work.took_ns = max(self._now_ns() - began_ns, round(FORGETS * work.took_ns))
