"""The lab's view: the values that its widgets show, from the workbench, the servo and the appraisal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from study_app.devices.registry import descriptor_of, list_devices, title_of
from study_app.evidence.appraisal import Costs, Errors
from study_app.gui.kit.devices import device_label
from study_app.gui.lab.lab_state import CostRow, DeviceShown, ErrorRow, EstimateShown, LabView, Now
from study_app.haptics.model.effects import NAMED
from study_app.lab.programmed_paths import TITLES

if TYPE_CHECKING:
    from study_app.app.lab.jobs import Prices
    from study_app.lab.ab_comparison import Workbench
    from study_app.lab.live import Live
    from study_app.lab.presets import Choice

SMALLEST_N = 0.001


def cost_rows(costs: Costs) -> tuple[CostRow, ...]:
    """Return what each part of a tick takes, the most expensive first, then what is not there, and why."""
    there = [CostRow(NAMED[it.effect].label, it.ns) for it in costs.effects if it.ns is not None]
    there.append(CostRow("Servo alone", costs.rest_ns))
    absent = (CostRow(NAMED[it.effect].label, None, it.why) for it in costs.effects if it.ns is None)
    return (*sorted(there, key=lambda row: -(row.ns or 0.0)), *absent)


def error_rows(errors: Errors) -> tuple[ErrorRow, ...]:
    """Return how far a setting is from the definition."""
    without = ", ".join(NAMED[it].label.lower() for it in errors.left_out)
    note = f"of drag and wake; no reference for {without}" if without else "along programmed paths"
    return (
        ErrorRow("Wake, of Σ|e|/S", "no wake" if errors.wake is None else _tiny(errors.wake), note),
        ErrorRow("Force, largest", "no drag" if errors.force_n is None else _newtons(errors.force_n), note),
        ErrorRow("Lag of the velocity filter", f"{1e3 * errors.lag_s:z.1f} ms", "at constant acceleration"),
    )


def device_choices() -> tuple[tuple[str, str], ...]:
    """Return every device's name, and the words to choose it by."""
    return tuple((name, device_label(name)) for name in list_devices())


def _tiny(share: float) -> str:
    return f"{share:.0e}".replace("e-0", "e−").replace("e-", "e−") if share > 0 else "0"


def _newtons(force_n: float) -> str:
    return f"< {SMALLEST_N:g} N" if force_n < SMALLEST_N else f"{force_n:.3f} N"


def lab_view(
    bench: Workbench,
    live: Live | None,
    appraisal: Prices,
    *,
    liquids: tuple[Choice, ...],
    device: str,
    opening: str | None,
    progress: str,
    cost_due: bool,
    trouble: str,
    refused: tuple[str, str] | None,
    said: str,
    study: str,
    estimate: EstimateShown,
) -> LabView:
    """Return the view of the lab at this moment.

    Parameters
    ----------
    bench, live, appraisal : both settings, the open device with its servo (None without one), and costs and errors
    liquids : the liquids that a side can be set to
    device : name of the selected device
    opening, progress : name of the device that is being opened (None without one), and its last message
    cost_due : whether an appraisal is about to be asked for
    trouble : what failed, "" if nothing did
    refused : name of a parameter and why its value was refused
    said : the last message about presets
    study : the study that takes changes back, "" without one
    estimate : what a measured force says
    """
    reading = None if live is None else live.reading()
    fault = "" if reading is None else reading.fault
    if fault or (trouble and live is None):  # an edit or a file that was refused stops no device
        state = "stopped"
    else:
        state = "opening" if opening is not None else "ready" if live is not None else "closed"
    scene = bench.in_hand.scene
    shown: dict[str, Any] = {}
    if live is not None:
        half_x, half_y, half_z = live.device.workspace_m
        shown["workspace_m"] = (2 * half_x, 2 * half_y, 2 * half_z)
    if not bench.blind:  # the ball's size would tell one from the other
        shown["body_radius_m"] = scene.body.diameter_m / 2 / scene.scale
    return LabView(
        workbench=bench,
        liquids=liquids,
        device=DeviceShown(
            device_choices(), device, state, live is not None and not fault, descriptor_of(device).pointer
        ),
        paths=tuple(TITLES.items()),
        path=None if live is None else live.path,
        trace=None if live is None else live.trace(),
        tail_a=None if live is None else live.tail("A"),
        tail_b=None if live is None else live.tail("B"),
        now=None if reading is None else Now(reading.position_m, reading.force_n, reading.wake_mps),
        limiters=() if live is None else live.limiters(),
        cost=() if appraisal.costs is None else cost_rows(appraisal.costs),
        tick_ns=None if appraisal.costs is None else appraisal.costs.tick_ns,
        errors=() if appraisal.errors is None else error_rows(appraisal.errors),
        measuring=appraisal.waits or cost_due,
        force_on=reading is not None and reading.force_on,
        busy="" if opening is None else progress or f"Opening {title_of(opening)}",
        trouble=trouble or fault,
        refused=refused,
        said=said,
        study=study,
        estimate=estimate,
        **shown,
    )
