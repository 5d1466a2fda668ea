"""What an examination of a Falcon shows, as values to be printed or drawn: every mode of failure, found or not.

Loads neither the compiler nor a driver, and goes from one process to another as it is.
"""

from typing import Final

from study_app.devices.doctor_report import Finding
from study_app.devices.falcon.facts import Facts, Mode
from study_app.devices.falcon.failure_modes import MODES

_NOTHING_SEEN: Final = Facts()


def findings_of(facts: Facts = _NOTHING_SEEN) -> tuple[Finding, ...]:
    """Return every mode in its order, as facts show it."""
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
        says_itself=mode.id == "firmware-file" and facts.program == "refused",  # the refusal says it all
    )
