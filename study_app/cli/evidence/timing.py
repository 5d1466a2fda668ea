"""The commands that measure the timing of servo, windows and outlets, also for hours."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, TypeAlias

import click

from study_app.cli.options import ShowProgress, Target, echo_files, end_if, exclude_each_other, prepare, progress
from study_app.errors import DisplayError, StudyError

if TYPE_CHECKING:
    from study_app.app.windows_load import WindowsThread
    from study_app.evidence.computer import LoadName

Result: TypeAlias = tuple[str, str, bool]
"""A text, the name of its file, and whether a limit is missed."""
MOST_COMPARED_S = 300.0
LOAD = click.Choice(("none", "gui", "gui+cpu"))


@click.command()
@click.option(
    "--seconds", type=float, default=10.0, show_default=True, metavar="S", help="Time for each loop, or for each delay."
)
@click.option(
    "--load", type=LOAD, default="none", show_default=True, help="Also paint both windows; also keep all cores busy."
)
@click.option(
    "--spin", "spin_us", type=float, metavar="US", help="Poll the clock for this time before a deadline [µs]."
)
@click.option("--delays", "of_delays", is_flag=True, help="Measure the delay of the participant's picture instead.")
@click.option(
    "--devices", "of_devices", is_flag=True, help="Compare each emulated device with the scripted hand instead."
)
@click.option("--lsl", is_flag=True, help="Measure the streams of the Lab Streaming Layer instead.")
@click.option(
    "--triggers",
    metavar="PORT",
    help="Measure triggers on a port instead, such as serial:/dev/ttyUSB0; virtual: on a pair of virtual ports.",
)
@click.option("--to", type=Target(), metavar="DIR", help="Folder for tables and figure.")
def timing(
    seconds: float,
    load: LoadName,
    spin_us: float | None,
    of_delays: bool,
    of_devices: bool,
    lsl: bool,
    triggers: str | None,
    to: Path | None,
) -> None:
    """Measure the lateness of the servo, a bare compiled loop, a Python thread and a Qt timer.

    They alternate every quarter second, in each priority class that the system grants. Ctrl+C ends the command.

    With --delays a session presents the delays of rek2024 on screens of 60 and 144 Hz, with and without load, and
    the error of every frame's delay is computed from its recordings. No display is needed.

    With --devices the servo runs alternately on each emulated device and on the scripted hand. Ends with exit code 3
    if the 99th percentile of the lateness on one of them is above 1.5 times that on the scripted hand, with its whole
    95 % interval.

    With --lsl another process receives samples at 1 kHz and markers for the given time; then the servo runs with and
    without both streams, alternately, for up to 300 s each. Ends with exit code 3 if something is lost, a marker's
    time differs from the servo's clock by more than 1 ms, or the median lateness grows by more than 10 %.

    With --triggers a byte is sent to a port for each event, and its delay is measured.
    """
    exclude_each_other(delays=of_delays, devices=of_devices, lsl=lsl, triggers=triggers)
    outlets = lsl or triggers is not None
    for options, chosen in (("lsl and --triggers", outlets), ("devices", of_devices), ("delays", of_delays)):
        if chosen and spin_us is not None:
            raise StudyError(f"--spin applies to the servo's loops: omit it with --{options}")
    if outlets:
        check_seconds(seconds)
    if of_delays:
        time_delays(seconds, load, to)
    elif of_devices:
        measured(partial(compare_devices, seconds), load, to)
    elif lsl:
        from study_app.evidence.outlets.localhost import localhost_only

        localhost_only()
        measured(partial(measure_streams, seconds), load, to)
    elif triggers is not None:
        measured(partial(measure_triggers, triggers, seconds), load, to)
    else:
        from study_app.evidence.timing.measurement import timing as time_loops
        from study_app.evidence.timing.report import text, write

        prepare(to)
        with ending_by_signal() as (ending, _), progress(partial(click.echo, err=True)) as show:
            found = time_loops(seconds, load, windows_thread(load), spin_us=spin_us, ending=ending, progress=show)
        click.echo(text(found), nl=False)
        echo_files(write(found, to) if to is not None else ())


def time_delays(seconds: float, load: LoadName, to: Path | None) -> None:
    """Print how well delays are kept; without a display, on none."""
    from study_app.evidence.timing.delays import text, write

    if sys.platform == "linux" and not any(map(os.environ.get, ("QT_QPA_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY"))):
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
    prepare(to)
    from study_app.app.delay_session import delays

    with progress(partial(click.echo, err=True)) as show:
        found = delays(seconds, load, progress=show)
    click.echo(text(found), nl=False)
    echo_files(write(found, to) if to is not None else ())


def measured(measure: Callable[[threading.Event, ShowProgress], Result], load: LoadName, to: Path | None) -> None:
    """Print and keep what is measured under load, until Ctrl+C; end with 3 where a limit is missed."""
    from study_app.evidence.computer import under_load
    from study_app.store.atomic import write_file

    prepare(to)
    windows = windows_thread(load) if load != "none" else None
    with ending_by_signal() as (ending, _), progress(partial(click.echo, err=True)) as show:
        text, name, missed = under_load(load, windows, lambda: measure(ending, show))
    click.echo(text, nl=False)
    if to is not None:
        write_file(to / name, text.encode())
        click.echo(to / name)
    end_if(missed)


def compare_devices(seconds: float, ending: threading.Event, show: ShowProgress) -> Result:
    """Return how late ticks begin with each emulated device."""
    from study_app.evidence.timing.device_lateness import emulated_devices, text, time_devices

    found = time_devices(seconds, emulated_devices(), ending=ending, progress=show)
    return text(found), "devices.txt", any(one.missed for one in found)


def measure_streams(seconds: float, ending: threading.Event, show: ShowProgress) -> Result:
    """Return what another process receives, and what that costs the servo."""
    from study_app.evidence.outlets.outlet_report import stream_text
    from study_app.evidence.outlets.streams import compare, stream

    found = stream(seconds, ending=ending, progress=show)
    ratios = compare(min(seconds, MOST_COMPARED_S), ending=ending, progress=show)
    missed = not found.met or any(one.percentile == 50 and one.verdict == "missed" for one in ratios)
    return stream_text(found, ratios), "streams.txt", missed


def measure_triggers(port: str, seconds: float, ending: threading.Event, show: ShowProgress) -> Result:
    """Return how long events take to their bytes on a port."""
    from study_app.evidence.outlets.outlet_report import trigger_text
    from study_app.evidence.outlets.trigger_delays import measure

    found = measure(port, seconds, ending=ending, progress=show)
    return trigger_text(found), "triggers.txt", bool(found.wrong)


def check_seconds(seconds: float) -> None:
    """Refuse seconds out of range."""
    from study_app.evidence.timing.measurement import LEAST_S, MOST_S

    if not LEAST_S <= seconds <= MOST_S:
        raise StudyError(f"outlets are measured for {LEAST_S:g} to {MOST_S:g} s, not {seconds:g}")


def windows_thread(load: LoadName) -> WindowsThread | None:
    """Return the windows' thread; None where there is no Qt and nothing is to be painted."""
    try:
        from study_app.app.windows_load import lend
    except DisplayError:
        if load != "none":
            raise
        return None
    return lend(load)


@contextmanager
def ending_by_signal() -> Iterator[tuple[threading.Event, list[int]]]:
    """Set an event on Ctrl+C and when asked to terminate, instead of breaking off; give it and the signals received."""
    ending = threading.Event()
    received: list[int] = []

    def end(number: int, _frame: FrameType | None) -> None:
        received.append(number)
        ending.set()

    before = {number: signal.signal(number, end) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield ending, received
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


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
    from study_app.evidence.computer import under_load
    from study_app.evidence.soak.soak import soak as soak_servo
    from study_app.protocol.load import load_scenes

    scenes = load_scenes(protocol)
    prepare(to)
    with ending_by_signal() as (ending, received):
        found = under_load(
            load,
            windows_thread(load) if load != "none" else None,
            lambda: soak_servo(scenes, hours, virtual=virtual, seed=seed, ending=ending, progress=click.echo),
        )
    click.echo(("" if found.ticks == 0 else "\n") + found.text())
    echo_files(found.write(to) if to is not None else ())
    end_if(found.findings)
    if received:
        context.exit(128 + received[0])
