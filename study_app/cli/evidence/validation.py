"""The commands that validate the analysis by simulated studies."""

import os
import time
from pathlib import Path

import click

from study_app.cli.evidence import present
from study_app.cli.options import Target, executor_for, prepare, progress, takes_workers
from study_app.workers.executors import Workers


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
    from study_app.evidence.report_rates.simulation import Rate, evidence, validate
    from study_app.protocol.load import load
    from study_app.session.simulated.rehearsal import condition_features

    prepare(to)
    rates: tuple[Rate, ...] = ()
    begun, done = time.monotonic(), 0

    def say(text: str) -> None:
        click.echo(f"{time.monotonic() - begun:.0f} s: {text}", err=True)

    try:
        with progress() as show, executor_for(workers) as executor:
            show("rehearsing every condition")
            protocol = load("rek2024")
            studied = plan(protocol, condition_features(protocol, seed=seed))
            begun = time.monotonic()
            for done, so_far in validate(studied, studies, executor, seed=seed, progress=say):
                rates = so_far
                show(f"{done} studies")
    except KeyboardInterrupt:
        click.echo("ended early", err=True)
    present(evidence(rates, f"{done} studies in {time.monotonic() - begun:.0f} s"), to)


@click.command()
@click.argument("files", metavar="[FILE]...", nargs=-1)
@click.option(
    "--studies",
    type=click.IntRange(10, 1_000_000),
    default=200,
    show_default=True,
    help="Studies of 20 participants, of each protocol and seed.",
)
@click.option(
    "--seed",
    "seeds",
    type=click.IntRange(0, 2**31 - 1),
    multiple=True,
    default=(1,),
    show_default=True,
    help="Seed of the simulation; may be given several times: studies of all seeds are judged together.",
)
@takes_workers
@click.option("--to", type=Target(), metavar="DIR", help="Folder for thresholds.md and thresholds.csv.")
def validate(files: tuple[str, ...], studies: int, seeds: tuple[int, ...], workers: Workers, to: Path | None) -> None:
    """Recover the known thresholds of simulated observers, with methods and analysis alone and with the whole program.

    For each protocol (default: viscosityjnd, delaydetect, delayjnd, thickness, forcedelay) many studies of 20
    observers, who differ by a factor of 1.2, are simulated and analysed; in magnitude estimation the exponent is known.
    Then three participants are rehearsed with servo, files, unblinding and analysis. Every value is printed with its
    limit. Ends with exit code 3 if a value exceeds its limit.
    """
    from study_app.evidence.thresholds.known_values import NAMES, evidence, known_value
    from study_app.evidence.thresholds.known_values import validate as validate_values
    from study_app.protocol.load import load, source_bytes

    try:
        chosen = [(source_bytes(name), known_value(Path(name).stem, load(name))) for name in files or NAMES]
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    prepare(to)
    begun = time.monotonic()
    with progress() as show, executor_for(workers) as executor:
        verdicts = validate_values(chosen, studies, seeds, executor, show)
    used_s = sum(os.times()[:4])  # with the workers', which have ended
    took = f"{time.monotonic() - begun:.0f} s, {used_s:.0f} s of processor time"
    heading = f"{studies} studies of each protocol and seed ({', '.join(map(str, seeds))}), in {took}"
    present(evidence(verdicts, heading), to)


@click.command("delay-thresholds")
@click.option("--people", type=click.IntRange(5, 1000), default=40, show_default=True, help="Simulated people.")
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=1, show_default=True, help="Seed of the simulation.")
@click.option("--to", type=Target(), metavar="DIR", help="Folder for the table and the figure.")
def delay_thresholds(people: int, seed: int, to: Path | None) -> None:
    """Compare the delay that simulated people rate as different (rek2024) with the one they detect (delaydetect).

    The forced choice does not depend on a person's criterion; the rating does.
    """
    from study_app.evidence.thresholds.noticed_delays import compare, evidence

    with progress() as show:
        show("simulating people")
        found = compare(people, seed)
    present(evidence(found), to)
