"""The tab Measures with a worker of slow numbers that answers when a test says so."""

from typing import Any

import pytest

from study_app.app.designer.measures.measures_worker import (
    Detecting,
    Grouping,
    MeasureOrder,
    Measuring,
    Observing,
    Wanted,
)
from study_app.authoring.measures.observers import Asked, Measurable, Observed
from study_app.authoring.measures.planned import Detectable, Finding, GroupPrecision

QUANTILES = (0.1, 0.15, 0.2, 0.25, 0.3)


class Worker:
    """Stands for the worker process: answers come when a test gives them."""

    def __init__(self) -> None:
        self.orders: list[MeasureOrder] = []
        self.given: list[tuple[int, Any]] = []
        self.stops = 0
        self.works = True

    @property
    def sizes(self) -> list[int]:
        """The numbers of participants of the studies that were ordered."""
        wanted = [one for order in self.orders for one in order.wanted]
        return [one.participants for one in wanted if isinstance(one, Grouping)]

    def order(self, order: MeasureOrder) -> int:
        self.orders.append(order)
        return len(self.orders)

    def stop(self) -> None:
        self.stops += 1

    def close(self) -> None:
        self.works = False

    def answers(self, wait_s: float = 0.0) -> list[tuple[int, Any]]:
        given, self.given = self.given, []
        return given

    def answer(self, *kinds: type) -> None:
        """Answer what was wanted last, of some kinds only where they are given."""
        number, order = len(self.orders), self.orders[-1]
        self.given += [(number, (one, answer_to(one))) for one in order.wanted if not kinds or isinstance(one, kinds)]
        if not kinds:
            self.given.append((number, None))


def answer_to(wanted: Wanted) -> Any:
    if isinstance(wanted, Observing):
        levels = wanted.plan.stimulus.grid
        curves = tuple(tuple(0.5 + 0.4 * share for _ in levels) for share in QUANTILES)
        one = tuple(Asked(at + 1, 1 + at % 2, levels[at % len(levels)], at % 3 > 0) for at in range(20))
        return Observed(
            wanted.threshold, wanted.lapses, 400, 0.75, levels, curves[2], curves[::-1],
            tuple((level, 1 / len(levels)) for level in levels), ((10, QUANTILES), (20, QUANTILES)), one, 0.26, 20,
        )  # fmt: skip
    if isinstance(wanted, Measuring):
        return Measurable((0.05, 0.5), ())
    if isinstance(wanted, Grouping):
        if wanted.participants < 20:
            enough = 22 if wanted.participants > 8 else None
            return GroupPrecision(wanted.participants, 60, wanted.precision, 80, 0.13, 107, 0.22, 60, enough)
        return GroupPrecision(wanted.participants, 60, wanted.precision, 80, 0.93, 107, 0.98, 60, 20)
    if isinstance(wanted, Detecting):
        return Detectable(wanted.participants, 200, 7, (Finding("feels_liquid", 0.9), Finding("like_honey", None)))
    return ("methods.adaptive.trials: more trials",)


@pytest.fixture
def worker(designer: Any) -> Worker:
    made = Worker()
    slow = designer.controller.measures.slow
    slow.make = lambda: made
    slow.rest.setInterval(30)
    return made


def jnd(designer: Any) -> None:
    designer.controller.begin("template:viscosity-jnd", "thicker")
    designer.editing.select(("blocks", "viscosity"))
    designer.place.pane.show_tab("measures")


def shown(qtbot: Any, designer: Any, at: int, number: str) -> None:
    part = designer.place.measures.numbers.parts[at]
    qtbot.waitUntil(lambda: part.number.text() == number)
