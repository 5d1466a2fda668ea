"""The service's own settings that change the force: which values a session uses, and which it refuses. As data.

Documents: docs.haply.co 3.5.x, "Device Configuration" (availability matrix, preset, basis, damping), "Filters" (force
pipeline), "Mount & Workspace Transforms" (presets), "WebSocket Protocol" step 1 (shape of ``config``).
"""

from collections.abc import Mapping
from typing import Any, Final

PROFILE: Final = "liquid-study:study"
PRESET: Final = "arm_front_centered"
"""Origin in the middle of the workspace ("Mount & Workspace Transforms", presets)."""
BASIS: Final = "XYZ"
FORCE_GATE_GAIN: Final = 0.0
"""Attenuates the force where the service detects an oscillation; its default is 0.3. That 0 turns it off is not
documented: on the bench list."""

SESSION_SCOPED: Final[Mapping[str, Any]] = {
    "preset": PRESET,
    "basis": {"permutation": BASIS},
    "filters": {"force_gate": {"gain": FORCE_GATE_GAIN}, "damping": {"scalar": 0.0}},
}
"""As a snapshot of the configuration shows what `first_message` sets."""

DEVICE_GLOBAL: Final[Mapping[str, Any]] = {
    "gravity_compensation": {"enabled": True, "scaling_factor": 1.0},
    "torque_scaling": {"enabled": True},
}
"""Factory values, which a message cannot set ("Device Configuration": HTTP only, device-global). They hold for every
program on the computer, so they are required, not changed."""

RECORDED: Final = (*SESSION_SCOPED, *DEVICE_GLOBAL, "mount", "handedness", "home_return", "streaming_mode")
_ZERO: Final = {"x": 0.0, "y": 0.0, "z": 0.0}


def first_message(device_id: str) -> dict[str, Any]:
    """Return the message that opens a session: profile, neutral settings and zero force.

    ``session.configure`` and a device's ``configure`` are sent once, with the first message ("WebSocket Protocol" and
    tutorial 01, "first-message-only handshake"); a command goes with it to keep the state coming.
    """
    configure = {
        "preset": {"preset": PRESET},
        "damping": {"scalar": 0.0, "vector": _ZERO},
        "force_gate": {"gain": FORCE_GATE_GAIN},
    }
    session = {"configure": {"profile": {"name": PROFILE}, "basis": {"permutation": BASIS}}}
    return {"session": session, **_command(device_id, configure=configure)}


def full_state_request(device_id: str) -> dict[str, Any]:
    """Return a message whose answer has the configuration, too ("Simulation Channel", configuration vs state)."""
    return {"session": {"force_render_full_state": {}}, **_command(device_id)}


def zero_force(device_id: str) -> dict[str, Any]:
    """Return a command of zero force ("Control Commands", set_cursor_force)."""
    return _command(device_id)


def _command(device_id: str, **further: Any) -> dict[str, Any]:
    return {
        "inverse3": [{"device_id": device_id, **further, "commands": {"set_cursor_force": {"vector": dict(_ZERO)}}}]
    }


def recorded(config: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of a configuration that change the force, for the receipt."""
    return {key: config[key] for key in RECORDED if key in config}


def differing(config: Mapping[str, Any], required: Mapping[str, Any]) -> list[str]:
    """Return which settings are not as required, in words; numbers that are equal as floats are equal.

    Parameters
    ----------
    required : `SESSION_SCOPED` or `DEVICE_GLOBAL`
    """
    return list(_differing("", config, required))


def _differing(place: str, value: Any, required: Any) -> list[str]:
    if isinstance(required, Mapping):
        found: list[str] = []
        for key, wanted in required.items():
            name = f"{place}.{key}" if place else key
            inner = value.get(key) if isinstance(value, Mapping) else None
            found += _differing(name, inner, wanted)
        return found
    return [] if value == required else [f"{place} is {value!r}, and {required!r} is required"]
