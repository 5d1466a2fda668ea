"""Results changed by hand: what `verify` finds by itself, and what with fingerprints that were kept elsewhere."""

import base64
import hashlib
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.protocol.simulated import TrialFeatures
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store import receipt
from study_app.store.blinded import blinding
from study_app.store.blinded.blinding import opened, sealed
from study_app.store.checksums import listed
from study_app.store.folders import StudyFolder
from study_app.store.journals import journal_events as events
from study_app.store.sessions.recovery import check_can_go_on, rebuild
from study_app.store.verification.verify_study import verify
from study_app.store.withdrawals import Tombstone, add_tombstone, describe_session
from tests.protocol.forms.mixed import mixed_file
from tests.store.conftest import SOURCE, Attend, Start, Tables
from tests.store.forging import Lines, cover_up, forge
from tests.studies import made_up

pytestmark = pytest.mark.slow

P007 = "data/sub-P007/ses-01"
JOURNAL = f"{P007}/journal.jsonl"
Act = Callable[[Path], None]


@pytest.fixture
def study(tmp_path: Path, finished: Start) -> Path:
    """Two rehearsed sessions that ended; their fingerprints are kept in tmp_path/kept.txt."""
    for person in ("P007", "P008"):
        finished(person, simulated=True)
    shutil.copy(tmp_path / "study" / "fingerprints.txt", tmp_path / "kept.txt")
    return tmp_path / "study"


def told(study: Path, kept: Path | None = None) -> str:
    return "\n".join(map(str, verify(study, kept).errors))


def of_receipt(study: Path, **changes: Any) -> None:
    path = study / P007 / "receipt.json"
    receipt.write(path, receipt.read(path) | changes)


def forging(
    edit: Callable[[Lines], object], *, chained: bool = True, covered: bool = False, **of_the_receipt: Any
) -> Act:
    """Return what changes the journal, and the receipt, and computes checksums and fingerprints anew if ``covered``."""

    def act(study: Path) -> None:
        of_receipt(study, **of_the_receipt)
        forge(study / JOURNAL, edit, chained=chained)
        digest = receipt.digest(receipt.read(study / P007 / "receipt.json"))
        forge(study / JOURNAL, of_start(receipt_hash=digest), chained=chained)
        if covered:
            cover_up(study)

    return act


def of_start(**changes: Any) -> Callable[[Lines], object]:
    return lambda lines: lines[0].update(changes)


def without_format(lines: Lines) -> None:
    del lines[0]["format"]


def other_responses(lines: Lines) -> None:
    for line in lines:
        if line["event"] == "responses":
            for item in line["items"]:
                item["value"] = 8 - item["value"]


def other_answers(lines: Lines) -> None:
    """Change the choices, too."""
    other_responses(lines)
    for line in lines:
        if line["event"] == "choice":
            line["value"] = 8 - line["value"]


def half(lines: Lines) -> None:
    del lines[len(lines) // 2 :]


def without_a_choice(lines: Lines) -> None:
    del lines[next(n for n, line in enumerate(lines) if line["event"] == "choice")]


def without_responses(lines: Lines) -> None:
    del lines[next(n for n, line in enumerate(lines) if line["event"] == "responses")]


def edit_a_response(study: Path) -> None:
    path = study / JOURNAL
    path.write_bytes(path.read_bytes().replace(b'"value":7', b'"value":1'))


cut_the_journal = forging(half, status="unfinished", reason="", ended_at=None)


def cut_the_journal_and_delete_the_checksums(study: Path) -> None:
    cut_the_journal(study)
    (study / P007 / "checksums.sha256").unlink()


def delete_a_participant(study: Path) -> None:
    shutil.rmtree(study / "data" / "sub-P007")
    kept = StudyFolder(study).fingerprints.read_bytes()
    cover_up(study)
    StudyFolder(study).fingerprints.write_bytes(kept)


def begin_the_chain_late(study: Path) -> None:
    path = study / JOURNAL
    first, second, *rest = path.read_bytes().splitlines(keepends=True)
    line = json.loads(first)
    del line["format"], line["previous"]
    first = json.dumps(line, separators=(",", ":")).encode() + b"\n"
    before = hashlib.sha256(first)
    told_after = json.loads(second)["previous"].encode()
    path.write_bytes(first + second.replace(told_after, before.hexdigest().encode()) + b"".join(rest))


def change_and_rebuild(study: Path) -> None:
    forge(study / JOURNAL, other_answers)
    (study / P007 / "checksums.sha256").unlink()
    rebuild(study / P007)


@pytest.mark.variants(5)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("act", "sentence"),
    [
        (edit_a_response, "was written after another line than the one before it, which was changed"),
        (forging(other_responses, covered=True), "another answer than was chosen before: it was changed"),
        (forging(without_a_choice, covered=True), "another answer than was chosen before: it was changed"),
        (cut_the_journal, "was written after the session ended, but the journal has no end"),
        (cut_the_journal_and_delete_the_checksums, f"{P007}: is not the session that fingerprints.txt lists as"),
        (delete_a_participant, f"{P007}: is missing, but fingerprints.txt lists it"),
        (forging(of_start(simulated=False)), "simulated: differ from the journal"),
        (forging(without_format, chained=False, format=1), "lacks format: it was changed"),
        (forging(without_responses, covered=True), "which was never confirmed: a line was removed"),
        (begin_the_chain_late, "has previous, and the lines before it lack it"),
        (change_and_rebuild, f"{P007}: is not the session that fingerprints.txt lists as"),
    ],
)
def test_a_forgery_that_computes_no_fingerprint_is_found(study: Path, tmp_path: Path, act: Act, sentence: str) -> None:
    assert verify(study, tmp_path / "kept.txt").sound
    act(study)
    assert sentence in told(study)
    assert not verify(study).sound


def forget_a_participant(study: Path) -> None:
    shutil.rmtree(study / "data" / "sub-P007")


def add_a_session(study: Path) -> None:
    path = study / "data" / "sub-P009" / "ses-01"
    shutil.copytree(study / P007, path)
    key = blinding.read_key(study)

    def of_another(lines: Lines) -> None:
        clear = opened(lines, key)
        clear[0]["participant"] = "P009"
        lines[:] = [sealed(clear[0], line["event"], line, key) for line in clear]

    forge(path / "journal.jsonl", of_another)
    receipt.write(path / "receipt.json", receipt.read(path / "receipt.json") | {"participant": "P009"})
    for table in path.glob("*_data.csv"):
        table.unlink()


@pytest.mark.variants(4)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("act", "sentence"),
    [
        (forging(other_answers), f"{P007}: is not the session that"),
        (cut_the_journal, "it no longer has an end"),
        (forget_a_participant, f"{P007}: is missing, but"),
        (forging(of_start(simulated=False), simulated=False), f"{P007}: is not the session that"),
        (
            forging(lambda lines: lines[-1].update(status="withdrawn"), status="withdrawn"),
            f"{P007}: is not the session that",
        ),
        (forging(of_start(seed=12), seed=12), f"{P007}: is not the session that"),
        (add_a_session, "it was added, or ended, after that copy was made"),
    ],
)
def test_a_forgery_that_computes_everything_anew_is_found_with_the_fingerprints_kept_elsewhere(
    study: Path, tmp_path: Path, act: Act, sentence: str
) -> None:
    """Without them nothing can be found: so it is with files that anyone may write."""
    act(study)
    cover_up(study)
    assert verify(study).sound
    assert sentence in told(study, tmp_path / "kept.txt")


def test_a_deleted_participant_who_is_said_to_have_withdrawn_is_named(study: Path, tmp_path: Path) -> None:
    """Without a line of the withdrawal it is an error with what was kept elsewhere."""
    folder = StudyFolder(study)
    erased = tuple(map(describe_session, folder.sessions()[:1]))
    forget_a_participant(study)
    cover_up(study)
    add_tombstone(folder, Tombstone("P007", "2026-03-02T09:30:00+01:00", "AB", "asked", erased))
    found = verify(study, tmp_path / "kept.txt")
    assert "the withdrawal of P007 is not in" in "\n".join(map(str, found.errors))
    found = verify(study)
    assert found.errors == ()
    assert "participant P007 withdrew at 2026-03-02T09:30:00+01:00 (recorded by AB)" in "\n".join(
        map(str, found.warnings)
    )


def test_changed_tables_do_not_survive_a_rebuild(study: Path, tmp_path: Path) -> None:
    tables = sorted((study / P007).glob("*_data.csv"))
    before = [table.read_bytes() for table in tables]
    for table in tables:
        table.write_bytes(table.read_bytes().replace(b",7,", b",1,").replace(b"complete", b"timeout"))
    assert "differs from the journal" in told(study)
    (study / P007 / "checksums.sha256").unlink()
    rebuild(study / P007)
    assert [table.read_bytes() for table in tables] == before
    assert "the list of checksums was missing" in "\n".join(map(str, verify(study).warnings))
    assert verify(study, tmp_path / "kept.txt").sound


OF_ANOTHER_MACHINE = json.dumps({"host": "elsewhere", "pid": 1, "began": "x"})


@pytest.mark.parametrize(
    ("harm", "sentence"),
    [
        (lambda journal: edit_a_response(journal.parents[3]), "was written after another line than the one before it"),
        (lambda journal: forge(journal, lambda lines: lines[0].update(participant="P008")), "is of participant 'P008'"),
        (lambda journal: journal.unlink(), "is missing, but receipt"),
        (lambda journal: journal.write_bytes(b""), "is not the session that"),
    ],
)
def test_a_marker_of_another_machine_hides_no_forgery_of_the_journal(
    study: Path, harm: Callable[[Path], object], sentence: str
) -> None:
    """The tables of a session that seems to run in a program are not judged; its journal is."""
    (study / P007 / ".open-0123abcd.json").write_text(OF_ANOTHER_MACHINE)
    assert verify(study).running == 1
    assert told(study) == ""
    harm(study / P007 / "journal.jsonl")
    assert sentence in told(study)


def test_a_marker_of_another_machine_hides_no_forgery_from_fingerprints(study: Path, tmp_path: Path) -> None:
    """A session that is listed had ended and cannot run, whatever its marker says."""
    cut_the_journal(study)
    (study / P007 / ".open-0123abcd.json").write_text(OF_ANOTHER_MACHINE)
    assert verify(study).running == 1
    for copy in (None, tmp_path / "kept.txt"):
        assert f"{P007}: is not the session that" in told(study, copy)


def test_an_unfinished_session_with_a_changed_line_does_not_go_on(
    tmp_path: Path, start: Start, attend: Attend, protocol: Protocol
) -> None:
    with start() as store:
        attend(store)
    check_can_go_on(store.folder.path, protocol, SOURCE)
    before = store.folder.journal.read_bytes()
    store.folder.journal.write_bytes(before.replace(b'"value":7', b'"value":1', 1))
    with pytest.raises(StoreError, match="was written after another line than the one before it"):
        check_can_go_on(store.folder.path, protocol, SOURCE)
    store.folder.journal.write_bytes(before)
    forge(store.folder.journal, lambda lines: lines[0].pop("format"), chained=False)
    with pytest.raises(StoreError, match="lacks format: it was changed"):
        check_can_go_on(store.folder.path, protocol, SOURCE)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("started_at", "2020-01-01T00:00:00+00:00"),
        ("ended_at", "2020-01-01T00:00:00+00:00"),
        ("reason", "tired"),
        ("device", {"name": "falcon"}),
        ("clock", {"origin_ns": 1, "origin_at": "2020-01-01T00:00:00+00:00"}),
        ("resumed", [{"at": "2020-01-01T00:00:00+00:00"}]),
        ("generator", "dice"),
        ("versions", {"liquid-study": "99.0"}),
        ("resumed", [1]),
        ("resumed", [{"at": []}]),
        ("protocol", {}),
        *(("protocol", {"sequence": steps}) for steps in (7, "consent", {"a": 1}, [[]])),
    ],
)
def test_a_changed_receipt_of_an_unfinished_session_is_found(
    tmp_path: Path, start: Start, attend: Attend, field: str, value: Any
) -> None:
    with start("P007") as store:
        attend(store)
    assert verify(tmp_path / "study").errors == ()
    of_receipt(tmp_path / "study", **{field: value})
    assert field in told(tmp_path / "study")


def test_a_session_that_was_aborted_before_its_last_page_came_again_is_sound(
    tmp_path: Path, start: Start, tables_of_study: Tables
) -> None:
    tables = tables_of_study()
    tables["sequence"] = [*tables["sequence"], "consent"]
    store = start(protocol=Protocol.model_validate(tables))
    store.append(events.PageShown(page="consent"))
    store.append(events.PageLeft(page="consent"))
    store.finish("aborted", "tired")
    found = verify(tmp_path / "study")
    assert (found.errors, found.warnings) == ((), ())


@pytest.mark.parametrize(
    ("removed", "number"),
    [
        (lambda line: line["event"] == "responses", 2),
        (lambda line: line["event"] == "form_answered", 2),
        (lambda line: line["event"] == "form_answered" and line["form"] == "end", 1),
        (lambda line: line["event"] in ("form_answered", "choice", "item_shown"), 2),
    ],
)
def test_a_removed_confirmation_is_found_where_the_session_went_on(
    tmp_path: Path, removed: Callable[[dict[str, Any]], bool], number: int
) -> None:
    """Also of a session that was completed right after it, and whose last form has no answer."""
    felt = {("stir", name): (TrialFeatures(1.0, 4.0, 0.1, 0.02, 0.03, 0.0),) for name in ("thin", "thick")}
    shorter = 'sequence = ["start", "stir", "load", "usability", "end"]', 'sequence = ["start", "stir", "end"]'
    file = mixed_file(tmp_path, shorter)
    study = rehearse_answers(file, participants=1, seed=1, results=tmp_path / "mixed", features=felt)
    assert verify(study).errors == ()
    journal = study / "data" / "sub-P001" / "ses-01" / "journal.jsonl"

    def edit(lines: Lines) -> None:
        lines[:] = [line for line in lines if not removed(line)]

    forge(journal, edit)
    cover_up(study)
    assert told(study).count("which was never confirmed: a line was removed") == number


def test_a_session_that_left_its_last_page_was_not_aborted(tmp_path: Path) -> None:
    study = rehearse_answers("demo", participants=1, seed=1, results=tmp_path / "demo", features=made_up("demo"))
    session = study / "data" / "sub-P001" / "ses-01"
    forge(session / "journal.jsonl", lambda lines: lines[-1].update(status="aborted"))
    receipt.write(session / "receipt.json", receipt.read(session / "receipt.json") | {"status": "aborted"})
    cover_up(study)
    assert "its status is 'aborted', though the last page was left: it was changed" in told(study)


def test_a_fingerprint_is_what_the_documentation_says(study: Path) -> None:
    """It can be computed without this program: SHA-256 of some lines of the list, in base32."""
    proofs = listed(StudyFolder(study).fingerprints)
    assert proofs
    for proof, place in proofs:
        lines = (study / place / "checksums.sha256").read_text().splitlines(keepends=True)
        proved = "".join(line for line in lines if "_data.csv" not in line and "rebuilt.txt" not in line)
        letters = base64.b32encode(hashlib.sha256(proved.encode()).digest()).decode().lower()
        assert proof.replace("-", "") == letters[:12]


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (None, "is not a file: name a copy"),
        (b"", "has no fingerprint"),
        (b"\xff\n", "line 1 is not a fingerprint: a line must be such as"),
        (b"k3vq-7m2p-xw4d data/sub-P007/ses-01\nx\n", "line 2 is not a fingerprint"),
    ],
)
def test_a_copy_that_is_none_is_named(study: Path, tmp_path: Path, content: bytes | None, sentence: str) -> None:
    path = tmp_path / "copy.txt"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(StoreError, match=sentence):
        verify(study, path)


def test_the_command_compares_with_the_copy(study: Path, tmp_path: Path) -> None:
    words = ["verify", str(study), "--fingerprints", str(tmp_path / "kept.txt")]
    done = CliRunner().invoke(commands, words)
    assert (done.exit_code, done.output.splitlines()[-1]) == (0, "2 sessions: sound")
    forget_a_participant(study)
    cover_up(study)
    done = CliRunner().invoke(commands, words)
    assert (done.exit_code, done.output.splitlines()[-1]) == (3, "1 session: not sound")
    assert f"error: {P007}: is missing, but" in done.output


def test_a_torn_reveal_is_a_warning_and_opens_no_key(study: Path) -> None:
    blinding.reveal(study, "AB", "done")
    path = StudyFolder(study).reveals
    path.write_bytes(path.read_bytes()[:-9])
    assert blinding.revealed_key(study) is None
    assert told(study) == ""
    assert "line 1 is not a reveal: it is incomplete" in "\n".join(map(str, verify(study).warnings))
