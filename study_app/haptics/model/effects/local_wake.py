"""The local wake: a position tail whose elements stay where they arose."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from study_app.haptics.model.effect import FLOAT, INT, Effect, Fields, Liquid, Parameter, Rows, Scene
from study_app.haptics.model.effects.wake import fill_tail, start_tail, tail_bound_n, within_scaling
from study_app.haptics.model.ranges import Decay, Exponent, Extent, Frozen, TailLength, TailScaling, within

BIT = 1 << 2
CELLS = 64  # most cells of a local wake


class LocalWake(Frozen):
    """A position tail that stays where the body left it."""

    length: TailLength
    scaling: TailScaling
    exponent: Exponent = 1.0
    decay: Decay = 0.999975
    axes: Literal["xz", "xyz"] = Field(
        default="xz", description="xz: the wake ignores vertical motion; xyz: it includes vertical motion."
    )
    reach_m: Extent | None = Field(
        default=None,
        description=(
            "Radius around a wake point within which that point acts [m]; the default is one diameter of the body."
        ),
    )
    spreading_m2ps: Annotated[
        float,
        within(
            0,
            10,
            "with faster spreading, a wake vanishes within a tick",
            what="How fast a wake point spreads and weakens with time [m²/s].",
        ),
    ] = 1e-3

    @model_validator(mode="after")
    def _liquid_never_outruns_the_body(self) -> Self:
        return within_scaling(self)


def _fill(record: Any, liquid: Liquid, scene: Scene, first: Mapping[str, int]) -> None:
    wake, diameter_m = liquid.local_wake, scene.body.diameter_m
    fill_tail(record, wake, scene.rate_hz, first["cells"])
    record.cell_m = diameter_m
    record.cell_elements = max(1, math.ceil(record.length / 16))
    record.reach_m = wake.reach_m or diameter_m
    record.spreading_m2ps = wake.spreading_m2ps


_PARAMETERS: Fields = (
    ("row", INT),  # its first row in the model's cells
    ("length", INT),  # N, in elements at the scene's rate
    ("scaling", FLOAT),  # S, likewise
    ("exponent", FLOAT),  # y
    ("log_decay_per_s", FLOAT),  # ln λ a second
    ("vertical", FLOAT),  # 1 where vertical motion enters, else 0
    ("cell_m", FLOAT),  # greatest path of a cell
    ("cell_elements", INT),  # greatest number of its elements
    ("reach_m", FLOAT),  # σ_0: reach of the wake around a place
    ("spreading_m2ps", FLOAT),  # ν
)

_STATE: Fields = (
    ("first", INT),  # where in its rows the oldest cell is; the others follow, around the end
    ("cells", INT),  # how many there are
    ("held", INT),  # elements in them, those at rest too
    ("path_m", FLOAT),  # path of the newest cell
    ("time_s", FLOAT),  # since the wake was empty
    ("drift_m", FLOAT, (3,)),  # displacement of the liquid by the current since then
)

_CELL: Fields = (
    ("place_m", FLOAT, (3,)),  # mean place of its elements, in the frame that drifts with the current
    ("velocity_mps", FLOAT, (3,)),  # Σe at ``time_s``
    ("speed_mps", FLOAT),  # Σ|e|
    ("square_m2ps2", FLOAT),  # Σ|e|²
    ("count", INT),  # its elements, those at rest too
    ("time_s", FLOAT),  # when the last of them was stored
    ("spread_m2", FLOAT),  # s_c, along each axis, at ``time_s``
)

EFFECT = Effect(
    name="local_wake",
    label="Local wake",
    bit=BIT,
    bound_n=lambda extremes: tail_bound_n(extremes, extremes.liquid.local_wake),
    automatic=False,
    model=LocalWake,
    missing="length, scaling, ...",
    through=("drag",),
    excludes=("wake",),
    parameters=_PARAMETERS,
    state=_STATE,
    fill=_fill,
    rows=(Rows("local-wake cells", {"cells": _CELL}, lambda liquid, rate_hz: CELLS, lambda rate_hz: CELLS),),
    adjustable=False,  # its cells depend on its parameters
    open_values={"reach_m": lambda scene: scene.body.diameter_m},
    start=start_tail,
    controls=(
        Parameter("local_wake.length", "Length", unit="ticks", logarithmic=True, whole=True, decimals=0),
        Parameter("local_wake.scaling", "Scaling", unit="ticks", least=1.0, most=1e5, logarithmic=True, decimals=0),
        Parameter("local_wake.exponent", "Exponent", unit="", least=0.05, logarithmic=True),
        Parameter("local_wake.decay", "Decay", unit="per tick", least=0.99, decimals=6),
        Parameter(
            "local_wake.reach_m", "Reach", unit="m", least=1e-3, most=0.5, factor=1e3, shown_unit="mm", decimals=1
        ),
        Parameter("local_wake.spreading_m2ps", "Spreading", unit="m²/s", most=0.1, factor=1e4, shown_unit="cm²/s"),
        Parameter("local_wake.axes", "Axes", choices=(("xz", "Horizontal"), ("xyz", "All three"))),
    ),
)
