"""The cases of the stability sweep: liquid, loop, device and hand, with a line of text that reproduces each case."""

import difflib
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import Any, Final

from study_app.errors import StudyError
from study_app.haptics.model.effects import DAMPING_NSPM, Drag
from study_app.haptics.model.estimators import MOST_LAG_TICKS
from study_app.haptics.model.estimators import NAMED as ESTIMATORS
from study_app.haptics.model.scene import ForceLink, Liquid, Scene
from study_app.protocol.load import load
from study_app.protocol.source import shipped, shipped_file

REACHES: Final = "reaches"
CIRCLES: Final = "circles"
STROKE: Final = "stroke"
SINE: Final = "sine"
MOTIONS: Final = (REACHES, CIRCLES, STROKE, SINE)

FIRST: Final = "handle"
SECOND: Final = "arm"
PLANTS: Final = (FIRST, SECOND)
FALCON: Final = "falcon"

DAMPER: Final = "damper"
"""The strongest linear damper that a file may contain."""

_SWEEP_STUDIES: Final = {"rek2024": "", "physical_liquids": "physical_"}
"""Studies whose liquids the sweep presents, and the prefix of their names."""

THROWN: Final = "thrown"
LETS_GO: Final = "lets-go"

DEVICE: Final = "device"
"""The estimator of cases whose device measures the velocity itself."""
_AVERAGE: Final = "average"
_FIRST_ORDER: Final = "first-order"
_LATE: Final = "late"
FILTERS: Final = (_AVERAGE, _FIRST_ORDER, _LATE)
"""Causes of the lag of such a velocity: a mean over twice the lag, a first-order filter, or pure delay."""
_DEVICE_FIELDS: Final = ("velocity_lag", "velocity_filter", "velocity_noise_mmps", "velocity_count_mmps")
"""Fields of cases with such a device; the line of any other case omits them."""
_OPTIONAL_FIELDS: Final = ("swaps", "jump_mm", "outliers", "outlier_mm")
"""Fields that a line omits if they are 0, since the seed of a force link is derived from the line."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Grip:
    """A hand modelled as mass, spring and damper (van Beek et al. 2015; Hasser & Cutkosky 2002)."""

    mass_kg: float
    stiffness_npm: float
    damping_nspm: float


GRIPS: Final[Mapping[str, Grip]] = {
    "light": Grip(mass_kg=0.1, stiffness_npm=50.0, damping_nspm=2.0),
    "middle": Grip(mass_kg=0.554, stiffness_npm=135.0, damping_nspm=6.45),
    "firm": Grip(mass_kg=1.0, stiffness_npm=800.0, damping_nspm=25.0),
    LETS_GO: Grip(mass_kg=0.554, stiffness_npm=135.0, damping_nspm=6.45),
    THROWN: Grip(mass_kg=0.554, stiffness_npm=135.0, damping_nspm=6.45),
}

_RANGES: Final[Mapping[str, tuple[float, float]]] = {
    "scale": (0.1, 100.0),
    "rate_hz": (250.0, 5000.0),
    "delay": (0, 4),
    "speed_mps": (0.01, 5.0),
    "mass_kg": (0.02, 5.0),
    "viscous_nspm": (0.0, 50.0),
    "coulomb_n": (0.0, 5.0),
    "quantum_um": (0.0, 1000.0),
    "noise_um": (0.0, 1000.0),
    "jitter": (0.0, 0.5),
    "missed": (0.0, 0.5),
    "way_mm": (4.0, 200.0),
    "release_s": (0.3, 2.0),
    "believed": (-1, 4),
    "slows_to": (-1, 4),
    "lost": (0.0, 0.5),
    "duplicated": (0.0, 0.5),
    "burst_ms": (0.0, 40.0),
    "believed_kg": (0.0, 5.0),
    "other_kg": (0.0, 5.0),
    "force_delay_ms": (0.0, float(ForceLink.MOST_DELAY_MS)),
    "force_jitter_ms": (0.0, float(ForceLink.MOST_JITTER_MS)),
    "force_loss": (0.0, ForceLink.MOST_LOSS),
    "velocity_lag": (0.0, MOST_LAG_TICKS),
    "velocity_noise_mmps": (0.0, 1000.0),
    "velocity_count_mmps": (0.0, 1000.0),
    "swaps": (0, 1),
    "jump_mm": (0.0, 100.0),
    "outliers": (0.0, 0.5),
    "outlier_mm": (0.0, 100.0),
}
"""Permitted ranges of a case's values, which include those of the sweep."""

_ESTIMATORS: Final[Mapping[str, Any]] = {name: it.model() for name, it in ESTIMATORS.items() if it.of_device}


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One closed loop. ``delay`` is in ticks, ``jitter`` in periods, ``missed`` a fraction of ticks.

    ``hand`` is a grip of `GRIPS`: "thrown" is released at the start, "lets-go" after ``release_s``. ``speed_mps`` is
    the greatest speed of the hand along its ``motion``, ``way_mm`` the length of a reach, the diameter of a circle and
    twice the amplitude of a sine.

    ``plant`` selects device and hand: that of ``haptics.kernels.plant``, the second one, of `arm`, or "falcon", the
    driver with its emulator (`driven`), which has its own delay, encoders and samples. ``believed`` is the delay that
    the loop assumes (-1: the true one), ``slows_to`` the device's delay from 0.5 s onwards, with ``swaps`` 1 only in
    every second interval of 150 ms; above 0, the device measures its delay. ``lost`` is the fraction of ticks without a
    new sample, ``duplicated`` that of samples that repeat the previous position; for the last ``burst_ms`` of every 300
    ms there is no new sample, and all later positions are offset by up to ``jump_mm`` along each axis. ``outliers`` is
    the fraction of ticks whose position is wrong by up to ``outlier_mm``. ``believed_kg`` is the least mass that the
    device reports (0: the true one), ``other_kg`` the mass of the handle in every second interval of 150 ms (0: the
    same). ``force_delay_ms``, ``force_jitter_ms`` and ``force_loss`` define the study's own force link.

    With the ``estimator`` "device" the device measures the velocity: ``velocity_lag`` [ticks] is the mean lag of its
    ``velocity_filter``, which it reports; peak-to-peak noise and quantisation are added.
    """

    liquid: str = "water"
    scale: float = 10.0
    rate_hz: float = 1000.0
    delay: int = 1
    estimator: str = "ewma"
    hand: str = "middle"
    motion: str = REACHES
    speed_mps: float = 0.3
    mass_kg: float = 0.1
    viscous_nspm: float = 0.5
    coulomb_n: float = 0.0
    quantum_um: float = 38.0
    noise_um: float = 0.0
    jitter: float = 0.0
    missed: float = 0.0
    way_mm: float = 60.0
    release_s: float = 0.6
    plant: str = FIRST
    believed: int = -1
    slows_to: int = -1
    lost: float = 0.0
    duplicated: float = 0.0
    burst_ms: float = 0.0
    believed_kg: float = 0.0
    other_kg: float = 0.0
    force_delay_ms: float = 0.0
    force_jitter_ms: float = 0.0
    force_loss: float = 0.0
    velocity_lag: float = 0.0
    velocity_filter: str = _AVERAGE
    velocity_noise_mmps: float = 0.0
    velocity_count_mmps: float = 0.0
    swaps: int = 0
    jump_mm: float = 0.0
    outliers: float = 0.0
    outlier_mm: float = 0.0

    @property
    def believed_delay(self) -> int:
        """The delay [ticks] that the loop assumes at the start."""
        return self.delay if self.believed < 0 else self.believed

    @property
    def misjudged(self) -> bool:
        """Whether the delay that the loop assumes ever differs from the device's."""
        return self.believed_delay != self.delay or self.slows_to > self.delay

    def __str__(self) -> str:
        unused = () if self.estimator == DEVICE else _DEVICE_FIELDS
        names = [field.name for field in fields(self) if field.name not in unused]
        names = [name for name in names if name not in _OPTIONAL_FIELDS or getattr(self, name)]
        return " ".join(f"{name}={_format_value(getattr(self, name))}" for name in names)


def parse_case(line: str) -> Case:
    """Return the case described by a line of ``name=value`` words; omitted values have their defaults.

    Raises
    ------
    StudyError
        A word has another form, a name is unknown, or a value is not permitted.
    """
    defaults = Case()
    kinds: dict[str, type] = {field.name: type(getattr(defaults, field.name)) for field in fields(Case)}
    values: dict[str, Any] = {}
    for word in line.split():
        name, separator, value = word.partition("=")
        if not separator:
            raise StudyError(f'a case consists of settings such as "scale=10", not {word!r}')
        if name not in kinds:
            similar = difflib.get_close_matches(name, kinds, n=1)
            suggestion = f"did you mean {similar[0]!r}? " if similar else ""
            raise StudyError(
                f"a case does not have a setting {name!r}: {suggestion}its settings are {', '.join(kinds)}"
            )
        try:
            values[name] = kinds[name](value)
        except ValueError as error:
            raise StudyError(
                f"{name}={value} must be {'a number' if kinds[name] is float else 'a whole number'}"
            ) from error
    case = Case(**values)
    for name, (low, high) in _RANGES.items():
        if not low <= getattr(case, name) <= high:
            raise StudyError(f"{name}={getattr(case, name):g} must lie between {low:g} and {high:g}")
    for name, permitted in (
        ("liquid", scenes()),
        ("hand", GRIPS),
        ("motion", MOTIONS),
        ("estimator", (*_ESTIMATORS, DEVICE)),
        ("velocity_filter", FILTERS),
        ("plant", (*PLANTS, FALCON)),
    ):
        if getattr(case, name) not in permitted:
            raise StudyError(f"{name}={getattr(case, name)} is not permitted: choose {', '.join(permitted)}")
    if reason := _link_of(case).refusal_reason(case.rate_hz):
        raise StudyError(reason)
    return case


@cache
def liquids() -> Mapping[str, Scene]:
    """Return the scenes of the sweep by liquid.

    They are the liquids of the shipped studies, including tar, a far denser one, and the strongest permitted linear
    damper.
    """
    scenes_by_name: dict[str, Scene] = {}
    for protocol, prefix in _SWEEP_STUDIES.items():
        study = load(shipped_file(protocol))
        scenes_by_name |= {f"{prefix}{name}": study.scene_of(name) for name in study.liquids}
    damper = Liquid(id=DAMPER, density_kg_m3=1000, drag=Drag(law="linear", damping_nspm=DAMPING_NSPM[1]))
    for liquid in (Liquid(id="dense", density_kg_m3=10_000), damper):
        scenes_by_name[liquid.id] = Scene(liquids=(liquid,))
    return scenes_by_name


@cache
def scenes() -> Mapping[str, Scene]:
    """Return all scenes that a case may present: those of the sweep, and the liquids of all other shipped studies."""
    scenes_by_name = dict(liquids())
    for protocol in shipped():
        if protocol in _SWEEP_STUDIES:
            continue
        study = load(shipped_file(protocol))
        scenes_by_name |= {f"{protocol}_{name}": study.scene_of(name) for name in study.liquids}
    return scenes_by_name


@cache
def materials() -> tuple[str, ...]:
    """Return the names of the non-Newtonian liquids in `scenes`."""
    return tuple(name for name, scene in scenes().items() if scene.liquids[0].non_newtonian is not None)


@cache
def physical2_liquids() -> tuple[str, ...]:
    """Return the liquid names of physical2, which have unsteady drag if the Reynolds number permits it."""
    return tuple(name for name in scenes() if name.startswith("physical2_"))


def scene_of(case: Case) -> Scene:
    """Return the scene that the case presents."""
    velocity = _ESTIMATORS["ewma" if case.estimator == DEVICE else case.estimator]  # replaced by a device's own
    link = _link_of(case)
    changes = {"scale": case.scale, "rate_hz": case.rate_hz, "velocity": velocity, "link": link}
    return Scene.model_validate(scenes()[case.liquid].model_copy(update=changes).model_dump())


def _link_of(case: Case) -> ForceLink:
    """Return the force link of a case; its seed follows from the case."""
    return ForceLink(
        delay_s=case.force_delay_ms / 1000,
        jitter_s=case.force_jitter_ms / 1000,
        loss=case.force_loss,
        seed=zlib.crc32(str(case).encode()),
    )


def _format_value(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
