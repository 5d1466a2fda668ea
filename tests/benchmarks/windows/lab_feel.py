"""How soon an edit of the liquid lab is felt, what the shadow costs, and whether the servo notices any of it.

Run it by itself: ``python tests/benchmarks/windows/lab_feel.py``. A scripted hand goes in circles through honey, in
real time. In turns the servo alone, and with the lab that looks at it thirty times a second and changes the density
three times a second; lateness is printed of both, and their ratio. The time to be felt is from the call to the end of
the first tick that presents the scene, and to the one whose force is whole.
"""

import statistics
import time

import numpy as np

from study_app.haptics.model.layout import LIMITER_FADE
from study_app.lab.ab_comparison import Setting, Workbench
from study_app.lab.live import Live, open_live
from study_app.protocol.load import load_scenes

ROUNDS, SECONDS = 8, 2.0
FRAME_S = 0.033
EDIT_EVERY = 10  # frames


def main() -> None:
    """Measure and print."""
    scenes = load_scenes("rek2024")
    bench = Workbench(*(Setting(name, scenes[name], scenes[name]) for name in ("honey", "water")))
    with open_live("scripted") as live:
        live.feel(bench)
        live.play("circle")
        rounds = [(_lateness_ns(live, bench, lab=False), _lateness_ns(live, bench, lab=True)) for _ in range(ROUNDS)]
        alone, beside = (np.concatenate(it) for it in zip(*rounds, strict=True))
        taken_ms, whole_ms = _felt_ms(live, bench)
        shadow_us = _shadow_us(live)
    for name, pick in (("median", 50), ("p99", 99), ("p99.9", 99.9)):
        one, other = (float(np.percentile(it, pick)) / 1e3 for it in (alone, beside))
        print(f"lateness {name:6}  alone {one:8.1f} µs   with the lab {other:8.1f} µs   ratio {other / one:.2f}")
    print(f"an edit is presented after {statistics.median(taken_ms):.2f} ms (worst {max(taken_ms):.2f})")
    print(f"and felt whole after      {statistics.median(whole_ms):.2f} ms (worst {max(whole_ms):.2f})")
    print(f"both shadows and the trace: {shadow_us:.2f} µs a tick; {live.shadow.differing} of", end=" ")
    print(f"{live.shadow.followed} forces differ from the servo's")


def _lateness_ns(live: Live, bench: Workbench, *, lab: bool) -> np.ndarray:
    """Return the lateness of every tick of a while."""
    reader = live.servo.telemetry.reader()
    ends, frame = time.monotonic() + SECONDS, 0
    while time.monotonic() < ends:
        time.sleep(FRAME_S)
        frame += 1
        if not lab:
            continue
        live.poll()
        live.trace(), live.tail("A"), live.tail("B"), live.limiters()
        if frame % EDIT_EVERY == 0:
            live.feel(bench.change("liquid.density_kg_m3", 1400.0 - frame % 100))
    return np.asarray(reader.read().lateness_ns)


def _felt_ms(live: Live, bench: Workbench) -> tuple[list[float], list[float]]:
    """Return how long edits took to be presented, and to be felt whole."""
    taken, whole = [], []
    for k in range(30):
        time.sleep(0.12)
        live.poll()
        reader = live.servo.telemetry.reader()
        called_ns = live.servo.now_ns()
        live.feel(bench.change("liquid.density_kg_m3", 1300.0 - k))
        time.sleep(0.2)
        samples = reader.read()
        after = samples[samples.scene == live.servo.serial]
        ends_ns = after.time_ns + after.busy_ns
        taken.append((ends_ns[0] - called_ns) * 1e-6)
        whole.append((ends_ns[(after.limiters & LIMITER_FADE) == 0][0] - called_ns) * 1e-6)
    return taken, whole


def _shadow_us(live: Live) -> float:
    """Return what following a tick takes."""
    live.poll()
    time.sleep(1.0)
    began, ticks = time.perf_counter_ns(), live.shadow.followed
    live.poll()
    return (time.perf_counter_ns() - began) / 1e3 / max(live.shadow.followed - ticks, 1)


if __name__ == "__main__":
    main()
