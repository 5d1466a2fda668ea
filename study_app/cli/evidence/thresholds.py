"""The commands about thresholds: known ones are recovered, and two procedures are compared on the same people."""

import os
import time
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
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=1, show_default=True, help="Seed of the simulation.")
@takes_workers
@click.option("--to", type=Target(), metavar="DIR", help="Folder for thresholds.md and thresholds.csv.")
def validate(files: tuple[str, ...], studies: int, seed: int, workers: Workers, to: Path | None) -> None:
    """Recover the known thresholds of simulated observers, with methods and analysis alone and with the whole program.

    For each protocol (default: viscosityjnd, delaydetect, delayjnd, thickness, forcedelay) many studies of ten
    identical observers are simulated and analysed; in magnitude estimation the exponent is known. Then three
    participants are rehearsed with servo, files, unblinding and analysis. Every value is printed with its limit. Ends
    with exit code 3 if a value exceeds its limit.
    """
    from study_app.protocol.load import load, source_bytes
    from study_app.store.output_files import make_folder, write_files
    from study_app.validation.thresholds.many_studies import NAMES, methods_alone, plant
    from study_app.validation.thresholds.verdicts import Verdict, markdown, table
    from study_app.validation.thresholds.whole_pipeline import PEOPLE, judged, rehearsed

    try:
        chosen = [(source_bytes(name), plant(Path(name).stem, load(name))) for name in files or NAMES]
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    if to is not None:
        make_folder(to)
    begun = time.monotonic()
    judgements: list[Verdict] = []
    with progress() as show, executor_for(workers) as executor:
        rehearsals = [executor.submit(rehearsed, one, source, seed) for source, one in chosen]
        for (_, one), rehearsal in zip(chosen, rehearsals, strict=True):

            def counted(done: int, name: str = one.name) -> None:
                show(f"{name}: {done} of {studies} studies", done / studies)

            of_methods, spread = methods_alone(one, studies, seed, executor, counted)
            show(f"{one.name}: rehearsing {PEOPLE} participants")
            judgements += [*of_methods, *judged(one, rehearsal.result(), spread)]
    used_s = sum(os.times()[:4])  # with the workers', which have ended
    took = f"{time.monotonic() - begun:.0f} s, {used_s:.0f} s of processor time"
    words = f"{studies} studies of each protocol, seed {seed}, in {took}\n\n{markdown(judgements)}"
    click.echo(words, nl=False)
    if to is not None:
        for path in write_files(to, {"thresholds.md": words.encode(), "thresholds.csv": table(judgements)}):
            click.echo(path)
    beyond = sum(not one.holds for one in judgements)
    click.echo(
        f"{beyond} of {len(judgements)} values exceed their limits" if beyond else "every value is within its limit"
    )
    if beyond:
        click.get_current_context().exit(EXIT_FOUND)


@click.command("delay-thresholds")
@click.option("--people", type=click.IntRange(5, 1000), default=40, show_default=True, help="Simulated people.")
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=1, show_default=True, help="Seed of the simulation.")
@click.option("--to", type=Target(), metavar="DIR", help="Folder for the table and the figure.")
def delay_thresholds(people: int, seed: int, to: Path | None) -> None:
    """Compare the delay that simulated people rate as different (rek2024) with the one they detect (delaydetect).

    The forced choice does not depend on a person's criterion; the rating does.
    """
    from study_app.validation.thresholds.noticed_delays import compare, markdown
    from study_app.validation.thresholds.noticed_figure import write

    with progress() as show:
        show("simulating people")
        found = compare(people, seed)
    click.echo(markdown(found), nl=False)
    if to is not None:
        for path in write(found, to):
            click.echo(path)
