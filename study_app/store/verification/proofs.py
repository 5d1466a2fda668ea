"""Proofs to store elsewhere: a line for each session and record, signed and time-stamped if possible.

The line of a session is that of ``fingerprints.txt`` with two check characters. Each withdrawal, reveal, exclusion and
reversed exclusion has a line that names its file and participant. The lines may be followed by ``signature KEY
SIGNATURE`` (Ed25519, base64) and ``stamp TOKEN`` (RFC 3161), both over the bytes of the lines.
"""

import atexit
import base64
import json
import threading
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from study_app.errors import StoreError
from study_app.store import workstation
from study_app.store.blinded.blinding import reveals
from study_app.store.exclusions import exclusions, reversals
from study_app.store.files.atomic import read_if_there, write_file
from study_app.store.files.folders import StudyFolder
from study_app.store.integrity.checksums import Proofs, checked_line, parse_copy, proof_of, read_list
from study_app.store.merged import folders_of
from study_app.store.verification.time_stamps import WAITS_S, checked_stamp, optional_library, request_stamp
from study_app.store.withdrawals import proof_of_withdrawal, tombstones

_KEYRING_ENTRY: Final = ("liquid-study", "signing key of the lab")


@dataclass(frozen=True, slots=True)
class Proof:
    """A stored proof: its lines, and notes on its signature and time stamp for the report."""

    lines: Proofs
    notes: tuple[str, ...] = ()


def record_proofs(study: StudyFolder) -> Proofs:
    """Return fingerprint and name of each record (withdrawal, reveal, exclusion) of a study."""
    rows = (*exclusions(study.path), *reversals(study.path))
    name = study.exclusions.name
    excluded = [(proof_of(json.dumps(row.fields()).encode()), f"{name}/sub-{row.participant}") for row in rows]
    opened = [(proof_of(json.dumps(reveal).encode()), study.reveals.name) for reveal in reveals(study.path)]
    return (*map(proof_of_withdrawal, tombstones(study).values()), *opened, *dict.fromkeys(excluded))


def _fingerprint_lines(study: StudyFolder) -> str:
    """Return the lines that prove the current state of a study; in a merged study each name includes the site."""
    lines = [
        checked_line(proof, f"{site_prefix(study.path, folder)}{name}")
        for folder in folders_of(study.path).values()
        for proof, name in (*read_list(StudyFolder(folder).fingerprints), *record_proofs(StudyFolder(folder)))
    ]
    if not lines:
        raise StoreError(f"{study.path} does not contain a finished session: there is nothing to prove yet")
    return "".join(f"{line}\n" for line in lines)


def site_prefix(study: Path, folder: Path) -> str:
    """Return the prefix of the names in a proof for a site in ``folder``, such as "sites/A/"; "" if not merged."""
    return "" if folder == study else f"{folder.relative_to(study).as_posix()}/"


def _sign_lines(lines: str) -> str:
    """Sign ``lines`` with the lab's key, which is created if missing, and return the signature as a line."""
    key = _signing_key(draws=True)
    public = base64.b64encode(key.public_key().public_bytes_raw()).decode()
    return f"signature {public} {base64.b64encode(key.sign(lines.encode())).decode()}\n"


def read_proof(path: Path) -> Proof:
    """Read a stored proof and verify its signature and time stamp.

    Raises
    ------
    StoreError
        The proof cannot be read, a line is invalid or mistyped, a line is below a signature or stamp, or these do not
        belong to its lines.
    """
    if not path.is_file():
        raise StoreError(f"{path} is not a file: specify a copy of a study's fingerprints.txt")
    text = (read_if_there(path) or b"").decode("utf-8-sig", "replace").replace("\r\n", "\n")
    lines, notes = "", list[str]()
    for number, line in enumerate(text.splitlines(keepends=True), start=1):
        name, _, value = line.strip().partition(" ")
        if name == "signature":
            notes.append(_check_signature(path, lines, *value.partition(" ")[::2]))
        elif name == "stamp":
            notes.append(checked_stamp(path, lines, value))
        elif notes and name:
            raise StoreError(
                f"{path}, line {number} is below the signature or stamp, which does not cover it: remove it"
            )
        else:
            lines += line
    return Proof(parse_copy(path, lines), tuple(notes))


def write_proof(study: StudyFolder, say: Callable[[str], object]) -> None:
    """Write the study's proof, signed and stamped, into the folder of the settings in the background."""
    settings = workstation.load_or_default()[0]
    if settings.proofs is None:
        return
    to = Path(settings.proofs) / f"{study.path.name}-proof.txt"

    def write() -> None:
        try:
            write_file(to, proof_text(study, server=settings.stamps).encode())
            say(f"the study's proof was written to {to}")
        except StoreError as error:
            say(f"the study's proof was not written to {to}: {error}")

    thread = threading.Thread(target=write, name="proof", daemon=True)  # a network folder may never respond
    thread.start()
    atexit.register(thread.join, 2 * WAITS_S)


def proof_text(study: StudyFolder, *, server: str = "", sign: bool | None = None) -> str:
    """Return a study's proof, signed (None: if the lab has a key) and stamped if a ``server`` (URL) is given."""
    lines, suffix = _fingerprint_lines(study), ""
    if sign or (sign is None and _signing_key(draws=False) is not None):
        suffix += _sign_lines(lines)
    if server:
        suffix += request_stamp(lines, server)
    return lines + suffix


def _signing_key(*, draws: bool) -> Any:
    """Return the lab's private key from the system's key store; without one, draw it or return None."""
    if not draws and None in (find_spec("keyring"), find_spec("cryptography")):
        return None
    keyring, ed25519 = (
        optional_library("keyring"),
        optional_library("cryptography.hazmat.primitives.asymmetric.ed25519"),
    )
    try:
        encoded_key = keyring.get_password(*_KEYRING_ENTRY)
        if encoded_key is None and draws:
            encoded_key = base64.b64encode(ed25519.Ed25519PrivateKey.generate().private_bytes_raw()).decode()
            keyring.set_password(*_KEYRING_ENTRY, encoded_key)
    except optional_library("keyring.errors").KeyringError as error:
        if not draws:
            return None
        raise StoreError(
            f"the system's key store cannot be used ({error}): unlock it, or do not sign the proof"
        ) from error
    return None if encoded_key is None else ed25519.Ed25519PrivateKey.from_private_bytes(base64.b64decode(encoded_key))


def _check_signature(path: Path, lines: str, public: str, signature: str) -> str:
    """Return a text on who signed the proof in ``path``; StoreError if the signature is wrong or by another key."""
    ed25519 = optional_library("cryptography.hazmat.primitives.asymmetric.ed25519")
    invalid_signature = optional_library("cryptography.exceptions").InvalidSignature
    try:
        key = ed25519.Ed25519PublicKey.from_public_bytes(base64.b64decode(public))
        key.verify(base64.b64decode(signature), lines.encode())
    except (invalid_signature, ValueError) as error:
        raise StoreError(f"{path} was changed after it was signed") from error
    own_key = _signing_key(draws=False)
    if own_key is not None and own_key.public_key().public_bytes_raw() != key.public_bytes_raw():
        raise StoreError(f"{path} is signed with another computer's key ({public}): the signature was replaced")
    signer = "this computer's key" if own_key is not None else f"the key {public}: compare it with your own"
    return f"is signed with {signer}"
