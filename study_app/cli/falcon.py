"""The commands about the Novint Falcon."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from study_app.devices.falcon.emulator.emulator import Emulator


@click.command("emulate-falcon")
@click.option(
    "--socket", required=True, type=click.Path(path_type=Path), metavar="PATH", help="Unix socket to serve it at."
)
@click.option("--fault", "faults", multiple=True, metavar="NAME", help="frozen, drop=0.01 …; may come again.")
@click.option("--running", is_flag=True, help="Its program is loaded already.")
@click.option("--geometry", metavar="NAME", help="libnifalcon (default), zm-redux or martin-hillier.")
@click.option("--serial", default="EMULATED", show_default=True, metavar="TEXT", help="Serial number of its bridge.")
@click.option("--seed", default=0, show_default=True, metavar="N", help="Of tremor and faults.")
def emulate_falcon(
    socket: Path, faults: tuple[str, ...], running: bool, geometry: str | None, serial: str, seed: int
) -> None:
    """Serve an emulated Falcon to other programs, in real time, until Ctrl-C.

    It answers as the USB bridge does, from the boot loader on, in the frames that
    study_app/devices/falcon/transport/socket_frames.py describes; --device falcon-socket:PATH connects our own driver.
    Lights, homing and torques are printed as they change, on a terminal only.
    """
    from study_app.devices.falcon.emulator.emulator import Emulator
    from study_app.devices.falcon.emulator.socket_server import EmulatorServer
    from study_app.devices.falcon.mechanics.geometry import DEFAULT_GEOMETRY

    random = Random(seed)  # noqa: S311 - tremor and faults keep no secrets
    emulator = Emulator(random, geometry=geometry or DEFAULT_GEOMETRY, running=running, serial=serial)
    for fault in faults:
        emulator.take(fault)
    server = EmulatorServer(emulator, socket)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: server.stop())
    click.echo(f"An emulated Falcon at {socket}; Ctrl-C ends it.")
    server.serve(_teller(emulator) if sys.stdout.isatty() else None)


def _teller(emulator: Emulator) -> Callable[[], None]:
    """Return what prints the state when it has changed."""
    told = ""

    def tell() -> None:
        nonlocal told
        state = state_of(emulator)
        if state != told:
            told = state
            click.echo(state)

    return tell


def state_of(emulator: Emulator) -> str:
    """Return lights, homing and torques in a line."""
    from study_app.devices.falcon.wire import constants

    names = {constants.FLAG_RED: "red", constants.FLAG_GREEN: "green", constants.FLAG_BLUE: "blue"}
    lights = ", ".join(name for flag, name in names.items() if emulator.lights & flag) or "none"
    torques = ", ".join(str(torque) for torque in emulator.torques)
    if not emulator.powered:
        return "no power"
    if not emulator.running:
        return f"no program yet, {emulator.loaded} bytes of it"
    return f"lights {lights} | arms homed {emulator.homed.bit_count()} of 3 | torques {torques}"
