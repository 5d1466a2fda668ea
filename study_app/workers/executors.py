"""The choice of an executor of many independent cases: processes of this computer, or a Dask cluster.

Code with many cases receives a `concurrent.futures.Executor` and uses only ``submit`` and ``map``. Each case has its
own seed, so results do not depend on the executor.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from concurrent.futures import Executor

# multiprocessing is imported only when it is needed, since every command imports this module.


@dataclass(frozen=True, slots=True)
class Workers:
    """The workers: ``count`` processes of this computer (None means one per core), or the cluster at an address."""

    count: int | None = None
    cluster: str | None = None


def open_executor(workers: Workers = Workers()) -> Executor:
    """Return the executor; an exception in its ``with`` block cancels the unfinished cases.

    Raises
    ------
    WorkerError
        There is no cluster at this address. The end of the ``with`` block raises it if a process or the cluster failed.
    """
    from study_app.workers.cases import ClusterExecutor, ProcessExecutor  # noqa: PLC0415

    if workers.cluster is not None:
        return ClusterExecutor(workers.cluster)
    return ProcessExecutor(workers.count or os.cpu_count() or 1)
