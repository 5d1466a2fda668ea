"""The descriptor of an effect: what gate, packing, files, lab and evaluation need to know about it.

An effect is two files of one name: the descriptor in ``haptics.model.effects``, the kernel in
``haptics.kernels.effects``; and one line in ``haptics.kernels.tick``. Descriptors are found by importing the modules of
their folder (``haptics.model.effects.EFFECTS``).
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, field
from typing import Any, Literal, NamedTuple, TypeAlias

Value: TypeAlias = "float | str | None"
_Choices: TypeAlias = tuple[tuple[str, str], ...]

Fields: TypeAlias = tuple[tuple[Any, ...], ...]
"""The fields of a record, as numpy's dtype takes them, so that descriptors need no numpy: name, type, shape if any."""
INT, FLOAT = "i8", "f8"

GRAVITY_MPS2 = 9.80665
TAIL_RATE_HZ = 1000.0
"""Elements of a wake are counted at this rate."""

_KALMAN_SMOOTHING_S = 0.015

LEAST, MOST = 0.0, 1.0  # of a parameter without a range: then the range in its model counts


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter in the lab: its label and range, in SI units; displayed numbers are multiplied by ``factor``.

    ``default`` is the default of its model or, without one, the scene's value. A parameter with ``choices`` (value,
    text) has one of these values, and ``least`` and ``most`` are unused. The displayed number has ``decimals``
    decimals.
    """

    name: str
    label: str
    _: KW_ONLY
    unit: str = ""
    least: float = LEAST
    most: float = MOST
    default: Value = None
    logarithmic: bool = False
    whole: bool = False
    choices: _Choices = ()
    shown_unit: str = ""
    factor: float = 1.0
    decimals: int = 2

    def shown(self, value: float) -> str:
        """Return a number with its unit as text."""
        number = f"{value * self.factor:.{self.decimals}f}"
        number = number.rstrip("0").rstrip(".") if "." in number else number
        return f"{number} {self.shown_unit}".rstrip()


class Flow(NamedTuple):
    """The greatest speed [m/s] of a liquid that flows by itself, and its greatest change along a path [m/s per m]."""

    speed_mps: float
    shear_per_s: float


Liquid: TypeAlias = Any
Scene: TypeAlias = Any
Extremes: TypeAlias = Any
"""Values of ``model.scene`` and ``model.gate``, which are made from the descriptors."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Rows that an effect owns in arrays of the model: the same rows in each of ``arrays``.

    ``needed`` returns the number that a liquid needs at a rate [Hz]; ``most`` is the greatest number that any liquid
    needs, None if only the caller that packs the scenes knows it. ``noun`` is their name in messages.
    """

    noun: str
    arrays: Mapping[str, Fields]
    needed: Callable[[Liquid, float], int]
    most: Callable[[float], int] | None = None


def _nothing_to_fill(record: Any, liquid: Liquid, scene: Scene, first: Mapping[str, int]) -> None:
    """Write nothing: the effect has no parameters."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """The properties of an effect that the program uses outside of its kernel.

    Parameters
    ----------
    name : str
        Name in files, records and tables.
    label : str
        Name in windows.
    bit : int
        Of ``layout.LIQUID``'s ``effects``; effects are listed in the order of their bits.
    bound_n : callable
        The greatest change of the force [N] if it is omitted; None if the liquid has no parameters for it.
    exerted_n : callable, optional
        Estimate of its greatest force [N]; None if it acts through others.
    extent : "area" | "volume"
        The wetted quantity that it is proportional to; "" if a surface does not change it.
    accelerated_n : callable, optional
        The force [N] if the liquid's velocity along the body's path changes by Δv [m/s] at a [m/s²].
    flow : callable, optional
        The speed and shear of the liquid's own flow, from the table.
    automatic : bool
        Whether the gate may choose it.
    bars : callable, optional
        Effects that the gate may not choose, with reasons.
    choose : callable, optional
        The table that the gate gives it, and why, in words.
    note : callable, optional
        Text appended to the reason why it is selected or listed, if it has no ``choose``.
    model : Any
        Type of its table in a liquid; None without a table.
    default : Any
        Its table if a file has none.
    missing : str
        Description of a missing table in messages.
    through : tuple of str
        The effects that it can act through, one of which it needs; the usual one first.
    excludes : tuple of str
        Other models of the same effect.
    replaces : tuple of str
        Fields of the liquid that must be empty with it: the lab clears them.
    problem : callable, optional
        The error in a liquid that selects it, in a sentence.
    parameters : tuple, optional
        Fields of its record of parameters in a liquid; ``fill`` writes them.
    state : tuple, optional
        Fields of its record of state in a liquid.
    fill : callable
        Writes its parameters into a liquid's record.
    rows : tuple of Rows
        Its rows in the arrays of the model.
    damping_nspm : callable, optional
        Its damping [N·s/m, scene] of fast motion, from its parameters and a factor of its smoothing rates; the loop is
        stable with only a fraction of such a force, and the kernel writes it to the next row of ``local.inertia_n``.
    adjustable : bool
        Whether its parameters may change while it acts.
    controls : tuple of Parameter
        Its parameters in the lab.
    with_liquid : bool
        Whether the lab shows them with the liquid's own, selected or not.
    open_values : mapping
        Values of unset parameters, computed from the scene.
    start : callable, optional
        The initial table of a kind ("": the default kind) in the lab, around a centre [m] within a reach [m].
    thresholds : tuple of str
        Parameters that cannot be fitted: the force jumps with them or does not change.
    """

    name: str
    label: str
    bit: int
    bound_n: Callable[[Extremes], float | None]
    exerted_n: Callable[[Extremes], float | None] | None = None
    extent: Literal["area", "volume", ""] = ""
    accelerated_n: Callable[[Extremes, float, float], float] | None = None
    flow: Callable[[Any], Flow] | None = None
    automatic: bool = True
    bars: Callable[[Extremes], tuple[tuple[str, ...], str]] | None = None
    choose: Callable[[Extremes], tuple[Any, str]] | None = None
    note: Callable[[Liquid], str] | None = None
    model: Any = None
    default: Any = None
    missing: str = ""
    through: tuple[str, ...] = ()
    excludes: tuple[str, ...] = ()
    replaces: tuple[str, ...] = ()
    problem: Callable[[Any], str | None] | None = None
    parameters: Fields | None = None
    state: Fields | None = None
    fill: Callable[[Any, Liquid, Scene, Mapping[str, int]], None] = _nothing_to_fill
    rows: tuple[Rows, ...] = ()
    damping_nspm: Callable[[Any, float], float] | None = None
    adjustable: bool = True
    controls: tuple[Parameter, ...] = ()
    with_liquid: bool = False
    open_values: Mapping[str, Callable[[Scene], float]] = field(default_factory=dict)
    start: Callable[[str, tuple[float, float, float], float], Mapping[str, Any]] | None = None
    thresholds: tuple[str, ...] = ()


def smoothing_s(velocity: Any, given_s: float | None, usual_s: float) -> float:
    """Return the smoothing time [s] of an effect: ``given_s`` in its table, or by the velocity estimator.

    Velocities given with the motion are not smoothed; that of "kalman" lags less and may be smoothed for longer before
    the history force.
    """
    if velocity.kind == "given":
        return 0.0
    if given_s is not None:
        return given_s
    return _KALMAN_SMOOTHING_S if velocity.kind == "kalman" else usual_s


def rate_per_s(time_s: float) -> float:
    """Return the rate [1/s] of a filter with this time constant [s]."""
    return math.inf if time_s == 0 else 1 / time_s
