"""The columns of a trial's recording: samples of the servo, and frames shown; said once, as those of the tables are."""

from __future__ import annotations

from study_app.store.tables.columns import Column

_AXES = (("x", "to the right"), ("y", "up"), ("z", "toward the participant"))


def _vector(name: str, unit: str, ending: str, description: str) -> tuple[Column, ...]:
    return tuple(
        Column(f"{name}_{axis}_{ending}", "number", f"{description}, {direction}.", unit) for axis, direction in _AXES
    )


SAMPLES: tuple[Column, ...] = (
    Column("tick", "integer", "Number of the servo's turn since it started; a gap is samples that were lost."),
    Column("time_ns", "integer", "When the device was read, on the servo's clock.", "ns"),
    Column("due_ns", "integer", "When the turn was due; it was late by time_ns - due_ns.", "ns"),
    Column("fresh", "flag", "true where the device reported a new sample."),
    *_vector("position", "m", "m", "Place of the hand, exact"),
    *_vector("velocity", "m/s", "mps", "Velocity in the scene, as the force was computed from; to 1/4096 m/s"),
    *_vector("wake", "m/s", "mps", "Velocity of the liquid's wake in the scene; to 1/4096 m/s"),
    *_vector("device_force", "N", "n", "Force that the device sent to the hand; to 1/16384 N"),
    *_vector("undelivered", "N", "n", "Force that the servo commanded and the device did not send"),
    *_vector("withheld", "N", "n", "Force of the liquid that was not sent: device_force + withheld is what it exerted"),
    Column("buttons", "integer", "Buttons of the device that were down, as bits."),
    Column("limiters", "integer", "Limiters that acted, as bits in the order of the trial's limiter columns."),
    Column("delay_ticks", "integer", "Ticks by which a force is believed to act late.", minimum=0, maximum=4),
    Column("scene", "integer", "Number of the scene that was felt; 0 is none.", minimum=0),
    Column(
        "status",
        "integer",
        "State of the servo.",
        levels=(
            ("0", "in order"),
            ("1", "no usable sample for 50 ms"),
            ("2", "device lost"),
            ("3", "a force that is no number"),
        ),
    ),
)

FRAMES: tuple[Column, ...] = (
    Column("painted_ns", "integer", "When the frame was shown, on the servo's clock.", "ns"),
    Column("sample_ns", "integer", "The moment whose place of the hand it showed.", "ns"),
    Column("age_ns", "integer", "Age of what was shown: painted_ns - sample_ns, the visual delay achieved.", "ns"),
)
