"""The force that arrives: sent forces of every shipped liquid against the law on the hand's true motion.

An arm holds a handle of 0.2 kg through its tissue (`arm_plant`, middle) and moves it by 1.6 Hz ±20 mm at 1 kHz, with
every delay, estimator and device. The law is the same scene on the handle's true motion, velocities given. Buoyancy,
which needs no velocity, is left out.

- *error*: RMS of sent force less law over RMS of the law;
- *withheld*: Σ|F_a - F_b| / Σ|F_a|, F_a the force of the effects, F_b the force sent, whatever took it;
- *unstable*: which of the same strokes by light, middle and firm hands, and of releases at four phases with each plant,
  are unstable (`verdict`).
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import cache
from typing import Final, NamedTuple

import numpy as np

from study_app.evidence.reference_solutions import without_buoyancy
from study_app.evidence.stability.bench import Bench, law_along, sine_path
from study_app.evidence.stability.case_groups import peak_mps
from study_app.evidence.stability.stability_cases import DAMPER, FIRST, LETS_GO, SECOND, SINE, Case, scene_of, scenes
from study_app.evidence.stability.velocity import WHOLE, wiener_bound
from study_app.evidence.stability.verdict import judge
from study_app.evidence.table import Evidence, run


class _Limit(NamedTuple):
    """The greatest permitted error [%] (a multiple of the Wiener bound in `_BOUNDED`) and withheld share [%]."""

    error: float
    withheld: float


_HONEY: Final = "honey of physical2"
_BOUNDED: Final = "others of physical2"
_STEEP: Final = "steeper than a loop bears"
_THESIS: Final = "rek2024"
_GROUPS: Final = {
    "physical2_": _BOUNDED,
    "physical_": "physical_liquids",
    "slime_": "slime",
    "forcedelay_": "dampers",
    "viscosityjnd_": "dampers",
    "thickness_": "dampers",
}
"""By the beginning of a liquid's name; all others are of the thesis."""
_SINGLE: Final = {
    "physical2_honey": _HONEY,
    **dict.fromkeys(("physical_tar", "physical2_tar", "slime_toothpaste", "slime_cornstarch"), _STEEP),
}
_LIMITS: Final[Mapping[tuple[str, str], tuple[_Limit, _Limit, _Limit]]] = {
    (_HONEY, "kalman"): (_Limit(15, 13), _Limit(18, 18), _Limit(72, 75)),
    (_BOUNDED, "kalman"): (_Limit(1.6, 1), _Limit(1.6, 5), _Limit(12, 80)),
    (_THESIS, "kalman"): (_Limit(9, 2), _Limit(42, 36), _Limit(70, 65)),
    ("physical_liquids", "kalman"): (_Limit(18, 13), _Limit(20, 21), _Limit(75, 77)),
    ("slime", "kalman"): (_Limit(13, 5), _Limit(67, 66), _Limit(82, 81)),
    ("dampers", "kalman"): (_Limit(3, 1), _Limit(3, 1), _Limit(3, 1)),
    (_STEEP, "kalman"): (_Limit(85, 87), _Limit(92, 92), _Limit(95, 95)),
    (_HONEY, "ewma"): (_Limit(40, 5), _Limit(40, 26), _Limit(74, 70)),
    (_BOUNDED, "ewma"): (_Limit(4.2, 5), _Limit(4.2, 5), _Limit(11, 70)),
    (_THESIS, "ewma"): (_Limit(18, 5), _Limit(40, 30), _Limit(67, 60)),
    ("physical_liquids", "ewma"): (_Limit(40, 5), _Limit(40, 27), _Limit(76, 73)),
    ("slime", "ewma"): (_Limit(17, 5), _Limit(58, 58), _Limit(76, 76)),
    ("dampers", "ewma"): (_Limit(11, 1), _Limit(11, 1), _Limit(11, 1)),
    (_STEEP, "ewma"): (_Limit(92, 88), _Limit(95, 95), _Limit(97, 97)),
}
"""By group and estimator: at one, two and three ticks of delay, on every device."""


class Device(NamedTuple):
    """Encoder count and mass of a handle, and the least mass that its driver reports."""

    count_um: float
    mass_kg: float
    least_kg: float


DEVICES: Final[Mapping[str, Device]] = {
    "falcon": Device(count_um=38.0, mass_kg=0.2, least_kg=0.1),
    "inverse3": Device(count_um=14.0, mass_kg=0.2, least_kg=0.1),
    "force-dimension": Device(count_um=10.0, mass_kg=0.2, least_kg=0.2),
}
"""A count of the Inverse3 is not published: [choice]. All drivers permit 8 N."""
_ESTIMATORS: Final = ("kalman", "ewma")
DELAYS: Final = (1, 2, 3)
_LASTS_S: Final = 6.0
_SETTLED_S: Final = 1.5
_RELEASES: Final = 4


class Delivered(NamedTuple):
    """One liquid in one loop: error, Wiener bound and withheld share [%], and the unstable cases."""

    liquid: str
    estimator: str
    delay: int
    device: str
    error: float
    bound: float
    withheld: float
    unstable: tuple[Case, ...]

    @property
    def group(self) -> str:
        of_file = (group for name, group in _GROUPS.items() if self.liquid.startswith(name))
        return _SINGLE.get(self.liquid) or next(of_file, _THESIS)

    @property
    def share_of_limits(self) -> tuple[float, float]:
        limit = _LIMITS[self.group, self.estimator][self.delay - 1]
        most = limit.error * self.bound if self.group == _BOUNDED else limit.error
        return self.error / most, self.withheld / limit.withheld


@cache
def _shipped_liquids() -> Mapping[str, tuple[str, ...]]:
    """Return the liquids of all shipped studies; liquids with the same force appear once, with all names."""
    liquids: dict[str, list[str]] = {}
    for name, scene in scenes().items():
        if name not in {"dense", DAMPER}:
            alone = without_buoyancy(scene).model_dump(include={"scale", "rate_hz", "body", "knee", "liquids"})
            alone["liquids"][0].pop("id")
            liquids.setdefault(str(alone), []).append(name)
    return {first: tuple(others) for first, *others in liquids.values()}


def measure(
    names: Sequence[str] | None = None,
    estimators: Sequence[str] = _ESTIMATORS,
    delays: Sequence[int] = DELAYS,
    devices: Sequence[str] = tuple(DEVICES),
    *,
    executor: Executor | None = None,
) -> tuple[Delivered, ...]:
    """Return the delivered force of liquids (by default all); in parallel with an executor."""
    planned = itertools.product(devices, estimators, names or _shipped_liquids(), delays)
    return run(_measured, planned, executor)


def _measured(device: str, estimator: str, liquid: str, delay: int) -> Delivered:
    of_device = DEVICES[device]
    case = Case(
        liquid=liquid,
        scale=scenes()[liquid].scale,
        delay=delay,
        estimator=estimator,
        motion=SINE,
        speed_mps=peak_mps(WHOLE.frequency_hz, WHOLE.amplitude_m),
        way_mm=2e3 * WHOLE.amplitude_m,
        quantum_um=of_device.count_um,
        mass_kg=of_device.mass_kg,
        believed_kg=of_device.least_kg,
        plant=SECOND,
    )
    unstable = tuple(stroke for stroke in _strokes(case) if not judge(stroke, safe=True).stable)
    return Delivered(
        liquid=liquid, estimator=estimator, delay=delay, device=device, **errors(case)._asdict(), unstable=unstable
    )


class Errors(NamedTuple):
    """The error, the Wiener bound, and the withheld share [%]."""

    error: float
    bound: float
    withheld: float


def errors(case: Case) -> Errors:
    """Return the errors in a held stroke."""
    scene = without_buoyancy(scene_of(case))
    path_m = sine_path(WHOLE.amplitude_m, 2 * math.pi * WHOLE.frequency_hz, _LASTS_S, case.rate_hz)
    trace = Bench(case, scene=scene).follow(path_m)
    counted = trace.t_s >= _SETTLED_S
    law_n = law_along(scene, trace)[counted]
    sent_n, asked_n = trace.sent_n[counted], trace.asked_n[counted]
    error = math.sqrt(float(np.sum((sent_n - law_n) ** 2) / np.sum(law_n**2)))
    withheld = float(np.linalg.norm(asked_n - sent_n, axis=1).sum() / np.linalg.norm(asked_n, axis=1).sum())
    bound = wiener_bound(scene, 1e-6 * case.quantum_um, case.delay / case.rate_hz)
    return Errors(error=100 * error, bound=100 * bound, withheld=100 * withheld)


def _strokes(case: Case) -> Iterator[Case]:
    """Yield the strokes that are judged: held, and released at several phases of a cycle."""
    for hand in ("light", "middle", "firm"):
        yield replace(case, hand=hand)
    for plant, phase in itertools.product((FIRST, SECOND), range(_RELEASES)):
        released_s = round(0.6 + phase / (_RELEASES * WHOLE.frequency_hz), 5)
        yield replace(case, hand=LETS_GO, plant=plant, release_s=released_s)


def evidence(found: Sequence[Delivered]) -> Evidence:
    """Return the table, and whether each limit is met."""
    lines = tuple(_lines(found))
    missed = any("not met" in line for line in lines) or any(delivered.unstable for delivered in found)
    text = "\n".join(lines) + "\n"
    return Evidence(text, {"delivered.txt": text}, missed=missed)


def _lines(found: Sequence[Delivered]) -> Iterator[str]:
    yield f"force sent against the law on the true motion, middle hand, {WHOLE}: RMS error, least error of a linear"
    yield "estimator, share withheld [%], unstable cases; at 1, 2, 3 ticks of delay"
    for (device, estimator), of_loop in itertools.groupby(found, key=lambda one: (one.device, one.estimator)):
        yield ""
        yield f"{device}, {DEVICES[device].count_um:g} µm, {estimator}"
        for liquid, rows in itertools.groupby(of_loop, key=lambda one: one.liquid):
            cells = (f"{it.error:6.1f} {it.bound:5.1f} {it.withheld:5.1f} {len(it.unstable):2d}" for it in rows)
            same = "".join(f" = {name}" for name in _shipped_liquids().get(liquid, ()))
            yield f"  {liquid:20}{'  '.join(cells)}{same}"
    yield ""
    for (group, estimator), limits in _LIMITS.items():
        for delay, limit in enumerate(limits, start=1):
            of_limit = [it for it in found if (it.group, it.estimator, it.delay) == (group, estimator, delay)]
            if of_limit:
                yield _verdict(of_limit, limit, f"{group}, {estimator}, {delay} tick{'s' * (delay > 1)}")
    unstable = [case for it in found for case in it.unstable]
    yield f"unstable cases: {len(unstable)}"
    yield from map(str, unstable)


def _verdict(rows: Sequence[Delivered], limit: _Limit, what: str) -> str:
    units = " times the least" if rows[0].group == _BOUNDED else " %", " %"
    shares = (max(shares) for shares in zip(*(it.share_of_limits for it in rows), strict=True))
    said = (
        f"{name} at most {most:g}{unit}: {'met' if share <= 1.0 else 'not met'} ({share * most:.3g})"
        for name, most, unit, share in zip(limit._fields, limit, units, shares, strict=True)
    )
    return f"{what}: {'; '.join(said)}"
