"""What the pre-flight says of facts, and that it measures them."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from study_app.devices.simulated import ScriptedDevice
from study_app.errors import StoreError
from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics
from study_app.haptics.runtime.clocks.clock import VirtualClock
from study_app.haptics.runtime.clocks.grants import Grant
from study_app.haptics.runtime.servo import Servo
from study_app.haptics.runtime.telemetry import Timing
from study_app.outlets.session_outlets import OutletStatus
from study_app.protocol.load import load, parse, protocol_hash, read_document, source_bytes
from study_app.protocol.model import Protocol
from study_app.protocol.warnings.untranslated import untranslated_on_pages
from study_app.session import preflight_measurements
from study_app.session.preflight import Measurements, PredictedDelivery, Screen, preflight_checks, refusal_reasons
from study_app.session.preflight_measurements import measure_servo_and_disk
from study_app.session.start import NewSession, participant_with_other_contents
from study_app.store import receipt
from study_app.store.folders import StudyFolder
from tests.compiled import needs_servo
from tests.golden import compare, each_once, what_comes
from tests.protocol.edited_studies import text_of
from tests.session import small

DAMPERS = text_of("strong")
DELAYS = DAMPERS.replace("damping_nspm = 16", "damping_nspm = 30").replace(
    'vary = "damping_nspm"\nlevels = [0.02, 0.6]', 'vary = "force_delay_ms"\nlevels = [2, 50]'
)


def studies() -> dict[str, Protocol]:
    """Return the small study and variants of it, and studies of dampers."""
    small_one = small.protocol()
    blocks = small.TABLES["blocks"] | {"feeling": small.TABLES["blocks"]["feeling"] | {"order": "williams"}}
    with_rate = {
        f"{hz:g} Hz": small_one.model_copy(update={"device": small_one.device.model_copy(update={"rate_hz": hz})})
        for hz in (400.0, 499.0, 500.0)
    }
    single = small_one.model_copy(update={"study": small_one.study.model_copy(update={"blinding": "single"})})
    return with_rate | {
        "small": small_one,
        "single-blind": single,
        "dealt": Protocol.model_validate(small.TABLES | {"blocks": blocks}),
        "dampers": parse(DAMPERS.encode(), "dampers.toml"),
        "delays": parse(DELAYS.encode(), "delays.toml"),
    }


def timing(
    rate_hz: float, p99_s: float = 1e-4, gap_s: float = 2e-3, late: int = 0, ticks: int = 2000
) -> dict[str, Any]:
    return {"timing": Timing(ticks=ticks, rate_hz=rate_hz, lateness_p99_s=p99_s, worst_gap_s=gap_s, overruns=late)}


LIVE = OutletStatus(title="LSL markers", listens=True)
FACTS: tuple[tuple[str, dict[str, Any]], ...] = (
    *(("small", {"fresh_share": share}) for share in (0.49, 0.5)),
    ("small", timing(0.0, ticks=0)),
    *(("small", timing(hz)) for hz in (490.0, 501.0, 979.0, 981.0, 1019.0, 1021.0, 1499.0, 1501.0)),
    *(("small", timing(1000.0, p99_s=p99_s)) for p99_s in (2e-3, 2.01e-3)),
    *(("small", timing(1000.0, gap_s=gap_s, late=9)) for gap_s in (20e-3, 20.1e-3)),
    *(("small", {"grant": Grant(*words)}) for words in (("raised", "nice -15"), ("normal", "refused"))),
    ("small", {"grant": Grant("raised", "nice -15", advice=("do this",)).with_memory(locked=False, advice="do that")}),
    ("small", {"grant": Grant("normal", "refused", locked=False)}),
    *(("small", {"sample_age_s": age_s}) for age_s in (0.002, 0.005, 0.01, 0.03)),
    *(("small", {"screen": Screen(hz, 1.0)}) for hz in (30.0, 49.9, 50.0, 144.0)),
    *(("small", {"screen": Screen(60.0, scaling)}) for scaling in (1.25, 1.5, 2.0)),
    ("small", {"probe_s": None, "probe_fault": "the folder is read-only"}),
    *(("small", {"probe_s": probe_s}) for probe_s in (0.1, 0.101)),
    *(("small", {"free_bytes": count}) for count in (None, 19_000_000, 50_000_000, 60_500_000, 10**8, 3 * 10**8)),
    *(("small", {"free_bytes": count, "recordings": False}) for count in (19_000_000, 59_000_000, 60_500_000)),
    *(
        ("small", {"dynamics": Dynamics(delay_s), "delay_ticks": ticks})
        for delay_s, ticks in ((None, 1), (0.00093, 1), (0.0018, 2), (0.00093, 3))
    ),
    *((name, {"withheld": {"thin": 0.001, "thick": share}}) for name in ("small", "single-blind")
      for share in (0.032, 0.05, 0.051)),
    *(("small", {"delivery": PredictedDelivery(missing=missing, asked=asked, out=out, judged=5, limit_percent=25)})
      for missing, asked, out in ((0, 40, 0), (26, 40, 0), (1, 1, 2), (0, 0, 1))),
    *(("small", {"tick_s": tick_s}) for tick_s in (1e-4, 2e-4, 2.01e-4, 1e-3)),
    *(("small", {"outlets": (one,)}) for one in (
        LIVE, replace(LIVE, listens=False), OutletStatus(title="LSL samples", withheld=True),
        OutletStatus(title="LSL samples", listens=True, shows_force=True),
        OutletStatus(title="LSL samples", listens=False, shows_force=True), OutletStatus(title="Serial port"),
        OutletStatus(title="Serial port", lost="it is gone"))),
    *(("small", {"key_hash": key, "participant": who}) for key, who in (("0" * 64, "P001"), (None, "Anna"))),
    *((
        "small", {"device": device, "dynamics": dynamics, "velocity_errors": errors})
        for device in ("force-dimension:7", "mouse")
        for dynamics, errors in ((UNKNOWN, (0.121, 0.0101)), (Dynamics(1e-3, assumed=("mass_kg",)), (0.01, 0.01)),
                                 (Dynamics(1e-3, assumed=("mass_kg",)), (0.012, 0.01)))
    ),
    *(("dealt", {"participant": who}) for who in ("P001", "Anna")),
    *((f"{hz} Hz", timing(float(hz), ticks=800)) for hz in (400, 499, 500)),
    *((name, {"delay_ticks": ticks, "dynamics": Dynamics(delay_s=1e-3 * ticks)}) for name in ("dampers", "delays")
      for ticks in (1, 2, 3, 4)),
)  # fmt: skip


def test_both_sides_of_each_limit(pytestconfig: pytest.Config) -> None:
    known, lines = studies(), list[str]()
    for name, study in known.items():
        lines += [f"== {name}", *(f"{check} {check.share}" for check in preflight_checks(small.WELL, study))]
    for name, changed in FACTS:
        found = preflight_checks(replace(small.WELL, **changed), known[name])
        usual = {str(check) for check in preflight_checks(small.WELL, known[name])}
        lines.append(f"== {name} {changed}")
        lines += [f"{check} {check.share} {check.entry}" for check in found if str(check) not in usual]
        lines.append(f"refused: {refusal_reasons(found)}")
    compare(Path(__file__).parent / "golden" / "preflight.txt", each_once(what_comes(lines)), pytestconfig)


@pytest.mark.parametrize(("study", "needed"), [("rek2024", 209), ("thickness", 124)])
def test_a_session_needs_what_its_sealed_recordings_take(study: str, needed: int) -> None:
    """A trial of 3 s is sealed into the room of 4 s, whatever its page and its questions take."""
    (room,) = [check for check in preflight_checks(small.WELL, load(study)) if check.name == "Free space"]
    assert room.about == f"a session needs about {needed} MB"


@pytest.mark.parametrize(("recorded", "who"), [("ab" * 32, "P001"), (protocol_hash(source_bytes("rek2024")), "")])
def test_another_file_of_the_same_version_is_a_warning(tmp_path: Path, recorded: str, who: str) -> None:
    study = load("rek2024")
    place = StudyFolder(tmp_path).session("P001", 1)
    place.path.mkdir(parents=True)
    ran = {"key_hash": "", "protocol_hash": recorded, "protocol": {"study": {"version": study.study.version}}}
    receipt.write(place.receipt, ran)
    chosen = NewSession(
        source="rek2024",
        participant="P002",
        session=1,
        seed=7,
        operator="AK",
        language="en",
        device="scripted",
        windowed=True,
        screen=None,
        results=tmp_path,
    )
    assert participant_with_other_contents(chosen) == who
    found = preflight_checks(replace(small.WELL, ran_otherwise=who), study)
    assert [check.verdict for check in found if check.name == "Study file"] == ["warning"] * bool(who)


@pytest.mark.parametrize(("language", "told"), [("fr", "4 texts; still in English"), ("en", "")])
def test_pages_in_two_languages_are_a_warning(language: str, told: str) -> None:
    """What participants read of it: an instruction, a title, a text and a question; the study's title they do not."""
    text = source_bytes("delayjnd").decode()
    assert "languages = " not in text
    document = read_document(text.replace("[study]", f'[study]\nlanguages = ["{language}"]').encode(), "")[0]
    facts = replace(small.WELL, untranslated=untranslated_on_pages(document))
    warned = [check.said for check in preflight_checks(facts, load("delayjnd")) if check.name == "Translation"]
    assert [sentence.split("; Pages")[0] for sentence in warned] == ([told] if told else [])


def measured(results: Path) -> Measurements:
    device = ScriptedDevice()
    with device, Servo(device, clock=VirtualClock(), elements=10) as servo:
        return measure_servo_and_disk(
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
    assert refusal_reasons(preflight_checks(facts, small.protocol())) == ""


@needs_servo
def test_a_disk_that_takes_nothing_is_a_failure_with_its_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_folder: Path) -> int:
        raise StoreError("the disk is full")

    monkeypatch.setattr(preflight_measurements, "probe_free_bytes", full)
    facts = measured(tmp_path)
    assert "the disk is full" in refusal_reasons(preflight_checks(facts, small.protocol()))
