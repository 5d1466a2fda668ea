"""Sessions asked for by command: begun or gone on with, without a dialog."""

import contextlib
from collections.abc import Callable, Mapping
from pathlib import Path

from PySide6.QtCore import QEventLoop, QTimer

from study_app.app.failures import ended_from_outside
from study_app.app.session.live_session import LiveSession
from study_app.app.session.timing import collecting_here
from study_app.devices import DEFAULT_DEVICE
from study_app.errors import StoreError
from study_app.gui.application import application_here
from study_app.gui.theme.theme import LIGHT
from study_app.protocol.load import load
from study_app.session.resume import is_rehearsal
from study_app.session.start import NewSession, check, draw_seed, resumed, study_results
from study_app.store import receipt
from study_app.store.folders import locate
from study_app.store.sessions.begin import refuse_never_begun
from study_app.store.workstation import remember_protocol
from study_app.workspace import workspace


def run(
    protocol: str,
    *,
    participant: str,
    session: int = 1,
    seed: int | None = None,
    device: str = DEFAULT_DEVICE,
    device_options: Mapping[str, str | Path] | None = None,
    language: str | None = None,
    operator: str = "",
    windowed: bool = False,
    screen: int | None = None,
    results: Path | None = None,
    pilot: bool = False,
    recordings: bool = True,
    row_of: str | None = None,
    progress: Callable[[str], object] | None = None,
) -> int:
    """Run a session without dialogs; return the exit code when its windows are closed.

    Parameters
    ----------
    protocol : file or name of a protocol
    participant, session, operator : participant's id, session number, operator's id
    seed : default: drawn, shown and recorded
    device, language : default: the mouse, the protocol's first language
    device_options : values of the device's options, by name
    windowed, screen : where the participant's window opens; screens count from 1
    results : the study's folder; default ``results/<study>`` of the workspace, of a pilot ``results/<study>-pilot``
    pilot : to try it out: in a window with a frame, apart from the data and marked
    row_of : the participant who is replaced, whose rows of squares the session takes; default: the participant's own
    recordings : whether every tick of the servo and every frame of a trial is kept
    progress : is given the lines of the pre-flight, before the first page

    Raises
    ------
    StudyError
        The session could not begin, and then nothing was created; or device or servo failed while it ran.
    """
    study = load(protocol)
    chosen = NewSession(
        source=protocol,
        participant=participant,
        session=session,
        seed=draw_seed() if seed is None else seed,
        operator=operator,
        language=study.study.languages[0] if language is None else language,
        device=device,
        windowed=windowed or pilot,
        screen=screen,
        results=(
            study_results(workspace().results, study.study.name, device, pilot=pilot)
            if results is None
            else Path(results)
        ),
        pilot=pilot,
        recordings=recordings,
        device_options=device_options or {},
        row_of=row_of,
    )
    check(chosen, study)
    if Path(protocol).is_file():
        with contextlib.suppress(StoreError):  # a session does not depend on it
            remember_protocol(Path(protocol))
    return run_session(chosen, progress)


def resume(
    session_folder: Path,
    *,
    protocol: str | None = None,
    device: str | None = None,
    device_options: Mapping[str, str | Path] | None = None,
    operator: str = "",
    windowed: bool = False,
    screen: int | None = None,
    progress: Callable[[str], object] | None = None,
) -> int:
    """Go on with a session whose program was ended; return the exit code when its windows are closed.

    A rehearsed session goes on as one, without windows.

    Parameters
    ----------
    protocol : file or name of its protocol; default: looked for among those at hand
    device : default: the one it began with
    device_options, operator, windowed, screen, progress : as for ``run``

    Raises
    ------
    StudyError
        It cannot go on (finished, of a changed protocol, open elsewhere); or device or servo failed while it ran.
    """
    folder = Path(session_folder)
    session = locate(folder)[1]
    refuse_never_begun(session)
    if is_rehearsal(receipt.read(session.receipt)):
        from study_app.session.simulated import rehearsal  # noqa: PLC0415 - the compiler: only once it is needed

        rehearsal.resume(folder, protocol=protocol)
        return 0
    chosen = resumed(
        folder,
        protocol=protocol,
        operator=operator,
        device=device,
        windowed=windowed,
        screen=screen,
        device_options=device_options,
    )
    check(chosen, chosen.read_protocol())
    return run_session(chosen, progress)


def run_session(chosen: NewSession, progress: Callable[[str], object] | None) -> int:
    """Open a session's windows and return when they are closed."""
    application_here()
    live = LiveSession(chosen, LIGHT, progress)
    loop = QEventLoop()
    live.over.connect(loop.quit)
    with collecting_here(), ended_from_outside(live.end_by_signal):
        QTimer.singleShot(0, live.open)
        loop.exec()
        live.wait(live.patience_s)
    if live.error is not None:
        raise live.error
    return live.code
