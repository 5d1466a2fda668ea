"""Parts of the lab for tests: a controlled appraiser and devices, and the sent force."""

import threading
from types import SimpleNamespace
from typing import Any

import numpy as np

from study_app.app.lab_controller import LabController
from study_app.evidence.appraisal import Costs, EffectCost, Errors, Question
from study_app.haptics.model.scene import Scene

OPENS_MS = 120_000  # the first time it compiles


SOON_MS = 20_000


PATIENCE: Any = SimpleNamespace(left_s=20.0)
"""How long a lab that ends waits for its threads."""


COSTS = Costs(160.0, 60.0, (EffectCost("drag", 10.0), EffectCost("history", None, "not used")))


ERRORS = Errors(wake=2e-15, force_n=1e-12, lag_s=0.0095, left_out=())


class Prices:
    """An appraiser that answers when a test says so."""

    def __init__(self) -> None:
        self.requests: list[Scene] = []
        self.pending_answers: list[tuple[int, Any]] = []
        self.works, self.closed = True, False

    def order(self, question: Question) -> int:
        self.requests.append(question.scene)
        return len(self.requests)

    def answers(self) -> list[tuple[int, Any]]:
        answers, self.pending_answers = self.pending_answers, []
        return answers

    def close(self) -> None:
        self.closed = True


class Stays:
    """A random source whose draws exchange nothing."""

    def random(self) -> float:
        return 0.9


def force_n(visit: LabController) -> float:
    """Return the size of the force that was sent last [N]."""
    assert visit.live is not None
    latest = visit.live.servo.telemetry.latest()
    return 0.0 if latest is None else float(np.linalg.norm(latest.device_force_n))


def held_n(live: Any) -> float:
    """Return the size of the force that the device holds [N]."""
    return float(np.linalg.norm(live.device.state.handle.force_n))


def is_let_go(live: Any) -> bool:
    return held_n(live) == 0.0 and not live.servo.loop.live


class SlowDevices:
    """A device source that waits for permission to open."""

    def __init__(self) -> None:
        self.open, self.closed, self.requests = 0, 0, []
        self.most = 0
        self.gate = threading.Event()

    def __call__(self, name: str, *, progress: Any, cancelled: Any, **_: Any) -> Any:
        self.requests.append(name)
        self.open += 1
        self.most = max(self.most, self.open)
        progress(f"switch {name} on")
        self.gate.wait(30.0)
        return self

    def close(self) -> None:
        self.open -= 1
        self.closed += 1
