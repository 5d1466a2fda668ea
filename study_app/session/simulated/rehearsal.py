"""Whole sessions with simulated participants, faster than real time, through everything a real one goes through.

The transitions, the runner, the servo's compiled loop, the store and the checks of every questionnaire are the same;
only the device, the clock, the screen and the participant are simulated. Time is the servo's virtual clock, so that the
same call into another folder gives the same tables but for wall-clock times. Every row says that it is simulated.

What a participant does and answers in a trial is drawn from streams of that trial. A rehearsal that was killed and
resumed answers as one that was not: from what is felt in the whole session, which is computed again for that.
"""

import time
from collections.abc import Callable
from datetime import datetime
from functools import partial
from pathlib import Path

from study_app.devices.registry import descriptor_of, discover
from study_app.devices.rig import Rig
from study_app.errors import SessionError
from study_app.protocol.load import parse, source_bytes
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Schedule, build_schedule
from study_app.protocol.simulated_observer import TrialFeatures
from study_app.session.resume import FIRST, REHEARSED_SCREENS, Start, find_protocol, resume_at, source_to_resume
from study_app.session.simulated.design_observer import OBSERVER, Observer
from study_app.session.simulated.rehearsed_session import RehearsedSession, rehearsal_rig
from study_app.session.unkept import Unkept
from study_app.store.blinded.allocation import session_protocol
from study_app.store.folders import StudyFolder, locate, rehearsal_folder
from study_app.store.journals import journal
from study_app.store.journals.journal import SessionClock
from study_app.store.progress import progress_of
from study_app.store.sessions.begin import SessionStart, begin, check_unused
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.recovery import reopen
from study_app.store.tables.study_files import check_study
from study_app.workspace import workspace


def rehearse(
    protocol: str | Path,
    *,
    participants: int,
    seed: int,
    device: str = "scripted",
    results: Path | None = None,
    recordings: bool = True,
    progress: Callable[[str], object] | None = None,
    observer: Observer = OBSERVER,
) -> Path:
    """Run a session each of P001, P002 … and return the study folder.

    Parameters
    ----------
    protocol : str or Path
        File or name of a protocol.
    participants : int
        How many.
    seed : int
        All randomness comes from it, the key's too.
    device : str
        A simulated device.
    results : Path, optional
        Study folder; by default a new ``results/<study>-rehearsal-<n>`` of the workspace.
    recordings : bool
        Whether every tick of the servo and every frame of a trial is kept.
    progress : callable, optional
        Called with a line after each session.
    observer : Observer, optional
        Discriminates the intervals of a trial.

    Raises
    ------
    ProtocolError
        The protocol cannot be used.
    StoreError
        The folder holds another study or an id is used already, and then nothing was touched; or results cannot be
        written.
    DeviceError
        The device is not known, or cannot be opened.
    SessionError
        The device does not move by itself, or a session broke; what was kept before is safe.
    """
    if not descriptor_of(device).moves_by_itself:
        alone = " or ".join(one.name for one in discover().devices if one.moves_by_itself)
        raise SessionError(f"device '{device}' waits for a person: rehearse with {alone}")
    source = source_bytes(protocol)
    study = parse(source, str(protocol))
    folder = rehearsal_folder(workspace().results, study.study.name) if results is None else Path(results)
    check_study(StudyFolder(folder), study.study.name)
    people = [f"P{number:03d}" for number in range(1, participants + 1)]
    for person in people:
        check_unused(StudyFolder(folder), person, 1)
    for person in people:
        began = time.perf_counter()
        with rehearsal_rig(study, person, seed, device) as rig:
            start = SessionStart(
                person,
                seed=seed,
                operator="",
                language=study.study.languages[0],
                device=rig.described,
                screens=REHEARSED_SCREENS,
                simulated=True,
                recordings=recordings,
            )
            store = begin(folder, study, source, start, clock=SessionClock(rig.servo.now_ns))
            own = session_protocol(StudyFolder(folder), store.as_recorded(study), person, 1)
            lasted_s, answers = _run(own, build_schedule(own, person, seed), rig, store, FIRST, observer)
            proof = store.fingerprint
        if progress is not None:
            took_s = time.perf_counter() - began
            held = f"{lasted_s / 60:.1f} min of session in {took_s:.1f} s (simulated)"
            progress(f"{person}: {answers} responses, {held}, fingerprint {proof}")
    return folder


def resume(session_folder: Path, *, protocol: str | Path | None = None) -> None:
    """Go on with a rehearsed session whose program was ended, to its last page.

    Parameters
    ----------
    session_folder : Path
        The session's ``ses-NN`` folder.
    protocol : str or Path, optional
        File or name of its protocol; by default it is looked for.

    Raises
    ------
    StoreError
        The session cannot be opened, is finished, or began with another protocol.
    SessionError
        No protocol at hand is the session's, or the session broke; what was kept before is safe.
    """
    lines = journal.read(locate(session_folder)[1].journal)
    begun = progress_of(lines).start
    read = partial(source_to_resume, session_folder)
    name = find_protocol(begun, read=read) if protocol is None else str(protocol)
    source = read(name)
    study = parse(source, name)
    person, seed = begun["participant"], begun["seed"]
    with rehearsal_rig(study, person, seed, begun["device"]) as rig:
        store = reopen(
            session_folder,
            study,
            source,
            operator="",
            device=rig.described,
            screens=REHEARSED_SCREENS,
            now_ns=rig.servo.now_ns,
            now=max(datetime.now().astimezone(), datetime.fromisoformat(lines[-1]["at"])),
        )
        own = session_protocol(locate(session_folder)[0], store.as_recorded(study), person, begun["session"])
        schedule = build_schedule(own, person, seed)
        _run(own, schedule, rig, store, resume_at(own, schedule, lines, store.key), OBSERVER)


def _run(
    study: Protocol, schedule: Schedule, rig: Rig, store: SessionStore, start: Start, observer: Observer
) -> tuple[float, int]:
    """Run an open session to its end; return how long it lasted in its own time [s], and its answers."""
    with store:
        known = (
            {}
            if start is FIRST
            else _felt_in_whole_session(study, schedule, rig.device.name, store.key.codes, store.key.nonce)
        )
        rehearsal = RehearsedSession(study, schedule, rig, store, start, known=known, observer=observer)
        rehearsal.run()
    return store.clock.seconds(), rehearsal.answers


def _felt_in_whole_session(
    study: Protocol, schedule: Schedule, device: str, codes: dict[str, dict[str, str]], secret: bytes
) -> dict[int, tuple[TrialFeatures, ...]]:
    """Return what is felt in each trial (by number) of a session that is not interrupted."""
    felt: dict[int, tuple[TrialFeatures, ...]] = {}
    with rehearsal_rig(study, schedule.participant, schedule.seed, device) as rig:
        RehearsedSession(study, schedule, rig, Unkept(rig.servo.now_ns, codes, secret), felt=felt.__setitem__).run()
    return felt
