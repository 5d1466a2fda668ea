"""The executor for many independent cases, each of which draws from its own seed: processes here, or a Dask cluster.

Code that has many cases takes a `concurrent.futures.Executor` and uses only its ``submit`` and ``map``: results do not
depend on the executor.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from concurrent.futures import Executor

# multiprocessing is loaded where processes are needed: every command imports this module.


@dataclass(frozen=True, slots=True)
class Workers:
    """The workers: ``count`` processes of this computer (None: one per core), or a cluster by its address."""

    count: int | None = None
    cluster: str | None = None


def open_executor(workers: Workers = Workers()) -> Executor:
    """Return the executor; a ``with`` block that is left by an exception cancels what has not finished.

    Raises
    ------
    WorkerError
        There is no cluster at this address. The ``with`` block raises it if a process, or the cluster, was lost.
    """
    from study_app.workers.cases import ClusterExecutor, ProcessExecutor  # noqa: PLC0415

    if workers.cluster is not None:
        return ClusterExecutor(workers.cluster)
    return ProcessExecutor(workers.count or os.cpu_count() or 1)
