"""The tab Measures with a worker of simulations that answers when a test says so."""

from typing import Any

import pytest

from study_app.designer.measures.simulation import Simulated, Simulation

TABLE = "# Power\n\n| participants | power |\n|---:|---:|\n| 12 | 80% |\n"


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

    def answer(self, waiting: str = "") -> None:
        """Answer the last order, in part if it is still ``waiting``."""
        warnings = ("methods.adaptive.trials: more trials",)
        self.given.append((len(self.orders), Simulated(warnings=warnings, table=TABLE, waiting=waiting)))


@pytest.fixture
def worker(designer: Any) -> Worker:
    made = Worker()
    measures = designer.controller.measures
    measures.make = lambda: made
    measures.rest.setInterval(30)
    return made


def open_viscosity_block(designer: Any) -> None:
    designer.controller.begin_study("template:viscosity-jnd", "thicker")
    designer.editing.select(("blocks", "viscosity"))
    designer.place.pane.show_tab("measures")
