"""The lab's view: the values that its widgets show, from the workbench, the servo and the appraisal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from study_app.app.lab_rows import cost_rows, device_choices, error_rows
from study_app.devices.registry import descriptor_of, title_of
from study_app.lab.programmed_paths import TITLES
from study_app.viewmodels.estimation import EstimateShown
from study_app.viewmodels.lab import DeviceShown, LabView, Now

if TYPE_CHECKING:
    from study_app.app.lab.costs import Prices
    from study_app.lab.ab_comparison import Workbench
    from study_app.lab.live import Live
    from study_app.lab.presets import Choice


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
