"""The command that plants thresholds and looks whether they are recovered."""

from __future__ import annotations

import os
import tempfile
import time
from functools import partial
from pathlib import Path

import click

from study_app.cli.options import EXIT_FOUND, Target
from study_app.cli.parallel import executor_for, takes_workers
from study_app.cli.progress import progress
from study_app.workers.executors import Workers


@click.command()
@click.argument("files", metavar="[FILE]...", nargs=-1)
@click.option(
    "--studies",
    type=click.IntRange(10, 1_000_000),
    default=200,
    show_default=True,
    help="Studies of ten participants, of each protocol.",
)
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=1, show_default=True)
@takes_workers
@click.option("--to", type=Target(), metavar="DIR", help="Folder for thresholds.md and thresholds.csv.")
def validate(files: tuple[str, ...], studies: int, seed: int, workers: Workers, to: Path | None) -> None:
    """Recover planted thresholds: by the methods and the analysis alone, and through the whole program.

    For each protocol (default: viscosityjnd, delaydetect, delayjnd) many studies of ten equal observers choose levels
    and are analysed; then three participants are rehearsed with servo, store, unblinding and analysis. Every value is
    printed with its limit. Ends with exit code 3 if one exceeds it.
    """
    from study_app.protocol.load import load
    from study_app.store.output_files import write_files
    from study_app.validation.thresholds.methods_alone import simulate
    from study_app.validation.thresholds.planted import SHIPPED, planted
    from study_app.validation.thresholds.verdicts import Verdict, markdown, spread, table, verdicts
    from study_app.validation.thresholds.whole_pipeline import PEOPLE, run

    try:
        chosen = [(name, planted(Path(name).stem, load(name))) for name in files or tuple(SHIPPED)]
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    begun = time.monotonic()
    judged: list[Verdict] = []
    with progress() as show, executor_for(workers) as executor:
        for source, one in chosen:
            found = []
            for study in executor.map(partial(simulate, one, seed=seed), range(studies)):
                found.append(study)
                show(f"{one.name}: {len(found)} of {studies} studies", len(found) / studies)
            judged += verdicts(one, found)
            show(f"{one.name}: rehearsing {PEOPLE} participants")
            with tempfile.TemporaryDirectory() as folder:
                judged += run(one, source, Path(folder) / "study", spread(found, PEOPLE), seed=seed)
    used_s = sum(os.times()[:4])  # with the workers', which have ended
    took = f"{time.monotonic() - begun:.0f} s, {used_s:.0f} s of processor time"
    words = f"{studies} studies of each protocol, seed {seed}, in {took}\n\n{markdown(judged)}"
    click.echo(words, nl=False)
    if to is not None:
        for path in write_files(to, {"thresholds.md": words.encode(), "thresholds.csv": table(judged)}):
            click.echo(path)
    beyond = sum(not one.holds for one in judged)
    click.echo(f"{beyond} of {len(judged)} values exceed their limits" if beyond else "every value is within its limit")
    if beyond:
        click.get_current_context().exit(EXIT_FOUND)
