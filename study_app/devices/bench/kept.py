"""What a bench measured of a device, and this machine's settings kept, for what the device does not report."""

import json
from contextlib import suppress

from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics
from study_app.user_folder import settings_file


def dynamics_of(
    delay_s: float | None, count_m: float | None, mass_kg: float | None, *, name: str, serial: str | None
) -> Dynamics:
    """Return a device's dynamics: as it reports them, else as its latest bench on this computer measured them.

    Parameters
    ----------
    delay_s, count_m, mass_kg : as the device reports them; None: it does not
    name, serial : by which its bench is kept; settings that cannot be read hold none
    """
    with suppress(OSError, ValueError, KeyError, TypeError, AttributeError):
        for bench in json.loads(settings_file().read_bytes())["benches"]:
            if (bench["name"], bench["serial"]) == (name, serial or ""):
                count_m = count_m or bench.get("count_m")
                mass_kg = mass_kg or max(min(bench["mass_kg"]), 0.0)
    assumed = tuple(word for word, value in (("count_m", count_m), ("mass_kg", mass_kg)) if not value)
    return Dynamics(delay_s, count_m or UNKNOWN.count_m, mass_kg or UNKNOWN.mass_kg, assumed=assumed)
