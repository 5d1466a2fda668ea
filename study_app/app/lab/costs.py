"""What the felt setting costs and how true it is, as far as it was answered."""

import logging
from collections.abc import Callable

from study_app.evidence.appraisal import Costs, Errors
from study_app.evidence.appraisal_worker import AppraisalClient, Question
from study_app.haptics.model.scene import Scene

log = logging.getLogger(__name__)


class Prices:
    """What the felt setting costs and how true it is, as far as it was answered."""

    def __init__(self, make_appraiser: Callable[[], AppraisalClient]) -> None:
        self._make = make_appraiser
        self._appraiser: AppraisalClient | None = None
        self._asked = 0
        self.costs: Costs | None = None
        self.errors: Errors | None = None
        self.waits = False

    def forget(self) -> None:
        """Know nothing of a setting that was changed."""
        self._asked, self.costs, self.errors, self.waits = -1, None, None, False

    def ask(self, scene: Scene) -> None:
        """Ask about a setting; the answers come to `take`."""
        self.forget()
        if self._appraiser is not None and not self._appraiser.works:
            self.close()
        if self._appraiser is None:
            try:
                self._appraiser = self._make()
            except OSError as error:  # no process to be had: the lab continues without costs
                log.info("the appraisal failed: %s", error)
                return
        self._asked, self.waits = self._appraiser.order(Question(scene)), True

    def take(self) -> None:
        """Take what was answered since."""
        for number, answer in () if self._appraiser is None else self._appraiser.answers():
            if number != self._asked:
                continue
            if isinstance(answer, Costs):
                self.costs = answer
            elif isinstance(answer, Errors):
                self.errors, self.waits = answer, False
            else:
                self.waits = False

    def close(self) -> None:
        """End the process."""
        appraiser, self._appraiser, self.waits = self._appraiser, None, False
        if appraiser is not None:
            appraiser.close()
