"""What an examination shows: every mode in its order, as found, ok or not looked at."""

import pickle
from dataclasses import dataclass

import pytest

from study_app.devices.doctor_report import NOTHING_WRONG, Report, lines
from study_app.devices.falcon.doctor.failure_report import findings_of
from study_app.devices.falcon.facts import OPEN, Facts
from study_app.devices.falcon.failure_modes import MODES


@dataclass(frozen=True)
class Seen:
    """What ``doctor.examine`` returns, without the compiler that it loads."""

    facts: Facts
    failure: str | None = None
    seen: tuple[str, ...] = ()


WELL = Facts(
    platform="linux",
    usb=OPEN,
    listed=True,
    ftdi_sees=True,
    program="running",
    replies=True,
    homed=0b111,
    moved=True,
    pulled_out=True,
    round_trip_s=0.0007,
    broken_share=0.0,
    rate_hz=1000.0,
    step_n=0.01,
)


def report(seen: Seen) -> Report:
    return Report(seen.seen, findings_of(seen.facts), seen.failure)


def test_nothing_looked_at_is_not_called_well_mode_for_mode():
    found = report(Seen(Facts(platform="linux")))
    assert [finding.id for finding in found.findings] == [mode.id for mode in MODES]
    assert [finding.number for finding in found.findings] == list(range(1, len(MODES) + 1))
    assert found.unseen
    assert found.conclusion.startswith("Nothing wrong was found. Not checked: ")


def test_a_falcon_in_order():
    found = report(Seen(WELL))
    assert found.well
    assert {finding.state for finding in found.findings} == {"ok"}
    assert found.conclusion == NOTHING_WRONG


@pytest.mark.parametrize(("platform", "pastes"), [("linux", True), ("win32", False)])
def test_what_is_found_says_cause_cure_and_what_to_paste_here(platform, pastes):
    found = report(Seen(Facts(platform=platform, usb="access"), "the Falcon cannot be used"))
    assert not found.well
    assert found.conclusion == f"Found: {len(found.found)}."
    for finding in found.found:
        assert finding.cause
        assert finding.cure
        assert finding.known_by
    assert any(finding.paste for finding in found.found) is pastes


def test_a_refused_firmware_says_itself_what_is_wrong():
    found = report(Seen(Facts(platform="linux", usb=OPEN, program="refused"), "it is a web page"))
    (finding,) = (one for one in found.found if one.id == "firmware-file")
    assert finding.says_itself


def test_a_report_goes_to_another_process_as_it_is():
    found = report(Seen(Facts(platform="linux", usb="access"), "refused", ("opened",)))
    assert pickle.loads(pickle.dumps(found)) == found  # noqa: S301 - our own


def test_a_report_states_what_was_tested_and_what_is_wrong_first():
    told = lines(report(Seen(Facts(platform="linux", usb="access"), "the Falcon cannot be used")))
    numbered = [line for line in told if line[:2].strip().isdigit()]
    states = [line[4:17].strip() for line in numbered]
    assert states == sorted(states, key=("FOUND", "not checked", "ok").index)
    assert numbered[0].endswith("only the administrator can open it")
    in_order = lines(report(Seen(WELL)))
    assert any(line.split() == ["5", "ok", "its", "firmware", "is", "available"] for line in in_order)
    assert not any("there is no firmware" in line for line in in_order)
