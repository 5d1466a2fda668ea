"""The commands that plan a study: estimate power, write a preregistration."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from study_app.analysis.planning import MOST_PARTICIPANTS, SIZES, STUDIES, THRESHOLD_STUDIES
from study_app.cli.options import (
    EXIT_CANCELLED,
    FILE,
    Target,
    WholeNumber,
    echo_files,
    executor_for,
    progress,
    takes_workers,
)
from study_app.workers.executors import Workers

if TYPE_CHECKING:
    from study_app.analysis.planning.power_estimates import PowerEstimate

_TRIALS = (1, 1000)


def _parse_numbers(value: str, least: int, most: int, what: str) -> tuple[int, ...]:
    """Return the distinct numbers of a list, in ascending order."""
    try:
        numbers = sorted({int(part) for part in value.split(",")})
    except ValueError as error:
        raise click.BadParameter(f"{value!r} is not a list of numbers: specify {what}, such as 5,8,12") from error
    if not numbers or numbers[0] < least or numbers[-1] > most:
        raise click.BadParameter(f"{value!r} is out of range: specify {what} from {least} to {most}, such as 5,8,12")
    return tuple(numbers)


@click.command()
@FILE
@click.option(
    "--sizes",
    default=",".join(map(str, SIZES)),
    show_default=True,
    callback=lambda _context, _option, value: _parse_numbers(value, 2, MOST_PARTICIPANTS, "numbers of participants"),
    metavar="N,N,…",
    help="Numbers of participants; the default also includes the planned number.",
)
@click.option(
    "--trials",
    callback=lambda _context, _option, value: (
        () if value is None else _parse_numbers(value, *_TRIALS, "numbers of trials")
    ),
    metavar="N,N,…",
    help="Numbers of trials per standard, comparison or rated level, for studies of thresholds, d′, ratings or "
    "magnitude estimation; default: the protocol's number.",
)
@click.option(
    "--studies",
    type=WholeNumber(1, 1_000_000),
    help=f"Number of simulated studies for each size; default: {STUDIES}, or {THRESHOLD_STUDIES} for thresholds.",
)
@takes_workers
@click.option("--engine", type=click.Choice(["processes", "dask"]), hidden=True)
@click.option("--seed", type=WholeNumber(0, 2**31 - 1), default=1, show_default=True, help="Seed for the simulation.")
@click.option("--to", type=Target(), metavar="DIR", help="Folder for the tables and figures.")
def power(
    protocol: str,
    sizes: tuple[int, ...],
    trials: tuple[int, ...],
    studies: int | None,
    workers: Workers,
    engine: str | None,
    seed: int,
    to: Path | None,
) -> None:
    """Simulate studies to estimate the power of the protocol's own tests and the smallest detectable difference.

    Four complete sessions are simulated to obtain the forces and delays in each condition. Thousands of participants
    are then simulated with the answer model used in rehearsals, which is plausible but not based on measurements. Power
    is printed for typical participants, or for the values in [simulated_participants], with the range across
    consistent, typical and noisy participants. For a study of thresholds, d′, ratings or magnitude estimation, the
    command prints three values for each number of participants and trials: the standard deviation of one participant's
    estimate, the half-width of the group's 95 % interval, and the proportion of studies that achieve
    analysis.precision. Ctrl+C ends the command and prints the results so far.
    """
    if engine == "processes":
        workers = Workers(workers.count)
    elif engine == "dask" and workers.cluster is None:
        raise click.UsageError("--engine dask needs a cluster: specify --cluster tcp://HOST:8786")
    from study_app.analysis.planning.power_estimates import estimate_power, planned_sizes
    from study_app.analysis.planning.threshold_studies import plans
    from study_app.protocol.load import load
    from study_app.session.simulated.rehearsal import condition_features
    from study_app.store.files import is_there, make_folder

    study = load(protocol)
    if trials and not plans(study, trials):
        raise click.UsageError(
            f"--trials cannot be used: {study.study.name} does not measure thresholds, d′, ratings or magnitude "
            f"estimation in a main block"
        )
    is_given = click.get_current_context().get_parameter_source("sizes") is not ParameterSource.DEFAULT
    if is_given and study.analysis is not None and (looks := study.analysis.looks):
        raise click.UsageError(
            f"--sizes cannot be used, because the study plans interim looks at {', '.join(map(str, looks))} "
            "participants: omit --sizes"
        )
    sizes = sizes if is_given else planned_sizes(study)
    estimate: PowerEstimate | None = None
    cancelled = False
    is_new_folder = to is not None and not is_there(to)
    if to is not None:
        make_folder(to, waits=False)  # before the simulation, which takes minutes
    try:
        with progress() as show, executor_for(workers) as executor:
            for estimate in estimate_power(
                study,
                executor,
                sizes=sizes,
                trials=trials,
                studies=studies,
                seed=seed,
                rehearse=lambda: condition_features(study, seed=seed, progress=show),
                progress=show,
            ):
                if estimate.asked:
                    done = f"{estimate.studies} of {estimate.asked} studies for each size"
                    show(done, estimate.studies / estimate.asked)
    except KeyboardInterrupt:
        cancelled = True
    finally:
        if to is not None and is_new_folder and estimate is None:
            with suppress(OSError):
                to.rmdir()
    if estimate is not None:
        _write_estimate(estimate, to)
    if cancelled:
        click.echo("ended early" if estimate else "ended before the first studies were complete", err=True)
        click.get_current_context().exit(EXIT_CANCELLED)


def _write_estimate(estimate: PowerEstimate, to: Path | None) -> None:
    """Print the tables; write them and the figures to ``to``, if given."""
    from study_app.analysis.planning.power_curves import Powers, write_power
    from study_app.analysis.planning.power_estimates import estimate_markdown
    from study_app.analysis.planning.threshold_studies import threshold_csv
    from study_app.store.files import write_files

    text = estimate_markdown(estimate)
    click.echo(text, nl=False)
    if to is None:
        return
    if isinstance(estimate, Powers):
        echo_files(write_power(estimate, to))
    else:
        echo_files(write_files(to, {"power.md": text.encode(), "power.csv": threshold_csv(estimate)}))


@click.command()
@FILE
@click.option(
    "--power",
    "computed",
    type=Target(),
    metavar="DIR",
    help="Folder written by power --to; its tables are added to the preregistration.",
)
@click.option("--to", type=Target(), metavar="DIR", help="Folder for preregistration.md; default: print it.")
def preregister(protocol: str, computed: Path | None, to: Path | None) -> None:
    """Write a preregistration from the protocol: hypotheses, design, participants, exclusions, analysis, and file hash.

    If the preregistration is in the study's folder (results/<study>), the report compares the study with it and lists
    every deviation.
    """
    from study_app.analysis.planning.preregistration import FILE as NAME
    from study_app.analysis.planning.preregistration import preregistration
    from study_app.protocol.load import parse, protocol_hash, source_bytes
    from study_app.store.files import write_files

    source = source_bytes(protocol)
    study = parse(source, protocol)
    power_md = None
    if computed is not None:
        try:
            power_md = (computed / "power.md").read_text(encoding="utf-8")
        except OSError as error:
            raise click.UsageError(
                f"--power {computed}: power.md cannot be read ({error.strerror}): specify a folder written by "
                "power --to"
            ) from error
        if f"({study.study.name} {study.study.version})" not in power_md:
            raise click.UsageError(
                f"--power {computed}: power.md was not written for {study.study.name} {study.study.version}"
            )
    text = preregistration(study, protocol_hash(source), power_md)
    if to is None:
        click.echo(text, nl=False)
        return
    echo_files(write_files(to, {NAME: text.encode()}))
