"""The last bench of each device (`liquid-study devices bench`), as windows show it. No Qt here."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from study_app.store.workstation import DeviceBench


@dataclass(frozen=True, slots=True)
class BenchShown:
    """The last bench of a device: date and numbers in ``words``; its ``report``, None where that file is missing."""

    words: str
    report: Path | None


def benches_shown(benches: Iterable[DeviceBench]) -> dict[str, BenchShown]:
    """Return the first bench of each device in ``benches`` (newest first), by the device's name."""
    shown: dict[str, BenchShown] = {}
    for bench in benches:
        shown.setdefault(bench.name, _shown(bench))
    return shown


def _shown(bench: DeviceBench) -> BenchShown:
    serial = f", serial number {bench.serial}" if bench.serial else ""
    numbers = [
        f"mass {_range(bench.mass_kg, 2)} kg",
        f"damping {_range(bench.damping_nspm, 1)} N·s/m",
        f"friction {_range(bench.friction_n, 2)} N",
        f"delay {_range(bench.delay_ms, 1)} ms",
        f"stable damping {_range(bench.stable_nspm, 0)} N·s/m",
    ]
    if bench.gain is not None:
        numbers.append(f"{bench.gain:.2f} N on the scale per newton sent")
    words = f"Measured {bench.measured}{serial}: {', '.join(numbers)}."
    report = None if bench.report is None else Path(bench.report)
    if report is not None and not report.is_file():
        return BenchShown(f"{words} The report is missing: {report}.", None)
    return BenchShown(words, report)


def _range(of_axes: tuple[float, float, float], digits: int) -> str:
    """Return the least and the greatest of three axes, once where they are equal."""
    least, most = (f"{value:.{digits}f}" for value in (min(of_axes), max(of_axes)))
    return least if least == most else f"{least} to {most}"
