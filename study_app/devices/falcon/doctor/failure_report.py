"""The result of a Falcon's examination, for display: every failure mode, found or not.

Loads neither the compiler nor a driver, and can be passed between processes.
"""

from typing import Final

from study_app.devices.doctor_report import Finding
from study_app.devices.falcon.failures import MODES, Facts, Mode

_NOTHING_SEEN: Final = Facts()


def findings_of(facts: Facts = _NOTHING_SEEN) -> tuple[Finding, ...]:
    """Return every mode in its order, with the verdict of the facts."""
    return tuple(_finding(number, mode, facts) for number, mode in enumerate(MODES, start=1))


def _finding(number: int, mode: Mode, facts: Facts) -> Finding:
    shown = mode.shown_by(facts)
    return Finding(
        number,
        mode.id,
        mode.tested,
        mode.symptom,
        "not checked" if shown is None else "found" if shown else "ok",
        mode.cause,
        mode.cure(facts.platform),
        mode.detected,
        mode.paste if facts.platform == "linux" else "",
        says_itself=mode.id == "firmware-file" and facts.program == "refused",  # the refusal contains everything
    )
