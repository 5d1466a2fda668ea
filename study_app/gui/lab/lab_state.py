"""The content of the liquid lab as one immutable value, without Qt.

Everything is in SI units and the scene frame, unless stated otherwise; the ``factor`` and ``shown_unit`` of a parameter
determine how it is displayed.
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
"""Pairs of a value and its label."""
Floats: TypeAlias = NDArray[np.float64]
Point: TypeAlias = tuple[float, float, float]

SPAN_S = 2.5
SIDES: tuple[Side, Side] = ("A", "B")


@dataclass(frozen=True, slots=True, kw_only=True)
class Now:
    """The current position of the hand [m, hand frame], the force on it [N], and the wake at the body [m/s, scene]."""

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
    """A deviation of the felt setting from its reference as text: "Largest force error", "< 0.001 N"."""

    measure: str
    value: str
    note: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceShown:
    """The choice of devices, the chosen device, and its ``state`` in one or two words.

    ``pointer`` tells whether the mouse pointer moves the ball, ``diagnosable`` whether the device can be diagnosed.
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

    ``liquids`` are the liquids that a side can have. ``paths`` are the programmed motions, and ``path`` is the running
    one, or None for free motion. ``busy`` is the current activity ("Opening the Falcon"). ``refused`` is the parameter
    that could not be changed, and the reason; every rejection is a new pair. ``said`` names what was saved or opened
    last. ``tail_a``, ``tail_b``, ``trace`` and ``now`` are None before the first motion; so is the tail of a setting
    without a wake. ``cost`` and ``errors`` are those of the felt setting, and empty until they are measured;
    ``measuring`` is set during a measurement. ``study`` names the edited study that changes can be put back into.
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
