"""Time stamps (RFC 3161) of the lines of a proof: requested from a server and verified with its root certificate."""

import base64
import queue
import threading
from importlib import import_module
from pathlib import Path
from typing import Any, Final
from urllib.error import HTTPError
from urllib.parse import urlsplit

from study_app.errors import StoreError
from study_app.store import workstation
from study_app.store.files.atomic import read_regular

_EXTRA: Final = "from the optional proofs extra: pip install 'liquid-study[proofs]'"
WAITS_S: Final = 10.0
_MAX_ANSWER_BYTES: Final = 1_000_000
"""Greatest length of a time-stamp server's answer [bytes]."""
_EXAMPLE_URL: Final = "https://freetsa.org/tsr"


def optional_library(name: str) -> Any:
    """Import a library of the extra ``proofs``; raise StoreError with the way to install it."""
    try:
        return import_module(name)
    except ImportError as error:
        raise StoreError(f"a proof requires {name.partition('.')[0]} {_EXTRA}") from error


def request_stamp(lines: str, server: str) -> str:
    """Request a time stamp of ``lines`` from ``server`` (URL) and return it as a line.

    The answer must grant a token over exactly these lines with the nonce of the request. If a root certificate is
    configured, the token must be signed under it.

    Raises
    ------
    StoreError
        The server returns no valid stamp within `WAITS_S`.
    """
    client = optional_library("rfc3161_client")
    request = client.TimestampRequestBuilder().data(lines.encode()).build()
    if not server.startswith(("http://", "https://")):
        raise StoreError(f"{_without_login(server)} is not a time-stamp server: specify a URL such as {_EXAMPLE_URL}")
    answers = queue.SimpleQueue[bytes | Exception]()
    threading.Thread(target=_post_request, args=(server, request.as_bytes(), answers), daemon=True).start()
    try:
        answer = answers.get(timeout=WAITS_S)  # the connection's own time-out applies to each packet
        if not isinstance(answer, Exception):
            check_granted(answer, request)
            if workstation.load_or_default()[0].stamp_root is not None:
                _verify_stamp(answer, lines)
    except queue.Empty:
        answer = TimeoutError(f"no reply within {WAITS_S:g} s")
    except (client.VerificationError, ValueError, OSError) as error:
        answer = error
    if isinstance(answer, Exception):
        reason = f"{_without_login(server)} did not return a time stamp ({str(answer)[:100]!r}): try again later"
        raise StoreError(reason) from answer
    return f"stamp {base64.b64encode(answer).decode()}\n"


def _without_login(url: str) -> str:
    """Return a URL without user name and password."""
    parts = urlsplit(url)
    return parts._replace(netloc=parts.netloc.rpartition("@")[2]).geturl()


def check_granted(answer: bytes, request: Any) -> None:
    """Raise ValueError unless an answer of a server grants a token over the request's digest with its nonce."""
    client = optional_library("rfc3161_client")
    response = client.decode_timestamp_response(answer)
    if response.status != client.PKIStatus.GRANTED:
        raise ValueError(
            f"the server rejected the request: status {response.status} {' '.join(response.status_string)}".strip()
        )
    token = response.tst_info
    if token.message_imprint.message != request.message_imprint.message:
        raise ValueError("the token was issued for another text")
    if token.nonce != request.nonce:
        raise ValueError("the token was issued for another request")


def _post_request(server: str, content: bytes, answers: queue.SimpleQueue[bytes | Exception]) -> None:
    """Put the server's answer (at most `_MAX_ANSWER_BYTES`) or the error into ``answers``; follow no redirect."""
    import urllib.request as network  # noqa: PLC0415 - loads network modules, needed only for a stamp

    try:
        opener = network.OpenerDirector()
        handlers = (network.ProxyHandler, network.HTTPHandler, network.HTTPSHandler, network.HTTPDefaultErrorHandler)
        for handler in (*handlers, network.HTTPErrorProcessor):
            opener.add_handler(handler())
        request = network.Request(  # noqa: S310 - http or https, as checked
            server, content, {"Content-Type": "application/timestamp-query"}
        )
        with opener.open(request, timeout=WAITS_S) as answer:
            answers.put(answer.read(_MAX_ANSWER_BYTES))
    except Exception as error:  # noqa: BLE001 - raised by the waiting thread
        if isinstance(error, HTTPError):
            error.close()
        answers.put(error)


def checked_stamp(path: Path, lines: str, token: str) -> str:
    """Return a text with the time of a file's stamp; raise StoreError if the stamp does not match its lines."""
    client = optional_library("rfc3161_client")
    if workstation.load_or_default()[0].stamp_root is None:
        raise StoreError(
            f"{path} has a time stamp: to verify it, specify the server's root certificate with liquid-study "
            "proof --root FILE"
        )
    try:
        answer = _verify_stamp(base64.b64decode(token), lines)
    except (client.VerificationError, ValueError, OSError) as error:
        raise StoreError(
            f"{path} was changed after it was stamped, or was stamped by another server ({error})"
        ) from error
    return f"was stamped at {answer.tst_info.gen_time.isoformat()}"


def _verify_stamp(token: bytes, lines: str) -> Any:
    """Verify that a stamp covers ``lines`` and is signed under the configured root; return the decoded stamp."""
    client, x509 = optional_library("rfc3161_client"), optional_library("cryptography.x509")
    answer = client.decode_timestamp_response(token)
    root = read_regular(Path(str(workstation.load_or_default()[0].stamp_root)))
    verifier = client.VerifierBuilder().add_root_certificate(x509.load_pem_x509_certificate(root))
    verifier.build().verify_message(answer, lines.encode())
    return answer
