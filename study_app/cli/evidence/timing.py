"""The commands that measure the timing of servo, windows and outlets, also for hours."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

import click

from study_app.cli.options import EXIT_FOUND, Target, exclude_each_other, progress
from study_app.errors import DisplayError, StudyError

if TYPE_CHECKING:
    from study_app.app.windows_load import WindowsThread
    from study_app.validation.timing.machine_load import LoadName

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
    if (lsl or triggers is not None) and spin_us is not None:
        raise StudyError("--spin applies to the servo's loops: omit it with --lsl and --triggers")
    if lsl:
        measure_streams(seconds, load, to)
        return
    if triggers is not None:
        measure_triggers(triggers, seconds, load, to)
        return
    if of_devices:
        if spin_us is not None:
            raise StudyError("--spin applies to the servo's loops: omit it with --devices")
        compare_devices(seconds, load, to)
        return
    if of_delays:
        if spin_us is not None:
            raise StudyError("--spin applies to the servo's loops: omit it with --delays")
        time_delays(seconds, load, to)
        return
    from study_app.store.output_files import make_folder
    from study_app.validation.timing.measurement import timing as time_loops
    from study_app.validation.timing.timing_report import text, write

    if to is not None:
        make_folder(to)
    with ending_by_signal() as ending, progress(partial(click.echo, err=True)) as show:
        found = time_loops(seconds, load, windows_thread(load), spin_us=spin_us, ending=ending, progress=show)
    click.echo(text(found), nl=False)
    for written in write(found, to) if to is not None else ():
        click.echo(written)


def time_delays(seconds: float, load: LoadName, to: Path | None) -> None:
    """Print how well delays are kept; without a display, on none."""
    from study_app.store.output_files import make_folder
    from study_app.validation.timing.delay_report import text, write

    if sys.platform == "linux" and not any(map(os.environ.get, ("QT_QPA_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY"))):
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
    if to is not None:
        make_folder(to)
    from study_app.app.delay_session import delays

    with progress(partial(click.echo, err=True)) as show:
        found = delays(seconds, load, progress=show)
    click.echo(text(found), nl=False)
    for written in write(found, to) if to is not None else ():
        click.echo(written)


def compare_devices(seconds: float, load: LoadName, to: Path | None) -> None:
    """Print how late ticks begin with each emulated device; end with 3 where the limit is missed."""
    from study_app.store.output_files import make_folder
    from study_app.validation.timing.device_lateness import emulated_devices, text, time_devices
    from study_app.validation.timing.machine_load import under_load

    if to is not None:
        make_folder(to)
    with ending_by_signal() as ending, progress(partial(click.echo, err=True)) as show:
        found = under_load(
            load,
            windows_thread(load) if load != "none" else None,
            lambda: time_devices(seconds, emulated_devices(), ending=ending, progress=show),
        )
    print_and_keep(text(found), to, "devices.txt")
    if any(one.missed for one in found):
        click.get_current_context().exit(EXIT_FOUND)


def measure_streams(seconds: float, load: LoadName, to: Path | None) -> None:
    """Print what another process receives, and what that costs the servo; end with 3 where a limit is missed."""
    from study_app.store.output_files import make_folder
    from study_app.validation.outlets.lateness import compare
    from study_app.validation.outlets.localhost import localhost_only
    from study_app.validation.outlets.outlet_report import stream_text
    from study_app.validation.outlets.streams import stream
    from study_app.validation.timing.machine_load import under_load

    check_seconds(seconds)
    localhost_only()
    if to is not None:
        make_folder(to)
    windows = windows_thread(load) if load != "none" else None
    with ending_by_signal() as ending, progress(partial(click.echo, err=True)) as show:
        found, ratios = under_load(
            load,
            windows,
            lambda: (
                stream(seconds, ending=ending, progress=show),
                compare(min(seconds, MOST_COMPARED_S), ending=ending, progress=show),
            ),
        )
    print_and_keep(stream_text(found, ratios), to, "streams.txt")
    if not found.met or any(one.percentile == 50 and one.verdict == "missed" for one in ratios):
        click.get_current_context().exit(EXIT_FOUND)


def measure_triggers(port: str, seconds: float, load: LoadName, to: Path | None) -> None:
    """Print how long events take to their bytes on a port."""
    from study_app.store.output_files import make_folder
    from study_app.validation.outlets.outlet_report import trigger_text
    from study_app.validation.outlets.trigger_delays import measure
    from study_app.validation.timing.machine_load import under_load

    check_seconds(seconds)
    if to is not None:
        make_folder(to)
    windows = windows_thread(load) if load != "none" else None
    with ending_by_signal() as ending, progress(partial(click.echo, err=True)) as show:
        found = under_load(load, windows, lambda: measure(port, seconds, ending=ending, progress=show))
    print_and_keep(trigger_text(found), to, "triggers.txt")
    if found.wrong:
        click.get_current_context().exit(EXIT_FOUND)


def check_seconds(seconds: float) -> None:
    """Refuse seconds out of range."""
    from study_app.validation.timing.measurement import LEAST_S, MOST_S

    if not LEAST_S <= seconds <= MOST_S:
        raise StudyError(f"outlets are measured for {LEAST_S:g} to {MOST_S:g} s, not {seconds:g}")


def print_and_keep(text: str, to: Path | None, name: str) -> None:
    """Print a text, and write it into a folder where one was given."""
    from study_app.store.atomic import write_file

    click.echo(text, nl=False)
    if to is not None:
        write_file(to / name, text.encode())
        click.echo(to / name)


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
