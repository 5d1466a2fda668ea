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

from study_app.cli.evidence import present
from study_app.cli.options import ShowProgress, Target, exclude_each_other, prepare, progress
from study_app.errors import DisplayError, StudyError

if TYPE_CHECKING:
    from study_app.app.delay_session import WindowsThread
    from study_app.evidence.computer import LoadName

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
    from study_app.evidence.computer import under_load
    from study_app.evidence.table import Evidence, check_seconds

    others = {"delays": of_delays, "devices": of_devices, "lsl": lsl, "triggers": triggers}
    exclude_each_other(**others)
    other = next((name for name, given in others.items() if given), "")
    if other and spin_us is not None:
        raise StudyError(f"--spin applies to the servo's loops: omit it with --{other}")
    if other in {"lsl", "triggers"}:
        check_seconds(seconds, "outlets are measured")
    if other == "delays":
        _choose_display()
    prepare(to)

    def measured(ending: threading.Event, show: ShowProgress) -> Evidence:
        if other == "devices":
            from study_app.evidence.timing import device_lateness as devices

            names = devices.emulated_devices()
            return devices.evidence(devices.time_devices(seconds, names, ending=ending, progress=show))
        if other == "lsl":
            from study_app.evidence.outlets import streams
            from study_app.evidence.outlets.localhost import localhost_only

            localhost_only()
            found = streams.stream(seconds, ending=ending, progress=show)
            compared = streams.compare(min(seconds, MOST_COMPARED_S), ending=ending, progress=show)
            return streams.evidence(found, compared)
        from study_app.evidence.outlets import triggers as ports

        return ports.evidence(ports.measure(triggers or "", seconds, ending=ending, progress=show))

    if other == "delays":
        from study_app.app.delay_session import delays
        from study_app.evidence.timing.delays import evidence

        with progress(partial(click.echo, err=True)) as show:
            found = evidence(delays(seconds, load, progress=show))
    else:
        windows = windows_thread(load) if load != "none" or not other else None
        with ending_by_signal() as (ending, _), progress(partial(click.echo, err=True)) as show:
            if other:
                found = under_load(load, windows, partial(measured, ending, show))
            else:
                from study_app.evidence.timing import measurement, report

                timed = measurement.timing(seconds, load, windows, spin_us=spin_us, ending=ending, progress=show)
                found = report.evidence(timed)
    present(found, to)


def _choose_display() -> None:
    """Without a display, show on none."""
    if sys.platform == "linux" and not any(map(os.environ.get, ("QT_QPA_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY"))):
        os.environ["QT_QPA_PLATFORM"] = "offscreen"


def windows_thread(load: LoadName) -> WindowsThread | None:
    """Return the windows' thread; None where there is no Qt and nothing is to be painted."""
    try:
        from study_app.app.delay_session import lend
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
    if found.ticks > 0:
        click.echo()
    present(found.evidence(), to)
    if received:
        context.exit(128 + received[0])
