"""The command that measures how often the report's verdicts are wrong."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import click

from study_app.cli.options import EXIT_FOUND, Target

EXIT_UNDECIDED = 4


@click.command("validate-report")
@click.option(
    "--studies", type=click.IntRange(1, 1_000_000), default=1000, show_default=True, help="In each cell, at first."
)
@click.option("--jobs", type=click.IntRange(-1), default=-1, metavar="N", help="At once; default: one a core.")
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=1, show_default=True)
@click.option("--to", type=Target(), metavar="DIR", help="Folder for rates.md and rates.csv.")
def validate_report(studies: int, jobs: int, seed: int, to: Path | None) -> None:
    """Simulate empty, partially empty and full studies, and say how often the report's verdicts are wrong.

    Studies of rek2024 with 5, 12 and 24 participants, by the rehearsals' answer model and by an ordinal probit model
    with random effects, go through the report's own tests. Of every rate the Wilson interval is printed, and whether
    it keeps to its limit: "at most 5 %" holds if the interval reaches down to 5 % and ends below 7.5 %. A cell with an
    undecided rate is continued with further studies, up to four times as many. Ctrl-C ends with what was simulated
    until then. Ends with exit code 3 where a rate is beyond its limit by its 99.9 % interval, else with 4 where the
    studies are too few to decide about one.
    """
    if jobs == 0:
        raise click.BadParameter("0 jobs do nothing: give 1 or more, or -1 for one a core", param_hint="--jobs")
    from study_app.analysis.power.plan import plan
    from study_app.protocol.load import load
    from study_app.session.simulated.trial_features import feelings
    from study_app.store.output_files import write_files
    from study_app.validation.report_rates.rate_tables import markdown, table
    from study_app.validation.report_rates.rates import Rate
    from study_app.validation.report_rates.simulated_studies import simulated
    from study_app.validation.report_rates.simulation import validate

    protocol = load("rek2024")
    studied = simulated(protocol, plan(protocol, feelings(protocol, seed=seed)))
    rates: tuple[Rate, ...] = ()
    begun, done = time.monotonic(), 0
    clear = "\r\033[K" if sys.stderr.isatty() else ""

    def line(text: str) -> None:
        click.echo(f"{clear}{time.monotonic() - begun:.0f} s: {text}", err=True)

    try:
        for done, so_far in validate(studied, studies, seed, jobs=jobs, progress=line):
            rates = so_far
            if clear:
                click.echo(f"{clear}{done} studies", err=True, nl=False)
    except KeyboardInterrupt:
        click.echo("ended early", err=True)
    words = f"{done} studies in {time.monotonic() - begun:.0f} s\n\n{markdown(rates)}"
    click.echo(words, nl=False)
    if to is not None:
        for path in write_files(to, {"rates.md": words.encode(), "rates.csv": table(rates)}):
            click.echo(path)
    beyond, undecided = (sum(one.holds == verdict for one in rates) for verdict in ("no", "too few studies"))
    limited = sum(one.holds != "counted" for one in rates)
    click.echo(_summary(beyond, undecided, limited))
    if beyond:
        click.get_current_context().exit(EXIT_FOUND)
    if undecided or not limited:
        click.get_current_context().exit(EXIT_UNDECIDED)


def _summary(beyond: int, undecided: int, limited: int) -> str:
    """Return how many of the rates that have a limit are beyond it, or may be."""
    if not limited:
        return "nothing was counted"
    if beyond:
        return f"{beyond} of {limited} rates beyond their limits, {undecided} undecided"
    if undecided:
        return f"{undecided} of {limited} rates undecided: simulate more studies"
    return "every rate keeps to its limit"
