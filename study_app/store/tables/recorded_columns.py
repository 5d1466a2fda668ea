"""The columns of a trial's recording: samples of the servo, and frames shown; said once, as those of the tables are."""

from study_app.store.tables.column import Column

_AXES = (("x", "to the right"), ("y", "up"), ("z", "toward the participant"))


def _vector(name: str, unit: str, ending: str, description: str) -> tuple[Column, ...]:
    return tuple(
        Column(f"{name}_{axis}_{ending}", "number", f"{description}, {direction}.", unit) for axis, direction in _AXES
    )


SAMPLES: tuple[Column, ...] = (
    Column("tick", "integer", "Number of the servo's tick since its start; gaps are lost samples."),
    Column("time_ns", "integer", "Time when the device was read, on the servo's clock.", "ns"),
    Column("due_ns", "integer", "Time when the tick was due; its lateness is time_ns - due_ns.", "ns"),
    Column("fresh", "flag", "true where the device reported a new sample."),
    *_vector("position", "m", "m", "Position of the hand, exact"),
    *_vector(
        "velocity", "m/s", "mps", ("Velocity in the scene from which the force was computed; resolution 1/4096 m/s")
    ),
    *_vector("wake", "m/s", "mps", "Velocity of the liquid's wake in the scene; resolution 1/4096 m/s"),
    *_vector("device_force", "N", "n", "Force that the device applied to the hand; resolution 1/16384 N"),
    *_vector("undelivered", "N", "n", "Force that the servo commanded and the device did not apply"),
    *_vector(
        "withheld",
        "N",
        "n",
        ("Force of the liquid that was withheld: the force of the liquid is device_force + withheld"),
    ),
    Column("buttons", "integer", "Pressed buttons of the device, as bits."),
    Column("limiters", "integer", "Limiters that acted, as bits in the order of the trial's limiter columns."),
    Column("delay_ticks", "integer", "Estimated delay of the force, in ticks.", minimum=0, maximum=4),
    Column("scene", "integer", "Number of the presented scene; 0 is none.", minimum=0),
    Column(
        "status",
        "integer",
        "State of the servo.",
        levels=(
            ("0", "running normally"),
            ("1", "no usable sample for 50 ms"),
            ("2", "device lost"),
            ("3", "a non-finite force (NaN or infinite)"),
        ),
    ),
    Column(
        "measured",
        "integer",
        "What the device measured itself, as bits: 1 velocity, 2 orientation, 4 gripper, 8 time.",
        minimum=0,
        maximum=15,
    ),
    *_vector("device_velocity", "m/s", "mps", "Velocity of the hand, as the device measured it (NaN if not measured)"),
    *(
        Column(
            f"orientation_{part}",
            "number",
            f"Orientation of the handle in the hand frame: {part} of a unit quaternion; NaN if not measured.",
        )
        for part in "wxyz"
    ),
    Column("gripper_m", "number", "Opening of the gripper; NaN if not measured.", "m"),
    Column("device_time_ns", "integer", "Time of the sample on the device's clock; 0 if not measured.", "ns"),
)

FRAMES: tuple[Column, ...] = (
    Column("painted_ns", "integer", "Time when the frame was shown, on the servo's clock.", "ns"),
    Column("sample_ns", "integer", "Time of the hand position that was shown.", "ns"),
    Column("age_ns", "integer", "Achieved visual delay: painted_ns - sample_ns.", "ns"),
    Column("video_frame", "integer", "Number of the video's frame in it, from 0; -1 without one.", minimum=-1),
    Column(
        "video_ns",
        "integer",
        "Time when that was due without a delay, on the servo's clock: when the camera's picture was ready, or by the "
        "time in the file; 0 without one.",
        "ns",
    ),
    Column(
        "video_age_ns",
        "integer",
        "Age of the camera's picture when it was ready, by the source's time stamps: it was taken at video_ns - "
        "video_age_ns; -1 if unknown or without one.",
        "ns",
        minimum=-1,
    ),
)
