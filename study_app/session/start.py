"""Starting a session: check the choices, measure the device, then claim or reopen the session on the disk."""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Any

from study_app.devices.registry import check_options, descriptor_of
from study_app.devices.rig import Rig
from study_app.errors import SessionError, StoreError
from study_app.outlets.session_outlets import Outlets, OutletStatus
from study_app.protocol.load import parse, read_document, source_bytes
from study_app.protocol.model import Protocol
from study_app.protocol.randomization import enrolment_number, stream
from study_app.protocol.source import has_hash, protocol_file
from study_app.protocol.warnings import check_translated, untranslated_on_pages
from study_app.session.preflight import Masking, Measurements, Screen
from study_app.session.resume import find_protocol, source_to_resume
from study_app.store import workstation
from study_app.store.blinded import check_conditions, check_session, open_events, opened_key, read_key
from study_app.store.files import ID_PATTERN, StudyFolder, locate_session, study_folder
from study_app.store.journals import journal
from study_app.store.journals.journal import SessionClock
from study_app.store.journals.journal_events import start_of
from study_app.store.session_progress import TOLERATED_TICKS, late_device_text, progress_of
from study_app.store.sessions import (
    SessionStart,
    SessionStore,
    begin_session,
    check_participant,
    check_resumable,
    refuse_finished,
    refuse_never_begun,
    reopen_store,
    used_ids,
)
from study_app.store.tables import check_study
from study_app.store.versions import run_of
from study_app.store.workstation import MachineSettings
from study_app.video.sources import Videos

if TYPE_CHECKING:
    from study_app.haptics.runtime.servo import Servo

MAX_SEED = 2_147_483_647
_MAX_DRAWN_SEED = 999_999  # greatest seed, short enough to be read aloud
MEASURED_S = 2.0  # duration of the servo's measurement before a session [s]
_PLAYED_MEASURED_S = 0.5  # the same before a session played from the designer [s]


@dataclass(frozen=True, slots=True, kw_only=True)
class NewSession:
    """The operator's choices for a session to begin or resume.

    ``results`` is the study's folder. ``screen`` counts from 1; None is the last screen. ``resumes`` is the folder of
    the session to resume, None for a new one; ``device_options`` are the values of the device's options, by name.
    ``row_of`` is the id of the replaced participant and ``group`` the participant's pre-existing group; each is None if
    there is none, or to keep that of the first session. ``played`` means that the session is played from the designer:
    it continues exactly at the interrupted step and has no operator's window. ``footage`` is the folder of the study's
    footage; by default it is the folder of the study's file.
    """

    source: str
    participant: str
    session: int
    seed: int
    operator: str
    language: str
    device: str
    windowed: bool
    screen: int | None
    results: Path
    pilot: bool = False
    recordings: bool = True
    resumes: Path | None = None
    device_options: Mapping[str, str | Path] = field(default_factory=dict)
    row_of: str | None = None
    group: str | None = None
    played: bool = False
    footage: Path | None = None

    def read_source(self) -> bytes:
        """Return the protocol's source; for a resumed session, with its liquid files as sealed."""
        return source_bytes(self.source) if self.resumes is None else source_to_resume(self.resumes, self.source)

    def read_protocol(self) -> Protocol:
        """Return the protocol of `read_source`."""
        return parse(self.read_source(), self.source)

    def tremor(self) -> Random:
        """Return the random generator of the tremor of a simulated hand."""
        return stream(self.seed, f"run/{self.participant}/tremor")

    @property
    def who(self) -> str:
        """The participant and session, as a text for the operator."""
        group = "" if self.group is None else f"  ·  group {self.group}"
        kind = "  ·  pilot" if self.pilot else ""
        return f"Participant {self.participant}{group}  ·  session {self.session}  ·  seed {self.seed}{kind}"


def resumed_choices(
    session_folder: Path,
    *,
    protocol: str | None = None,
    candidates: Iterable[str] | None = None,
    operator: str = "",
    device: str | None = None,
    windowed: bool = False,
    screen: int | None = None,
    device_options: Mapping[str, str | Path] | None = None,
) -> NewSession:
    """Return the choices for resuming the session in a folder: those recorded, with the current screen.

    Raise StoreError if the session cannot be resumed: it is not a session folder, open in another program, finished,
    damaged, or of another protocol. Raise SessionError if no available protocol belongs to its study.
    """
    study, folder = locate_session(session_folder)
    refuse_never_begun(folder)
    lines = journal.read(folder.journal)
    start, progress = start_of(lines), progress_of(lines)
    refuse_finished(folder, progress)
    read = partial(source_to_resume, session_folder)
    chosen = protocol if protocol is not None else find_protocol(start, candidates, read)
    source = read(chosen)
    check_resumable(session_folder, parse(source, chosen), source)
    return NewSession(
        source=chosen,
        participant=start.participant,
        session=start.session,
        seed=start.seed,
        operator=operator,
        language=progress.language,
        device=device if device is not None else start.device or "",
        windowed=windowed or start.pilot,
        screen=screen,
        results=study.path,
        pilot=start.pilot,
        recordings=start.recordings,
        resumes=session_folder,
        device_options=device_options or {},
        row_of=start.row_of,
        group=start.group,
    )


def check_row(row_of: str | None, study: Protocol) -> None:
    """Raise SessionError if a replaced participant's id has no effect in this study.

    In a study with groups any id is accepted here, since `allocation.check_choice` looks up its entry.
    """
    if row_of is None or study.groups:
        return
    if not study.assigns_rows:
        raise SessionError(
            f"participant {row_of!r} cannot be replaced: no block in {study.study.name} has a Williams or Latin order, "
            "so rows are not used; omit this option"
        )
    if not ID_PATTERN.fullmatch(row_of) or enrolment_number(row_of) is None:
        raise SessionError(
            f"participant {row_of!r} cannot be replaced: rows are assigned by the number in the ID; specify an ID with "
            "a number, such as P007"
        )


def draw_seed() -> int:
    """Return a random seed, at most `_MAX_DRAWN_SEED`."""
    return secrets.randbelow(_MAX_DRAWN_SEED) + 1


def study_results(results: Path, study: str, device: str, *, pilot: bool = False) -> Path:
    """Return a study's folder under ``results``; pilots and simulated hands are kept apart from participants' data."""
    descriptor = descriptor_of(device)
    name = f"{study}-{descriptor.name}" if descriptor.simulated else study
    return study_folder(results, name, pilot=pilot).path


@dataclass(frozen=True, slots=True)
class Ready:
    """Device and servo at rest with their measurements; ``masking`` is the operator's answer, None if not asked.

    ``outlets`` are already open, so that recording programs can connect before the session; ``videos`` are those of the
    study, None if it shows none.
    """

    rig: Rig
    facts: Measurements
    masking: Masking | None = None
    outlets: Outlets | None = None
    videos: Videos | None = None

    def facts_with(self, refresh_hz: float, scaling: float) -> Measurements:
        """Return the measurements with those of the outlets and of the screen: refresh rate and pixel scaling."""
        screen = Screen(refresh_hz=refresh_hz, scaling=scaling)
        return replace(self.facts, screen=screen, outlets=self.outlet_statuses)

    @property
    def outlet_statuses(self) -> tuple[OutletStatus, ...]:
        """The current status of the outlets."""
        return () if self.outlets is None else self.outlets.statuses()


def check_choices(chosen: NewSession, study: Protocol) -> None:
    """Raise an error for a session that cannot begin, before any window opens; change nothing."""
    check_options(chosen.device, chosen.device_options)
    if chosen.language not in study.study.languages:
        known = ", ".join(study.study.languages)
        raise SessionError(
            f"language {chosen.language!r}: {study.study.name} is available only in {known}; choose one of these "
            "languages"
        )
    if chosen.resumes is not None:
        return
    folder = StudyFolder(chosen.results)
    if not chosen.pilot:
        check_translated(read_document(chosen.read_source(), chosen.source)[0])
    check_participant(chosen.participant, pilot=chosen.pilot)
    check_row(chosen.row_of, study)
    check_study(folder, study.study.name)
    used_ids(folder).check_unused(chosen.participant, chosen.session)
    check_session(folder, study, chosen.participant, chosen.session, group=chosen.group, row_of=chosen.row_of)
    check_conditions(folder.path, study)


def unopened_videos(chosen: NewSession, study: Protocol, camera: str, rig: Rig) -> Videos | None:
    """Return the unopened videos of a study, None if it shows none. ``camera`` is that of this computer."""
    if not any(condition.shows_video for condition in study.conditions.values()):
        return None
    folder = protocol_file(chosen.source).parent if chosen.footage is None else chosen.footage
    return Videos(study, folder, camera, rig.servo.now_ns)


def measure_rig(
    rig: Rig, chosen: NewSession, videos: Videos | None = None, *, sleep: Callable[[float], object] = time.sleep
) -> Measurements:
    """Return the measurements for the pre-flight, without those of the screen.

    ``videos`` that are not open yet, or failed, are opened. Tests pass a ``sleep`` that does not wait.
    """
    from study_app.session.preflight_measurements import measure_servo_and_disk  # noqa: PLC0415 - the compiler: only once it is needed

    video_status = None if videos is None else videos.open()
    facts = measure_servo_and_disk(
        rig.servo,
        chosen.results,
        device=rig.device.name,
        screen=Screen(refresh_hz=0.0, scaling=1.0),
        participant=chosen.row_of or chosen.participant,
        recordings=chosen.recordings,
        lasts_s=_PLAYED_MEASURED_S if chosen.played else MEASURED_S,
        sleep=sleep,
    )
    document, _ = read_document(chosen.read_source(), chosen.source)
    untranslated = untranslated_on_pages(document)
    return replace(
        facts,
        video=video_status,
        ran_otherwise=participant_with_other_contents(chosen),
        untranslated=untranslated,
        late_device=late_device_sentence(rig, StudyFolder(chosen.results), chosen.read_protocol().study.blinding),
    )


def participant_with_other_contents(chosen: NewSession) -> str:
    """Return a participant whose session ran the same version with other contents of the file; "" if there is none."""
    if chosen.resumes is not None:
        return ""
    source = chosen.read_source()
    version = parse(source, chosen.source).study.version
    for session in StudyFolder(chosen.results).sessions():
        run = run_of(session.receipt)
        if run is not None and run.version == version and not has_hash(source, run.hash):
            return session.participant
    return ""


def late_device_sentence(rig: Rig, folder: StudyFolder, blinding: str) -> str:
    """Return a sentence if the device is known to have answered later than the servo assumes, else "".

    The sources are the bench test on this computer, or else the trials of the study's last session. In a double-blind
    study these would reveal which participants felt a thick liquid, so they are read only after unblinding.
    """
    bench = with_bench_measurements(rig.described).get("bench")
    if bench is not None:
        ticks, assumed = round(max(bench["delay_ms"]) * rig.servo.rate_hz / 1000), rig.servo.delay_ticks
        if ticks > assumed + TOLERATED_TICKS:
            text = late_device_text({"device_delay_ticks": ticks, "loop_delay_ticks": assumed})
            return f"In the bench test of {bench['measured']}, {text}"
    with suppress(StoreError, OSError, ValueError):
        last = max(folder.sessions(), key=lambda session: session.journal.stat().st_mtime)
        key = opened_key(folder) if blinding == "double" else read_key(folder.path)
        lines = open_events(journal.read(last.journal), key)
        late = progress_of(lines).late
        if late and start_of(lines).device == rig.device.name:
            trial = max(late)
            return f"In trial {trial} of the last session (participant {last.participant}), {late[trial]}"
    return ""


def open_outlets(machine: MachineSettings, servo: Servo, blinding: str) -> Outlets | None:
    """Open the outlets configured on this computer; return None if there are none."""
    if not machine.marker_addresses and machine.lsl_samples == "off":
        return None
    return Outlets(machine.marker_addresses, machine.lsl_samples, servo, blinding)


def open_store(
    chosen: NewSession,
    protocol: Protocol,
    source: bytes,
    rig: Rig,
    screens: dict[str, Any],
    masking: Masking | None = None,
    outlets: Outlets | None = None,
    videos: Videos | None = None,
) -> SessionStore:
    """Claim a new session on the disk or open the resumed one; ``outlets`` get the markers of its events."""
    environment: dict[str, Any] = {
        "operator": chosen.operator,
        "device": with_bench_measurements(rig.described),
        "screens": screens,
        "motors_masked": None if masking is None else masking.entry,
        "outlets": None if outlets is None else outlets.described,
        "video": None if videos is None else videos.describe(),
    }
    if chosen.resumes is not None:
        store = reopen_store(chosen.resumes, protocol, source, now_ns=rig.servo.now_ns, **environment)
    else:
        start = SessionStart(
            chosen.participant,
            session=chosen.session,
            seed=chosen.seed,
            language=chosen.language,
            simulated=descriptor_of(chosen.device).simulated,
            pilot=chosen.pilot,
            recordings=chosen.recordings,
            row_of=chosen.row_of,
            group=chosen.group,
            **environment,
        )
        store = begin_session(chosen.results, protocol, source, start, clock=SessionClock(rig.servo.now_ns))
    if outlets is not None:
        store.attach(outlets)
    return store


def with_bench_measurements(described: Mapping[str, Any]) -> dict[str, Any]:
    """Return the receipt's entry of a device, with the measurements of ``devices bench`` on this computer, if any."""
    bench = workstation.load_or_default()[0].bench_of(described)
    return {**described} if bench is None else {**described, "bench": bench.entry}
