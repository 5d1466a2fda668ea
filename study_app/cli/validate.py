"""The command that measures how often the report's verdicts are wrong."""

import time
from pathlib import Path

import click

from study_app.cli.options import EXIT_FOUND, Target
from study_app.cli.parallel import executor_for, takes_workers
from study_app.cli.progress import progress
from study_app.workers.executors import Workers

EXIT_UNDECIDED = 4


@click.command("validate-report")
@click.option(
    "--studies",
    type=click.IntRange(1, 1_000_000),
    default=1000,
    show_default=True,
    help="Initial number of studies per cell.",
)
@takes_workers
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=1, show_default=True, help="Seed of the simulation.")
@click.option("--to", type=Target(), metavar="DIR", help="Folder for rates.md and rates.csv.")
def validate_report(studies: int, workers: Workers, seed: int, to: Path | None) -> None:
    """Measure how often the report's verdicts are wrong, on studies simulated with no, some or all effects.

    Studies of rek2024 with 5, 12 and 24 participants, by the rehearsals' answer model and by an ordinal probit model
    with random effects, are analysed by the report's own tests. Every rate is printed with its Wilson interval, and
    whether it meets its limit: "at most 5 %" is met if the interval reaches down to 5 % and ends below 7.5 %. A cell
    with an undecided rate is continued with further studies, up to four times as many. Ctrl+C ends the command with
    the results so far. Ends with exit code 3 if a rate exceeds its limit by its 99.9 % interval, otherwise with 4 if
    there are too few studies to decide about a rate.
    """
    from study_app.analysis.planning.simulated_studies import plan
    from study_app.protocol.load import load
    from study_app.session.simulated.rehearsal import condition_features
    from study_app.store.output_files import make_folder, write_files
    from study_app.validation.report_rates.known_effects import simulated
    from study_app.validation.report_rates.rates import Rate, markdown, table
    from study_app.validation.report_rates.simulation import validate

    if to is not None:
        make_folder(to)
    rates: tuple[Rate, ...] = ()
    begun, done = time.monotonic(), 0

    def say(text: str) -> None:
        click.echo(f"{time.monotonic() - begun:.0f} s: {text}", err=True)

    try:
        with progress() as show, executor_for(workers) as executor:
            show("rehearsing every condition")
            protocol = load("rek2024")
            studied = simulated(protocol, plan(protocol, condition_features(protocol, seed=seed)))
            begun = time.monotonic()
            for done, so_far in validate(studied, studies, executor, seed=seed, progress=say):
                rates = so_far
                show(f"{done} studies")
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
        return "no rate was counted"
    if beyond:
        return f"{beyond} of {limited} rates exceed their limits, {undecided} undecided"
    if undecided:
        return f"{undecided} of {limited} rates undecided: simulate more studies"
    return "every rate is within its limit"
