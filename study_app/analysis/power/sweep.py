"""The sweep over simulated studies on one core, several, or a cluster: the same counts whoever does the counting."""

from __future__ import annotations

import importlib
import signal
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack
from typing import Any, Final, Literal, TypeAlias, get_args

from joblib import Parallel, delayed, parallel_config

from study_app.analysis.power.counts import BATCH, Counts, count
from study_app.analysis.power.plan import Plan
from study_app.errors import AnalysisError

Engine: TypeAlias = Literal["processes", "threads", "dask", "ray"]
ENGINES: Final[tuple[Engine, ...]] = get_args(Engine)
_NEEDS: Final = {"dask": "distributed", "ray": "ray"}


def engine(name: str) -> Engine:
    """Return the engine of that name.

    Raises
    ------
    AnalysisError
        There is none.
    """
    for known in ENGINES:
        if known == name:
            return known
    raise AnalysisError(f"there is no engine {name!r}: take one of {', '.join(ENGINES)}")


def sweep(
    plan: Plan, sizes: Sequence[int], studies: int, seed: int, *, jobs: int = -1, by: Engine = "processes"
) -> Iterator[tuple[int, Counts]]:
    """Yield after every batch how many studies were simulated so far, and what was counted in them all.

    Parameters
    ----------
    sizes : numbers of participants
    studies : how many studies of each size
    seed : of all randomness; what is counted depends on neither ``jobs`` nor ``by``
    jobs : how many work at once; -1: as many as there are cores
    by : who works: processes or threads of this machine, or the workers of a Dask or Ray cluster, which is the one
        that ``DASK_SCHEDULER_ADDRESS`` or ``RAY_ADDRESS`` names, otherwise one started here

    Raises
    ------
    AnalysisError
        The engine is not installed, or its cluster cannot be reached.
    """
    batches = [(first // BATCH, min(BATCH, studies - first)) for first in range(0, studies, BATCH)]
    done, total = 0, Counts()
    with ExitStack() as running:
        running.enter_context(_started(by))
        work = Parallel(n_jobs=jobs, return_as="generator", pre_dispatch="2*n_jobs", batch_size=1)
        results = work(delayed(count)(plan, tuple(sizes), seed, batch, many) for batch, many in batches)
        running.callback(results.close)
        for (_, many), counted in zip(batches, results, strict=True):
            done += many
            total = {what: total.get(what, 0) + numbers for what, numbers in counted.items()}
            yield done, total


def _started(engine: Engine) -> AbstractContextManager[Any]:
    """Return what makes joblib use an engine while it is entered."""
    if engine in _NEEDS:
        try:
            return _cluster(engine)
        except ImportError as error:
            needed = _NEEDS[engine]
            raise AnalysisError(
                f"--engine {engine} needs the package {needed!r}, which is not installed: pip install {needed}, or "
                "take --engine processes"
            ) from error
    here: AbstractContextManager[Any] = (
        parallel_config(backend="loky", initializer=_ignore_interrupts)
        if engine == "processes"
        else parallel_config(backend="threading")
    )
    return here


def _ignore_interrupts() -> None:
    """Leave Ctrl-C to the process that started this one: it ends its workers itself, without their tracebacks."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _cluster(engine: Engine) -> AbstractContextManager[Any]:
    if engine == "ray":
        importlib.import_module("ray.util.joblib").register_ray()
        ray: AbstractContextManager[Any] = parallel_config(backend="ray")
        return ray
    stack = ExitStack()
    client = importlib.import_module("distributed").Client
    try:
        stack.enter_context(client())
    except OSError as error:
        raise AnalysisError(f"--engine dask found no cluster ({error}): mend DASK_SCHEDULER_ADDRESS") from error
    stack.enter_context(parallel_config(backend="dask"))
    return stack
