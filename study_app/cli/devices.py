"""The commands about what is felt with: what is connected, what is wrong with it, and how strong it is."""

from __future__ import annotations

import os
import queue
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from math import degrees
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

import click

from study_app.cli.options import EXIT_FOUND

if TYPE_CHECKING:
    from study_app.devices.falcon.device import FalconDevice
    from study_app.devices.falcon.doctor.weighing import Ask, Notes
    from study_app.devices.falcon.emulator.emulator import Emulator
    from study_app.devices.falcon.mechanics.calibration import Calibration

_WIDTH = 100
_PREPARING = "Preparing …"
FIRMWARE = click.option("--firmware", type=click.Path(path_type=Path), metavar="PATH", help="Its program.")
DEVICE = click.option("--device", "name", default="falcon", show_default=True, metavar="NAME", help="Which Falcon.")


@click.group(invoke_without_command=True)
@click.pass_context
def devices(context: click.Context) -> None:
    """List what can be felt with; look a Falcon over; calibrate it."""
    if context.invoked_subcommand is None:
        context.invoke(list_devices)


@devices.command("list")
def list_devices() -> None:
    """List every device, what of it is connected, what it can do, and why it cannot be used."""
    from study_app.devices.backends import backends

    for backend in backends():
        click.echo(f"{backend.name:<19} {backend.state}  ({backend.by})")
        for line in (backend.can, backend.why):
            if line:
                click.echo(_indented(line, 20))


@devices.command()
@DEVICE
@FIRMWARE
@click.option("--fault", "faults", multiple=True, metavar="NAME", help="Of falcon-emulated: frozen, drop=0.01 …")
@click.option("--to", type=click.Path(path_type=Path), metavar="FILE", help="Write a zip file for whoever helps.")
def doctor(name: str, firmware: Path | None, faults: tuple[str, ...], to: Path | None) -> None:
    """Look a Falcon over: find, open, load, home and turn it, without force; say what is wrong, why, and the cure.

    NAME is falcon, falcon:SERIAL, falcon-emulated or falcon-socket:PATH. Exit code 3 where something is wrong. The zip
    file holds this report, versions, settings, log and last error; no participant's id, no answer, no liquid's value.
    """
    click.echo(_PREPARING)  # what is imported and compiled next takes long the first time
    from study_app.devices.doctor_report import lines
    from study_app.devices.falcon.doctor.examine import examine
    from study_app.devices.falcon.doctor.failure_report import report

    found = report(examine(name, firmware=firmware, faults=faults, tell=click.echo))
    for line in lines(found):
        click.echo(line)
    if to is not None:
        from study_app.store.support import write_support

        write_support(to, "\n".join(lines(found)).strip() + "\n")
        click.echo(f"Written: {to}")
    if not found.well:
        click.get_current_context().exit(EXIT_FOUND)


@devices.command()
@DEVICE
@FIRMWARE
@click.option("--grams", type=click.FloatRange(110, 600), metavar="G", help="Hang a weight, 110 to 600.")
@click.option("--scale", is_flag=True, help="Pull with a luggage scale instead.")
@click.option("--geometry", metavar="NAME", help="libnifalcon (default), zm-redux or martin-hillier.")
def calibrate(name: str, firmware: Path | None, grams: float | None, *, scale: bool, geometry: str | None) -> None:
    """Measure how many motor units a newton takes, with a known weight or a luggage scale; kept by serial number.

    The Falcon holds its grip at five places, first with nothing on it, then with the weight. Exit code 3 where what was
    weighed does not fit together: then nothing is kept.
    """
    if scale == (grams is not None):
        raise click.UsageError("calibrate needs either --grams G, a weight to hang on the grip, or --scale")
    click.echo(_PREPARING)
    from study_app.devices.falcon.doctor import weighing
    from study_app.devices.falcon.mechanics import calibration
    from study_app.devices.falcon.mechanics.geometry import DEFAULT_GEOMETRY, geometry_named

    measures = geometry_named(geometry or DEFAULT_GEOMETRY)
    device, emulator = _falcon(name, firmware, grams)
    with device:
        grip = weighing.Grip(device, virtual=emulator is not None)
        weight_n = (grams or 0.0) / 1000 * weighing.GRAVITY_MPS2
        ask = _Terminal(sys.stdin.fileno()).ask if emulator is None else _ask_emulator(emulator, weight_n)
        notes = weighing.pull(grip, ask) if grams is None else weighing.hang(grip, weight_n, ask)
        serial = device.describe()["serial"]
    found = calibration.fit(measures, notes.counts, notes.forces_n, notes.units)
    for line in _calibrated(found, notes):
        click.echo(line)
    if found.residual_n > calibration.MOST_RESIDUAL_N:
        click.echo(f"More than {calibration.MOST_RESIDUAL_N} N is unexplained: nothing was kept. Weigh again.")
        click.get_current_context().exit(EXIT_FOUND)
    if name.startswith("falcon-socket"):
        click.echo("Nothing is kept of what answers at a socket.")
    else:
        click.echo(f"Kept in {calibration.save(serial or '', found)}.")


def _falcon(name: str, firmware: Path | None, grams: float | None) -> tuple[FalconDevice, Emulator | None]:
    """Return the Falcon, not yet open, and the emulator behind it, if there is one."""
    from study_app.devices.falcon.device import FalconDevice
    from study_app.devices.falcon.emulated import EmulatedFalcon
    from study_app.devices.falcon.emulator.emulator import Emulator
    from study_app.devices.registry import kind_of
    from study_app.errors import DeviceError

    kind = kind_of(name)
    if not kind.startswith("falcon"):
        raise DeviceError(f"'{name}' has no motors to calibrate: only a Falcon has")
    if kind != "falcon-emulated":
        return FalconDevice(name, firmware=firmware, tell=click.echo), None
    if grams is None:
        raise DeviceError("nobody pulls an emulated Falcon with a scale: hang a weight on it with --grams")
    # A serial number of its own: no rehearsal shall find this calibration.
    emulator = Emulator(running=firmware is None, serial="EMULATED-WEIGHED")
    return EmulatedFalcon(firmware=firmware, tell=click.echo, emulator=emulator), emulator


def _calibrated(found: Calibration, notes: Notes) -> list[str]:
    """Return what was found, and what it leaves of each rest."""
    from study_app.devices.falcon.mechanics.calibration import UNCALIBRATED_UNITS_PER_NM, left_over

    lines = ["", "rest  load [N]  unexplained x, y, z [N]"]
    for number, (load, left) in enumerate(
        zip(-notes.forces_n[:, 1], left_over(found, notes.counts, notes.forces_n, notes.units), strict=True), start=1
    ):
        lines.append(f"{number:>4}  {load:>8.2f}  {left[0]:+.3f} {left[1]:+.3f} {left[2]:+.3f}")
    share = found.units_per_nm / UNCALIBRATED_UNITS_PER_NM
    lines += [
        "",
        f"{found.units_per_nm:.0f} motor units for a newton metre, {share:.2f} times those of one without calibration",
        f"arms' offset {degrees(found.arm_offset_rad):+.2f} degrees; the grip's own weight {found.own_weight_n:.2f} N",
        f"unexplained {found.residual_n:.3f} N in the mean square, friction for the most part",
    ]
    return lines


class _Terminal:
    """Lines that the operator types while the grip is held.

    Read without Python's own buffer, whose lock a thread that still waits at the program's end would keep.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        threading.Thread(target=self._listen, daemon=True).start()

    def ask(self, kind: str, words: str) -> Callable[[], str | None]:
        """Ask for an answer; the end of the input gives up. What was typed before the question does not count."""
        if os.isatty(self._descriptor):
            with suppress(queue.Empty):
                while self._lines.get_nowait() is not None:
                    pass
        click.echo(words if kind == "reading" else f"{words} Then press Enter.")

        def answered() -> str | None:
            try:
                line = self._lines.get_nowait()
            except queue.Empty:
                return None
            if line is None:
                raise click.Abort
            return line.strip()

        return answered

    def _listen(self) -> None:
        typed = b""
        with suppress(OSError):  # in the background nothing can be read from a terminal
            while more := os.read(self._descriptor, 1024):
                *lines, typed = (typed + more).split(b"\n")
                for line in lines:
                    self._lines.put(line.decode(errors="replace"))
        self._lines.put(None)


def _ask_emulator(emulator: Emulator, weight_n: float) -> Ask:
    """Let the emulated hand do what is asked for."""

    def ask(kind: str, words: str) -> Callable[[], str | None]:
        click.echo(words)
        if kind in {"hang", "take-off"}:
            emulator.weight_n = weight_n if kind == "hang" else 0.0
        emulator.held = kind == "take-off"
        return lambda: ""

    return ask


def _indented(words: str, by: int) -> str:
    space = " " * by
    return fill(words, _WIDTH, initial_indent=space, subsequent_indent=space, break_long_words=False)
