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
    """Where the hand is [m, hand frame], the force felt on it [N], the wake that the body meets [m/s, scene]."""

    position_m: Point
    force_n: Point = (0.0, 0.0, 0.0)
    wake_mps: Point = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class CostRow:
    """An effect and the ns it takes of a tick; ``ns`` None where it is not there, and ``why`` not ("not used")."""

    effect: str
    ns: float | None
    why: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class ErrorRow:
    """A measure of how far the felt setting is from its reference, written out: ("Force, largest", "< 0.001 N")."""

    measure: str
    value: str
    note: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceShown:
    """Which devices can be chosen, which is, and how it is: ``state`` is one or two words.

    ``pointer`` is whether the window's pointer moves it, ``diagnosable`` whether it can be examined.
    """

    choices: Choices
    chosen: str
    state: str = ""
    ready: bool = True
    pointer: bool = False
    diagnosable: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class LabView:
    """Everything on the liquid lab's place.

    ``liquids`` are what a side can be set to, ``paths`` the programmed motions; ``path`` is the one that runs, None for
    live motion alone. ``busy`` says what is waited for ("Opening the Falcon"); ``refused`` is the parameter that could
    not be changed and one line why, a new pair for every refusal; ``said`` tells what was saved or opened last.
    ``tail_a``, ``tail_b``, ``trace`` and ``now`` are None where nothing has moved yet, a tail also where the setting
    has no wake. ``cost`` and ``errors`` are of the felt setting, empty until they are measured; ``measuring`` while
    they are measured anew. ``study`` is the study that is edited and takes changes back, "" without one.
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
