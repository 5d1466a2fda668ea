"""The commands about devices, plug-ins and outlets: list, diagnose, measure and calibrate."""

from __future__ import annotations

import os
import queue
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from datetime import date
from math import degrees
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import click

from study_app.cli.options import TakesDeviceOptions, exit_if
from study_app.errors import DeviceError

if TYPE_CHECKING:
    from study_app.devices.bench.procedure import Ask as AskOperator
    from study_app.devices.bench.procedure import Found
    from study_app.devices.emulators.falcon_emulator import Emulator
    from study_app.devices.falcon.calibration import Ask, Calibration, Notes
    from study_app.devices.falcon.device import FalconDevice

_WIDTH = 100
_PREPARING = "Preparing…"
_FIRMWARE = click.option("--firmware", type=click.Path(path_type=Path), metavar="PATH", help="Firmware file.")
DEVICE = click.option("--device", "name", default="falcon", show_default=True, metavar="NAME", help="The device.")
_OFF = "off"


@click.group(invoke_without_command=True)
@click.pass_context
def devices(context: click.Context) -> None:
    """List the devices, examine or measure one, or calibrate a Falcon."""
    if context.invoked_subcommand is None:
        context.invoke(list_devices)


@devices.command("list")
def list_devices() -> None:
    """List every device: whether it is connected, what it can do and, if it cannot be used, why."""
    from study_app.devices.registry import all_devices, backends

    properties = {
        device.name: f"; {device.kind}, {device.degrees_of_freedom} degrees of freedom" for device in all_devices()
    }
    for backend in backends():
        description = f"{backend.by}{properties.get(backend.name.partition(':')[0], '')}"
        click.echo(f"{backend.name:<19} {backend.state}  ({description})")
        for line in (backend.can, backend.why):
            if line:
                space = " " * 20
                click.echo(fill(line, _WIDTH, initial_indent=space, subsequent_indent=space, break_long_words=False))


@click.command()
def plugins() -> None:
    """List the plug-ins from other packages, with their versions and locations, what they add, and any problems.

    The exit code is 3 if a plug-in cannot be used.
    """
    from study_app.discovery import UPDATE, plug_ins

    entries = plug_ins()
    for package, version, origin in dict.fromkeys((entry.package, entry.version, entry.origin) for entry in entries):
        click.echo(f"{package} {version}  ({origin})")
        for entry in entries:
            if (entry.package, entry.version) == (package, version):
                click.echo(f"    {entry.kind:<9} {entry.name}{f': {entry.fault}; {UPDATE}' if entry.fault else ''}")
    if not entries:
        click.echo("No plug-ins are installed; docs/plug-ins.md explains how to write one.")
    exit_if(any(entry.fault for entry in entries))


@devices.command(cls=TakesDeviceOptions)
@DEVICE
@click.option(
    "--fault",
    "faults",
    multiple=True,
    metavar="NAME",
    help="Fault to simulate on an emulated device, such as nan or drop=0.01.",
)
@click.option("--to", type=click.Path(path_type=Path), metavar="FILE", help="Write a zip file for support.")
def doctor(name: str, faults: tuple[str, ...], to: Path | None, device_options: dict[str, str | Path]) -> None:
    """Examine a device: find, open and run it without force; report each fault with its cause and remedy.

    NAME is a device that can be examined: falcon, falcon:SERIAL, falcon-emulated, inverse3,
    inverse3:HOST:PORT, inverse3-emulated, force-dimension, force-dimension:SERIAL or force-dimension-emulated. The exit
    code is 3 if a fault is found. The zip file contains this report, version numbers, settings, the log and the last
    error, but no participant IDs, answers or liquids.
    """
    click.echo(_PREPARING)  # the first time, the imports and compilations below take long
    from study_app.devices.doctor import report_lines
    from study_app.devices.registry import check_options, doctor_of

    check_options(name, device_options)
    diagnosis = doctor_of(name).examine(name, options=device_options, faults=faults, progress=click.echo)
    for line in report_lines(diagnosis):
        click.echo(line)
    if to is not None:
        from study_app.store.support import write_support_archive

        write_support_archive(to, "\n".join(report_lines(diagnosis)).strip() + "\n")
        click.echo(f"Written: {to}")
    exit_if(not diagnosis.well)


@devices.command()
@DEVICE
@_FIRMWARE
@click.option("--grams", type=click.FloatRange(110, 600), metavar="G", help="Use a weight of 110 to 600 grams.")
@click.option("--scale", is_flag=True, help="Use a luggage scale instead.")
@click.option("--geometry", metavar="NAME", help="Arm geometry: libnifalcon (default), zm-redux or martin-hillier.")
def calibrate(name: str, firmware: Path | None, grams: float | None, *, scale: bool, geometry: str | None) -> None:
    """Calibrate a Falcon's force with a known weight or a luggage scale; the result is stored under its serial number.

    The Falcon holds its grip in five positions, first without a load and then with the weight. If the measurements are
    inconsistent, nothing is saved and the exit code is 3.
    """
    if scale == (grams is not None):
        raise click.UsageError("calibrate needs either --grams G (a weight to hang on the grip) or --scale")
    click.echo(_PREPARING)
    from study_app.devices.falcon import calibration
    from study_app.devices.falcon.mechanics import DEFAULT_GEOMETRY, geometry_named

    measures = geometry_named(geometry or DEFAULT_GEOMETRY)
    device, emulator = _falcon_and_emulator(name, firmware, grams)
    with device:
        grip = calibration.Grip(device, virtual=emulator is not None)
        weight_n = (grams or 0.0) / 1000 * calibration.GRAVITY_MPS2
        ask = Terminal(sys.stdin.fileno()).ask if emulator is None else _ask_emulator(emulator, weight_n)
        notes = (
            calibration.measure_with_scale(grip, ask)
            if grams is None
            else calibration.measure_with_weight(grip, weight_n, ask)
        )
        serial = device.describe()["serial"]
    calibrated = calibration.fit(measures, notes.counts, notes.forces_n, notes.units)
    for line in _calibration_lines(calibrated, notes):
        click.echo(line)
    if calibrated.residual_n > calibration.MOST_RESIDUAL_N:
        problem = f"The unexplained force is greater than {calibration.MOST_RESIDUAL_N} N"
        click.echo(f"{problem}, so nothing was saved. Repeat the calibration.")
        exit_if(True)
    click.echo(f"Saved in {calibration.save_calibration(serial or '', calibrated)}.")


@devices.command(cls=TakesDeviceOptions)
@click.argument("name")
@click.option(
    "--to",
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    help="Folder for the report; default: bench-NAME in the current folder.",
)
def bench(name: str, to: Path | None, device_options: dict[str, str | Path]) -> None:
    """Measure a device in ten minutes: timing, noise, mass, friction, force on a scale, and maximum stable damping.

    Stay within reach of the power switch: the handle moves by itself, with a force of up to 4 N. To stop the force,
    press Enter, Ctrl+C or the handle's stop button, if it has one. You can share the report (bench.md, bench.json); the
    measurements are also copied into the receipt of each later session on this machine. If anyone touched the handle,
    the measurements are not copied, and the exit code is 3.
    """
    from study_app.devices.registry import check_options, descriptor_of

    descriptor = descriptor_of(name)
    check_options(name, device_options)
    if descriptor.kind == "seen":
        raise DeviceError(
            f"device '{name}' does not produce force: see 'liquid-study devices list' for devices that do"
        )
    click.echo(_PREPARING)
    from study_app.devices.bench.procedure import ask_simulated_hand, run_bench
    from study_app.devices.registry import open_device
    from study_app.haptics.runtime.clocks import SystemClock, VirtualClock

    folder = to if to is not None else Path(f"bench-{descriptor.name}")
    folder.mkdir(parents=True, exist_ok=True)
    with open_device(name, options=device_options, progress=click.echo) as device:
        simulated = descriptor.moves_by_itself
        results = run_bench(
            device,
            ask_simulated_hand(device, click.echo) if simulated else _ask_operator(Terminal(sys.stdin.fileno())),
            progress=click.echo,
            clock=VirtualClock() if simulated else SystemClock(),
        )
    _save_bench(results, folder, simulated=descriptor.simulated)


def _ask_operator(terminal: Terminal) -> AskOperator:
    """Return a function that asks at the terminal; only "let-go" asks to press Enter."""
    return lambda kind, question: terminal.ask(kind if kind == "let-go" else "reading", question)


def _save_bench(results: Found, folder: Path, *, simulated: bool) -> None:
    """Write the report; for a real device, also store the results in this machine's settings."""
    from study_app.devices.bench.procedure import as_json, as_markdown, workstation_results
    from study_app.store import workstation
    from study_app.store.files import write_file

    day = date.today().isoformat()
    text = as_markdown(results, day)
    for name, content in (("bench.md", text), ("bench.json", as_json(results, day))):
        write_file(folder / name, content.encode())
    click.echo(f"\n{text}\nWritten: {folder / 'bench.md'}, {folder / 'bench.json'}")
    if simulated:
        click.echo("The device is simulated, so its measurements will not be copied into receipts.")
        return
    if not results.fits:
        click.echo(
            "The measurements will not be copied into receipts, because mass, damping and friction do not "
            "explain the handle's motion."
        )
        exit_if(True)
    report = str((folder / "bench.md").resolve())
    bench = workstation.DeviceBench.model_validate({**workstation_results(results, day), "report": report})
    workstation.save_settings(workstation.load_or_default()[0].with_bench(bench))
    click.echo(
        "The results were saved in this machine's settings. They appear on the Devices page and in the "
        "receipts of later sessions."
    )


def _falcon_and_emulator(name: str, firmware: Path | None, grams: float | None) -> tuple[FalconDevice, Emulator | None]:
    """Return the Falcon, which is not open yet, and its emulator, if it is emulated."""
    from study_app.devices.descriptor import OpenRequest
    from study_app.devices.driver import framed_device
    from study_app.devices.emulators.falcon import EmulatedFalcon
    from study_app.devices.emulators.falcon_emulator import Emulator
    from study_app.devices.falcon.device import FalconDevice

    options = {} if firmware is None else {"firmware": firmware}
    request = OpenRequest(argument=name.partition(":")[2], options=options, progress=click.echo)
    device = framed_device(name, request)
    if not isinstance(device, FalconDevice):
        raise DeviceError(f"'{name}' cannot be calibrated: specify a Falcon")
    if not isinstance(device, EmulatedFalcon):
        return device, None
    if grams is None:
        raise DeviceError("an emulated Falcon cannot be pulled with a scale: use a weight with --grams")
    # Rehearsals must not find this calibration, so the serial number differs from theirs.
    emulator = Emulator(running=firmware is None, serial="EMULATED-WEIGHED")
    return EmulatedFalcon(firmware=firmware, progress=click.echo, emulator=emulator), emulator


def _calibration_lines(fit: Calibration, notes: Notes) -> list[str]:
    from study_app.devices.falcon.calibration import UNCALIBRATED_UNITS_PER_NM, residual_forces

    lines = ["", "pos.  load [N]  unexplained x, y, z [N]"]
    for number, (load, residual) in enumerate(
        zip(-notes.forces_n[:, 1], residual_forces(fit, notes.counts, notes.forces_n, notes.units), strict=True),
        start=1,
    ):
        lines.append(f"{number:>4}  {load:>8.2f}  {residual[0]:+.3f} {residual[1]:+.3f} {residual[2]:+.3f}")
    ratio = fit.units_per_nm / UNCALIBRATED_UNITS_PER_NM
    lines += [
        "",
        f"{fit.units_per_nm:.0f} motor units per newton metre, {ratio:.2f} times the uncalibrated default",
        f"arm offset {degrees(fit.arm_offset_rad):+.2f} degrees; grip weight {fit.own_weight_n:.2f} N",
        f"unexplained force {fit.residual_n:.3f} N RMS, mostly friction",
    ]
    return lines


class Terminal:
    """Reads the lines that the operator types, in a separate thread.

    It does not use ``sys.stdin``, since a thread that is still reading at the end of the program would hold its lock.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        threading.Thread(target=self._read_lines, daemon=True).start()

    def ask(self, kind: str, question: str) -> Callable[[], str | None]:
        """Ask a question; return a function that returns the answer, or None until there is one.

        Lines typed earlier at a terminal are ignored.
        """
        if os.isatty(self._descriptor):
            with suppress(queue.Empty):
                while self._lines.get_nowait() is not None:
                    pass
        click.echo(question if kind == "reading" else f"{question} Then press Enter.")

        def read_answer() -> str | None:
            try:
                line = self._lines.get_nowait()
            except queue.Empty:
                return None
            if line is None:
                raise click.Abort
            return line.strip()

        return read_answer

    def _read_lines(self) -> None:
        incomplete = b""
        with suppress(OSError):  # a background process cannot read from a terminal
            while received := os.read(self._descriptor, 1024):
                *lines, incomplete = (incomplete + received).split(b"\n")
                for line in lines:
                    self._lines.put(line.decode(errors="replace"))
        self._lines.put(None)


def _ask_emulator(emulator: Emulator, weight_n: float) -> Ask:
    """Return a function that carries out the instructions on the emulator instead of asking."""

    def ask(kind: str, question: str) -> Callable[[], str | None]:
        click.echo(question)
        if kind in {"hang", "take-off"}:
            emulator.weight_n = weight_n if kind == "hang" else 0.0
        emulator.held = kind == "take-off"
        return lambda: ""

    return ask


@click.command()
@click.option(
    "--markers", type=click.Choice((_OFF, "on")), help="Send event markers over the Lab Streaming Layer (LSL)."
)
@click.option(
    "--samples",
    type=click.Choice((_OFF, "single-blind", "always")),
    help="Send samples over LSL; single-blind sends them except in double-blind studies.",
)
@click.option(
    "--triggers", metavar="PORT", help=("Send trigger codes to a port, such as serial:/dev/ttyUSB0; off disables them.")
)
def outlets(markers: str | None, samples: str | None, triggers: str | None) -> None:
    """Print what sessions on this machine send to other programs; use the options to change this."""
    from study_app.errors import OutletError
    from study_app.outlets.session_outlets import is_port, port_examples
    from study_app.store import workstation

    settings = workstation.load_settings()
    changes: dict[str, Any] = {} if markers is None else {"lsl_markers": markers == "on"}
    if samples is not None:
        changes["lsl_samples"] = samples
    if triggers is not None:
        changes["triggers"] = "" if triggers == _OFF else triggers
        if triggers != _OFF and not is_port(triggers):
            examples = " or ".join(port_examples())
            raise OutletError(
                f"--triggers '{triggers}' is not the address of a port: specify one such as {examples}, or off"
            )
    if changes:
        settings = type(settings).model_validate(settings.model_dump() | changes)
        workstation.save_settings(settings)
    click.echo(f"markers over LSL: {'on' if settings.lsl_markers else _OFF}")
    click.echo(f"samples over LSL: {settings.lsl_samples}")
    click.echo(f"triggers: {settings.triggers or _OFF}")
