"""What the pre-flight says of facts, and that it measures them."""

import itertools
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from study_app.devices.simulated import ScriptedDevice
from study_app.errors import StoreError
from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.grants import Grant
from study_app.haptics.runtime.servo import Servo
from study_app.haptics.runtime.telemetry import Telemetry, Timing
from study_app.outlets.session_outlets import OutletStatus
from study_app.protocol.load import load, parse, protocol_hash, read_document, source_bytes
from study_app.protocol.model import Protocol
from study_app.protocol.warnings.untranslated import untranslated_on_pages
from study_app.session import preflight_measurements
from study_app.session.preflight import Measurements, PredictedDelivery, Screen, preflight_checks, refusal_reasons
from study_app.session.preflight_measurements import measure_servo_and_disk
from study_app.session.start import late_device_sentence, participant_with_other_contents
from study_app.store import receipt
from study_app.store.files.folders import StudyFolder
from study_app.store.journals.journal_events import TrialStarted
from study_app.store.unblinding import unblind
from study_app.store.workstation import DEFAULTS, DeviceBench, save_settings
from study_app.video.sources import VideosFound
from tests.compiled import needs_servo
from tests.journal_lines import event_of
from tests.protocol.edited_studies import text_of
from tests.session import small
from tests.studies import begun

DAMPERS = text_of("strong")
DELAYS = DAMPERS.replace("damping_nspm = 16", "damping_nspm = 30").replace(
    'vary = "damping_nspm"\nlevels = [0.02, 0.6]', 'vary = "force_delay_ms"\nlevels = [2, 50]'
)


def studies() -> dict[str, Protocol]:
    """Return the small study and variants of it, and studies of dampers."""
    small_one, delays = small.protocol(), parse(DELAYS.encode(), "delays.toml")
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
        "delays": delays,
        "fast delays": delays.model_copy(update={"device": delays.device.model_copy(update={"rate_hz": 1001.0})}),
    }


def timing(
    rate_hz: float, p99_s: float = 1e-4, gap_s: float = 2e-3, late: int = 0, ticks: int = 2000
) -> dict[str, Any]:
    return {"timing": Timing(ticks=ticks, rate_hz=rate_hz, lateness_p99_s=p99_s, worst_gap_s=gap_s, overruns=late)}


LIVE = OutletStatus(title="LSL markers", listens=True)
FACTS: tuple[tuple[str, dict[str, Any], str], ...] = (
    ("small", {"fresh_share": 0.49}, "failure Device: not responding; mouse sends a new sample in 49 % of the ticks"),
    ("small", {"fresh_share": 0.5}, "ok Device: responding; mouse sends a new sample in 50 % of the ticks"),
    ("small", timing(0.0, ticks=0), "failure Servo rate: 0.0 Hz"),
    *(("small", timing(hz), f"{verdict} Servo rate: {hz} Hz; requested: 1000 Hz") for hz, verdict in (
        (490.0, "failure"), (501.0, "warning"), (979.0, "warning"), (981.0, "ok"),
        (1019.0, "ok"), (1021.0, "warning"), (1499.0, "warning"), (1501.0, "failure"))),
    ("small", timing(1000.0, p99_s=2e-3), "ok Servo lateness: 2.00 ms; 99th percentile (limit: 2 ms)"),
    ("small", timing(1000.0, p99_s=2.01e-3), "warning Servo lateness: 2.01 ms; 99th percentile (limit: 2 ms)"),
    *(("small", timing(1000.0, gap_s=gap_s, late=9), f"{verdict} Servo lateness: 0.10 ms; 99th percentile "
       f"(limit: 2 ms); largest gap {1e3 * gap_s:.1f} ms (limit: 20 ms); 9 overruns")
      for gap_s, verdict in ((20e-3, "ok"), (20.1e-3, "warning"))),
    *(("small", {"grant": Grant(*words)}, f"warning Priority: {'; '.join(words)}")
      for words in (("raised", "nice -15"), ("normal", "refused"))),
    ("small", {"grant": Grant("raised", "nice -15", advice=("do this",)).with_memory(locked=False, advice="do that")},
     "warning Priority: raised; nice -15, memory not locked"),
    ("small", {"grant": Grant("normal", "refused", locked=False)}, "warning Priority: normal; refused, memory not"),
    *(("small", {"sample_age_s": age_s}, f"{verdict} Visual delay: up to {1000 / 60 + 1000 * age_s:.1f} ms")
      for age_s, verdict in ((0.002, "ok"), (0.005, "ok"), (0.01, "warning"), (0.03, "warning"))),
    *(("small", {"screen": Screen(hz, 1.0)}, f"{verdict} Screen: {hz} Hz, 100 %")
      for hz, verdict in ((30.0, "warning"), (49.9, "warning"), (50.0, "ok"), (144.0, "ok"))),
    *(("small", {"screen": Screen(60.0, scaling)}, f"warning Screen: 60.0 Hz, {100 * scaling:.0f} %")
      for scaling in (1.25, 1.5, 2.0)),
    ("small", {"probe_s": None, "probe_fault": "the folder is read-only"}, "failure Results folder: not usable"),
    ("small", {"probe_s": 0.1}, "ok Results folder: 100.0 ms; time to write a file"),
    ("small", {"probe_s": 0.101}, "warning Results folder: 101.0 ms; time to write a file"),
    ("small", {"free_bytes": None}, "warning Free space: not known; a session needs about 64 MB"),
    *(("small", {"free_bytes": count}, f"{verdict} Free space: {count / 1e6:.0f} MB free; a session needs about 64 MB")
      for count, verdict in ((19_000_000, "failure"), (60_500_000, "failure"), (10**8, "ok"), (3 * 10**8, "ok"))),
    ("small", {"free_bytes": 1_234_567_890_000}, "ok Free space: 1 234 568 MB free"),
    *(("small", {"free_bytes": count, "recordings": False}, f"{verdict} Free space: {count / 1e6:.0f} MB free; a "
       "session needs about 60 MB")
      for count, verdict in ((19_000_000, "failure"), (59_000_000, "failure"), (60_500_000, "ok"))),
    *(("small", {"dynamics": Dynamics(delay_s), "delay_ticks": ticks}, expected) for delay_s, ticks, expected in (
        (None, 1, "ok Loop delay: 1 tick; assumed"),
        (0.00093, 1, "ok Loop delay: 1 tick; a force takes effect after 0.93 ms"),
        (0.0018, 2, "warning Loop delay: 2 ticks; a force takes effect after 1.80 ms"),
        (0.00093, 3, "warning Loop delay: 3 ticks; a force takes effect after 0.93 ms"))),
    ("small", {"late_device": "In trial 2 of the last session (participant P003), the device answered after 4 ticks, "
     "but the servo assumes 1 tick"}, "warning Loop delay: 1 tick; assumed, because the device does not measure"),
    *((name, {"withheld": {"thin": 0.001, "thick": share}}, f"{verdict} Force withheld: at most {percent} %; in the "
       f"fastest stroke of a task (limit: 5 %){of_each.format(percent)}")
      for name, of_each in (("small", ""), ("single-blind", ": thick {} %, thin 0.1 %"))
      for share, percent, verdict in ((0.032, "3.2", "ok"), (0.05, "5.0", "ok"), (0.051, "5.1", "warning"))),
    *(("small", {"delivery": PredictedDelivery(missing=missing, asked=asked, out=out, judged=5, limit_percent=25)},
       f"{expected}; predicted for a delay of 1 tick") for missing, asked, out, expected in (
        (0, 40, 0, "ok Trials delivered: all"),
        (26, 40, 0, "warning Trials delivered: 26 of 45 trials beyond the limit"),
        (1, 1, 2, "warning Trials delivered: 3 of 6 trials beyond the limit"),
        (0, 0, 1, "warning Trials delivered: 1 of 5 trials beyond the limit"))),
    *(("small", {"tick_s": tick_s}, f"{verdict} Scene cost: {1e9 * tick_s:.0f} ns per tick")
      for tick_s, verdict in ((1e-4, "ok"), (2e-4, "ok"), (2.01e-4, "warning"))),
    *(("small", {"outlets": (outlet,)}, expected) for outlet, expected in (
        (LIVE, "ok LSL markers: listener"), (replace(LIVE, listens=False), "warning LSL markers: no listener"),
        (OutletStatus(title="LSL samples", withheld=True), "ok LSL samples: off; because the study is double-blind"),
        (OutletStatus(title="LSL samples", listens=True, shows_force=True), "warning LSL samples: listener"),
        (OutletStatus(title="LSL samples", listens=False, shows_force=True), "warning LSL samples: no listener"),
        (OutletStatus(title="Serial port"), "ok Serial port: ready; open"),
        (OutletStatus(title="Serial port", lost="it is gone"), "warning Serial port: not available; it is gone"))),
    ("small", {"key_hash": "01234567" + 56 * "8"}, "ok Blinding: double-blind; the key is sealed; its hash begins with "
     "01234567"),
    ("small", {"key_hash": None}, "ok Blinding: double-blind; the key is generated"),
    *(("small", {"device": device, "dynamics": dynamics, "velocity_errors": errors},
       f"{expected}{unknown}" if device != "mouse" else "")
      for device in ("force-dimension:7", "mouse")
      for dynamics, errors, expected, unknown in (
        (UNKNOWN, (0.121, 0.0101), "warning Velocity: 12 % instead of 1 %; error at 2 Hz, because the device's ",
         "delay, encoder count and mass are unknown"),
        (Dynamics(1e-3, assumed=("mass_kg",)), (0.01, 0.01), "ok Velocity: 1 %; error at 2 Hz, although the device's ",
         "mass is unknown"),
        (Dynamics(1e-3, assumed=("mass_kg",)), (0.012, 0.01), "warning Velocity: 1.2 % instead of 1 %; error at 2 Hz, ",
         "because the device's mass is unknown"))),
    ("dealt", {"participant": "P012"}, "ok Balance: participant number 12"),
    ("dealt", {"participant": "Anna"}, "warning Balance: drawn; row of the Latin square"),
    *((f"{hz} Hz", timing(float(hz), ticks=800), f"{verdict} Servo rate: {hz}.0 Hz; requested: {hz} Hz")
      for hz, verdict in ((400, "failure"), (499, "failure"), (500, "ok"))),
    *((name, {"delay_ticks": ticks, "dynamics": Dynamics(delay_s=1e-3 * ticks)}, f"{'ok' if ticks == 1 else 'failure'} "
       f"Levels: up to {highest} N·s/m; with a delay of {ticks} tick")
      for name, highest in (("dampers", "25.6"), ("delays", "30")) for ticks in (1, 2, 3, 4)),
    *(("delays", {"dynamics": Dynamics(mass_kg=mass_kg)},
       f"{expected}; the study delays forces at 1000 Hz, with a handle of {grams} g")
      for mass_kg, grams, expected in (
        (0.0994, 99, "failure Delayed force: not permitted"), (0.1, 100, "ok Delayed force: permitted"))),
    ("fast delays", timing(1001.0), "failure Delayed force: not permitted; the study delays forces at 1001 Hz, with"),
)  # fmt: skip


def test_both_sides_of_each_limit() -> None:
    known = studies()
    for name, changed, expected in FACTS:
        found_checks = preflight_checks(replace(small.WELL, **changed), known[name])
        checks = ["{verdict} {name}: {value}; {about}".format(**check.entry) for check in found_checks]
        assert (
            [line.startswith(expected) for line in checks].count(True) == 1
            if expected
            else "Velocity" not in str(checks)
        ), f"{changed} is not told as {expected!r}: {checks}"
        assert bool(refusal_reasons(found_checks)) == expected.startswith("failure"), changed
        shares = {check.name: check for check in found_checks if check.share is not None and check.name != "Scene cost"}
        assert all((check.share > 1) == (check.verdict == "warning") for check in shares.values()), changed


LATE = "In trial 2 of the last session (participant P003), the device answered after 4 ticks"
ALL_WRONG: dict[str, Any] = {
    "device": "force-dimension:7",
    "fresh_share": 0.25,
    "sample_age_s": 0.02,
    "screen": Screen(40.0, 1.25),
    "probe_s": 0.25,
    "free_bytes": 19_000_000,
    "participant": "Anna",
    "tick_s": 3e-4,
    "key_hash": "89abcdef" + 56 * "0",
    "grant": Grant("raised", "nice -15", locked=False, advice=("do this", "or that")),
    "dynamics": Dynamics(delay_s=1.8e-3, assumed=("count_m", "mass_kg")),
    "delay_ticks": 3,
    "withheld": {"thin": 0.2, "thick": 0.1},
    "delivery": PredictedDelivery(missing=26, asked=40, out=2, judged=5, limit_percent=25),
    "velocity_errors": (0.3, 0.1),
    "outlets": (
        OutletStatus(title="LSL markers", listens=False),
        OutletStatus(title="LSL samples", listens=True, shows_force=True),
        OutletStatus(title="Serial port", lost="it is gone"),
    ),
    "video": VideosFound("a camera of 30 Hz", fault="no camera is connected"),
    "ran_otherwise": "P004",
}
"""Measurements of a computer, a device and a study folder on which nothing is well."""
HELD_BACK = "the safety layer held back too much force (limit 25 %)"
WARNINGS: tuple[tuple[str, str, str, str, str, float | None], ...] = (
    ("failure", "Device", "not responding", "force-dimension:7 sends a new sample in 25 % of the ticks",
     "force-dimension:7 sends a new sample in only 25 % of the ticks: check its cable and power", None),
    ("warning", "Loop delay", "3 ticks", "a force takes effect after 1.80 ms, as measured by the device when it was "
     "opened; it has measured a longer delay since",
     "The force limits are stricter because of this delay; connect the device without a hub.", None),
    ("warning", "Servo rate", "700.0 Hz", "requested: 1000 Hz", "Close other programs.", None),
    ("warning", "Servo lateness", "5.00 ms", "99th percentile (limit: 2 ms); largest gap 60.0 ms (limit: 20 ms); "
     "9 overruns", "Trials would be invalid: close other programs.", 60 / 20),
    ("warning", "Priority", "raised", "nice -15, memory not locked", "Do this; Or that.", None),
    ("warning", "Visual delay", "up to 45.0 ms", "in addition to the requested delay (limit: 25 ms)",
     "Trials would be invalid: use a screen with a higher refresh rate.", 45 / 25),
    ("warning", "Screen", "40.0 Hz, 125 %", "refresh rate and scaling of the participant's screen",
     "Set the participant's screen to 100 % scaling and at least 50 Hz.", None),
    ("warning", "Results folder", "250.0 ms", "time to write a file", "Use a local disk.", None),
    ("failure", "Free space", "19 MB free", "a session needs about 64 MB",
     "19 MB free, a session needs about 64 MB: free up some disk space", None),
    ("ok", "Blinding", "double-blind", "the key is sealed; its hash begins with 89abcdef", "", None),
    ("failure", "Video", "not usable", "a camera of 30 Hz", "no camera is connected", None),
    ("warning", "LSL markers", "no listener", "the stream is not being received",
     "Start the program that records it, such as LabRecorder, and select this stream.", None),
    ("warning", "LSL samples", "listener", "the study is double-blind",
     "Do not show the stream to anyone, because the force reveals the liquid.", None),
    ("warning", "Serial port", "not available", "it is gone", "The session can run without it.", None),
    ("warning", "Scene cost", "300000 ns per tick", "the most demanding scene uses 30 % of each tick",
     "Remove an effect from the scene.", 0.3),
    ("warning", "Velocity", "30 % instead of 10 %",
     "error at 2 Hz, because the device's encoder count and mass are unknown",
     "Measure the device: liquid-study devices bench force-dimension:7.", None),
    ("warning", "Force withheld", "at most 20.0 %", "in the fastest stroke of a task (limit: 5 %)",
     "Trials with such strokes would be invalid.", 20 / 5),
    ("warning", "Trials delivered", "28 of 45 trials beyond the limit", "predicted for a delay of 3 ticks",
     f"26 of 40 trials would not be delivered: {HELD_BACK}; 2 of 5 trials would exceed the limits: {HELD_BACK}.", None),
    ("warning", "Study file", "changed", "version 1 has already been run from a different file, with P004",
     "Set a different study.version in the changed file; the report mentions the change either way.", None),
    ("warning", "Balance", "drawn", "row of the Latin square",
     "Anna does not contain a number, so the row is drawn at random; use IDs such as P007.", None),
)  # fmt: skip


def test_each_warning_and_failure_has_its_explanation_and_its_remedy() -> None:
    facts = replace(small.WELL, **ALL_WRONG, **timing(700.0, p99_s=5e-3, gap_s=60e-3, late=9))
    checks = preflight_checks(facts, studies()["dealt"])
    assert [
        (check.verdict, check.name, check.value, check.about, check.advice, check.share and pytest.approx(check.share))
        for check in checks
    ] == [*WARNINGS]
    assert refusal_reasons(checks) == (
        "device: force-dimension:7 sends a new sample in only 25 % of the ticks: check its cable and power; "
        "free space: 19 MB free, a session needs about 64 MB: free up some disk space; video: no camera is connected"
    )
    assert str(checks[7]) == "warning  Results folder  250.0 ms; time to write a file; Use a local disk."
    unknown = replace(facts, probe_s=None, probe_fault="it is read-only", free_bytes=None, late_device=LATE)
    checks_by_name = {check.name: (check.verdict, check.about, check.advice) for check in preflight_checks(
        replace(unknown, video=VideosFound("a camera of 30 Hz")), studies()["dealt"])}  # fmt: skip
    assert checks_by_name["Results folder"] == ("failure", "no file could be written", "it is read-only")
    assert checks_by_name["Free space"][::2] == ("warning", "The operating system does not report the free space.")
    assert checks_by_name["Loop delay"][2] == (
        f"{LATE}; connect the device without a hub, then measure it: liquid-study devices bench force-dimension:7."
    )
    assert checks_by_name["Video"] == ("ok", "a camera of 30 Hz", "")


@pytest.mark.parametrize(("study", "needed"), [("rek2024", 209), ("thickness", 124)])
def test_the_free_space_check_counts_sealed_recordings(study: str, needed: int) -> None:
    """A trial of 3 s is sealed into the room of 4 s, whatever its page and its questions take."""
    (room,) = [check for check in preflight_checks(small.WELL, load(study)) if check.name == "Free space"]
    assert room.about == f"a session needs about {needed} MB"


@pytest.mark.parametrize(
    ("recorded", "version", "who"),
    [
        ("ab" * 32, load("rek2024").study.version, "P001"),
        ("ab" * 32, "0.0.1", ""),
        (protocol_hash(source_bytes("rek2024")), load("rek2024").study.version, ""),
    ],
)
def test_another_file_of_the_same_version_is_a_warning(tmp_path: Path, recorded: str, version: str, who: str) -> None:
    study = load("rek2024")
    place = StudyFolder(tmp_path).session("P001", 1)
    place.path.mkdir(parents=True)
    ran = {"key_hash": "", "protocol_hash": recorded, "protocol": {"study": {"version": version}}}
    receipt.write(place.receipt, ran)
    choices = replace(small.CHOSEN, source="rek2024", participant="P002", results=tmp_path)
    assert participant_with_other_contents(choices) == who
    checks = preflight_checks(replace(small.WELL, ran_otherwise=who), study)
    assert [check.verdict for check in checks if check.name == "Study file"] == ["warning"] * bool(who)


RIG: Any = SimpleNamespace(
    servo=SimpleNamespace(rate_hz=500.0, delay_ticks=1),
    device=SimpleNamespace(name="mouse"),
    described={"name": "mouse", "serial": "7"},
)
"""A device that is assumed to be one tick late at 500 Hz."""


@pytest.mark.parametrize(("delay_ms", "ticks"), [((1.0, 5.2, 3.0), 3), ((1.0, 4.8, 3.0), None), ((7.0, 7.0, 7.0), 4)])
def test_a_bench_test_shows_that_a_device_is_late(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, delay_ms: tuple[float, ...], ticks: int | None
) -> None:
    """At 500 Hz, two ticks more than assumed, 3 ticks, are 6 ms; delays from 5 ms on are rounded to them."""
    monkeypatch.setenv("LIQUID_STUDY_CONFIG", str(tmp_path))
    three = (0.2, 0.2, 0.2)
    facts = DeviceBench(
        name="mouse", serial="7", measured="2026-11-21", mass_kg=three, damping_nspm=three, friction_n=three,
        delay_ms=delay_ms, stable_nspm=three,
    )  # fmt: skip
    save_settings(DEFAULTS.with_bench(facts))
    message = f"In the bench test of 2026-11-21, the device answered after {ticks} ticks, but the servo assumes 1 tick"
    assert late_device_sentence(RIG, StudyFolder(tmp_path / "study"), "double") == (message if ticks else "")


def hold_session(folder: StudyFolder, who: str, delays: tuple[int | None, ...]) -> None:
    """Hold a session in whose trials the device answered after so many ticks."""
    with begun(folder.path, who, small.protocol(), b"small") as store:
        for number, ticks in enumerate(delays, start=1):
            which: dict[str, Any] = {"block": "feeling", "phase": "main", "part": 1, "of": len(delays), "code": "L1"}
            store.append(TrialStarted(trial=number, attempt=1, index=number, **which))
            facts = {"loop_delay_ticks": 1, "device_delay_ticks": ticks}
            store.append(event_of("trial_ended", trial=number, attempt=1, outcome="complete", **facts))
        store.finish("aborted")


def test_the_last_session_shows_that_a_device_is_late(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LIQUID_STUDY_CONFIG", str(tmp_path))
    folder = StudyFolder(tmp_path / "small")
    assert late_device_sentence(RIG, folder, "single") == ""
    hold_session(folder, "P002", (None, 3, None, 5, None))
    message = "the device answered after 5 ticks, but the servo assumes 1 tick"
    assert (
        late_device_sentence(RIG, folder, "single") == f"In trial 4 of the last session (participant P002), {message}"
    )
    assert late_device_sentence(RIG, folder, "double") == ""
    unblind(folder.path, "AK", "end of the study")
    assert (
        late_device_sentence(RIG, folder, "double") == f"In trial 4 of the last session (participant P002), {message}"
    )
    hold_session(folder, "P001", (None, None))
    assert late_device_sentence(RIG, folder, "single") == ""


@pytest.mark.parametrize(("language", "told"), [("fr", "4 texts; still in English"), ("en", "")])
def test_pages_in_two_languages_are_a_warning(language: str, told: str) -> None:
    """Participants read an instruction, a title, a text and a question, but not the study's title."""
    text = source_bytes("delayjnd").decode()
    assert "languages = " not in text
    document = read_document(text.replace("[study]", f'[study]\nlanguages = ["{language}"]').encode(), "")[0]
    facts = replace(small.WELL, untranslated=untranslated_on_pages(document))
    warned = [check.said for check in preflight_checks(facts, load("delayjnd")) if check.name == "Translation"]
    assert [sentence.split("; Pages")[0] for sentence in warned] == ([told] if told else [])


def measure_facts(results: Path) -> Measurements:
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
    """Return None instead of the result of a call."""


@needs_servo
def test_the_measurement_of_servo_and_disk_leaves_no_file(tmp_path: Path) -> None:
    facts = measure_facts(tmp_path / "not" / "yet")
    assert facts.timing.rate_hz == pytest.approx(1000, rel=1e-3)
    assert facts.fresh_share == 1.0
    assert (facts.dynamics.delay_s, facts.delay_ticks) == (0.0, 0)
    assert 0 <= facts.sample_age_s <= 0.001
    assert facts.probe_s is not None and 0 < facts.probe_s < 60  # noqa: PT018
    assert facts.free_bytes is not None
    assert list(tmp_path.iterdir()) == []
    assert refusal_reasons(preflight_checks(facts, small.protocol())) == ""


@needs_servo
def test_the_sample_age_is_that_of_all_but_a_twentieth(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    newest, looks = Telemetry.latest, itertools.count()

    def late(self: Telemetry) -> Any:
        sample = newest(self).copy()
        sample["time_ns"] -= next(looks) % 20 * 1_000_000
        return sample

    monkeypatch.setattr(Telemetry, "latest", late)
    assert measure_facts(tmp_path).sample_age_s == pytest.approx(0.018, abs=0.0015)


@needs_servo
def test_an_unwritable_disk_fails_the_preflight_with_its_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_folder: Path) -> int:
        raise StoreError("the disk is full")

    monkeypatch.setattr(preflight_measurements, "probe_free_bytes", full)
    facts = measure_facts(tmp_path)
    assert "the disk is full" in refusal_reasons(preflight_checks(facts, small.protocol()))
