"""What an operator chose before a session, as a value. No Qt here."""

import secrets
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from random import Random

from study_app.devices.registry import descriptor_of
from study_app.errors import SessionError, StoreError
from study_app.protocol.load import parse, source_bytes
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Schedule, build_schedule, stream
from study_app.protocol.orders.sequences import enrolment
from study_app.session.resume import find_protocol, source_to_resume
from study_app.store.folders import ID_PATTERN, locate, study_folder
from study_app.store.progress import progress
from study_app.store.sessions.begin import refuse_never_begun
from study_app.store.sessions.recovery import check_can_go_on

MAX_SEED = 999_999


@dataclass(frozen=True, slots=True)
class NewSession:
    """What the operator chose; ``results`` is the study's folder, ``screen`` counts from 1 (None: the last).

    ``resumes`` is the folder of the session that goes on, None for a new one; ``device_options`` are the values
    of the device's options, by name. ``row_of`` is the id whose rows of squares the session takes, None: its own.
    ``played`` says that it is played from the designer: exactly from where it was left, without an operator's window.
    ``footage`` is the folder of the study's footage, None: that of its file.
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
    played: bool = False
    footage: Path | None = None

    def read_source(self) -> bytes:
        """Return the protocol's source; of a session that goes on, with its liquid files as they were sealed."""
        return source_bytes(self.source) if self.resumes is None else source_to_resume(self.resumes, self.source)

    def read_protocol(self) -> Protocol:
        """Return the protocol of `read_source`."""
        return parse(self.read_source(), self.source)

    def schedule(self, protocol: Protocol) -> Schedule:
        """Return the steps of the session, in the participant's own protocol."""
        return build_schedule(protocol, self.participant, self.seed, self.row_of)

    def tremor(self) -> Random:
        """Return the random numbers of a hand that moves by itself."""
        return stream(self.seed, f"run/{self.participant}/tremor")

    @property
    def who(self) -> str:
        """Whose session it is, in the operator's words."""
        kind = "  ·  pilot" if self.pilot else ""
        return f"Participant {self.participant}  ·  session {self.session}  ·  seed {self.seed}{kind}"


def resumed(
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
    """Return the choices to go on with the session in a folder: its own, and where its windows open now.

    Raises
    ------
    StoreError
        It cannot go on: it is not a session folder, open in another program, finished, damaged, or of another protocol.
    SessionError
        No protocol at hand is of its study.
    ProtocolError
        The protocol cannot be used.
    """
    study, folder = locate(session_folder)
    refuse_never_begun(folder)
    done = progress(session_folder)
    if done.ended is not None:
        raise StoreError(
            f"{folder.path} is finished ({done.ended}) and cannot be resumed; use a new session number for another "
            "visit"
        )
    start = done.start
    read = partial(source_to_resume, session_folder)
    chosen = protocol if protocol is not None else find_protocol(start, candidates, read)
    source = read(chosen)
    check_can_go_on(session_folder, parse(source, chosen), source)
    return NewSession(
        source=chosen,
        participant=start["participant"],
        session=start["session"],
        seed=start["seed"],
        operator=operator,
        language=done.language,
        device=device if device is not None else start["device"],
        windowed=windowed or start["pilot"],
        screen=screen,
        results=study.path,
        pilot=start["pilot"],
        recordings=bool(start.get("recordings")),
        resumes=session_folder,
        device_options=device_options or {},
        row_of=start.get("row_of"),
    )


def check_row(row_of: str | None, study: Protocol) -> None:
    """Refuse an id whose rows of squares a session is to take where that decides nothing.

    Raises
    ------
    SessionError
        The study assigns no rows, or the id has no number that would determine one.
    """
    if row_of is None:
        return
    if not study.assigns_rows:
        raise SessionError(
            f"row of {row_of!r}: no block of {study.study.name} has a Williams or Latin order, so no participant has a "
            "row; leave it out"
        )
    if not ID_PATTERN.fullmatch(row_of) or enrolment(row_of) is None:
        raise SessionError(
            f"row of {row_of!r}: rows are assigned by the number in a participant's id; give the id of the participant "
            "who is replaced, such as P007"
        )


def draw_seed() -> int:
    """Return a random seed, short enough to be read aloud."""
    return secrets.randbelow(MAX_SEED) + 1


def study_results(results: Path, study: str, device: str, *, pilot: bool = False) -> Path:
    """Return a study's folder under ``results``; pilots and simulated hands are kept apart from participants' data."""
    used = descriptor_of(device)
    name = f"{study}-{used.name}" if used.simulated else study
    return study_folder(results, name, pilot=pilot).path
