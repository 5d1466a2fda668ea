"""Proofs that leave the room: which of twenty forgeries each of them tells, by the table of docs/files.md."""

import base64
import json
import re
import shutil
import subprocess
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.errors import StoreError
from study_app.store import workstation
from study_app.store.files.folders import StudyFolder
from study_app.store.verification import time_stamps
from study_app.store.verification.proofs import proof_text, read_proof, write_proof
from study_app.store.verification.whole_study import verify_study
from tests.store.verification.played_studies import proved
from tests.strangers import ends_with_each
from tests.studies import once

pytestmark = pytest.mark.slow

P001 = "data/sub-P001/ses-01"


@pytest.fixture
def study(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    proved_study = once(tmp_path_factory, "proved", lambda folder: proved(folder / "demo"))
    shutil.copytree(proved_study, tmp_path / "proved")
    assert verify_study(tmp_path / "proved" / "demo").errors == ()
    return tmp_path / "proved" / "demo"


@pytest.fixture
def key_store(tmp_path: Path) -> Iterator[Path]:
    """A file that the library of key stores uses."""
    keyring = pytest.importorskip("keyring", reason="the optional extra proofs is not installed")
    backend = pytest.importorskip("keyring.backend")
    key_file = tmp_path / "keys.json"

    class InFile(backend.KeyringBackend):  # type: ignore[misc, name-defined]
        priority = 1

        def get_password(self, service: str, username: str) -> str | None:
            return json.loads(key_file.read_text("utf-8")).get(f"{service}/{username}") if key_file.exists() else None

        def set_password(self, service: str, username: str, password: str) -> None:
            key_file.write_text(json.dumps({f"{service}/{username}": password}), encoding="utf-8", newline="\n")

    before = keyring.get_keyring()
    keyring.set_keyring(InFile())
    yield key_file
    keyring.set_keyring(before)


def test_the_documentation_lists_the_forgeries_and_their_detection() -> None:
    page = " ".join((Path(__file__).parents[3] / "docs" / "files.md").read_text(encoding="utf-8").split())
    tried = (Path(__file__).parent / "transcripts" / "proofs.txt").read_text(encoding="utf-8").split("=== ")[1:]
    verdicts = [
        (output.partition("\n")[0], *re.findall(r"running: (sound|not sound)$", output, re.MULTILINE))
        for output in tried
    ]
    assert {kept_verdict for _, _, kept_verdict in verdicts} == {"not sound"}
    assert f"We tested {len(tried)} forgeries" in page
    assert f"reveal all {len(tried)} forgeries." in page
    alone = {name for name, verdict, _ in verdicts if verdict == "not sound"}
    assert len(alone) == 6
    assert "On its own, `verify` detects six, such as a changed answer or a deleted session folder" in page
    assert alone > {"an answer changed in the journal", "an answer changed in a table", "a session's folder deleted"}
    (others,) = re.findall(r"does not detect, for example, ([^.]*)\.", page)
    untold = {
        "exchanged answers": {"all answers of a participant inverted", "answers of two participants exchanged"},
        "shifted times": {"all times moved"},
        "a changed seed or operator": {"another seed", "another operator"},
        "a simulated session marked as real": {"a simulated session marked as real"},
        "an added session": {"a session added"},
        "or a deleted participant": {"a participant deleted", "a participant deleted, with a false withdrawal"},
        "exclusion or withdrawal": {"an exclusion deleted", "the record of a withdrawal deleted"},
    }
    assert others.split(", ") == list(untold)
    assert set().union(*untold.values()) <= {name for name, *_ in verdicts} - alone


def test_lines_of_records_are_compared_and_a_withdrawal_that_was_asked_for_adds_its_own(study: Path) -> None:
    proof_copy = study.parent / "kept.txt"
    lines = [line.split()[1] for line in proof_copy.read_text("utf-8").splitlines()]
    names = ["withdrawals.jsonl/sub-P003", "reveals.jsonl", "exclusions.csv/sub-P002"]
    assert lines == [P001, P001.replace("1/", "2/"), *names]
    typed = study.parent / "typed.txt"
    typed.write_text(proof_copy.read_text("utf-8").upper(), encoding="utf-8", newline="\n")
    assert verify_study(study, proof_copy).errors == verify_study(study, typed).errors == ()
    (study / "blinding" / "reveals.jsonl").write_bytes(b"")
    assert "reveals.jsonl: does not contain " in "\n".join(map(str, verify_study(study, proof_copy).errors))
    words = ("withdraw", str(study), "--participant", "P002", "--by", "AK", "--reason", "asked")
    result = CliRunner().invoke(commands, words).stdout.splitlines()
    errors_text = "\n".join(map(str, verify_study(study, proof_copy).errors))
    line = next(words for words in result if words.startswith("keep this line")).partition(":  ")[2]
    assert f"the withdrawal of P002 is not in {proof_copy}: if P002 requested it, add the line: {line}" in errors_text
    proof_copy.write_text(f"{proof_copy.read_text('utf-8')}{line}\n", encoding="utf-8", newline="\n")
    assert "P002" not in "\n".join(map(str, verify_study(study, proof_copy).errors))


def test_a_misread_line_is_named(study: Path) -> None:
    proof_copy = study.parent / "kept.txt"
    first, *rest = proof_copy.read_text("utf-8").splitlines()
    other = ("b" if first[2] != "b" else "c").join((first[:2], first[3:]))
    proof_copy.write_text("\n".join([other, *rest]), encoding="utf-8", newline="\n")
    with pytest.raises(
        StoreError, match=r"kept.txt, line 1 was copied incorrectly: its last two characters do not match the rest"
    ):
        verify_study(study, proof_copy)


def test_a_signature_reveals_a_changed_copy_and_another_key(study: Path, key_store: Path) -> None:
    proof_copy = study.parent / "signed.txt"
    result = CliRunner().invoke(commands, ["proof", str(study), "--sign", "--to", str(proof_copy)])
    assert (result.exit_code, result.stdout.strip()) == (0, str(proof_copy)), result.output
    verification = verify_study(study, proof_copy)
    assert verification.errors == ()
    assert f"{proof_copy} is signed with this computer's key" in "\n".join(map(str, verification.warnings))
    whole = proof_copy.read_text("utf-8")
    proof_copy.write_text("".join(whole.splitlines(keepends=True)[1:]), encoding="utf-8", newline="\n")
    with pytest.raises(StoreError, match="was changed after it was signed"):
        verify_study(study, proof_copy)
    key_store.unlink()
    proof_copy.write_text(whole, encoding="utf-8", newline="\n")
    assert "compare it with your own" in "\n".join(read_proof(proof_copy).notes)
    proof_text(StudyFolder(study), sign=True)
    with pytest.raises(StoreError, match=r"signed with another computer's key .*: the signature was replaced"):
        verify_study(study, proof_copy)


@pytest.mark.parametrize("forged", ["aaaa-aaaa-aaaa-aa withdrawals.jsonl/sub-P002", "P003", "# a comment"])
def test_a_line_below_a_signature_is_refused(study: Path, key_store: Path, forged: str) -> None:
    proof_copy = study.parent / "signed.txt"
    proof_copy.write_text(proof_text(StudyFolder(study), sign=True), encoding="utf-8", newline="\n")
    lines = len(proof_copy.read_text("utf-8").splitlines())
    with proof_copy.open("a", encoding="utf-8", newline="\n") as file:
        file.write(f"\n{forged}\n")
    with pytest.raises(StoreError, match=rf"signed.txt, line {lines + 2} is below the signature or stamp"):
        verify_study(study, proof_copy)


def wait_for_proofs() -> None:
    for thread in threading.enumerate():
        if thread.name == "proof":
            thread.join()


@pytest.fixture
def server(tmp_path: Path) -> Iterator[str]:
    """The URL of a server of time stamps, with a certificate of its own: ``root.pem``."""
    pytest.importorskip("rfc3161_client", reason="the optional extra proofs is not installed")
    if shutil.which("openssl") is None:
        pytest.skip("openssl stamps")
    (tmp_path / "ts.cnf").write_text(
        "[req]\ndistinguished_name=dn\nx509_extensions=v3\nprompt=no\n[dn]\nCN=lab\nO=lab\n"
        "[v3]\nbasicConstraints=critical,CA:FALSE\nkeyUsage=critical,digitalSignature\n"
        "extendedKeyUsage=critical,timeStamping\nsubjectKeyIdentifier=hash\nauthorityKeyIdentifier=keyid\n"
        "[ca]\nbasicConstraints=critical,CA:TRUE\nkeyUsage=critical,keyCertSign\nsubjectKeyIdentifier=hash\n"
        f"[tsa]\ndefault_tsa=t\n[t]\nserial={tmp_path}/serial\nsigner_cert={tmp_path}/tsa.pem\n"
        f"signer_key={tmp_path}/tsa.key\nsigner_digest=sha256\ndefault_policy=1.2.3.4.1\ndigests=sha256,sha512\n"
        "accuracy=secs:1\n",
        encoding="utf-8",
        newline="\n",
    )

    def openssl(*words: str) -> None:
        subprocess.run(("openssl", *words), cwd=tmp_path, check=True, capture_output=True)

    new = ("-newkey", "rsa:2048", "-nodes", "-config", "ts.cnf", "-x509", "-days", "2")
    openssl("req", *new, "-extensions", "ca", "-keyout", "root.key", "-out", "root.pem", "-subj", "/CN=root")
    signed_by = ("-CA", "root.pem", "-CAkey", "root.key")
    openssl("req", *new, *signed_by, "-extensions", "v3", "-keyout", "tsa.key", "-out", "tsa.pem", "-subj", "/CN=tsa")

    class Stamps(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            (tmp_path / "asked").write_bytes(self.rfile.read(int(self.headers["Content-Length"])))
            openssl("ts", "-reply", "-config", "ts.cnf", "-section", "t", "-queryfile", "asked", "-out", "answer")
            self.send_response(200)
            self.end_headers()
            self.wfile.write((tmp_path / "answer").read_bytes())

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Stamps) as serving:
        thread = threading.Thread(target=serving.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{serving.server_address[1]}"
        serving.shutdown()
        thread.join()


def test_a_time_stamp_dates_the_study_and_is_requested_automatically(
    study: Path, server: str, tmp_path: Path, key_store: Path
) -> None:
    outside = tmp_path / "outside"
    outside.mkdir()
    words = ["proof", str(study), "--server", server, "--root", str(tmp_path / "root.pem"), "--always", str(outside)]
    result = CliRunner().invoke(commands, [*words, "--sign"])
    assert result.exit_code == 0, result.output
    messages: list[str] = []
    write_proof(StudyFolder(study), messages.append)
    wait_for_proofs()
    proof_copy = outside / "demo-proof.txt"
    assert messages == [f"the study's proof was written to {proof_copy}"]
    verification = verify_study(study, proof_copy)
    assert verification.errors == ()
    assert re.search(r"was stamped at 20\d\d-", "\n".join(map(str, verification.warnings)))
    whole = proof_copy.read_text("utf-8")
    proof_copy.write_text(
        "".join(line for line in whole.splitlines(keepends=True)[1:] if not line.startswith("signature")),
        encoding="utf-8",
        newline="\n",
    )
    with pytest.raises(StoreError, match="was changed after it was stamped, or was stamped by another server"):
        verify_study(study, proof_copy)
    workstation.save_settings(workstation.load_settings().model_copy(update={"stamp_root": None}))
    proof_copy.write_text(whole, encoding="utf-8", newline="\n")
    with pytest.raises(StoreError, match=r"has a time stamp: to verify it, specify the server's root certificate"):
        verify_study(study, proof_copy)


def test_proofs_are_written_only_if_the_settings_name_a_folder(study: Path) -> None:
    write_proof(StudyFolder(study), pytest.fail)
    wait_for_proofs()


def test_a_server_without_a_time_stamp_is_named_and_the_program_continues(study: Path, tmp_path: Path) -> None:
    pytest.importorskip("rfc3161_client", reason="the optional extra proofs is not installed")
    workstation.save_settings(workstation.MachineSettings(proofs=str(tmp_path), stamps="http://127.0.0.1:9"))
    messages: list[str] = []
    write_proof(StudyFolder(study), messages.append)
    wait_for_proofs()
    (line,) = messages
    assert re.search(
        (
            r"proof.txt: http://127.0.0.1:9 did not return a time stamp \(.*refused.*\): try again "
            r"later"
        ),
        line,
    )


@pytest.mark.parametrize(
    ("status", "headers", "answer", "reason"),
    [
        (200, {}, bytes.fromhex("30053003020102"), "the server rejected the request: status 2"),
        (200, {}, bytes.fromhex("30053003020100"), "Missing"),
        (200, {}, b"<html>no</html>", ""),
        (302, {"Location": "http://127.0.0.2/"}, b"", "HTTP Error 302"),
    ],
    ids=["rejection", "no token", "HTML", "redirect"],
)
def test_a_rejected_time_stamp_request_fails_at_once(
    study: Path, status: int, headers: dict[str, str], answer: bytes, reason: str
) -> None:
    pytest.importorskip("rfc3161_client", reason="the optional extra proofs is not installed")

    class Refuses(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            self.rfile.read(int(self.headers["Content-Length"]))  # what is not read resets the connection on Windows
            self.send_response(status)
            for name, value in headers.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(answer)

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Refuses) as serving:
        threading.Thread(target=serving.serve_forever).start()
        port = serving.server_address[1]
        with pytest.raises(StoreError) as error:
            time_stamps.request_stamp("a line\n", f"http://127.0.0.1:{port}/")
        serving.shutdown()
    assert re.match(rf"http://127.0.0.1:{port}/ did not return a time stamp \(.*{reason}", str(error.value))


def test_a_message_shows_no_login_of_a_server() -> None:
    pytest.importorskip("rfc3161_client", reason="the optional extra proofs is not installed")
    with pytest.raises(StoreError, match=r"^http://127.0.0.1:9/tsr did not return a time stamp"):
        time_stamps.request_stamp("a line\n", "http://lab:secret@127.0.0.1:9/tsr")


def test_a_stamp_of_another_request_is_refused(study: Path, server: str, monkeypatch: pytest.MonkeyPatch) -> None:
    client = pytest.importorskip("rfc3161_client", reason="the optional extra proofs is not installed")
    old = base64.b64decode(time_stamps.request_stamp("a line\n", server).split()[1])
    request = client.TimestampRequestBuilder().data(b"a line\n").build()
    with pytest.raises(ValueError, match="was issued for another request"):
        time_stamps.check_granted(old, request)
    other = client.TimestampRequestBuilder().data(b"another line\n").build()
    with pytest.raises(ValueError, match="was issued for another text"):
        time_stamps.check_granted(old, other)


def test_the_program_does_not_wait_for_a_server_that_is_not_a_time_stamp_server(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("rfc3161_client", reason="the optional extra proofs is not installed")
    monkeypatch.setattr(time_stamps, "WAITS_S", 1.0)

    def client(port: int) -> str:
        with pytest.raises(StoreError) as error:
            time_stamps.request_stamp("a line\n", f"http://127.0.0.1:{port}/")
        return str(error.value)

    messages = ends_with_each(client)
    line = r"http://127.0.0.1:\d+/ did not return a time stamp \([^\n]{1,200}\): try again later$"
    assert [outcome for outcome in messages.items() if not re.match(line, outcome[1])] == []
