"""The descriptor of an effect: what gate, packing, files, lab and evaluation need to know about it.

An effect is two files of one name: the descriptor in ``haptics.model.effects``, the kernel in
``haptics.kernels.effects``; and one line in ``haptics.kernels.tick``. Descriptors are found by importing the modules of
their folder (``haptics.model.effects.EFFECTS``).
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, Protocol, TypeAlias

Value: TypeAlias = "float | str | None"
Choices: TypeAlias = tuple[tuple[str, str], ...]

Fields: TypeAlias = tuple[tuple[Any, ...], ...]
"""The fields of a record, as numpy's dtype takes them, so that descriptors need no numpy: name, type, shape if any."""
INT, FLOAT = "i8", "f8"

GRAVITY_MPS2 = 9.80665
TAIL_RATE_HZ = 1000.0
"""Elements of a wake are counted at this rate."""

KALMAN_SMOOTHING_S = 0.015

LEAST, MOST = 0.0, 1.0  # of a parameter that says nothing else: then its model's own range counts


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter in the lab: what it is called, and what it may be, SI; as shown it is ``factor`` times as much.

    ``default`` is what its model gives it, or what the scene has where that gives nothing. A parameter with ``choices``
    (value, words) is one of those, and ``least``, ``most`` mean nothing. ``decimals`` of the shown number are
    significant.
    """

    name: str
    label: str
    unit: str = ""
    least: float = LEAST
    most: float = MOST
    default: Value = None
    logarithmic: bool = False
    whole: bool = False
    choices: Choices = ()
    shown_unit: str = ""
    factor: float = 1.0
    decimals: int = 2

    def shown(self, value: float) -> str:
        """Return a number with its unit, as people read it."""
        number = f"{value * self.factor:.{self.decimals}f}"
        number = number.rstrip("0").rstrip(".") if "." in number else number
        return f"{number} {self.shown_unit}".rstrip()


class Flow(NamedTuple):
    """The greatest speed [m/s] of a liquid that flows by itself, and its greatest change along a path [m/s per m]."""

    speed_mps: float
    shear_per_s: float


class LiquidLike(Protocol):
    """What descriptors read of a ``liquid.Liquid``, which is made of their tables and so imports them."""

    @property
    def density_kg_m3(self) -> float: ...  # noqa: D102
    @property
    def viscosity_pa_s(self) -> float | None: ...  # noqa: D102
    @property
    def region(self) -> Any: ...  # noqa: D102
    def __getattr__(self, name: str) -> Any: ...  # an effect's table


class BodyLike(Protocol):
    """What descriptors read of a ``scene.Body``."""

    @property
    def diameter_m(self) -> float: ...  # noqa: D102
    @property
    def drag_coefficient(self) -> float: ...  # noqa: D102
    @property
    def volume_m3(self) -> float: ...  # noqa: D102


class SceneLike(Protocol):
    """What descriptors read of a ``scene.Scene``."""

    @property
    def scale(self) -> float: ...  # noqa: D102
    @property
    def rate_hz(self) -> float: ...  # noqa: D102
    @property
    def body(self) -> BodyLike: ...  # noqa: D102
    @property
    def velocity(self) -> Any: ...  # noqa: D102
    @property
    def accuracy(self) -> Any: ...  # noqa: D102


class ExtremesLike(Protocol):
    """What descriptors read of the ``bounds.Extremes`` of the motion in one liquid of a scene."""

    @property
    def scene(self) -> SceneLike: ...  # noqa: D102
    @property
    def liquid(self) -> LiquidLike: ...  # noqa: D102
    @property
    def has_top(self) -> bool: ...  # noqa: D102
    @property
    def depth_m(self) -> tuple[float, float]: ...  # noqa: D102
    @property
    def relative_mps(self) -> float: ...  # noqa: D102
    @property
    def speed_mps(self) -> float: ...  # noqa: D102
    @property
    def acceleration_mps2(self) -> float: ...  # noqa: D102
    @property
    def flow(self) -> Flow: ...  # noqa: D102
    @property
    def reynolds(self) -> float: ...  # noqa: D102
    @property
    def radius_m(self) -> float: ...  # noqa: D102
    @property
    def volume_m3(self) -> float: ...  # noqa: D102
    @property
    def lift_n(self) -> float: ...  # noqa: D102
    @property
    def weight_n(self) -> float: ...  # noqa: D102
    def drag_by_flow_n(self, flow_mps: float) -> float: ...  # noqa: D102
    def inertial_n(self, accelerated_n: Callable[[Any, float, float], float]) -> float: ...  # noqa: D102
    def sheared_n(self) -> float: ...  # noqa: D102
    def total_n(self, extent: str) -> float: ...  # noqa: D102
    def submerged(self, depth_m: float) -> float: ...  # noqa: D102
    def doubtful_shares(self) -> tuple[float, float]: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class Rows:
    """Rows that an effect owns in arrays of the model, as many and from the same first row in each of ``arrays``.

    ``needed`` returns how many a liquid needs at a rate [Hz]; ``most`` how many any liquid can need, None where only
    whoever packs the scenes can know. ``words`` name them in messages.
    """

    words: str
    arrays: Mapping[str, Fields]
    needed: Callable[[LiquidLike, float], int]
    most: Callable[[float], int] | None = None


def _nothing_to_fill(record: Any, liquid: LiquidLike, scene: SceneLike, first: Mapping[str, int]) -> None:
    """Fill in nothing: the effect has no parameters of its own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """What the program needs to know about one effect.

    Parameters
    ----------
    name : str
        As files, records and tables call it.
    label : str
        As windows call it.
    bit : int
        Of ``layout.LIQUID``'s ``effects``; effects are listed in the order of their bits.
    bound_n : callable
        The greatest change of the force [N] that leaving it out makes; None where the liquid has no parameters
        for it.
    exerted_n : callable, optional
        About the greatest force [N] of its own; None where it acts through others.
    extent : "area" | "volume"
        What of the wetted body it grows with; "" where a surface does not change it.
    accelerated_n : callable, optional
        The force [N] where the liquid changes its velocity along the body's path by Δv [m/s] at a [m/s²].
    flow : callable, optional
        How fast the liquid flows by itself, from the table.
    format : int
        The format of files that it came with.
    automatic : bool
        Whether the gate may choose it.
    bars : callable, optional
        Effects that the gate may not choose in a scene of its format, by what it knows of them, and why.
    choose : callable, optional
        The table that the gate gives it, and why, in words.
    note : callable, optional
        What follows why it is chosen or named, where it has no ``choose``.
    model : Any
        Type of its table in a liquid; None without a table.
    default : Any
        Its table where a file has none.
    missing : str
        What a message says of a table that is missing.
    through : tuple of str
        The effects that it can act through, one of which it needs; the usual one first.
    excludes : tuple of str
        Effects that are models of the same thing.
    replaces : tuple of str
        Fields of the liquid that must be empty with it: the lab empties them.
    problem : callable, optional
        What is wrong with a liquid that selects it, in a sentence.
    parameters : tuple, optional
        Fields of its record of parameters in a liquid; ``fill`` writes them.
    state : tuple, optional
        Fields of its record of state in a liquid.
    fill : callable
        Writes its parameters into a liquid's record.
    rows : tuple of Rows
        What it owns in the arrays of the model.
    damping_nspm : callable, optional
        The damping [N·s/m, scene] that fast motion meets, by its parameters; a loop tolerates only a part of
        such a force, and the kernel writes it to the next row of ``local.inertia_n``.
    adjustable : bool
        Whether its numbers may change while it acts.
    controls : tuple of Parameter
        Its parameters in the lab.
    with_liquid : bool
        Whether the lab shows them with the liquid's own, selected or not.
    open_values : mapping
        What follows from the scene where a parameter is left open.
    start : callable, optional
        The table that the lab begins with, of a kind ("": the usual one), around a centre [m] within a reach
        [m].
    thresholds : tuple of str
        Parameters that cannot be fitted: the force jumps with them or does not change.
    """

    name: str
    label: str
    bit: int
    bound_n: Callable[[ExtremesLike], float | None]
    exerted_n: Callable[[ExtremesLike], float | None] | None = None
    extent: Literal["area", "volume", ""] = ""
    accelerated_n: Callable[[ExtremesLike, float, float], float] | None = None
    flow: Callable[[Any], Flow] | None = None
    format: int = 1
    automatic: bool = True
    bars: Callable[[ExtremesLike], tuple[tuple[str, ...], str]] | None = None
    choose: Callable[[ExtremesLike], tuple[Any, str]] | None = None
    note: Callable[[LiquidLike], str] | None = None
    model: Any = None
    default: Any = None
    missing: str = ""
    through: tuple[str, ...] = ()
    excludes: tuple[str, ...] = ()
    replaces: tuple[str, ...] = ()
    problem: Callable[[Any], str | None] | None = None
    parameters: Fields | None = None
    state: Fields | None = None
    fill: Callable[[Any, LiquidLike, SceneLike, Mapping[str, int]], None] = _nothing_to_fill
    rows: tuple[Rows, ...] = ()
    damping_nspm: Callable[[Any], float] | None = None
    adjustable: bool = True
    controls: tuple[Parameter, ...] = ()
    with_liquid: bool = False
    open_values: Mapping[str, Callable[[SceneLike], float]] = field(default_factory=dict)
    start: Callable[[str, tuple[float, float, float], float], Mapping[str, Any]] | None = None
    thresholds: tuple[str, ...] = ()


def smoothing_s(velocity: Any, given_s: float | None, usual_s: float) -> float:
    """Return over what time [s] an effect smooths: ``given_s`` by its table, or as suits the velocity estimator.

    Velocities that come with the motion are not smoothed; that of "kalman" lags less and may be smoothed for longer
    before a history.
    """
    if velocity.kind == "given":
        return 0.0
    if given_s is not None:
        return given_s
    return KALMAN_SMOOTHING_S if velocity.kind == "kalman" else usual_s


def rate_per_s(time_s: float) -> float:
    """Return the rate [1/s] of a filter of this time [s]."""
    return math.inf if time_s == 0 else 1 / time_s
