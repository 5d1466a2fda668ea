"""The command that runs the servo for hours."""

from __future__ import annotations

import signal
import threading
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

import click

from study_app.cli.evidence.timing import LOAD, windows_thread
from study_app.cli.options import EXIT_FOUND, Target

if TYPE_CHECKING:
    from study_app.validation.timing.machine_load import LoadName


@click.command()
@click.argument("protocol", metavar="[FILE]", default="rek2024")
@click.option("--hours", type=float, required=True, metavar="H", help="Duration in hours; 0.01 is 36 seconds.")
@click.option("--virtual", is_flag=True, help="In virtual time: a day takes minutes.")
@click.option("--seed", type=click.IntRange(0, 2**31 - 1), default=1, show_default=True, help="Seed of the faults.")
@click.option(
    "--load", type=LOAD, default="none", help="Also paint both windows of a session; also keep all cores busy."
)
@click.option("--to", type=Target(), metavar="DIR", help="Folder for the report.")
@click.pass_context
def soak(
    context: click.Context, hours: float, protocol: str, seed: int, load: LoadName, to: Path | None, *, virtual: bool
) -> None:
    """Run the servo for hours with a moving hand and every fault; report drift, leaks and failures.

    FILE defines the liquids; default: rek2024. Ctrl+C ends it with the report so far.
    """
    from study_app.protocol.load import load_scenes
    from study_app.store.output_files import make_folder
    from study_app.validation.soak.soak import soak as soak_servo
    from study_app.validation.timing.machine_load import under_load

    scenes = load_scenes(protocol)
    if to is not None:
        make_folder(to)
    ending = threading.Event()
    heard: list[int] = []

    def end(number: int, _frame: FrameType | None) -> None:
        heard.append(number)
        ending.set()

    before = {number: signal.signal(number, end) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        found = under_load(
            load,
            windows_thread(load) if load != "none" else None,
            lambda: soak_servo(scenes, hours, virtual=virtual, seed=seed, ending=ending, progress=click.echo),
        )
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    click.echo(("" if found.ticks == 0 else "\n") + found.text())
    for written in found.write(to) if to is not None else ():
        click.echo(written)
    if found.findings:
        context.exit(EXIT_FOUND)
    if heard:
        context.exit(128 + heard[0])
