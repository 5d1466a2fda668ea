"""Lateness of the servo's ticks, compared with a bare loop on the same clock, a Python thread and a Qt timer."""

from study_app.evidence.timing.delays import BESIDE, DELAYS_S, VIRTUAL_HZ, Delayed, Shown, delays_evidence
from study_app.evidence.timing.device_lateness import emulated_devices, lateness_evidence, time_devices
from study_app.evidence.timing.measurement import measure_timing
from study_app.evidence.timing.report import timing_evidence

__all__ = [
    "BESIDE",
    "DELAYS_S",
    "VIRTUAL_HZ",
    "Delayed",
    "Shown",
    "delays_evidence",
    "emulated_devices",
    "lateness_evidence",
    "measure_timing",
    "time_devices",
    "timing_evidence",
]
