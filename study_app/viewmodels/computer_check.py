"""Whether this computer is fit for sessions, apart from every study: the first-run check. No Qt here."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from study_app.devices.descriptor import NOT_AVAILABLE, Backend
from study_app.protocol.model import Protocol
from study_app.session.preflight import Check, Facts, checks

OF_THE_COMPUTER: Final = ("Servo rate", "Servo lateness", "Priority", "Screen", "Results folder", "Free space")
"""The checks before a session that say nothing of the study or its device."""

RECOMPILES: Final = "Every start compiles again, for up to a minute: set NUMBA_CACHE_DIR to a writable folder."


def computer_checks(
    facts: Facts, protocol: Protocol, devices: Sequence[Backend], *, cache: Path | None, compiled: int
) -> tuple[Check, ...]:
    """Return what is to be said of a computer.

    ``facts`` were measured with the simulated hand, for which ``compiled`` functions had to be compiled; the protocol's
    limits apply; ``cache`` is the folder of compiled code, None where nothing can be stored.
    """
    of_servo = {check.name: check for check in checks(facts, protocol)}
    found = [of_servo[name] for name in OF_THE_COMPUTER]
    return (*found, _devices(devices), _compiled(cache, compiled))


def _devices(devices: Sequence[Backend]) -> Check:
    """Say which haptic devices are connected; without one sessions run with the mouse."""
    haptic = [one for one in devices if one.state.startswith("connected")]
    missing = [one.name for one in devices if one.state == NOT_AVAILABLE]
    about = f"cannot be used now: {', '.join(missing)}" if missing else "every device can be used"
    if haptic:
        return Check("Haptic devices", "ok", ", ".join(one.name for one in haptic), about)
    advice = "Connect one, then look at Devices; without one only the mouse and the simulated hand can be used."
    return Check("Haptic devices", "warning", "none connected", about, advice)


def _compiled(cache: Path | None, compiled: int) -> Check:
    if cache is None:
        return Check("Compiled code", "warning", "not stored", "no folder is writable", RECOMPILES)
    value = f"{compiled} functions compiled" if compiled else "stored"
    return Check("Compiled code", "ok", value, f"the force model for this processor, in {cache}")
