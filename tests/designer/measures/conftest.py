"""The tab Measures with a worker of simulations that answers when a test says so."""

from typing import Any

import pytest

from study_app.designer.measures.simulation import (
    Asked,
    Detectable,
    Finding,
    GroupPrecision,
    Measurable,
    Observed,
    Simulated,
    Simulation,
    hypotheses_of,
)
from study_app.protocol.warnings.expected_precision import threshold_plan

QUANTILES = (0.1, 0.15, 0.2, 0.25, 0.3)


class Worker:
    """Stands for the worker process: answers come when a test gives them."""

    def __init__(self) -> None:
        self.orders: list[Simulation] = []
        self.given: list[tuple[int, Any]] = []
        self.stops = 0
        self.works = True

    def order(self, order: Simulation) -> int:
        self.orders.append(order)
        return len(self.orders)

    def stop(self) -> None:
        self.stops += 1

    def close(self) -> None:
        self.works = False

    def answers(self, wait_s: float = 0.0) -> list[tuple[int, Any]]:
        given, self.given = self.given, []
        return given

    def answer(self) -> None:
        """Answer what was wanted last."""
        self.given.append((len(self.orders), answer_to(self.orders[-1])))


def answer_to(wanted: Simulation) -> Simulated:
    controls, warnings = wanted.controls, ("methods.adaptive.trials: more trials",)
    plan = threshold_plan(wanted.protocol, wanted.protocol.blocks[wanted.block]) if wanted.block else None
    if plan is None:
        found = Finding("feels_liquid", 0.9, "0.9 (0.7–1.4)"), Finding("like_honey", None, "beyond")
        return Simulated(
            detectable=Detectable(participants=controls.participants, studies=200, points=7, findings=found)
        )
    levels = plan.stimulus.grid
    curves = tuple(tuple(0.5 + 0.4 * share for _ in levels) for share in QUANTILES)
    one = tuple(Asked(at + 1, 1 + at % 2, levels[at % len(levels)], at % 3 > 0) for at in range(20))
    observed = Observed(
        threshold=controls.threshold,
        lapses=controls.lapses,
        observers=400,
        at_threshold=0.75,
        levels=levels,
        planted=curves[2],
        found=curves[::-1],
        asked=tuple((level, 1 / len(levels)) for level in levels),
        course=((10, QUANTILES), (20, QUANTILES)),
        one=one,
        error=0.26,
        trials=20,
    )
    group = GroupPrecision(
        participants=controls.participants,
        studies=60,
        precision=controls.precision,
        trials=80,
        share=0.93,
        more_trials=107,
        more_share=0.98,
        most=60,
        enough=20,
    )
    hypotheses = tuple(
        (one.described(), "80 % of studies of 12 show a ratio of 1.2") for one in hypotheses_of(wanted.protocol)
    )
    return Simulated(observed, Measurable((0.05, 0.5), ()), group, hypotheses=hypotheses, warnings=warnings)


@pytest.fixture
def worker(designer: Any) -> Worker:
    made = Worker()
    measures = designer.controller.measures
    measures.make = lambda: made
    measures.rest.setInterval(30)
    return made


def jnd(designer: Any) -> None:
    designer.controller.begin_study("template:viscosity-jnd", "thicker")
    designer.editing.select(("blocks", "viscosity"))
    designer.place.pane.show_tab("measures")


def shown(qtbot: Any, designer: Any, at: int, number: str) -> None:
    part = designer.place.measures.numbers.parts[at]
    qtbot.waitUntil(lambda: part.number.text() == number)
