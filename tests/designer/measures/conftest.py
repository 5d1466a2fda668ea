"""The tab Measures with a simulation worker whose answers a test sends."""

from typing import Any

import pytest

from study_app.designer.measures.simulation import Simulated, Simulation

TABLE = "# Power\n\n| participants | power |\n|---:|---:|\n| 12 | 80% |\n"


class Worker:
    """A replacement of the worker process whose answers a test sends."""

    def __init__(self) -> None:
        self.orders: list[Simulation] = []
        self.pending_answers: list[tuple[int, Any]] = []
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
        answers, self.pending_answers = self.pending_answers, []
        return answers

    def answer(self, waiting: str = "") -> None:
        """Answer the last order, in part if it is still ``waiting``."""
        warnings = ("methods.adaptive.trials: more trials",)
        self.pending_answers.append((len(self.orders), Simulated(warnings=warnings, table=TABLE, waiting=waiting)))


@pytest.fixture
def worker(designer: Any) -> Worker:
    worker = Worker()
    measures = designer.controller.measures
    measures.make = lambda: worker
    measures.rest.setInterval(30)
    return worker


def open_viscosity_block(designer: Any) -> None:
    designer.controller.begin_study("template:viscosity-jnd", "thicker")
    designer.editing.select(("blocks", "viscosity"))
    designer.place.pane.show_tab("measures")
