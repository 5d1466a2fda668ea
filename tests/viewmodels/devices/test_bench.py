"""The last bench of each device, in words, and where its report is."""

from pathlib import Path
from typing import Any

from study_app.store.workstation import DEFAULTS, DeviceBench
from study_app.viewmodels.devices.bench import benches_shown


def bench(**fields: Any) -> DeviceBench:
    numbers: dict[str, Any] = {
        "name": "falcon",
        "serial": "FT1",
        "measured": "2026-11-21",
        "mass_kg": (0.19, 0.21, 0.2),
        "damping_nspm": (0.5, 0.5, 0.5),
        "friction_n": (0.1, 0.12, 0.1),
        "delay_ms": (1.0, 1.0, 1.0),
        "stable_nspm": (118.0, 120.0, 122.4),
    }
    return DeviceBench.model_validate(numbers | fields)


def test_words_have_date_serial_number_and_the_range_over_the_axes() -> None:
    shown = benches_shown([bench(gain=0.984)])["falcon"]
    assert shown.words == (
        "Measured 2026-11-21, serial number FT1: mass 0.19 to 0.21 kg, damping 0.5 N·s/m, friction 0.10 to 0.12 N, "
        "delay 1.0 ms, stable damping 118 to 122 N·s/m, 0.98 N on the scale per newton sent."
    )
    assert shown.report is None


def test_the_newest_bench_of_a_device_is_shown() -> None:
    older, newer = bench(serial="A", measured="2026-11-01"), bench(serial="B", measured="2026-11-20")
    other = bench(name="inverse3", serial="")
    shown = benches_shown(DEFAULTS.with_bench(older).with_bench(newer).with_bench(other).benches)
    assert list(shown) == ["inverse3", "falcon"]
    assert "Measured 2026-11-20, serial number B:" in shown["falcon"].words
    assert "Measured 2026-11-21: " in shown["inverse3"].words


def test_a_report_that_is_gone_is_said_and_not_offered(tmp_path: Path) -> None:
    report = tmp_path / "bench.md"
    gone = benches_shown([bench(report=str(report))])["falcon"]
    assert gone.report is None
    assert gone.words.endswith(f"The report is missing: {report}.")
    report.write_text("# Bench\n")
    assert benches_shown([bench(report=str(report))])["falcon"].report == report
