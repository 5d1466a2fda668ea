"""What a recording costs: its size, and the time of the thread that hands samples over.

``python tests/benchmarks/haptics/recording.py [FOLDER on the disk to measure] [SECONDS of the paced run, default 60]``
"""

import sys
import tempfile
import time
from pathlib import Path
from random import Random

import numpy as np

from study_app.devices.scripted import QUANTUM_M, ScriptedDevice
from study_app.haptics.model.layout import SAMPLE
from study_app.haptics.runtime.clocks.clock import VirtualClock
from study_app.haptics.runtime.pack import elements_needed
from study_app.haptics.runtime.servo import Servo
from study_app.protocol.load import load
from study_app.store.recorder import Recorded, Recorder
from study_app.store.recording_files import read_samples

LIMIT_MB = 60.0
HALF_AN_HOUR = 1_800_000
FRAME_S = 1 / 60


def felt(seconds: int, quantum_m: float, liquid: str) -> np.ndarray:
    """Return what a hand that reaches about in ``liquid`` leaves, with ticks that are late as live ones are."""
    study = load("rek2024")
    device = ScriptedDevice(Random(1), quantum_m=quantum_m)  # noqa: S311
    scene = study.scene_for(liquid)
    servo = Servo(device, clock=VirtualClock(), elements=elements_needed(scene))
    places = np.random.default_rng(2).uniform(-0.045, 0.045, (seconds * 2, 3))
    chunks = []
    with device, servo:
        reader = servo.telemetry.reader()
        servo.load(scene)
        for x, y, z in places:
            device.reach_to(x, y, z)
            servo.advance(500)
            chunks.append(np.array(reader.read()))
    samples = np.concatenate(chunks)
    samples["lateness_ns"] = 90_000 * np.random.default_rng(3).lognormal(0.0, 0.6, len(samples))
    samples["time_ns"] += samples["lateness_ns"]
    return samples


def size(folder: Path, samples: np.ndarray) -> tuple[float, float]:
    """Return megabytes and seconds of writing for half an hour of such samples."""
    recorder = Recorder(folder, {}, waits=True)
    start = time.perf_counter()
    recorder.start(1, 1, 1000.0)
    recorder.append(samples)
    recorder.close()
    took = time.perf_counter() - start
    (kept,) = recorder.kept()
    assert isinstance(kept, Recorded)
    share = HALF_AN_HOUR / len(samples)
    return kept.samples.path.stat().st_size / 1e6 * share, took * share


def paced(folder: Path, samples: np.ndarray, seconds: float) -> None:
    """Hand samples over at their own pace, a frame's worth at a time, and print what that costs."""
    recorder = Recorder(folder, {})
    frames = round(seconds / FRAME_S)
    each = round(1000 * FRAME_S)
    durations = np.empty(frames)
    start = time.perf_counter()
    recorder.start(1, 1, 1000.0)
    for frame in range(frames):
        first = frame * each % (len(samples) - each)
        chunk = samples[first : first + each].copy()
        before = time.perf_counter_ns()
        recorder.append(chunk)
        recorder.frame(frame, frame)
        durations[frame] = (time.perf_counter_ns() - before) / 1e3
        time.sleep(max(0.0, start + (frame + 1) * FRAME_S - time.perf_counter()))
    ending = time.perf_counter()
    recorder.close()
    took_ms = (time.perf_counter() - ending) * 1e3
    (kept,) = recorder.kept()
    assert isinstance(kept, Recorded)
    p50, p99 = np.percentile(durations, [50, 99])
    print(f"{seconds:g} s in frames of {each} samples, with the disk at work beside:")
    print(f"  append p50 {p50:.1f}, p99 {p99:.1f}, worst {durations.max():.1f} µs")
    of = kept.samples.rows + kept.dropped
    print(f"  dropped {kept.dropped} of {of}; {took_ms:.0f} ms from the last sample to the whole file")


def main() -> None:
    disk = sys.argv[1] if len(sys.argv) > 1 else None
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else 60.0
    print(f"half an hour at 1 kHz (limit {LIMIT_MB:g} MB); a sample is {SAMPLE.itemsize} bytes in memory")
    print(f"{'':42}{'MB':>8}{'s to write':>12}")
    with tempfile.TemporaryDirectory(dir=disk) as folder:
        for name, quantum_m in (("encoders of 38 µm", QUANTUM_M), ("every digit of the place", 0.0)):
            for liquid in ("water", "light_oil"):
                samples = felt(300, quantum_m, liquid)
                megabytes, took = size(Path(folder) / f"{quantum_m}{liquid}", samples)
                print(f"{f'{name}, {liquid} without a rest':42}{megabytes:8.1f}{took:12.1f}")
        start = time.perf_counter()
        count = len(read_samples(Path(folder) / f"{0.0}light_oil" / "trial-001.parquet"))
        print(f"read back: {count / 1000 / (time.perf_counter() - start):.0f} times as fast as it was felt")
        paced(Path(folder) / "paced", samples, seconds)


if __name__ == "__main__":
    main()
