"""The command that shows how late the servo's turns begin, beside what others do."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

import click

from study_app.errors import DisplayError

if TYPE_CHECKING:
    from study_app.app.timing import WindowsThread
    from study_app.evaluation.timing.load import LoadName

LOAD = click.Choice(("none", "gui", "gui+cpu"))


@click.command()
@click.option(
    "--seconds", type=float, default=10.0, show_default=True, metavar="S", help="How long each loop is timed."
)
@click.option(
    "--load", type=LOAD, default="none", show_default=True, help="Paint both windows meanwhile; keep cores busy."
)
@click.option(
    "--spin", "spin_us", type=float, metavar="US", help="Look at the clock for so long before a deadline [µs]."
)
@click.option("--to", type=click.Path(path_type=Path), metavar="DIR", help="Folder for tables and figure.")
def timing(seconds: float, load: LoadName, spin_us: float | None, to: Path | None) -> None:
    """Time the servo's turns with every effect on, beside a bare compiled loop, a Python thread and a Qt timer.

    All take turns of a quarter second, round about, in each priority class that the system grants. Ctrl+C ends it.
    """
    from study_app.evaluation.output import make_folder
    from study_app.evaluation.timing.files import text, write
    from study_app.evaluation.timing.race import timing as time_loops

    if to is not None:
        make_folder(to)
    with ending_by_signal() as ending:
        found = time_loops(
            seconds,
            load,
            windows_thread(load),
            spin_us=spin_us,
            ending=ending,
            tell=lambda line: click.echo(line, err=True),
        )
    click.echo(text(found), nl=False)
    for written in write(found, to) if to is not None else ():
        click.echo(written)


def windows_thread(load: LoadName) -> WindowsThread | None:
    """Return the windows' thread; None where there is no Qt and nothing is to be painted."""
    try:
        from study_app.app.timing import lend
    except DisplayError:
        if load != "none":
            raise
        return None
    return lend(load)


@contextmanager
def ending_by_signal() -> Iterator[threading.Event]:
    """Set an event on Ctrl+C and when asked to terminate, instead of breaking off."""
    ending = threading.Event()

    def end(_number: int, _frame: FrameType | None) -> None:
        ending.set()

    before = {number: signal.signal(number, end) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield ending
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
