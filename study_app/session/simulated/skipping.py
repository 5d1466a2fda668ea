"""A session that begins at a later step: a simulated participant answers what comes before, and it is resumed there.

The levels of an adaptive track follow from the simulated answers. The participant senses varied numbers as they were
requested and feels nothing else, so that no force is computed. The journal notes which steps were simulated, and the
session counts as simulated.
"""

from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, Final

from study_app.errors import SessionError
from study_app.protocol.model import Protocol
from study_app.protocol.simulated_observer import NO_FEATURES
from study_app.session.simulated.answers_only import Answering, SimulatedTime
from study_app.session.simulated.preview import preview
from study_app.session.transitions.table import open_session
from study_app.store.journals.journal import SessionClock
from study_app.store.sessions.begin import SessionStart, begin

BEGINS: Final = frozenset({"page_shown", "form_shown", "trial_started"})
"""The lines that begin a step."""


def begin_at(results: Path, study: Protocol, source: bytes, start: SessionStart, step: int) -> Path:
    """Begin a simulated session in a new study folder, answer the steps before ``step``; return the session's folder.

    The session is unfinished; resumed exactly, it goes on at ``step``, or at the next one that is not passed over.

    Parameters
    ----------
    results : Path
        The study folder, without sessions.
    study : Protocol
        The study.
    source : bytes
        Its source.
    start : SessionStart
        What the session begins with.
    step : int
        The index of the step in the schedule of `preview.preview` with the same seed and participant.

    Raises
    ------
    SessionError
        The simulated participant does not reach that step.
    StoreError
        The folder cannot be written.
    """
    shown = preview(study, start.seed, start.participant)
    state = open_session(shown.protocol, shown.schedule, shown.codes, start.language, secret=shown.secret)
    lines, passed = _Lines(), SimulatedTime()
    answering = Answering(study, state, lines, passed, lambda _block, _condition: (NO_FEATURES,))
    lines.session = answering
    lines.until = step
    answering.run(until=step)
    if step and answering.state.index < step:
        raise SessionError(f"step {step + 1} is not reached: {lines.reason or 'the session ends before it'}")
    clock = SessionClock(lambda: 0, datetime.now().astimezone() - timedelta(seconds=passed.seconds))
    with begin(results, study, source, start, clock=clock) as store:
        if store.key.codes != shown.codes:
            raise SessionError(f"{results} holds sessions with another seed: use a new folder")
        if step:
            text = f"Steps 1 to {step} were answered by a simulated participant, without force."
            store.append("note", t_s=0.0, waits=False, kind="note", text=text)
        for event, at_s, fields in lines.kept:
            store.append(event, t_s=at_s, waits=False, **fields)
        return store.folder.path


@dataclass
class _Lines:
    """The lines of the steps before one; what begins that one is left to whoever resumes."""

    kept: list[tuple[str, float, dict[str, Any]]] = field(default_factory=list)
    reason: str = ""
    session: Answering | None = None
    until: int = 0
    _begun: bool = False

    def append(self, event: str, *, t_s: float | None = None, **fields: Any) -> None:
        """Keep a line unless the step has begun."""
        assert self.session is not None  # noqa: S101 - set before the session runs
        self._begun = self._begun or (event in BEGINS and self.session.state.index >= self.until)
        if not self._begun:
            self.kept.append((event, t_s or 0.0, fields))

    def finish(self, _status: str, reason: str = "") -> None:
        """Keep why the session ended before the step."""
        self.reason = reason
