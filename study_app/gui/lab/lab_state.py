"""What the liquid lab shows, as one frozen value: widgets only draw it. No Qt here.

Everything is in SI units and the scene frame unless said otherwise; a parameter's own ``factor`` and ``shown_unit`` say
how it is written.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.lab.ab_comparison import Side, Workbench
from study_app.lab.live import LimiterCount
from study_app.lab.presets import Choice
from study_app.lab.shadow import Tail

if TYPE_CHECKING:
    from study_app.lab.shadow import Trace

Choices: TypeAlias = tuple[tuple[str, str], ...]

Floats: TypeAlias = NDArray[np.float64]
Point: TypeAlias = tuple[float, float, float]
"""Pairs of what is chosen and the words for it."""

SPAN_S = 2.5
SIDES: tuple[Side, Side] = ("A", "B")


@dataclass(frozen=True, slots=True, kw_only=True)
class Now:
    """The current hand position [m, hand frame], force on the hand [N], and wake velocity at the body [m/s, scene]."""

    position_m: Point
    force_n: Point = (0.0, 0.0, 0.0)
    wake_mps: Point = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class CostRow:
    """An effect and its time per tick; ``ns`` is None if it is absent, for the reason ``why`` ("not used")."""

    effect: str
    ns: float | None
    why: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ErrorRow:
    """A deviation of the felt setting from its reference as text: ("Largest force error", "< 0.001 N")."""

    measure: str
    value: str
    note: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceShown:
    """The devices that can be chosen, the chosen one, and its ``state`` in one or two words.

    ``pointer`` tells whether the mouse pointer moves it, ``diagnosable`` whether it can be examined.
    """

    choices: Choices
    chosen: str
    state: str = ""
    ready: bool = True
    pointer: bool = False
    diagnosable: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class LabView:
    """The content of the liquid lab.

    ``liquids`` are the possible settings of a side, ``paths`` the programmed motions; ``path`` is the running one, None
    for live motion. ``busy`` is the current activity ("Opening the Falcon"); ``refused`` is the parameter that could
    not be changed and the reason, a new pair for every rejection; ``said`` names what was saved or opened last.
    ``tail_a``, ``tail_b``, ``trace`` and ``now`` are None before the first motion, a tail also if the setting has no
    wake. ``cost`` and ``errors`` are those of the felt setting, empty until they are measured; ``measuring`` is set
    during a new measurement. ``study`` is the edited study that takes changes back, or "".
    """

    workbench: Workbench
    liquids: tuple[Choice, ...]
    device: DeviceShown
    paths: Choices = ()
    path: str | None = None
    trace: Trace | None = None
    tail_a: Tail | None = None
    tail_b: Tail | None = None
    now: Now | None = None
    limiters: tuple[LimiterCount, ...] = ()
    cost: tuple[CostRow, ...] = ()
    tick_ns: float | None = None
    errors: tuple[ErrorRow, ...] = ()
    measuring: bool = False
    force_on: bool = True
    may_fade_in: bool = True
    busy: str = ""
    trouble: str = ""
    refused: tuple[str, str] | None = None
    said: str = ""
    workspace_m: Point = (0.1, 0.06, 0.06)
    body_radius_m: float = 0.0034
    study: str = ""

    @property
    def felt(self) -> Side:
        return self.workbench.presented

    @property
    def tail(self) -> Tail | None:
        return self.tail_a if self.felt == "A" else self.tail_b
