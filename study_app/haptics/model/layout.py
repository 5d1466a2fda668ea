"""The memory shared by Python and compiled code: shape, unit and meaning of every field.

Records are rows of ``np.recarray``: plain structs in compiled code, objects with attributes otherwise
(``NUMBA_DISABLE_JIT=1``). Positions and forces are float64; unless a name says otherwise, m, m/s, N, s.
"""

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field
from functools import partial
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np

from study_app.haptics.model.device_dynamics import ASSUMED_TICKS, MOST_DELAY
from study_app.haptics.model.effect import Fields
from study_app.haptics.model.effects import EFFECTS
from study_app.haptics.model.estimators import ESTIMATORS
from study_app.haptics.model.force_rules import ForceRules

Record: TypeAlias = Any  # one row of a recarray: fields as attributes, compiled or not


def record_type(fields: Fields) -> np.dtype[Any]:
    """Return the NumPy type of an effect's record with these fields."""
    return np.dtype(list(fields), align=True)


# Limiters that acted in a tick, as bits of Sample.limiters.
LIMITER_SLOPE = 1 << 0
LIMITER_NON_FINITE = 1 << 1
LIMITER_ENERGY = 1 << 2
LIMITER_NORM = 1 << 3
LIMITER_SLEW = 1 << 4
LIMITER_FADE = 1 << 5
LIMITER_STALE = 1 << 6
LIMITER_GLITCH = 1 << 7  # the position was rejected and must not be used
LIMITER_STOP = 1 << 8
LIMITER_ESTIMATOR = 1 << 9  # the velocity is EWMA's: the Kalman filter had a fault within the last second
LIMITER_SATURATED = 1 << 10  # the device's motors saturated: its force was between 0 and ``device_force_n``


class _Limiter(NamedTuple):
    """A limiter: its bit, the suffix of its column, its display name, and the description of its column.

    An ``expected`` one does not concern an operator.
    """

    bit: int
    name: str
    label: str
    meaning: str
    expected: bool = False


LIMITERS: Final = (
    _Limiter(bit=LIMITER_SLEW, name="slew", label="Slew", meaning="the slew limit slowed the change in force"),
    _Limiter(bit=LIMITER_FADE, name="fade", label="Fade", meaning="the force was fading in or out", expected=True),
    _Limiter(
        bit=LIMITER_SLOPE, name="slope", label="Slope", meaning="the slope limit reduced the change of force with speed"
    ),
    _Limiter(bit=LIMITER_NORM, name="norm", label="Force", meaning="the force was reduced to the force limit"),
    _Limiter(
        bit=LIMITER_ENERGY,
        name="energy",
        label="Passivity controller",
        meaning="the passivity controller changed the force",
    ),
    _Limiter(
        bit=LIMITER_STALE, name="stale", label="Stale sample", meaning="the device did not provide a new sample in time"
    ),
    _Limiter(
        bit=LIMITER_GLITCH, name="glitch", label="Rejected sample", meaning="a sample was rejected as implausible"
    ),
    _Limiter(
        bit=LIMITER_NON_FINITE,
        name="non_finite",
        label="Non-finite force",
        meaning="a force that was not finite was replaced with zero",
    ),
    _Limiter(bit=LIMITER_STOP, name="stop", label="Force stopped", meaning="the force was stopped", expected=True),
    _Limiter(
        bit=LIMITER_ESTIMATOR,
        name="estimator",
        label="Velocity filter",
        meaning=(
            "the velocity was estimated by EWMA because the Kalman filter's innovations were too large or the delay "
            "changed"
        ),
    ),
    _Limiter(
        bit=LIMITER_SATURATED,
        name="saturated",
        label="Saturated motors",
        meaning="the device's motors saturated, so its force was between zero and the recorded force",
    ),
)
"""Every limiter, in the order in which windows show them."""

LIMITER_NAMES: Final = tuple(limiter.name for limiter in sorted(LIMITERS))
"""Their names in the order of their bits, which is that of columns."""

# Status of the servo, in Sample.status; the owner turns a fault into ServoFault.
STATUS_OK = 0
STATUS_STALE_FAULT = 1
STATUS_DEVICE_LOST = 2
STATUS_NON_FINITE = 3

# The device button that stops the force, evaluated by the servo, as a bit of Sample.buttons: button 4.
BUTTON_STOP = 1 << 3

FORCE_STEP_N = 2.0**-14
"""Resolution of forces in recordings [N]; checks round forces to it, both live and afterwards."""
_SPEED_STEP_MPS = 2.0**-12
"""Resolution of computed velocities in recordings [m/s]."""

# What a device may measure besides position and buttons, as bits of Reading.measured.
MEASURED_VELOCITY = 1 << 0
MEASURED_ORIENTATION = 1 << 1
MEASURED_GRIPPER = 1 << 2
MEASURED_TIME = 1 << 3

_AXES: Final = {"x": "to the right", "y": "up", "z": "toward the participant"}
_QUATERNION: Final = {part: part for part in "wxyz"}


@dataclass(frozen=True, slots=True)
class SampleField:
    """A field of `SAMPLE`, and the columns that recordings and streams have of it.

    Attributes
    ----------
    name : of the field
    meaning : meaning of its column in recordings, with ``{component}`` for its direction; "": it is not recorded
    column : name of the column, with ``*`` for the letter; "": the field's
    kind : type of its numbers
    parts : of a vector: the letter of each component, and its meaning
    unit : of the column, "" without one
    stored : type of the column's numbers
    step : to which the column is rounded; 0: exact
    beside : the field from which the column is the difference, ``sign`` (this - beside), "": it is no difference
    measured : MEASURED_* bit without which the column is NaN, 0: it is always known
    since, before : first format of recordings that has the column, and the value in earlier ones
    minimum, maximum, levels : of the column, as in ``csv_files.Column``
    stream : its channel in a stream, with ``*`` for the letter; "": it is not streamed
    """

    name: str
    meaning: str = ""
    _: KW_ONLY
    column: str = ""
    kind: type = np.int64
    parts: Mapping[str, str] = field(default_factory=dict)
    unit: str = ""
    stored: type = np.int64
    step: float = 0.0
    beside: str = ""
    sign: int = 1
    measured: int = 0
    since: int = 1
    before: float = 0
    minimum: float | None = None
    maximum: float | None = None
    levels: tuple[tuple[str, str], ...] = ()
    stream: str = ""

    def named(self, pattern: str = "") -> list[str]:
        """Return a name for each component, or one for a scalar; with an empty ``pattern`` the column names."""
        return [(pattern or self.column or self.name).replace("*", part) for part in self.parts or ("",)]


_VECTOR: Final = partial(SampleField, kind=np.float64, parts=_AXES, stored=np.float32)
_SPEED: Final = partial(_VECTOR, unit="m/s", step=_SPEED_STEP_MPS)
_FORCE: Final = partial(_VECTOR, unit="N", step=FORCE_STEP_N)
_CODE: Final = partial(SampleField, stored=np.int32)

SAMPLE_FIELDS: Final = (
    SampleField(
        "tick",
        "Tick number, counted from the start of the servo; missing numbers indicate lost samples.",
        stream="tick",
    ),
    SampleField("time_ns", "Time at which the device was read, on the servo's clock.", unit="ns"),
    SampleField(
        "lateness_ns",
        "Time at which the tick was due; its lateness is time_ns - due_ns.",
        column="due_ns",
        unit="ns",
        beside="time_ns",
        sign=-1,
    ),
    SampleField("fresh", "true if the device reported a new sample.", stored=np.bool_),
    _VECTOR(
        "position_m",
        "Exact position of the hand, {component}.",
        column="position_*_m",
        unit="m",
        stored=np.float64,
        stream="position_*",
    ),  # device, hand frame
    _SPEED(
        "velocity_mps",
        "Scene velocity from which the force was computed, {component} (resolution: 1/4096 m/s).",
        column="velocity_*_mps",
        stream="velocity_*",
    ),  # after estimator and compression
    _SPEED(
        "wake_mps",
        "Velocity of the liquid's wake in the scene, {component} (resolution: 1/4096 m/s).",
        column="wake_*_mps",
    ),  # as used by this tick's drag
    _FORCE(
        "device_force_n",
        "Force that the device applied to the hand, {component} (resolution: 1/16384 N).",
        column="device_force_*_n",
        stream="force_*",
    ),
    _FORCE(
        "command_n",
        "Force that the servo commanded but the device did not apply, {component}.",
        column="undelivered_*_n",
        beside="device_force_n",
        since=2,
    ),
    _FORCE(
        "force_n",
        "Part of the liquid's force that was held back, {component}; the liquid's force is device_force + withheld.",
        column="withheld_*_n",
        beside="device_force_n",
    ),  # sum of the effects on the body, before slope limit and safety
    _CODE("buttons", "Device buttons that were pressed, as bits."),  # button 1 is bit 0
    _CODE("limiters", "Limiters that acted, as bits in the order of the trial's limiter columns.", stream="limiters"),
    _CODE(
        "delay_ticks",
        "Estimated delay of the force, in ticks.",
        minimum=0,
        maximum=MOST_DELAY,
        since=2,
        before=ASSUMED_TICKS,
    ),  # in writes
    _CODE("scene", "Number of the scene presented; 0 if there is none.", minimum=0),
    _CODE(
        "status",
        "State of the servo.",
        levels=(
            ("0", "running normally"),
            ("1", "no usable sample for 50 ms"),
            ("2", "device lost"),
            ("3", "a non-finite force (NaN or infinite)"),
        ),
    ),
    _CODE(
        "measured",
        "Quantities that the device itself measured, as bits: 1 velocity, 2 orientation, 4 gripper, 8 time.",
        minimum=0,
        maximum=15,
        since=3,
    ),
    _VECTOR(
        "device_velocity_mps",
        "Velocity of the hand as measured by the device, {component} (NaN if not measured).",
        column="device_velocity_*_mps",
        unit="m/s",
        stored=np.float64,
        measured=MEASURED_VELOCITY,
        since=3,
    ),
    _VECTOR(
        "orientation",
        "Orientation of the handle in the hand frame: component {component} of a unit quaternion; NaN if not measured.",
        column="orientation_*",
        parts=_QUATERNION,
        measured=MEASURED_ORIENTATION,
        since=3,
    ),
    SampleField(
        "gripper_m",
        "Gripper opening; NaN if not measured.",
        kind=np.float64,
        unit="m",
        stored=np.float32,
        measured=MEASURED_GRIPPER,
        since=3,
    ),
    SampleField("device_time_ns", "Time of the sample on the device's clock; 0 if not measured.", unit="ns", since=3),
    SampleField("busy_ns"),  # how long the tick took, from reading to writing
    SampleField("permitted_n", kind=np.float64),  # size of the force of the effects after norm and fades
    SampleField("withheld_n", kind=np.float64),  # size of its change by slope limits, passivity, slew and device
)
"""What a tick tells: recorded columns, their dictionary and the channels of a stream follow from it, in this order.

Vectors are in the hand frame (position, device_velocity, forces) or in the scene frame (velocity, wake).
"""

SAMPLE = np.dtype([(it.name, it.kind, (len(it.parts),) if it.parts else ()) for it in SAMPLE_FIELDS], align=True)

CONTRACT_VERSION = 2
"""Of `READING` and `COMMAND`. Later versions append fields: a driver uses those that fit into ``size_bytes``."""

READING = np.dtype(
    [
        ("version", np.int64),  # CONTRACT_VERSION, by the servo
        ("size_bytes", np.int64),  # bytes of this record, by the servo: a driver writes nothing beyond
        ("position_m", np.float64, (3,)),  # hand frame, after the driver's mapping
        ("buttons", np.int64),
        ("delay_ticks", np.int64),  # delay of a force in writes, measured while running; -1: not measured
        # from version 2 on
        ("measured", np.int64),  # MEASURED_* bits of what follows; the servo sets it to 0 before each reading
        ("velocity_mps", np.float64, (3,)),  # of the handle, hand frame
        ("orientation", np.float64, (4,)),  # unit quaternion w, x, y, z: from the handle's frame to the hand frame
        ("gripper_m", np.float64),  # opening of the gripper
        ("device_time_ns", np.int64),  # time of the sample on the device's own clock
    ],
    align=True,
)

COMMAND = np.dtype(
    [
        ("version", np.int64),  # CONTRACT_VERSION, by the servo
        ("size_bytes", np.int64),  # bytes of this record, by the servo
        ("force_n", np.float64, (3,)),  # to send: force on the hand, hand frame
        ("sent_n", np.float64, (3,)),  # ``force_n``; a driver that sends another force puts that here
    ],
    align=True,
)


# The memory of one scene ("model", haptics.runtime.pack) and of the safety layer, in the scene frame unless stated
# otherwise. The fields of an effect are in separate records (``model.effects``), unused if the effect is not selected.

REGION_EVERYWHERE = 0
REGION_BOX = 1
REGION_CYLINDER = 2

# How forces grow with the speed.
GROWS_AS_SQUARE = 0
GROWS_AS_SPEED = 1
GROWS_LESS = 2

COMPRESSION_NONE = 0
COMPRESSION_SQRT = 1
COMPRESSION_SQUARE = 2

# The force link (haptics.kernels.safety).
_LINK = np.dtype(
    [
        ("acts", np.int64),  # 0: the force of a tick is sent in that tick
        ("delay_ticks", np.int64),
        ("jitter_ticks", np.int64),  # greatest additional delay in ticks
        ("loss", np.float64),  # fraction of ticks whose force is lost
        ("seed", np.int64),  # of jitter and loss
    ],
    align=True,
)

_LINK_STATE = np.dtype(
    [
        ("ticks", np.int64),  # since the scene began
        ("arrived", np.int64),  # tick of the force sent last, counted from 1; 0: none has arrived yet
        ("force_n", np.float64, (3,)),  # that force
    ],
    align=True,
)

_RULES = np.dtype([(name, np.float64) for name in ForceRules._fields])

PARAMETERS = np.dtype(
    [
        ("scale", np.float64),  # scene metres per hand metre
        ("origin_m", np.float64, (3,)),  # the hand's origin in the scene
        ("period_s", np.float64),  # nominal time between ticks
        ("liquids", np.int64),  # number of liquids in use
        ("effects", np.int64),  # bits of the effects that any of them selects
        ("radius_m", np.float64),  # of the body
        ("weight_n", np.float64),  # of the body
        ("estimator", np.int64),  # code of `estimators`
        ("log_keep_per_s", np.float64),  # ln(1 - α) per second: after t the part of the old velocity is exp of it · t
        ("compression_law", np.int64),  # COMPRESSION_*
        ("compression_threshold_mps", np.float64),
        ("slope_limit_nspm", np.float64, (MOST_DELAY + 1,)),  # greatest |drag| / |w| [N·s/m, scene], by the delay
        ("force_limit_n", np.float64),
        ("fade_s", np.float64),  # duration of the fade-in
        ("slew_n", np.float64),  # greatest change of the force per tick while the loop has no energy debt
        ("filter_lag_s", np.float64),  # the part of the velocity estimator's mean delay that stores energy
        ("fallback_lag_s", np.float64),  # the same of EWMA, which replaces a Kalman filter after a fault
        ("count_m", np.float64),  # one encoder count of the device, hand frame
        ("mass_kg", np.float64),  # the device's least effective mass
        ("smoothing_lead", np.float64),  # fraction of the lag of smoothed dw/dt that is compensated
        ("known_force_ticks", np.int64),  # shortest delay at which inertial forces use the known force (`known_force`)
        ("link", _LINK),
        ("rules", _RULES),
    ],
    align=True,
)

_REGION = np.dtype(
    [
        ("kind", np.int64),  # REGION_*
        ("centre_m", np.float64, (3,)),
        ("half_m", np.float64, (3,)),  # half extents; of a cylinder: radius, half height, radius
    ],
    align=True,
)

LIQUID = np.dtype(
    [
        ("effects", np.int64),  # bits of the effects it selects
        ("inertia_share", np.float64, (MOST_DELAY + 1,)),  # stable fraction of inertial forces, by the delay
        ("smoothing_rate", np.float64, (MOST_DELAY + 1,)),  # factor of the rates at which dw/dt is smoothed, likewise
        # factor of the slope limit while inertial forces are those of the known force, likewise; 0: they never are
        ("known_force", np.float64, (MOST_DELAY + 1,)),
        ("region", _REGION),
        *((effect.name, record_type(effect.parameters)) for effect in EFFECTS if effect.parameters is not None),
    ],
    align=True,
)

STATE = np.dtype(
    [
        ("tracking", np.int64),  # 1 once a position was accepted
        ("placed", np.int64),  # 1 once the body was found inside or outside of each liquid
        ("rejected", np.int64),  # samples rejected in a row
        ("accepted_ns", np.int64),  # when the last accepted sample was taken
        ("hand_m", np.float64, (3,)),  # the last accepted position, hand frame
        ("steps", np.int64),  # 1 once a step between two accepted positions is known
        ("step_s", np.float64),  # its duration
        ("step_mps", np.float64, (3,)),  # and mean velocity, hand frame
        ("square_m2ps2", np.float64),  # squared speed of the last step with motion
        ("fastest_m2ps2", np.float64),  # the greater one of it and the one before
        ("position_m", np.float64, (3,)),  # the same in the scene
        ("previous_m", np.float64, (3,)),  # the one before
        ("weight", np.float64),  # of the newest difference, for an interval of ``weighted_s``
        ("weighted_s", np.float64),
        *((it.name, record_type(it.state)) for it in ESTIMATORS if it.state is not None),
        ("estimate_mps", np.float64, (3,)),  # the estimator's own velocity, before compression
        ("velocity_mps", np.float64, (3,)),  # after compression
        ("wake_mps", np.float64, (3,)),  # of the last listed liquid that acts, as used by drag
        ("drift_mps", np.float64, (3,)),  # velocity of the current at the body, of the same liquid
        ("force_n", np.float64, (3,)),  # sum of the effects
        ("lift_n", np.float64, (3,)),  # buoyancy and weight within it
        ("surprised", np.int64),  # 1: after a surprise, the known force is not or partly used (`known_force`)
        ("returnable_j", np.float64),  # the greatest energy that effects can return, times the scale
        ("growth", np.int64),  # GROWS_* of the force that depends least on the speed
        ("link", _LINK_STATE),
    ],
    align=True,
)

_MOST_INERTIAL = max(sum(effect.damping_nspm is not None for effect in EFFECTS), 1)

LIQUID_STATE = np.dtype(
    [
        ("inside", np.int64),  # 1 while the body is within the borders (with hysteresis)
        ("border", np.float64),  # 0 outside, 1 inside, faded between
        ("share", np.float64),  # φ of the volume: border fraction times submerged fraction
        ("frontal", np.float64),  # φ of the frontal area, likewise; of the motion w
        ("motion_mps", np.float64, (3,)),  # v - v_current
        ("wake_mps", np.float64, (3,)),  # v_wake; zero without a wake
        ("relative_mps", np.float64, (3,)),  # w = v - v_current - v_wake
        ("ticks", np.int64),  # ticks since the body entered; 0: effects are reset
        ("damping_n", np.float64, (3,)),  # sum of the forces that the slope limit bounds
        ("excess_n", np.float64, (3,)),  # part of the forces that is steeper than the slope limit
        ("late_n", np.float64, (3,)),  # delayed drag, bounded by the rest of the slope limit
        ("late_mps", np.float64),  # the speed for its limit; 0: no delayed drag
        ("prompt_nspm", np.float64),  # the slope of the drag that acts at once
        ("inertia_share", np.float64),  # stable fraction of inertial forces in this tick
        ("slope_factor", np.float64),  # factor of the slope limit in this tick
        ("inertial", np.int64),  # number of reduced inertial forces
        ("inertia_n", np.float64, (_MOST_INERTIAL, 3)),  # these forces, in the order of their effects
        *((effect.name, record_type(effect.state)) for effect in EFFECTS if effect.state is not None),
    ],
    align=True,
)

# The fast part of force and motion, and its work, at the hand (haptics.kernels.passivity).
_INCREMENTAL = np.dtype(
    [
        ("force_n", np.float64, (3,)),  # mean force since the last sample
        ("force_once_n", np.float64, (3,)),  # the same after one high-pass filter
        ("force_twice_n", np.float64, (3,)),  # and after two
        ("velocity_mps", np.float64, (3,)),  # mean velocity in the frame of the current
        ("velocity_once_mps", np.float64, (3,)),
        ("velocity_twice_mps", np.float64, (3,)),
        ("balance_j", np.float64),  # B: 0 or below
    ],
    align=True,
)

# The energy balances of hand and liquid, at the hand (haptics.kernels.passivity).
PASSIVITY = np.dtype(
    [
        ("balance_j", np.float64),  # E: energy from the hand not yet returned, if forces act at once
        ("late_balance_j", np.float64),  # the same, if they act after the assumed loop delay
        ("later_balance_j", np.float64),  # the same, if they act another tick later
        ("row", np.int64),  # the row of the newest force below
        ("sent_n", np.float64, (MOST_DELAY + 2, 3)),  # forces of the last ticks, without buoyancy and weight
        ("saturated_n", np.float64, (MOST_DELAY + 2, 3)),  # the part of them that saturated motors may not have given
        ("saturated_ticks", np.int64),  # ticks until no row above has such a part
        ("acted_n", np.float64, (MOST_DELAY + 2, 3)),  # the same of the forces on the hand (a shadow's differ)
        ("acted_impulse_ns", np.float64, (3,)),  # of such forces after the assumed loop delay, times time
        ("reserve_j", np.float64),  # greatest energy that liquids and estimator could return at the last sample
        ("stored_j", np.float64, (MOST_DELAY + 2,)),  # what the velocity estimator stored then, at the hand
        ("impulse_ns", np.float64, (3,)),  # such a force times time, summed since the last sample [N·s]
        ("late_impulse_ns", np.float64, (3,)),  # the same of late forces
        ("later_impulse_ns", np.float64, (3,)),  # the same of forces another tick later
        ("impulse_s", np.float64),  # the time since then
        ("fast", _INCREMENTAL),
        ("weighted_s", np.float64),  # time between samples to which the weights below belong
        ("weight", np.float64),  # of the newest velocity in ``velocity_mps``
        ("hand_weight", np.float64),  # of the newest of these in ``slow_mps``
        ("velocity_mps", np.float64, (3,)),  # the hand's in the frame of the current, smoothed over 2 ms
        ("slow_mps", np.float64, (3,)),  # the same, smoothed again
        ("fast_s", np.float64),  # for how long the hand moved fast of late
        ("quiet_s", np.float64),  # for how long it has been quiet
        ("gap_s", np.float64),  # time since the last gap in the samples
        ("swing_mps", np.float64, (3,)),  # the fast part of the velocity, smoothed over 4 ms
        ("peak_mps", np.float64, (3,)),  # its greatest value since its last reversal
        ("peak_m2ps2", np.float64),  # the square of that
        ("reversed_s", np.float64),  # time since that reversal
        ("reversals", np.int64),  # number of successive ones, each sooner than a hand can reverse
        ("acting_s", np.float64),  # how long the controller recently changed the force; only with a force link
        ("debt", np.int64),  # DEBT_*: why force is or was withheld
        ("longest_m", np.float64),  # the longest step so far
        ("strongest_n", np.float64),  # the strongest force so far
        ("gain", np.float64),  # fraction of the force that is sent
        ("norm_share", np.float64),  # fraction of it that the force limit leaves
        ("settling", np.int64),  # 1 if the force of the last tick was changed to repay a debt
        ("lift_n", np.float64, (3,)),  # buoyancy and weight in the force that is sent
    ],
    align=True,
)

DEBT_NONE = 0
DEBT_PUSHED = 1  # it began in a fast motion
DEBT_OWN = 2  # it began otherwise
DEBT_FORGIVEN = 3  # the force returns

# Persists when the scene changes; owned by the sender of the force. The host may write stop, fault and device_limit_n.
SAFETY = np.dtype(
    [
        ("stop", np.int64),  # nonzero: zero force at once; back to 0: the force fades in as at the start
        ("fault", np.int64),  # STATUS_* that stopped the force for good, until the host clears it
        ("withheld", np.int64),  # LIMITER_* bits for which the force is fading out
        ("started", np.int64),  # 1 after the first tick
        ("tick_ns", np.int64),  # time of the last tick
        ("usable_ns", np.int64),  # time of the last sample that was accepted
        ("tick_s", np.float64),  # time since the tick before
        ("late_s", np.float64),  # lateness of this tick beyond the tolerance
        ("fade", np.float64),  # fraction of the force that is sent, 0 … 1
        ("fade_s", np.float64),  # least duration of a fade from 0 to 1 after a start; else 0
        ("device_limit_n", np.float64),  # the device's own force limit
        ("delay_ticks", np.int64),  # assumed delay of a force in writes, 0 … MOST_DELAY
        ("slower", np.int64),  # samples in a row with a longer measured delay
        ("faster", np.int64),  # samples in a row with a shorter one
        ("requested_n", np.float64, (3,)),  # the force of the effects within norm and fades
        ("permitted_n", np.float64, (3,)),  # the same after slope limits
        ("slewed_n", np.float64, (3,)),  # the force of the last tick, before the passivity controller changed it
        ("passivity", PASSIVITY),  # reset with each scene
    ],
    align=True,
)


def records(dtype: np.dtype[Any], count: int) -> Any:
    """Return ``count`` zeroed records of ``dtype`` as a contiguous ``np.recarray`` of shape (count,)."""
    return np.zeros(count, dtype).view(np.recarray)


def new_reading() -> Any:
    """Return one ``READING``, shape (1,), with its version and size."""
    return _new_record(READING)


def new_command() -> Any:
    """Return one ``COMMAND``, shape (1,), with its version and size and zero force."""
    return _new_record(COMMAND)


def _new_record(dtype: np.dtype[Any]) -> Any:
    record = records(dtype, 1)
    record[0].version, record[0].size_bytes = CONTRACT_VERSION, dtype.itemsize
    return record
