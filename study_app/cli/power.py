"""The command that plans a study: how many participants it needs."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from study_app.cli.options import FILE, Target

SIZES = (5, 8, 12, 16, 20, 24)
EXIT_CANCELLED = 130


def _sizes(_context: click.Context, _option: click.Parameter, value: str) -> tuple[int, ...]:
    try:
        sizes = sorted({int(part) for part in value.split(",")})
    except ValueError as error:
        raise click.BadParameter(f"{value!r} is no list of numbers: give participants such as 5,8,12") from error
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
@click.option("--studies", type=click.IntRange(1, 1_000_000), default=1000, show_default=True, help="Of each size.")
@click.option("--jobs", type=click.IntRange(-1), default=-1, metavar="N", help="At once; default: one a core.")
@click.option(
    "--engine",
    type=click.Choice(["processes", "threads", "dask", "ray"]),
    default="processes",
    show_default=True,
    help="Who works: this machine, or the cluster that DASK_SCHEDULER_ADDRESS or RAY_ADDRESS names. The numbers are "
    "the same.",
)
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=1, show_default=True)
@click.option("--to", type=Target(), metavar="DIR", help="Folder for tables and figures.")
def power(
    protocol: str, sizes: tuple[int, ...], studies: int, jobs: int, engine: str, seed: int, to: Path | None
) -> None:
    """Simulate studies, and say how often the protocol's own tests show what, and from which difference on.

    Four sessions are rehearsed to know what each condition feels like; then thousands of participants answer by the
    rehearsals' answer model, which is plausible and not measured. Ctrl-C ends with what was simulated until then.
    """
    if jobs == 0:
        raise click.BadParameter("0 jobs do nothing: give 1 or more, or -1 for one a core", param_hint="--jobs")
    from study_app.analysis.power import sweep
    from study_app.analysis.power.plan import plan
    from study_app.analysis.power.power_curves import Powers, powers
    from study_app.analysis.power.power_files import write
    from study_app.analysis.power.power_tables import power_markdown
    from study_app.protocol.load import load
    from study_app.session.simulated.trial_features import feelings

    study = load(protocol)
    line = _Line()
    found: Powers | None = None
    cancelled = False
    try:
        line("feeling every condition")
        planned = plan(study, feelings(study, seed=seed, progress=line))
        for done, counts in sweep.sweep(planned, sizes, studies, seed, jobs=jobs, by=sweep.engine(engine)):
            line(f"{done} of {studies} studies of each size")
            found = powers(planned, sizes, done, studies, seed, counts)
    except KeyboardInterrupt:
        cancelled = True
    finally:
        line.clear()
    if found is not None:
        click.echo(power_markdown(found), nl=False)
        if to is not None:
            for path in write(found, to):
                click.echo(path)
    if cancelled:
        click.echo("ended early" if found else "ended before the first studies were simulated", err=True)
        click.get_current_context().exit(EXIT_CANCELLED)


class _Line:
    """One line of progress on a terminal, written over again and again; on anything else nothing."""

    def __init__(self) -> None:
        self._shown = sys.stderr.isatty()

    def __call__(self, words: str) -> None:
        if self._shown:
            click.echo(f"\r\033[K{words}", err=True, nl=False)

    def clear(self) -> None:
        """Take the line away."""
        if self._shown:
            click.echo("\r\033[K", err=True, nl=False)
