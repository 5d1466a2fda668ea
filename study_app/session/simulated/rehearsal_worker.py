"""The worker process in which a window rehearses a protocol."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeAlias

from study_app.workers.client import WorkerClient
from study_app.workers.server import Send, Stop

TASK: Final = "study_app.session.simulated.rehearsal_worker:carry_out"


@dataclass(frozen=True, slots=True)
class RehearsalOrder:
    """A protocol by its file or name, the number of participants, the seed and the study folder of a rehearsal."""

    protocol: str
    participants: int
    seed: int
    results: Path


RehearsalClient: TypeAlias = WorkerClient[RehearsalOrder, float | str | Path]
"""The client, which receives the fraction of compiled functions, a line per participant, then the study folder."""


def carry_out(order: RehearsalOrder, send: Send, _stop: Stop) -> Path:
    """Rehearse, and return the study folder (see `study_app.session.simulated.rehearsal.rehearse`)."""
    from study_app.haptics.kernels import following_compilation  # noqa: PLC0415 - only in that process
    from study_app.session.simulated.rehearsal import rehearse  # noqa: PLC0415 - the compiler, too

    with following_compilation(send):
        return rehearse(
            order.protocol, participants=order.participants, seed=order.seed, results=order.results, progress=send
        )
