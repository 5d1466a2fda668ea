"""Loops of a held handle whose device is later than assumed: how often `late_device_ticks` finds it.

Run it by itself: ``python tests/benchmarks/haptics/late_devices.py SEED LOOPS``; each line has so many loops of 10 s.
"""

import sys
from random import Random
from typing import Any

import numpy as np

from study_app.evidence.stability.bench import Bench, lowest_balance, new_trace
from study_app.evidence.stability.stability_cases import CIRCLES, DAMPER, PLANTS, REACHES, SINE, Case, scenes
from study_app.evidence.stability.velocity import random_path
from study_app.haptics.model.layout import SAMPLE
from study_app.store.session_progress.delivered import late_device_ticks

SECONDS = 10.0
RANDOM_HZ = (0.8, 1.2, 1.6, 2.0, 3.0)
TREMOR_M, TREMOR_HZ = 50e-6, (9.0, 10.3, 8.2)
CHOICES: dict[str, tuple[Any, ...]] = {
    "liquid": tuple(name for name in scenes() if name not in {"dense", DAMPER}),
    "rate_hz": (500.0, 1000.0, 1000.0, 2000.0),
    "estimator": ("ewma", "kalman"),
    "hand": ("light", "middle", "firm"),
    "plant": PLANTS,
    "motion": (REACHES, CIRCLES, SINE),
    "speed_mps": (0.1, 0.2, 0.3, 0.6),
    "mass_kg": (0.1, 0.2, 0.5),
    "viscous_nspm": (0.0, 0.5),
    "coulomb_n": (0.0, 0.3),
    "quantum_um": (20.0, 38.0, 60.0),
    "believed": (0, 1, 1, 2),
}
LINKS = {"force_delay_ms": (5.0, 20.0, 50.0, 100.0), "force_jitter_ms": (0.0, 5.0), "force_loss": (0.0, 0.1)}


def drawn_case(draw: Random, excess: int, choices: dict[str, tuple[Any, ...]]) -> Case:
    """Return a loop whose device is ``excess`` ticks later than assumed, at the scale of its scene or another."""
    values = {name: draw.choice(of) for name, of in choices.items()}
    believed = min(values["believed"], 4 - excess)
    scale = draw.choice((scenes()[values["liquid"]].scale, 1.0, 3.0, 10.0))
    return Case(**values | {"scale": scale, "believed": believed, "delay": believed + excess})


def trace_of(case: Case, draw: Random) -> Any:
    """Return the trace of a loop: the motion of the case, or, half of the time, random motion with tremor."""
    bench = Bench(case)
    if draw.random() < 0.5:
        bench.loop.moving_s = SECONDS
        bench.begin()
        trace = new_trace(case, SECONDS)
        return trace[: bench.run(trace, 0, SECONDS)]
    path_m = random_path(draw.choice(RANDOM_HZ), case.rate_hz, draw.randrange(2**31))[: round(SECONDS * case.rate_hz)]
    t_s = np.arange(len(path_m)) / case.rate_hz
    tremor_m = TREMOR_M * np.sin(2 * np.pi * np.outer(t_s, TREMOR_HZ) + np.arange(3))
    return bench.follow(draw.choice((0.5, 1.0, 1.5)) * path_m + tremor_m)


def found_ticks(case: Case, trace: Any) -> int | None:
    """Return the delay that the samples of a trace show."""
    samples = np.zeros(len(trace), SAMPLE)
    count_m = case.quantum_um * 1e-6
    samples["position_m"] = np.rint(trace.position_m / count_m) * count_m
    samples["device_force_n"], samples["limiters"], samples["delay_ticks"] = trace.sent_n, trace.limiters, trace.assumed
    return late_device_ticks(samples, case.rate_hz)


def main() -> None:
    """Print for each lateness how many loops were found, of all and of those in which the device gave energy."""
    seed, loops = sys.argv[1], int(sys.argv[2])
    for excess, links in ((0, {}), (0, LINKS), (1, {}), (2, {}), (3, {})):
        draw, rows = Random(f"{seed} {excess} {len(links)}"), []  # noqa: S311 - no secret
        for _ in range(loops):
            case = drawn_case(draw, excess, CHOICES | links)
            trace = trace_of(case, draw)
            rows.append((found_ticks(case, trace), case.delay, -1e3 * lowest_balance(trace)[0]))
        late = [(ticks, delay) for ticks, delay, _ in rows if ticks is not None]
        parts = [f"{len(late)} of {loops} found, {sum(ticks <= delay for ticks, delay in late)} at most the true delay"]
        for most_mj in (1, 5, 20):
            giving = [ticks is not None for ticks, _, given_mj in rows if given_mj > most_mj]
            parts.append(f"{sum(giving)} of {len(giving)} above {most_mj} mJ")
        kind = ", force delayed by the study" if links else ""
        print(f"{excess} ticks later{kind}: {'; '.join(parts)}", flush=True)


if __name__ == "__main__":
    main()
