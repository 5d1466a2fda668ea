"""The command that plans a study: how many participants it needs."""

from __future__ import annotations

from pathlib import Path

import click

from study_app.cli.options import FILE, Target
from study_app.cli.parallel import EXIT_CANCELLED, executor_for, takes_workers
from study_app.cli.progress import progress
from study_app.workers.executors import Workers

SIZES = (5, 8, 12, 16, 20, 24)


def _sizes(_context: click.Context, _option: click.Parameter, value: str) -> tuple[int, ...]:
    try:
        sizes = sorted({int(part) for part in value.split(",")})
    except ValueError as error:
        raise click.BadParameter(
            f"{value!r} is not a list of numbers: give numbers of participants such as 5,8,12"
        ) from error
    if not sizes or sizes[0] < 2 or sizes[-1] > 1000:
        raise click.BadParameter(f"{value!r}: give numbers of participants from 2 to 1000, such as 5,8,12")
    return tuple(sizes)


@click.command()
@FILE
@click.option(
    "--sizes",
    default=",".join(map(str, SIZES)),
    show_default=True,
    callback=_sizes,
    metavar="N,N,…",
    help="Numbers of participants.",
)
@click.option(
    "--studies",
    type=click.IntRange(1, 1_000_000),
    default=1000,
    show_default=True,
    help="Simulated studies for each size.",
)
@takes_workers
@click.option("--engine", type=click.Choice(["processes", "dask"]), hidden=True)
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=1, show_default=True)
@click.option("--to", type=Target(), metavar="DIR", help="Folder for tables and figures.")
def power(
    protocol: str,
    sizes: tuple[int, ...],
    studies: int,
    workers: Workers,
    engine: str | None,
    seed: int,
    to: Path | None,
) -> None:
    """Estimate the power of the protocol's own tests on simulated studies, and the smallest detectable difference.

    Four sessions are rehearsed to obtain the features of each condition; then thousands of participants answer with
    the rehearsals' answer model, which is plausible but not measured. Ctrl-C ends with the results so far.
    """
    if engine == "processes":
        workers = Workers(workers.count)
    elif engine == "dask" and workers.cluster is None:
        raise click.UsageError("--engine dask needs a cluster: give --cluster tcp://HOST:8786")
    from study_app.analysis.power.plan import plan
    from study_app.analysis.power.power_curves import Powers, powers
    from study_app.analysis.power.power_files import write
    from study_app.analysis.power.power_sweep import sweep
    from study_app.analysis.power.power_tables import power_markdown
    from study_app.protocol.load import load
    from study_app.session.simulated.trial_features import feelings

    study = load(protocol)
    found: Powers | None = None
    cancelled = False
    try:
        with progress() as show, executor_for(workers) as executor:
            show("simulating every condition")
            planned = plan(study, feelings(study, seed=seed, progress=show))
            for done, counts in sweep(planned, sizes, studies, seed, executor):
                show(f"{done} of {studies} studies of each size", done / studies)
                found = powers(planned, sizes, done, studies, seed, counts)
    except KeyboardInterrupt:
        cancelled = True
    if found is not None:
        click.echo(power_markdown(found), nl=False)
        if to is not None:
            for path in write(found, to):
                click.echo(path)
    if cancelled:
        click.echo("ended early" if found else "ended before the first studies were complete", err=True)
        click.get_current_context().exit(EXIT_CANCELLED)
