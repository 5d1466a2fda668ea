"""Measurements for ``preflight``: two seconds of the servo at rest, and the disk for the results."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import numpy as np

from study_app.errors import StoreError
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.scene import Scene
from study_app.haptics.runtime.grants import Grant
from study_app.haptics.runtime.offline import law_along
from study_app.haptics.runtime.telemetry import timing
from study_app.session.ports import ServoPort
from study_app.session.preflight import Measurements, Screen
from study_app.store.blinded import sealed_hash
from study_app.store.files import probe_free_bytes

_POLL_S = 1 / 60


class MeasuredServo(ServoPort, Protocol):
    """The interface of the servo for measurements, in addition to that for sessions."""

    @property
    def grant(self) -> Grant: ...  # noqa: D102
    @property
    def dynamics(self) -> Dynamics: ...  # noqa: D102
    @property
    def delay_ticks(self) -> int: ...  # noqa: D102


def measure_servo_and_disk(
    servo: MeasuredServo,
    results: Path,
    *,
    device: str,
    screen: Screen,
    participant: str,
    recordings: bool,
    lasts_s: float,
    sleep: Callable[[float], object] = time.sleep,
) -> Measurements:
    """Measure a running servo for ``lasts_s`` and the disk of the study folder ``results``; leave no files."""
    # compile it now instead of at the end of a trial
    law_along(Scene(), np.zeros(1), np.zeros((1, 3)), np.zeros((1, 3)))
    reader = servo.telemetry.reader()
    ages_s: list[float] = []
    for _ in range(max(1, round(lasts_s / _POLL_S))):
        sleep(_POLL_S)
        newest = servo.telemetry.latest()
        if newest is not None:
            ages_s.append((servo.now_ns() - int(newest["time_ns"])) * 1e-9)
    samples = reader.read()
    probe_s: float | None = None
    free_bytes, fault, began = None, "", time.perf_counter()
    try:
        free_bytes = probe_free_bytes(results)
        probe_s = time.perf_counter() - began
    except StoreError as error:
        fault = str(error)
    return Measurements(
        device=device,
        fresh_share=float((samples["fresh"] != 0).mean()) if len(samples) else 0.0,
        timing=timing(samples, servo.rate_hz),
        sample_age_s=float(np.percentile(ages_s, 95)) if ages_s else 0.0,
        screen=screen,
        probe_s=probe_s,
        probe_fault=fault,
        free_bytes=free_bytes,
        participant=participant,
        recordings=recordings,
        grant=servo.grant,
        dynamics=servo.dynamics,
        delay_ticks=servo.delay_ticks,
        key_hash=sealed_hash(results),
        lateness_ns=np.asarray(samples["lateness_ns"], np.int64),
    )
