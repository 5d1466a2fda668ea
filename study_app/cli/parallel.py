"""Where commands compute their cases: ``--workers`` and ``--cluster``, and what an interrupted start has finished."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import wraps
from typing import TYPE_CHECKING, Any, Final

import click
from click.core import ParameterSource

from study_app.cli.options import Command
from study_app.workers.executors import Workers, open_executor

if TYPE_CHECKING:
    from concurrent.futures import Executor

EXIT_CANCELLED: Final = 130


def takes_workers(function: Command) -> Command:
    """Give a command ``--workers`` and ``--cluster``; the function gets ``workers``."""

    @click.option(
        "--workers",
        "--jobs",
        "count",
        type=click.IntRange(-1),
        default=-1,
        metavar="N",
        callback=_not_zero,
        help="Worker processes on this computer; default: one per core.",
    )
    @click.option(
        "--cluster",
        metavar="ADDRESS",
        envvar="DASK_SCHEDULER_ADDRESS",
        show_envvar=True,
        help="Scheduler of a Dask cluster that computes instead, such as tcp://HOST:8786.",
    )
    @wraps(function)
    def run(*words: Any, count: int, cluster: str | None, **options: Any) -> Any:
        of_count, of_cluster = (click.get_current_context().get_parameter_source(it) for it in ("count", "cluster"))
        if of_count == of_cluster == ParameterSource.COMMANDLINE:
            raise click.UsageError("--workers and --cluster exclude each other: a cluster has its own workers")
        here = cluster is None or of_count == ParameterSource.COMMANDLINE
        workers = Workers(None if count < 0 else count) if here else Workers(cluster=cluster)
        return function(*words, workers=workers, **options)

    return run  # type: ignore[return-value]


def _not_zero(_context: click.Context, _option: click.Parameter, value: int) -> int:
    if value == 0:
        raise click.BadParameter("0 workers cannot compute: give 1 or more, or -1 for one per core")
    return value


@contextmanager
def executor_for(workers: Workers) -> "Iterator[Executor]":
    """Open the executor of a command, which keeps finished cases until all are; Ctrl+C says how many are kept.

    Yields
    ------
    concurrent.futures.Executor

    Raises
    ------
    WorkerError
        No cluster is there, or processes were lost again and again.
    """
    from study_app.workers.kept_cases import KeptCases

    computing = open_executor(workers)
    if computing.workers == 0:
        click.echo(f"{workers.cluster} has no worker yet: the computation begins when one joins", err=True)
    kept = KeptCases(computing)
    try:
        with kept:
            yield kept
    except BaseException:
        if kept.stored:
            click.echo(f"finished cases kept: {kept.stored}; the same command continues with them", err=True)
        raise
    if kept.reused:
        click.echo(f"cases finished by an earlier start: {kept.reused}", err=True)
