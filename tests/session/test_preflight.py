"""What the pre-flight says of facts, and that it measures them."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from study_app.devices.scripted import ScriptedDevice
from study_app.errors import StoreError
from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics
from study_app.haptics.runtime.clocks.clock import VirtualClock
from study_app.haptics.runtime.clocks.grants import Grant
from study_app.haptics.runtime.servo import Servo
from study_app.haptics.runtime.telemetry import Timing
from study_app.outlets.session_outlets import OutletStatus
from study_app.protocol.load import parse
from study_app.protocol.model import Protocol
from study_app.session import preflight_measurements
from study_app.session.preflight import Facts, Screen, checks, refused
from study_app.session.preflight_measurements import measure
from tests.compiled import needs_servo
from tests.protocol.edited_studies import text_of
from tests.session import small


def verdicts(study: Protocol | None = None, **changed: Any) -> dict[str, str]:
    return {check.name: check.verdict for check in checks(replace(small.WELL, **changed), study or small.protocol())}


def test_where_all_is_well_nothing_is_said_but_so() -> None:
    assert set(verdicts().values()) == {"ok"}
    assert refused(checks(small.WELL, small.protocol())) == ""


@pytest.mark.parametrize(
    ("status", "verdict", "said"),
    [
        (OutletStatus("LSL markers", listens=True), "ok", "listener; a program receives the stream"),
        (OutletStatus("LSL markers", listens=False), "warning", "no listener; no program receives the stream; Start"),
        (OutletStatus("LSL samples", withheld=True), "ok", "off; in a double-blind study: whoever sees the force can"),
        (OutletStatus("LSL samples", listens=True, shows_force=True), "warning", "listener; the study is double-blind"),
        (OutletStatus("LSL samples", listens=False, shows_force=True), "warning", "no listener; the study is double-b"),
        (OutletStatus("Serial port"), "ok", "ready; open"),
        (OutletStatus("Serial port", lost="it is gone"), "warning", "not available; it is gone; The session can run"),
    ],
)
def test_who_listens_is_said_and_nothing_of_it_refuses_a_session(status: OutletStatus, verdict: str, said: str) -> None:
    found = checks(replace(small.WELL, outlets=(status,)), small.protocol())
    (check,) = [one for one in found if one.name == status.title]
    assert check.verdict == verdict
    assert check.said.startswith(said)
    assert refused(found) == ""


@pytest.mark.parametrize(
    ("changed", "name", "verdict"),
    [
        ({"fresh_share": 0.2}, "Device", "failure"),
        ({"timing": Timing(0, 0.0, 0.0, 0.0, 0)}, "Device", "failure"),
        ({"timing": Timing(800, 400.0, 1e-4, 2e-3, 0)}, "Servo rate", "failure"),
        ({"timing": Timing(1900, 950.0, 1e-4, 2e-3, 0)}, "Servo rate", "warning"),
        ({"timing": Timing(2000, 1000.0, 2.1e-3, 2e-3, 0)}, "Servo lateness", "warning"),
        ({"timing": Timing(2000, 1000.0, 1e-4, 21e-3, 9)}, "Servo lateness", "warning"),
        ({"grant": Grant("raised", "nice -15", advice=("do this",))}, "Priority", "warning"),
        ({"grant": Grant("normal", "refused", locked=False)}, "Priority", "warning"),
        ({"sample_age_s": 0.01}, "Visual delay", "warning"),
        ({"screen": Screen(30.0, 1.0)}, "Visual delay", "warning"),
        ({"screen": Screen(60.0, 1.5)}, "Screen", "warning"),
        ({"probe_s": None, "probe_fault": "the folder is read-only"}, "Results folder", "failure"),
        ({"probe_s": 0.4}, "Results folder", "warning"),
        ({"free_bytes": 50_000_000}, "Free space", "failure"),
        ({"free_bytes": None}, "Free space", "warning"),
        ({"dynamics": Dynamics(0.0018), "delay_ticks": 2}, "Loop delay", "warning"),
        ({"withheld": {"thin": 0.01, "thick": 0.051}}, "Force withheld", "warning"),
        ({"withheld": {"thin": 0.01, "thick": 0.05}}, "Force withheld", "ok"),
    ],
)
def test_each_fact_has_its_limit(changed: dict[str, Any], name: str, verdict: str) -> None:
    assert verdicts(**changed)[name] == verdict
    reason = refused(checks(replace(small.WELL, **changed), small.protocol()))
    assert (name.lower() in reason) == (verdict == "failure")


@pytest.mark.parametrize("blinding", ["double", "single"])
def test_the_share_withheld_is_told_by_liquid_where_the_operator_may_know_them(blinding: Any) -> None:
    study = small.protocol()
    study = study.model_copy(update={"study": study.study.model_copy(update={"blinding": blinding})})
    facts = replace(small.WELL, withheld={"thin": 0.001, "thick": 0.032})
    (found,) = [check for check in checks(facts, study) if check.name == "Force withheld"]
    assert (found.value, found.share) == ("at most 3.2 %", pytest.approx(0.64))
    liquids = "" if blinding == "double" else ": thick 3.2 %, thin 0.1 %"
    assert found.about == f"in the fastest stroke of a task, limit 5 %{liquids}"


@pytest.mark.parametrize(
    ("delay_s", "ticks", "said"),
    [
        (None, 1, "assumed: the device does not measure its delay"),
        (0.00093, 1, "delay until a force acts: 0.93 ms, measured by the device"),
        (0.0018, 2, "delay until a force acts: 1.80 ms, measured by the device"),
        (0.00093, 3, "0.93 ms, measured by the device when it was opened; it measured more since"),
    ],
)
def test_the_delay_of_the_loop_is_told_with_where_it_comes_from(delay_s: float | None, ticks: int, said: str) -> None:
    facts = replace(small.WELL, dynamics=Dynamics(delay_s), delay_ticks=ticks)
    (found,) = [check for check in checks(facts, small.protocol()) if check.name == "Loop delay"]
    assert found.value == f"{ticks} tick{'s' * (ticks > 1)}"
    assert found.about.endswith(said)
    assert found.verdict == ("warning" if ticks > 1 else "ok")


@pytest.mark.parametrize(
    ("dynamics", "errors", "said"),
    [
        (
            UNKNOWN,
            (0.121, 0.0101),
            "12 % instead of 1 %; error at 2 Hz, because the device's delay, encoder count and mass are unknown; "
            "Measure the device: liquid-study devices bench force-dimension:7.",
        ),
        (
            Dynamics(1e-3, assumed=("mass_kg",)),
            (0.01, 0.01),
            "1 %; error at 2 Hz, although the device's mass is unknown",
        ),
    ],
)
def test_what_is_not_known_of_a_device_is_told_with_its_cost(
    dynamics: Dynamics, errors: tuple[float, float], said: str
) -> None:
    changed = {"dynamics": dynamics, "velocity_errors": errors}
    facts = replace(small.WELL, device="force-dimension:7", **changed)
    (check,) = [one for one in checks(facts, small.protocol()) if one.name == "Velocity"]
    assert check.said == said
    assert check.verdict == ("warning" if "instead" in said else "ok")
    assert "Velocity" not in verdicts(**changed)  # a mouse gives no force
    assert "Velocity" not in verdicts(device="force-dimension", dynamics=Dynamics(1e-3))


def test_what_was_not_granted_is_told_with_how_to_grant_it() -> None:
    grant = Grant("raised", "nice -15", advice=("do this",)).with_memory(locked=False, advice="do that")
    said = {check.name: check.said for check in checks(replace(small.WELL, grant=grant), small.protocol())}["Priority"]
    assert said == "raised; nice -15, memory not locked; Do this."


def test_a_servo_below_500_hz_is_refused_whatever_it_achieves() -> None:
    slow = small.protocol().model_copy(update={"device": small.protocol().device.model_copy(update={"rate_hz": 400.0})})
    found = checks(replace(small.WELL, timing=Timing(800, 400.0, 1e-4, 2e-3, 0)), slow)
    assert "servo rate: the servo runs at 400 Hz" in refused(found)
    enough = slow.model_copy(update={"device": slow.device.model_copy(update={"rate_hz": 500.0})})
    assert refused(checks(replace(small.WELL, timing=Timing(1000, 500.0, 1e-4, 2e-3, 0)), enough)) == ""


def test_less_room_is_enough_without_recordings() -> None:
    free_bytes = 60_500_000
    assert verdicts(free_bytes=free_bytes, recordings=True)["Free space"] == "failure"
    assert verdicts(free_bytes=free_bytes, recordings=False)["Free space"] == "ok"


def test_a_dealt_order_wants_a_number_in_the_id() -> None:
    blocks = small.TABLES["blocks"] | {"feeling": small.TABLES["blocks"]["feeling"] | {"order": "williams"}}
    assigned = Protocol.model_validate(small.TABLES | {"blocks": blocks})
    assert verdicts(assigned)["Balance"] == "ok"
    assert verdicts(assigned, participant="Anna")["Balance"] == "warning"
    assert "Balance" not in verdicts()


def measured(results: Path) -> Facts:
    device = ScriptedDevice()
    with device, Servo(device, clock=VirtualClock(), elements=10) as servo:
        return measure(
            servo,
            results,
            device="scripted",
            screen=Screen(60.0, 1.0),
            participant="P001",
            recordings=True,
            lasts_s=0.5,
            sleep=lambda seconds: void(servo.advance(round(seconds * 1000))),
        )


def void(_: object) -> None:
    """Drop what a call returned."""


@needs_servo
def test_servo_and_disk_are_measured_and_nothing_is_left(tmp_path: Path) -> None:
    facts = measured(tmp_path / "not" / "yet")
    assert facts.timing.rate_hz == pytest.approx(1000, rel=1e-3)
    assert facts.fresh_share == 1.0
    assert (facts.dynamics.delay_s, facts.delay_ticks) == (0.0, 0)
    assert 0 <= facts.sample_age_s <= 0.001
    assert facts.probe_s is not None and 0 < facts.probe_s < 60  # noqa: PT018
    assert facts.free_bytes is not None
    assert list(tmp_path.iterdir()) == []
    assert refused(checks(facts, small.protocol())) == ""


@needs_servo
def test_a_disk_that_takes_nothing_is_a_failure_with_its_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_folder: Path) -> int:
        raise StoreError("the disk is full")

    monkeypatch.setattr(preflight_measurements, "probe", full)
    facts = measured(tmp_path)
    assert "the disk is full" in refused(checks(facts, small.protocol()))


DAMPERS = text_of("strong")


def test_levels_beyond_the_limit_of_the_measured_delay_are_refused_with_the_highest_that_is_not() -> None:
    study = parse(DAMPERS.encode(), "dampers.toml")
    (one,) = [check for check in checks(small.WELL, study) if check.name == "Levels"]
    assert (one.verdict, one.value, one.about) == ("ok", "up to 25.6 N·s/m", "with a delay of 1 tick")
    facts = replace(small.WELL, delay_ticks=2, dynamics=Dynamics(delay_s=1.6e-3))
    (two,) = [check for check in checks(facts, study) if check.name == "Levels"]
    assert (two.verdict, two.value, two.about) == ("failure", "up to 25.6 N·s/m", "with a delay of 2 ticks")
    assert refused(checks(facts, study)) == (
        "levels: standard 16 at levels 0.34 and 0.6 gives up to 25.6 N·s/m at the hand; the slope limit (1000 Hz, "
        "kalman, 2 ticks) is 20.6: levels to 0.287, or the standard to 12.8"
    )


def test_a_damper_beyond_the_limit_of_the_measured_delay_is_refused_where_the_delay_of_its_force_varies() -> None:
    text = DAMPERS.replace("damping_nspm = 16", "damping_nspm = 30")
    text = text.replace('vary = "damping_nspm"\nlevels = [0.02, 0.6]', 'vary = "force_delay_ms"\nlevels = [2, 50]')
    study = parse(text.encode(), "delays.toml")
    assert verdicts(study)["Levels"] == "ok"
    for delay_ticks, limit_nspm in ((2, "20.6"), (3, "14.8"), (4, "11.1")):
        facts = replace(small.WELL, delay_ticks=delay_ticks)
        assert refused(checks(facts, study)) == (
            f'levels: "damper" gives 30 N·s/m at the hand; the slope limit (1000 Hz, kalman, {delay_ticks} ticks) is '
            f"{limit_nspm}: damping_nspm = {limit_nspm}"
        )


def test_a_study_without_levels_of_a_damper_says_nothing_of_them() -> None:
    assert "Levels" not in verdicts()
