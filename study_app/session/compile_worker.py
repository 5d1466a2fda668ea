"""The worker process that compiles the force model before the first session needs it."""

from random import Random
from typing import Final, TypeAlias

from study_app.workers.client import WorkerClient
from study_app.workers.server import Send, Stop

DEVICES: Final = ("scripted", "falcon-emulated")
_COMPLETE_MARKER: Final = "filled"
"""The file that marks a cache as holding all compiled code for `DEVICES`."""

CompilationClient: TypeAlias = WorkerClient[tuple[str, ...], float | None]
"""The client of the worker, which receives the fraction of compiled functions, and None at the end."""


def start_compilation(devices: tuple[str, ...] = DEVICES) -> CompilationClient | None:
    """Start a worker process that compiles the code for sessions with these devices.

    Return None if the code is compiled already, or cannot be cached.

    Raises
    ------
    OSError
        The system cannot start a process.
    """
    from study_app.haptics.kernels import CACHE  # noqa: PLC0415 - the compiler

    if CACHE is None or (CACHE / _COMPLETE_MARKER).exists():
        return None
    client: CompilationClient = WorkerClient("study_app.session.compile_worker:carry_out", name="compilation")
    client.order(devices)
    return client


def carry_out(devices: tuple[str, ...], send: Send, _stop: Stop) -> None:
    """Compile the code for ``devices`` by opening each with a servo at zero force."""
    from study_app.devices.rig import open_rig, study_settings  # noqa: PLC0415 - the compiler: only in that process
    from study_app.haptics.kernels import CACHE, following_compilation  # noqa: PLC0415
    from study_app.protocol.load import load  # noqa: PLC0415

    with following_compilation(send):
        for name in devices:
            open_rig(name, study_settings(load("demo"), Random(1))).stop()  # noqa: S311 - a simulated tremor
    if CACHE is not None:
        (CACHE / _COMPLETE_MARKER).touch()
