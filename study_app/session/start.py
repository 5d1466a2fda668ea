"""How a session begins: refused early, measured, and then claimed on the disk or opened again."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from study_app.devices.registry import check_options, descriptor_of
from study_app.devices.rig import Rig
from study_app.errors import SessionError
from study_app.outlets.session_outlets import Outlets, OutletStatus
from study_app.protocol.model import Protocol
from study_app.protocol.source.files import find
from study_app.session.masking import Masking
from study_app.session.preflight import Facts, Screen
from study_app.session.request import NewSession, check_row
from study_app.store import workstation
from study_app.store.blinded.allocation import check_session
from study_app.store.blinded.blinding import check_conditions
from study_app.store.folders import StudyFolder
from study_app.store.journals.journal import SessionClock
from study_app.store.sessions.begin import SessionStart, begin, check_participant, check_unused
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.recovery import reopen
from study_app.store.tables.study_files import check_study
from study_app.store.workstation import MachineSettings
from study_app.video.sources import Videos

if TYPE_CHECKING:
    from study_app.haptics.runtime.servo import Servo

MEASURED_S = 2.0  # so long the servo is looked at before a session
PLAYED_MEASURED_S = 0.5  # and before one that is played from the designer


@dataclass(frozen=True, slots=True)
class Ready:
    """Device and servo at rest, and what was measured of them; ``masking`` of its motors, where that was asked.

    ``outlets`` are open already, so that programs that record them can be connected before the session; ``videos`` are
    those of the study, None where it shows none.
    """

    rig: Rig
    facts: Facts
    masking: Masking | None = None
    outlets: Outlets | None = None
    videos: Videos | None = None

    def facts_with(self, refresh_hz: float, scaling: float) -> Facts:
        """Return the facts with those of the outlets and of the screen: its refresh rate and scaling of its pixels."""
        screen = Screen(refresh_hz=refresh_hz, scaling=scaling)
        return replace(self.facts, screen=screen, outlets=self.outlet_statuses)

    @property
    def outlet_statuses(self) -> tuple[OutletStatus, ...]:
        """How the outlets are at present."""
        return () if self.outlets is None else self.outlets.statuses()


def check(chosen: NewSession, study: Protocol) -> None:
    """Refuse what cannot begin before any window opens; nothing is touched."""
    check_options(chosen.device, chosen.device_options)
    if chosen.language not in study.study.languages:
        known = ", ".join(study.study.languages)
        raise SessionError(
            f"language {chosen.language!r}: {study.study.name} is written in {known}; choose one of these"
        )
    if chosen.resumes is not None:
        return
    folder = StudyFolder(chosen.results)
    check_participant(chosen.participant, pilot=chosen.pilot)
    check_row(chosen.row_of, study)
    check_study(folder, study.study.name)
    check_unused(folder, chosen.participant, chosen.session)
    check_session(folder, study, chosen.participant, chosen.session)
    check_conditions(folder.path, study)


def videos_of(chosen: NewSession, study: Protocol, camera: str, rig: Rig) -> Videos | None:
    """Return the videos of a study, not open yet; None where it shows none. ``camera`` is that of this machine."""
    if not any(condition.shows_video for condition in study.conditions.values()):
        return None
    folder = find(chosen.source).parent if chosen.footage is None else chosen.footage
    return Videos(study, folder, camera, rig.servo.now_ns)


def measured(
    rig: Rig, chosen: NewSession, videos: Videos | None = None, *, sleep: Callable[[float], object] = time.sleep
) -> Facts:
    """Return what the pre-flight judges, but for the screen; a ``sleep`` that does not wait cuts it short.

    ``videos`` that are not open yet, or failed, are opened.
    """
    from study_app.session.preflight_measurements import measure  # noqa: PLC0415 - the compiler: only once it is needed

    looked = None if videos is None else videos.open()
    facts = measure(
        rig.servo,
        chosen.results,
        device=rig.device.name,
        screen=Screen(refresh_hz=0.0, scaling=1.0),
        participant=chosen.row_of or chosen.participant,
        recordings=chosen.recordings,
        lasts_s=PLAYED_MEASURED_S if chosen.played else MEASURED_S,
        sleep=sleep,
    )
    return replace(facts, video=looked)


def open_outlets(machine: MachineSettings, servo: Servo, blinding: str) -> Outlets | None:
    """Open what this machine sends to other programs; None where it sends nothing."""
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
    """Claim a new session on the disk, or open the one that goes on; ``outlets`` get the markers of its events."""
    sent = None if outlets is None else outlets.described
    video = None if videos is None else videos.describe()
    if chosen.resumes is not None:
        store = reopen(
            chosen.resumes,
            protocol,
            source,
            operator=chosen.operator,
            device=with_bench(rig.described),
            screens=screens,
            motors_masked=None if masking is None else masking.entry,
            outlets=sent,
            video=video,
            now_ns=rig.servo.now_ns,
        )
    else:
        start = SessionStart(
            chosen.participant,
            session=chosen.session,
            seed=chosen.seed,
            operator=chosen.operator,
            language=chosen.language,
            device=with_bench(rig.described),
            screens=screens,
            simulated=descriptor_of(chosen.device).simulated,
            pilot=chosen.pilot,
            recordings=chosen.recordings,
            motors_masked=None if masking is None else masking.entry,
            outlets=sent,
            video=video,
            row_of=chosen.row_of,
        )
        store = begin(chosen.results, protocol, source, start, clock=SessionClock(rig.servo.now_ns))
    if outlets is not None:
        store.attach(outlets)
    return store


def with_bench(described: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a receipt says of a device, with what ``devices bench`` measured of it on this machine, if it did."""
    bench = workstation.load_or_default()[0].bench_of(described)
    return {**described} if bench is None else {**described, "bench": bench.entry}
