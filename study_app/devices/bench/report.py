"""The report of a bench as Markdown and as JSON, without folders of this computer."""

import json
import platform
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any, Final

from study_app import __version__
from study_app.devices.bench.procedure import AXES, LEAST_EXPLAINED, SHAKE_N, Found

FORMAT: Final = 1
NOT_FREE: Final = (
    f"Mass, damping and friction explain less than {100 * LEAST_EXPLAINED:g} % of the force: the handle was touched, "
    "or met a stop. Measure again."
)
_ENDED: Final = {
    "oscillation": "it oscillated",
    "operator": "the operator ended it",
    "most": "stable up to the largest damping tried",
}


def as_json(found: Found, day: str) -> str:
    """Return the results as JSON text; ``day`` is the date of the bench, such as 2026-11-21."""
    document = {
        "format": FORMAT,
        "kind": "devices bench",
        "measured": day,
        "program": __version__,
        "system": _system(),
        **asdict(found),
    }
    return json.dumps(_plain(document), indent=2, ensure_ascii=False) + "\n"


def as_markdown(found: Found, day: str) -> str:
    """Return the report as Markdown text."""
    return "\n".join(_lines(found, day)) + "\n"


def kept(found: Found, day: str) -> dict[str, Any]:
    """Return the results of a bench for this machine's settings (`store.workstation.DeviceBench`)."""
    own = ("mass_kg", "damping_nspm", "friction_n", "delay_ms")
    return {
        "name": found.device["name"],
        "serial": found.device.get("serial") or "",
        "measured": day,
        **{name: tuple(float(getattr(one, name)) for one in found.motions) for name in own},
        "count_m": found.count_m,
        "stable_nspm": tuple(one.damping_nspm for one in found.damping),
        "gain": None if found.gain is None else found.gain.gain,
    }


def _lines(found: Found, day: str) -> Iterator[str]:
    regular, still = found.regularity, found.noise
    yield from (f"# Bench of {found.device.get('name')}", "")
    serial = f", serial number {found.device['serial']}" if found.device.get("serial") else ""
    yield from (f"{day}{serial}; liquid-study {__version__}; {_system()}.", "")
    yield from ("## Loop", "", "| | median | 99 % | greatest |", "| --- | ---: | ---: | ---: |")
    yield f"| lateness of a tick [ms] | {_row(regular.lateness_ms, 3)} |"
    yield f"| duration of a tick, with reading and writing [ms] | {_row(regular.busy_ms, 3)} |"
    yield ""
    least, most = regular.delay_ticks
    delay = f"{least}" if least == most else f"{least} to {most}"
    yield (
        f"{regular.ticks} ticks; {100 * regular.new_share:.2f} % with a new position, at most "
        f"{regular.longest_gap_ms:.2f} ms apart; the driver's delay: {delay} ticks; {found.overruns} overruns."
    )
    yield from ("", "## At rest, without force", "", "| | x | y | z |", "| --- | ---: | ---: | ---: |")
    yield f"| standard deviation of the position [µm] | {_row(still.position_um, 2)} |"
    yield f"| its range [µm] | {_row(still.peak_um, 2)} |"
    yield from ("", f"Velocity (EWMA, weight 0.1): {still.velocity_mmps:.3f} mm/s RMS; drift {still.drift_um:.1f} µm.")
    yield from ("", "## Mass, damping, friction", "", "| | x | y | z |", "| --- | ---: | ---: | ---: |")
    for label, name, digits in (
        ("apparent mass [kg]", "mass_kg", 3),
        ("damping [N·s/m]", "damping_nspm", 2),
        ("Coulomb friction [N]", "friction_n", 3),
        ("delay from sending a force to motion [ms]", "delay_ms", 1),
        ("encoder count, from the noise in motion [µm]", "count_um", 1),
        ("explained variance of the force", "explained", 4),
    ):
        yield f"| {label} | {_row(tuple(getattr(one, name) for one in found.motions), digits)} |"
    if not found.fits:
        yield from ("", NOT_FREE)
    yield from ("", "## Greatest stable damping", "", "| axis | N·s/m | ended |", "| --- | ---: | --- |")
    for axis, one in zip(AXES, found.damping, strict=True):
        yield f"| {axis} | {one.damping_nspm:.0f} | {_ENDED[one.ended]} |"
    yield from ("", f"A free handle and a damper that grows; more than {SHAKE_N:g} N RMS above 20 Hz is oscillation.")
    yield from ("", "## Force on a scale", "")
    gain = found.gain
    yield (
        "Not measured."
        if gain is None
        else f"{gain.gain:.3f} N shown per newton sent, downward; offset {gain.offset_n:+.3f} N; greatest residual "
        f"{gain.residual_n:.3f} N; {gain.readings} readings."
    )
    yield from ("", "## What the device reports", "", "```json")
    yield json.dumps(_plain(found.device), indent=2, ensure_ascii=False)
    yield "```"


def _row(values: tuple[float, ...], digits: int) -> str:
    return " | ".join(f"{value:.{digits}f}" for value in values)


def _system() -> str:
    return f"{platform.system()} {platform.release()}, {platform.machine()}, Python {platform.python_version()}"


def _plain(value: Any) -> Any:
    """Return a value with replacements for types unknown to JSON: numpy's numbers, NaN."""
    if isinstance(value, dict):
        return {str(name): _plain(one) for name, one in value.items()}
    if hasattr(value, "_asdict"):
        return _plain(value._asdict())
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if hasattr(value, "item"):
        value = value.item()
    return None if isinstance(value, float) and value != value else value  # noqa: PLR0124 - NaN
