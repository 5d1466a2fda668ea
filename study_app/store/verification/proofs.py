"""Proofs that leave the room: a line for each session and each record, signed and time-stamped where that is possible.

A line is one of ``fingerprints.txt`` with two check characters. Each withdrawal, reveal and exclusion (a reversed one,
too) has a line that names its file and participant. Below the lines of a file may be ``signature KEY SIGNATURE``
(Ed25519, base64) and ``stamp TOKEN`` (RFC 3161), both over the bytes of the lines.
"""

import atexit
import base64
import json
import queue
import threading
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from study_app.errors import StoreError
from study_app.store import workstation
from study_app.store.atomic import read_if_there, read_regular, write_file
from study_app.store.blinded.blinding import reveals
from study_app.store.checksums import Proofs, checked_line, listed, parsed, proof_of
from study_app.store.exclusions import exclusions, reversals
from study_app.store.folders import StudyFolder
from study_app.store.withdrawals import proof_of_withdrawal, tombstones

EXTRA: Final = "needs the optional extra proofs: pip install 'liquid-study[proofs]'"
STORE: Final = ("liquid-study", "signing key of the lab")
WAITS_S: Final = 10.0
LONGEST: Final = 1_000_000
"""Bytes of an answer of a server of time stamps."""


@dataclass(frozen=True, slots=True)
class Proof:
    """What was kept elsewhere: its lines, and in words who signed them and when they were stamped."""

    lines: Proofs
    told: tuple[str, ...] = ()


def records(study: StudyFolder) -> Proofs:
    """Return fingerprint and place of each record of a study."""
    rows = (*exclusions(study.path), *reversals(study.path))
    name = study.exclusions.name
    excluded = [(proof_of(json.dumps(asdict(row)).encode()), f"{name}/sub-{row.participant}") for row in rows]
    opened = [(proof_of(json.dumps(one).encode()), study.reveals.name) for one in reveals(study.path)]
    return (*map(proof_of_withdrawal, tombstones(study).values()), *opened, *dict.fromkeys(excluded))


def lines_of(study: StudyFolder) -> str:
    """Return the lines that prove a study as it is now."""
    lines = [checked_line(*one) for one in (*listed(study.fingerprints), *records(study))]
    if not lines:
        raise StoreError(f"{study.path} has no session that ended: there is nothing to prove yet")
    return "".join(f"{line}\n" for line in lines)


def signed(lines: str) -> str:
    """Return a signature of lines, as a line, with the key of the lab; a first one is drawn and kept by the system."""
    key = _key(draws=True)
    public = base64.b64encode(key.public_key().public_bytes_raw()).decode()
    return f"signature {public} {base64.b64encode(key.sign(lines.encode())).decode()}\n"


def stamped(lines: str, server: str) -> str:
    """Return a time stamp of lines, as a line, from a server (URL).

    Raises
    ------
    StoreError
        It gives none within `WAITS_S`.
    """
    client = _library("rfc3161_client")
    asked = client.TimestampRequestBuilder().data(lines.encode()).build()
    if not server.startswith(("http://", "https://")):
        raise StoreError(f"{server} is not a server of time stamps: give a URL such as https://freetsa.org/tsr")
    answers = queue.SimpleQueue[bytes | Exception]()
    threading.Thread(target=_ask, args=(server, asked.as_bytes(), answers), daemon=True).start()
    try:
        answer = answers.get(timeout=WAITS_S)  # the time-out of a connection is for each packet alone
        if not isinstance(answer, Exception):
            client.decode_timestamp_response(answer)
    except queue.Empty:
        answer = TimeoutError(f"not within {WAITS_S:g} s")
    except ValueError as error:
        answer = error
    if isinstance(answer, Exception):
        raise StoreError(f"{server} gave no time stamp ({str(answer)[:100]!r}): try again later") from answer
    return f"stamp {base64.b64encode(answer).decode()}\n"


def _ask(server: str, question: bytes, answers: queue.SimpleQueue[bytes | Exception]) -> None:
    """Put what a server answers, in part where it is longer than a stamp, or the error of asking."""
    import urllib.request  # noqa: PLC0415 - loads the network's modules: only where a stamp is asked for

    try:
        request = urllib.request.Request(  # noqa: S310 - http or https, as checked
            server, question, {"Content-Type": "application/timestamp-query"}
        )
        with urllib.request.urlopen(request, timeout=WAITS_S) as answer:  # noqa: S310
            answers.put(answer.read(LONGEST))
    except Exception as error:  # noqa: BLE001 - raised where the answer is waited for
        answers.put(error)


def read_proof(path: Path) -> Proof:
    """Return what a file that was kept elsewhere proves, after its signature and its time stamp were verified.

    Raises
    ------
    StoreError
        It cannot be read, a line is none or was mistyped, or signature or stamp are not of its lines.
    """
    if not path.is_file():
        raise StoreError(f"{path} is not a file: name a copy of a study's fingerprints.txt")
    text = (read_if_there(path) or b"").decode("utf-8-sig", "replace").replace("\r\n", "\n")
    above, told = "", list[str]()
    for line in text.splitlines(keepends=True):
        name, _, value = line.strip().partition(" ")
        if name == "signature":
            told.append(_check_signature(path, above, *value.partition(" ")[::2]))
        elif name == "stamp":
            told.append(_check_stamp(path, above, value))
        else:
            above += line
    return Proof(parsed(path, above), tuple(told))


def leave(study: StudyFolder, say: Callable[[str], object]) -> None:
    """Write the study's proof into the folder that the settings name, signed and stamped, while the program goes on."""
    settings = workstation.load_or_default()[0]
    if settings.proofs is None:
        return
    to = Path(settings.proofs) / f"{study.path.name}-proof.txt"

    def write() -> None:
        try:
            write_file(to, proof_text(study, server=settings.stamps).encode())
            say(f"the proof of the study is in {to}")
        except StoreError as error:
            say(f"the proof of the study is not in {to}: {error}")

    thread = threading.Thread(target=write, name="proof", daemon=True)  # a folder may never answer
    thread.start()
    atexit.register(thread.join, 2 * WAITS_S)


def proof_text(study: StudyFolder, *, server: str = "", sign: bool | None = None) -> str:
    """Return a study's proof, signed (None: if the lab has a key), and stamped by a server (URL) where one is given."""
    lines, below = lines_of(study), ""
    if sign or (sign is None and _key(draws=False) is not None):
        below += signed(lines)
    if server:
        below += stamped(lines, server)
    return lines + below


def _library(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError as error:
        raise StoreError(f"a proof with {name.partition('.')[0]} {EXTRA}") from error


def _key(*, draws: bool) -> Any:
    """Return the private key of the lab from the system's key store; None, or a new one, where there is none."""
    if not draws and None in (find_spec("keyring"), find_spec("cryptography")):
        return None
    store, ed25519 = _library("keyring"), _library("cryptography.hazmat.primitives.asymmetric.ed25519")
    try:
        held = store.get_password(*STORE)
        if held is None and draws:
            held = base64.b64encode(ed25519.Ed25519PrivateKey.generate().private_bytes_raw()).decode()
            store.set_password(*STORE, held)
    except _library("keyring.errors").KeyringError as error:
        if not draws:
            return None
        raise StoreError(f"the system's key store cannot be used ({error}): unlock it, or sign no proof") from error
    return None if held is None else ed25519.Ed25519PrivateKey.from_private_bytes(base64.b64decode(held))


def _check_signature(path: Path, lines: str, public: str, signature: str) -> str:
    ed25519 = _library("cryptography.hazmat.primitives.asymmetric.ed25519")
    wrong = _library("cryptography.exceptions").InvalidSignature
    try:
        key = ed25519.Ed25519PublicKey.from_public_bytes(base64.b64decode(public))
        key.verify(base64.b64decode(signature), lines.encode())
    except (wrong, ValueError) as error:
        raise StoreError(f"{path} is not what was signed: it was changed") from error
    own = _key(draws=False)
    if own is not None and own.public_key().public_bytes_raw() != key.public_bytes_raw():
        raise StoreError(f"{path} is signed with another key ({public}) than this computer's: it was replaced")
    return f"is signed with {'the key of this computer' if own is not None else f'{public}: compare it with your key'}"


def _check_stamp(path: Path, lines: str, token: str) -> str:
    client, x509 = _library("rfc3161_client"), _library("cryptography.x509")
    root = workstation.load_or_default()[0].stamp_root
    try:
        answer = client.decode_timestamp_response(base64.b64decode(token))
        verifier = client.VerifierBuilder()
        if root is None:
            raise StoreError(f"{path} is stamped: name the server's root certificate, liquid-study proof --root FILE")
        verifier = verifier.add_root_certificate(x509.load_pem_x509_certificate(read_regular(Path(root))))
        verifier.build().verify_message(answer, lines.encode())
    except (client.VerificationError, ValueError, OSError) as error:
        raise StoreError(f"{path} is not what was stamped, or by another server ({error}): it was changed") from error
    return f"was stamped at {answer.tst_info.gen_time.isoformat()}"
