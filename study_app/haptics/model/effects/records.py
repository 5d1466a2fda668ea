"""What each effect keeps: its parameters, its state, and the rows it owns in the model's arrays.

Shapes, units and meaning are said here once, as in ``haptics.model.layout``, which puts these records together to those
of a liquid. Unless a name says otherwise: m, m/s, N, s, scene frame.
"""

from __future__ import annotations

import numpy as np

LAW_CONSTANT = 0
LAW_SCHILLER_NAUMANN = 1
LAW_HAIDER_LEVENSPIEL = 2
LAW_BROWN_LAWLER = 3

CURRENT_UNIFORM = 0
CURRENT_CHANNEL = 1
CURRENT_VORTEX = 2

CELLS = 64  # most cells of a local wake
EXPONENTIALS = 10  # of the kernel's tail

# --- Parameters, constant while a scene lasts

DRAG = np.dtype(
    [
        ("law", np.int64),  # LAW_*
        ("factor_kg_m", np.float64),  # ½ ρ C_d A, of the constant law
        ("stokes_nspm", np.float64),  # 3π µ D, of the laws of the Reynolds number
        ("reynolds_spm", np.float64),  # ρ D / µ, likewise: Re a unit of speed
    ],
    align=True,
)

WAKE = np.dtype(
    [
        ("row", np.int64),  # its first row in the model's elements and segments
        ("length", np.int64),  # N, in elements at the scene's rate: the rows it owns
        ("scaling", np.float64),  # S, likewise
        ("exponent", np.float64),  # y
        ("breaking_cosine", np.float64),  # cos β
        ("breaking_span_m", np.float64),
        ("log_decay_per_s", np.float64),  # ln λ a second
        ("resolution_m", np.float64),
        ("vertical", np.float64),  # 1 where vertical motion enters the tail, else 0
    ],
    align=True,
)

LOCAL_WAKE = np.dtype(
    [
        ("row", np.int64),  # its first row in the model's cells
        ("length", np.int64),  # N, in elements at the scene's rate
        ("scaling", np.float64),  # S, likewise
        ("exponent", np.float64),  # y
        ("log_decay_per_s", np.float64),  # ln λ a second
        ("vertical", np.float64),  # 1 where vertical motion enters, else 0
        ("cell_m", np.float64),  # how much path a cell takes
        ("cell_elements", np.int64),  # how many elements it takes at most
        ("reach_m", np.float64),  # σ_0: how far from a place its wake is felt
        ("spreading_m2ps", np.float64),  # ν
    ],
    align=True,
)

CURRENT = np.dtype(
    [
        ("kind", np.int64),  # CURRENT_*
        ("centre_m", np.float64, (3,)),
        ("velocity_mps", np.float64, (3,)),  # uniform: everywhere; channel: midway
        ("across", np.float64, (3,)),  # channel: unit vector from wall to wall
        ("size_m", np.float64),  # channel: half the width; vortex: the core's radius
        ("peak_mps", np.float64),  # vortex: at that radius
    ],
    align=True,
)

BUOYANCY = np.dtype([("lift_n", np.float64)], align=True)  # ρ V g

ADDED_MASS = np.dtype(
    [
        ("mass_kg", np.float64),  # C_a ρ V
        ("filter_per_s", np.float64),  # 1/τ
    ],
    align=True,
)

HISTORY = np.dtype(
    [
        ("row", np.int64),  # its first row in the model's intervals
        ("rows", np.int64),  # how many it owns
        ("tail_row", np.int64),  # its first row in the model's exponentials
        ("factor_kg_rs", np.float64),  # 6 R² √(π ρ µ) [kg/√s]
        ("window_s", np.float64),
        ("filter_per_s", np.float64),  # 1/τ of the velocity
    ],
    align=True,
)

# --- State

DRAG_STATE = np.dtype([("force_n", np.float64, (3,))], align=True)

WAKE_STATE = np.dtype(
    [
        ("stored", np.int64),  # elements stored since it was empty: the number of the next one
        ("held", np.int64),  # how many of them are still in the list
        ("first_segment", np.int64),  # number of the oldest segment
        ("last_segment", np.int64),  # number of the newest, to which elements are added
        ("reference", np.int64),  # number of the element the next one is compared with
        ("scanned", np.int64),  # number of the first element not yet considered as reference
        ("evicted", np.int64),  # moving elements that fell off since the last renewal
        ("arc_m", np.float64),  # a: path travelled in this liquid
        ("stored_at_m", np.float64, (3,)),  # where the body was when an element was last stored
        ("scale", np.float64),  # speeds and sums are stored divided by this common decay
        ("interior_mps", np.float64, (3,)),  # Σ direction · sum over segments between oldest and newest
        ("interior_carry_mps", np.float64, (3,)),  # its rounding error
        ("speed_mps", np.float64),  # Σ|e|
        ("speed_carry_mps", np.float64),
        ("square_m2ps2", np.float64),  # Σ|e|²
        ("square_carry_m2ps2", np.float64),
    ],
    align=True,
)

LOCAL_WAKE_STATE = np.dtype(
    [
        ("first", np.int64),  # where in its rows the oldest cell is; the others follow, around the end
        ("cells", np.int64),  # how many there are
        ("held", np.int64),  # elements in them, those at rest too
        ("path_m", np.float64),  # path of the newest cell
        ("time_s", np.float64),  # since the wake was empty
        ("drift_m", np.float64, (3,)),  # how far the current has carried the liquid since
    ],
    align=True,
)

CURRENT_STATE = np.dtype([("velocity_mps", np.float64, (3,))], align=True)

SURFACE_STATE = np.dtype(
    [
        ("volume", np.float64),  # share of the body's volume under the surface
        ("upright", np.float64),  # share of the frontal area of vertical motion
        ("level", np.float64),  # share of the frontal area of horizontal motion
    ],
    align=True,
)

ADDED_MASS_STATE = np.dtype(
    [
        ("primed", np.int64),  # 1 once a velocity is known
        ("previous_mps", np.float64, (3,)),  # w of the tick before
        ("acceleration_mps2", np.float64, (3,)),  # dw/dt, smoothed
        ("force_n", np.float64, (3,)),
    ],
    align=True,
)

HISTORY_STATE = np.dtype(
    [
        ("primed", np.int64),  # 1 once a velocity is known
        ("first", np.int64),  # where in its rows the oldest interval is; the others follow, around the end
        ("held", np.int64),  # how many there are
        ("smoothed_mps", np.float64, (3,)),  # w, smoothed
        ("force_n", np.float64, (3,)),
    ],
    align=True,
)

# --- Rows of the model's arrays, each liquid's in a stretch of its own

ELEMENT = np.dtype(
    [
        ("velocity_mps", np.float64, (3,)),  # e, divided by the wake's scale
        ("speed_mps", np.float64),  # |e|, likewise
        ("arc_m", np.float64),  # a when it was stored
        ("moving", np.int64),  # 0 for a zero element
    ],
    align=True,
)

SEGMENT = np.dtype(
    [
        ("direction", np.float64, (3,)),  # unit vector of its newest element
        ("speed_mps", np.float64),  # Σ|e| of its elements, divided by the wake's scale
        ("speed_carry_mps", np.float64),  # the rounding error of that sum
        ("count", np.int64),  # its elements still in the list
    ],
    align=True,
)

CELL = np.dtype(
    [
        ("place_m", np.float64, (3,)),  # mean place of its elements, in the frame that drifts with the current
        ("velocity_mps", np.float64, (3,)),  # Σe at ``time_s``
        ("speed_mps", np.float64),  # Σ|e|
        ("square_m2ps2", np.float64),  # Σ|e|²
        ("count", np.int64),  # its elements, those at rest too
        ("time_s", np.float64),  # when the last of them was stored
        ("spread_m2", np.float64),  # s_c, along each axis, at ``time_s``
    ],
    align=True,
)

INTERVAL = np.dtype(
    [
        ("acceleration_mps2", np.float64, (3,)),  # mean dw/dt
        ("duration_s", np.float64),
    ],
    align=True,
)

EXPONENTIAL = np.dtype([("memory", np.float64, (3,))], align=True)  # of the kernel's tail, times dw/dt [m/s / √s]
