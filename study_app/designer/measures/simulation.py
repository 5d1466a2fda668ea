"""Simulations of a study in another process: the precision warnings of ``check``, and the output of ``power``."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, Final, TypeAlias

from study_app.designer.measures.study_facts import text_keys
from study_app.haptics.model.device_dynamics import ASSUMED_TICKS
from study_app.protocol.model import Protocol
from study_app.protocol.warnings import imprecise, threshold_plan
from study_app.workers.client import WorkerClient
from study_app.workers.server import Send, Stop, Stopped

WAITING: Final = "simulating…"


@dataclass(frozen=True, slots=True, kw_only=True)
class Simulated:
    """The results of a study's simulation.

    ``warnings`` are those of ``check`` that need simulations, ``lost`` are sentences on trials that would not be
    delivered, and ``table`` is the output of ``power``. ``waiting`` describes the progress while the simulation runs,
    and ``failed`` is the reason if it cannot continue.
    """

    warnings: tuple[str, ...] = ()
    lost: tuple[str, ...] = ()
    table: str = ""
    waiting: str = ""
    failed: str = ""


@dataclass(frozen=True, slots=True)
class Simulation:
    """A requested simulation, with or without power; those with the same ``depends`` have the same result."""

    depends: str
    power: bool
    protocol: Protocol = field(compare=False, repr=False)


def simulation_of(protocol: Protocol, *, power: bool) -> Simulation | None:
    """Return the simulation that a study needs; None if it needs none."""
    if not power and not needs_precision_check(protocol):
        return None
    content = _without_texts(protocol.model_dump(mode="json", exclude={"pages"}))
    titles = (
        [protocol.study.title, *(block.title for block in protocol.main_blocks)] if power else []
    )  # shown in the table
    depends = json.dumps([content, titles], sort_keys=True)
    return Simulation(depends, power, protocol)


def needs_precision_check(protocol: Protocol) -> bool:
    """Return whether ``check`` simulates the precision of the study's thresholds."""
    decided = protocol.analysis
    planned = decided is not None and decided.precision is not None and decided.participants is not None
    return planned and any(threshold_plan(protocol, block) is not None for block in protocol.main_blocks)


def _without_texts(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_texts(inner) for key, inner in value.items() if key not in text_keys()}
    return [_without_texts(inner) for inner in value] if isinstance(value, list) else value


MeasureClient: TypeAlias = WorkerClient[Simulation, Simulated]


def start_measure_worker() -> MeasureClient:
    """Start the worker process, at the lowest priority."""
    return WorkerClient("study_app.designer.measures.simulation:run_simulation", name="measures", background=True)


class _InProcessExecutor(Executor):
    """An executor that runs each call in this process when its result is requested, after calling ``check``."""

    def __init__(self, check: Callable[[], None]) -> None:
        self._check = check

    def map(self, fn: Callable[..., Any], *iterables: Any, **_options: Any) -> Iterator[Any]:
        for arguments in zip(*iterables, strict=True):
            self._check()
            yield fn(*arguments)


def run_simulation(order: Simulation, send: Send, stop: Stop) -> Simulated:
    """Run a simulation, and send intermediate results.

    Raises Stopped if another one was ordered, or the client has ended.
    """

    def check() -> None:
        if stop():
            raise Stopped("the study has been edited")

    check()
    protocol, simulated = order.protocol, Simulated(waiting=WAITING)
    if needs_precision_check(protocol):
        simulated = replace(simulated, warnings=_precision_warnings(replace(order, power=False)))
    if order.power:
        from study_app.analysis.planning.power_estimates import estimate_markdown, estimate_power, planned_sizes  # noqa: PLC0415 - loads scipy: only in this process
        from study_app.session.simulated.predicted_delivery import predicted_delivery  # noqa: PLC0415 - the compiler: only here
        from study_app.session.simulated.rehearsal import condition_features  # noqa: PLC0415 - the compiler: only here

        def show_progress(text: str) -> None:
            check()
            send(replace(simulated, waiting=f"{text}…"))

        show_progress("predicting which trials can be delivered")
        simulated = replace(simulated, lost=predicted_delivery(protocol, ASSUMED_TICKS).sentences)
        for estimate in estimate_power(
            protocol,
            _InProcessExecutor(check),
            sizes=planned_sizes(protocol),
            rehearse=lambda: condition_features(protocol, seed=1, progress=show_progress),
            progress=show_progress,
        ):
            progress = f"{estimate.studies} of {estimate.asked} studies simulated per sample size"
            simulated = replace(simulated, table=estimate_markdown(estimate), waiting=progress)
            send(simulated)
    return replace(simulated, waiting="")


@lru_cache(maxsize=1)
def _precision_warnings(order: Simulation) -> tuple[str, ...]:
    protocol = order.protocol
    return tuple(sentence for block in protocol.main_blocks for sentence in imprecise(protocol, block))
