"""The worker process that examines a device.

If ended early, it closes the driver, which ends the force; if it does not end, it is killed, and the driver's guard
ends the force.
"""

import signal
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn, TypeAlias

from study_app.devices.doctor import Report
from study_app.devices.registry import doctor_of
from study_app.workers.client import WorkerClient
from study_app.workers.server import Send, Stop


@dataclass(frozen=True, slots=True)
class Examination:
    """The device to examine: its ``name`` as for ``--device``, its options, and the ``faults`` of an emulated one."""

    name: str
    options: Mapping[str, str | Path]
    faults: tuple[str, ...] = ()


ExaminationClient: TypeAlias = WorkerClient[Examination, str | Report]
"""The client of the worker; its answers are lines to show, then the report."""


def start_examination(
    name: str, *, options: Mapping[str, str | Path] | None = None, faults: Sequence[str] = ()
) -> ExaminationClient:
    """Start a worker process that examines one device (see `Examination`)."""
    client: ExaminationClient = WorkerClient("study_app.devices.doctor_worker:carry_out", name="examination")
    client.order(Examination(name, dict(options or {}), tuple(faults)))
    return client


def carry_out(examination: Examination, send: Send, _stop: Stop) -> Report:
    """Examine a device, and return the report."""
    signal.signal(signal.SIGTERM, _exit_on_signal)
    name, options, faults = examination.name, examination.options, examination.faults
    return doctor_of(name).examine(name, options=options, faults=faults, progress=send)


def _exit_on_signal(_number: int, _frame: object) -> NoReturn:
    """Exit by an exception through every ``with`` block, which closes the device."""
    sys.exit(0)
