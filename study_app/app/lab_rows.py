"""What a setting costs, how true it is, and what there is to feel it with, as the lab says it."""

from study_app.devices.registry import list_devices
from study_app.evidence.appraisal import Costs, Errors
from study_app.haptics.model.effects import NAMED
from study_app.viewmodels.devices.list_view import device_label
from study_app.viewmodels.lab import CostRow, ErrorRow

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
