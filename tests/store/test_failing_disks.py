"""Every writer of the store on a disk that fails at each of its calls in turn, is full, or whose program is killed.

Afterwards the results are sound, or the same command makes them so; the exit code says which; nothing is recorded
twice; and whatever was written was on the disk before what follows from it.
"""

import ast
import hashlib
import json
import os
import platform
import queue
import re
import shutil
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, get_args
from unittest import mock

import pytest
from click.testing import CliRunner

import study_app
from study_app import api, program_log
from study_app.cli import commands
from study_app.errors import StudyError
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store import exclusions, support, workstation
from study_app.store.files import atomic, csv_files, output_files
from study_app.store.files.atomic import temporary_path
from study_app.store.files.folders import StudyFolder
from study_app.store.integrity import folder_lock
from study_app.store.journals import journal_events as events
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.recovery import rebuild_session, reopen_store
from study_app.store.sites.merge import merge_sites
from study_app.store.upgrade import upgrade
from study_app.store.verification.proofs import write_proof
from study_app.store.verification.whole_study import verify_study
from study_app.store.versions import drafts, study_settings, study_versions
from study_app.workspace import Workspace
from tests import studies
from tests.journal_lines import event_of
from tests.platforms import needs_posix
from tests.protocol.groups.grouped import GROUPS, STUDY, grouped
from tests.store.conftest import SOURCE, attended, begun, made_samples, study_tables, ticking_clock
from tests.store.recorded_disk import Call, Disk, Fault, KilledError
from tests.studies import made_up

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="the system does not name open files"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),  # a killed program closes no file,
    pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning"),  # and its threads end
]

SESSION = "study/data/sub-P007/ses-01"
LISTS = (
    "blinding/reveals.jsonl",
    "withdrawals.jsonl",
    "exclusions.csv",
    "exclusions_reversed.jsonl",
    "fingerprints.txt",
)
WHO = ("--by", "AB", "--reason", "a reason")
TRIAL: Final = {"trial": 1, "attempt": 1}
OF_TRIAL: Final[dict[str, Any]] = {"block": "b", "phase": "main", "part": 1, "index": 1, "of": 1, "code": "L1"}
OF_P008 = ("--participant", "P008")


@dataclass(frozen=True)
class Writer:
    """A function that writes below a folder: ``prepare`` runs before it, and ``act`` can be repeated."""

    act: Callable[[Path], object]
    prepare: Callable[[Path], object] = lambda _: None
    results: str = "study"
    """The folder that `verify` judges."""
    remedy: str = "impossible"
    """Part of each error of `verify` after a fault."""


def command(*words: str) -> Callable[[Path], object]:
    """Return a function that runs a command; FOLDER in ``words`` is the folder."""

    def run(folder: Path) -> int:
        result = CliRunner().invoke(commands, [word.replace("FOLDER", str(folder)) for word in words])
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result.exit_code

    return run


exclude = command("exclude", "FOLDER/study", *OF_P008, "--session", "1", *WHO)


def prepare_withdrawal(folder: Path) -> None:
    for _ in range(2):
        exclude(folder)
        command("include", "FOLDER/study", *OF_P008, "--session", "1", *WHO)(folder)
    exclude(folder)
    (folder / "study/.psychds-ignore").write_text("", encoding="utf-8", newline="\n")
    output_files.write_output(folder / "study", folder / "study/report", {"report.html": b"P008"})


def lose_files(folder: Path) -> None:
    for path in (*(folder / SESSION).glob("*_data.csv"), folder / SESSION / "checksums.sha256"):
        path.unlink()
    atomic.write_file(
        fingerprints := folder / "study/fingerprints.txt", fingerprints.read_bytes().splitlines(keepends=True)[1]
    )
    temporary_path(folder / SESSION / "receipt.json").write_text("half", encoding="utf-8", newline="\n")


def merge_one(folder: Path) -> None:
    shutil.copytree(folder / "study", folder / "other")
    shutil.rmtree(folder / "other/data")
    merge_sites({"A": folder / "study"}, folder / "pooled")
    shutil.rmtree(folder / "other")
    hold_session(folder, results="other")


def hold_session(folder: Path, results: str = "study", participant: str = "P009") -> None:
    """Run a session like a program that is restarted after each failure: begin, resume or rebuild it."""
    study = StudyFolder(folder / results)
    session = study.session(participant, 1)
    if session.journal.exists() and session.journal.read_bytes().count(b"session_ended"):
        rebuild_session(session.path)
        return
    if session.journal.exists() and b"\n" in session.journal.read_bytes():
        choices: dict[str, Any] = {"operator": "AB", "device": {}, "screens": {}}
        store = reopen_store(session.path, study_protocol(), SOURCE, **choices)
    else:
        store = begun(study.path, participant, recordings=True, clock=ticking_clock(), simulated=True)
    with store:
        if not any(line.event == "trial_started" for line in store.lines):
            store.append(events.TrialStarted(**TRIAL, **OF_TRIAL))
            record_trial(store)
        if not any(line.event == "trial_ended" for line in store.lines):
            store.append(event_of("trial_ended", **TRIAL, outcome="complete"))
        store.write_tables()
        store.finish("withdrawn")


def record_trial(store: SessionStore) -> None:
    if store.recorder is not None:
        store.recorder.start(1, 1, 1000.0)
        store.recorder.append(made_samples(50))
        store.recorder.stop()


def study_protocol() -> Any:
    from study_app.protocol.model import Protocol

    return Protocol.model_validate(study_tables())


def save_edits(folder: Path) -> None:
    """Keep a draft, then save the study."""
    file = folder / "edited.toml"
    keeper = drafts.Keeper(file, base=study_versions.content_hash(file.read_bytes()))
    keeper.note_edit("[study]\n", (), 0.0)
    keeper.write()
    base = study_versions.content_hash(file.read_bytes())
    keeper.note_saved(study_versions.save_study(file, "[study]\n", base))
    study_settings.keep_original(file, "demo")


def keep_settings(folder: Path) -> None:
    workstation.keep_workspace(Workspace(folder / "workspace"))


def write_small_files(folder: Path) -> None:
    with mock.patch.object(program_log.logging.getLogger("study_app"), "handlers", []):
        program_log.start_log()
    csv_files.write_columns(folder / "table.csv", made_table())
    support.write_support_archive(folder / "support.zip")
    atomic.probe_free_bytes(folder)
    footage = output_files.FileCopy(folder / "waves.mp4", hashlib.sha256(b"waves").hexdigest())
    output_files.write_output(folder / "study", folder / "report", {"report.html": b"report", "waves.mp4": footage})
    atomic.copy_folder(folder / "study/blinding", folder / "copied") if not (folder / "copied").exists() else None


def made_table() -> Any:
    import numpy as np

    return np.rec.fromarrays([[1.0, 2.0]], names=["t_s"])


def spoil_settings(_folder: Path) -> None:
    workstation.settings_file().parent.mkdir(exist_ok=True)
    workstation.settings_file().write_text("no settings", encoding="utf-8", newline="\n")


def leave_session(folder: Path) -> None:
    """Leave a session in its first trial, with half a line, and half of a recording that the journal lacks."""
    store = begun(folder / "study", "P009", recordings=True, clock=ticking_clock(), simulated=True)
    store.append(events.TrialStarted(**TRIAL, **OF_TRIAL))
    record_trial(store)
    store.close()
    lines = store.folder.journal.read_bytes().splitlines(keepends=True)
    other_lines = [line for line in lines if b'"recorded"' not in line]
    (store.folder.recordings / "trial-001.parquet").unlink()
    store.folder.journal.write_bytes(b"".join(other_lines) + b'{"n":')


def leave_claims(folder: Path) -> None:
    """Leave a claimed but unstarted session, an unfinished claim, and an old temporary file."""
    for path in ("sub-P009/ses-01", f"sub-P009/{temporary_path(Path('ses-01')).name}"):
        (folder / "study/data" / path).mkdir(parents=True)
    for path in (folder / "study/data/sub-P009").iterdir():
        (path / "receipt.json").write_text("{}", encoding="utf-8", newline="\n")
        os.utime(path, (0, 0))
    (old := temporary_path(folder / "study/data/table")).write_text("half", encoding="utf-8", newline="\n")
    os.utime(old, (0, 0))


def refuse_session(folder: Path) -> None:
    """Begin a session in a folder whose table of participants cannot be written."""
    (folder / "study/data/study-brackish_description-participants_data.csv").unlink(missing_ok=True)
    (folder / "study/data/study-brackish_description-participants_data.csv").mkdir(exist_ok=True)
    with pytest.raises(StudyError, match="cannot be written"):
        begun(folder / "study", "P010", simulated=True)


def hold_grouped_session(folder: Path) -> None:
    source = (STUDY + GROUPS).encode()
    studies.begun(folder / "grouped", "P001", grouped(), source, device={"name": "scripted"}).close()


def rehearse(folder: Path) -> None:
    rehearse_answers("demo", participants=1, seed=1, results=folder / "rehearsed", features=made_up("demo"))


def keep_proof(folder: Path) -> None:
    (folder / "proofs").mkdir(exist_ok=True)
    workstation.save_settings(workstation.MachineSettings(proofs=str(folder / "proofs")))
    proof_lines = queue.Queue[str]()
    write_proof(StudyFolder(folder / "study"), proof_lines.put)
    assert proof_lines.get(timeout=20).startswith("the study's proof was written to")


PRIMITIVES: Final = {
    *("write_file", "append_line", "write_new_file", "create_folder", "copy_folder", "make_folder", "write_all"),
    *("remove_temporary_files", "remove_old_temporary_files", "probe_free_bytes", "write_whole"),
    *(".unlink", ".rename", ".rmtree", ".mkdir", ".rmdir", ".copytree", ".copyfileobj", ".truncate", ".chmod"),
}


def discovered() -> set[str]:
    """Return the functions of the store that change the disk themselves, as "atomic.py:write_file"."""
    store = Path(study_app.__file__).parent / "store"
    return {
        f"{path.relative_to(store)}:{name}"
        for path in store.rglob("*.py")
        for name, node in functions_in(ast.parse(path.read_text(encoding="utf-8")))
        if not PRIMITIVES.isdisjoint(called_in(node))
    }


def functions_in(node: ast.AST, within: str = "") -> Iterator[tuple[str, ast.FunctionDef]]:
    for inner in ast.iter_child_nodes(node):
        if isinstance(inner, ast.FunctionDef):
            yield f"{within}{inner.name}", inner
        if isinstance(inner, ast.ClassDef):
            yield from functions_in(inner, f"{inner.name}.")


def called_in(function: ast.FunctionDef) -> Iterator[str]:
    for node in ast.walk(function):
        if isinstance(node, ast.Call):
            called = node.func
            yield (
                called.id
                if isinstance(called, ast.Name)
                else f".{called.attr}"
                if isinstance(called, ast.Attribute)
                else ""
            )


WRITERS: Final = {
    "exclude": Writer(exclude),
    "include": Writer(command("include", "FOLDER/study", *OF_P008, "--session", "1", *WHO), exclude),
    "keep": Writer(
        lambda folder: exclusions.keep(folder / "study", "P008", 1, rule="below_chance", by="AB", reason="r") and None
    ),
    "unblind": Writer(command("unblind", "FOLDER/study", *WHO), remedy="unblind again"),
    "withdraw": Writer(
        command("withdraw", "FOLDER/study", *OF_P008, *WHO), prepare_withdrawal, remedy="withdraw again"
    ),
    "rebuild": Writer(command("rebuild", f"FOLDER/{SESSION}"), lose_files, remedy="rebuild"),
    "merge": Writer(command("merge", "A=FOLDER/study", "--to", "FOLDER/pooled"), results="pooled"),
    "merge a further site": Writer(
        command("merge", "B=FOLDER/other", "--to", "FOLDER/pooled"), merge_one, results="pooled"
    ),
    "session": Writer(hold_session, remedy="rebuild"),
}


def upgrade_liquid(folder: Path) -> None:
    """Upgrade a liquid file of format 1."""
    (folder / "liquid.toml").write_text("[liquids.water]\ndensity_kg_m3 = 1000\n", encoding="utf-8", newline="\n")
    upgrade(folder / "liquid.toml")


OTHERS: Final = {
    "edits": Writer(
        save_edits, lambda folder: (folder / "edited.toml").write_text("[study]", encoding="utf-8", newline="\n")
    ),
    "settings": Writer(keep_settings, spoil_settings),
    "small files": Writer(write_small_files, lambda folder: (folder / "waves.mp4").write_bytes(b"waves")),
    "resumed session": Writer(hold_session, leave_session),
    "session in a claimed folder": Writer(hold_session, leave_claims),
    "refused session": Writer(refuse_session),
    "session of a group": Writer(hold_grouped_session),
    "simulated sessions": Writer(rehearse),
    "proof": Writer(keep_proof),
    "upgrade": Writer(upgrade_liquid),
}
"""Further writers, of which it is only recorded which functions change the disk."""

WRITTEN_IN_PLACE: Final = {"fingerprints.txt", "rebuilt.txt", "001.json", "liquid.toml"}
"""Lists that grow by lines, a marker that a program owns alone, and what `upgrade_liquid` upgrades."""


@pytest.fixture(scope="module")
def studied(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a study of two sessions, of which one has recordings; do not change it."""
    folder = tmp_path_factory.mktemp("studied")
    with mock.patch("os.fsync"):
        for participant in ("P007", "P008"):
            store = begun(folder / "study", participant, recordings=participant == "P007", simulated=True)
            record_trial(store)
            attended(store)
            store.finish("completed")
    assert verify_study(folder / "study").is_sound
    return folder


def run(writer: Writer, folder: Path) -> tuple[int, str]:
    """Return the exit code and the message of a writer."""
    try:
        code = writer.act(folder)
    except StudyError as error:
        return 2, str(error)
    return (code if isinstance(code, int) else 0), ""


def counts_of_records(results: Path) -> dict[str, int]:
    """Return how many lines each list of a results folder has, and how many times each journal has each event."""
    counts = {name: len((results / name).read_bytes().splitlines()) for name in LISTS if (results / name).exists()}
    for path in results.rglob("journal.jsonl"):
        names = (
            json.loads(line)["event"].replace("recording_lost", "recorded")
            for line in path.read_text(encoding="utf-8").splitlines()
        )
        of_session = Counter(f"{path.parent.parent.name} {name}" for name in names if name != "session_resumed")
        counts |= of_session
    return counts


@contextmanager
def program_of_its_own(fault: Fault) -> Iterator[None]:
    """Let the locks of a program that is killed be those of a process that has ended."""
    ended = {"host": platform.node(), "pid": 2**22 + 1, "began": 0.0, "at": ""}
    with (
        mock.patch.object(folder_lock, "_this_program", side_effect=lambda: ended)
        if fault == "killed"
        else nullcontext()
    ):
        yield


def problems_after(
    studied: Path, folder: Path, name: str, fault: Fault, at: int, whole: dict[str, int]
) -> Iterator[str]:
    """Yield the problems after a writer met a fault at a call and after it was repeated."""
    writer, disk = WRITERS[name], Disk(folder, fault, at)
    shutil.copytree(studied, folder)
    writer.prepare(folder)
    code, message, before = -9, "", set(folder.rglob(".*.tmp"))
    with program_of_its_own(fault), disk.used(), suppress(KilledError):
        code, message = run(writer, folder)
    if not disk.happened:
        raise StopFaults
    code = -9 if fault == "killed" else code
    results = folder / writer.results
    left = [str(error) for error in verify_study(results).errors] if results.exists() else []
    if code == 0 and (left or counts_of_records(results) != whole):
        yield f"exit code 0, though not everything is done: {left}"
    if code == 2 and not message:
        yield "exit code 2 without a message"
    yield from (f"verify does not name the remedy: {error}" for error in left if writer.remedy not in error)
    if fault != "killed":
        yield from (f"{path.name} is left" for path in set(folder.rglob(".*.tmp")) - before)
    if code != 0:
        code, message = run(writer, folder)
        if code != 0 and not re.search("already|has been excluded since|is not excluded", message):
            yield f"the same command fails: {code} {message}"
        yield from (f"unsound: {error}" for error in verify_study(results).errors)
        if (counts := counts_of_records(results)) != whole:
            yield f"recorded {dict(counts.items() ^ whole.items())}"


class StopFaults(Exception):
    """There was no call with this number."""


@pytest.mark.usefixtures("user")
def test_an_output_that_cannot_be_listed_is_mentioned(studied: Path, tmp_path: Path) -> None:
    (tmp_path / "user").write_text("a file is where the list's folder should be", encoding="utf-8", newline="\n")
    warnings: list[str] = []
    output_files.write_output(studied / "study", tmp_path / "report", {"report.html": b"report"}, warnings.append)
    assert (tmp_path / "report/report.html").read_bytes() == b"report"
    assert "so the withdraw command will not list it" in warnings[0]


@needs_posix
@pytest.mark.usefixtures("user")
def test_the_python_interface_reports_an_incomplete_unblinding(studied: Path, tmp_path: Path) -> None:
    shutil.copytree(studied, tmp_path / "copy")
    study = tmp_path / "copy/study"
    full = Disk(study, "full", 20)
    with full.used(), pytest.raises(StudyError, match=r"the key was opened, but .* cannot be .*unblind again"):
        api.unblind(study, by="AB", reason="a reason")
    assert not verify_study(study).is_sound
    api.unblind(study, by="AB", reason="a reason")
    assert verify_study(study).is_sound


@pytest.fixture
def user(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for variable in ("CONFIG", "DATA"):
        monkeypatch.setenv(f"LIQUID_STUDY_{variable}", str(tmp_path / "user"))


FAULTS: Final = [fault for fault in get_args(Fault) if fault != "none"]


def check_faults(studied: Path, folder: Path, name: str, fault: Fault, calls: Iterable[int]) -> None:
    """Run a writer with a fault at each of its calls."""
    shutil.copytree(studied, folder / "whole")
    WRITERS[name].prepare(folder / "whole")
    assert run(WRITERS[name], folder / "whole")[0] == 0
    whole, problems = counts_of_records(folder / "whole" / WRITERS[name].results), list[str]()
    for at in calls:
        try:
            faults = list(problems_after(studied, folder / str(at), name, fault, at, whole))
        except StopFaults:
            break
        problems += [f"{fault} at call {at}: {problem}".replace(str(folder), "~") for problem in faults]
        shutil.rmtree(folder / str(at))
    assert problems == []


@pytest.mark.slow
@pytest.mark.usefixtures("user")
@pytest.mark.parametrize("name", WRITERS)
def test_some_faults(studied: Path, tmp_path: Path, name: str) -> None:
    """Calls that differ with the writer and the fault; the nightly test has all."""
    for number, fault in enumerate(FAULTS):
        check_faults(studied, tmp_path / str(number), name, fault, range(9 * number + len(name), 1000, 97))


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.usefixtures("user")
@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("name", WRITERS)
def test_every_fault(studied: Path, tmp_path: Path, name: str, fault: Fault) -> None:
    check_faults(studied, tmp_path, name, fault, range(1000))


def early_changes(calls: list[Call]) -> Iterator[str]:
    """Yield each change that depends on an unflushed earlier one, and each change that is never flushed.

    A file's content is on the disk once the file is flushed; its name or removal, and a new folder, once the folder
    around is. Under a temporary name nothing counts until that is renamed.
    """
    unflushed: dict[tuple[Path, Path], str] = {}  # the call by what was changed, and what must be flushed for it
    for call in calls:
        if call.name == "fsync":
            unflushed = {pair: name for pair, name in unflushed.items() if pair[1] != call.path}
            continue
        removes = call.name in ("unlink", "rmdir")
        if (removed_path := call.path if removes else call.old) is not None:
            if not removes and any(flushed.is_relative_to(removed_path) for _, flushed in unflushed):
                yield f"{call.path.name} takes its place before its content is flushed"
            unflushed = {pair: name for pair, name in unflushed.items() if not pair[0].is_relative_to(removed_path)}
        if not (is_hidden(call.path) or call.name == "mkdir"):
            unordered = ("mkdir", "unlink", "rmdir") if removes else ("mkdir",)
            for (changed, _), name in unflushed.items():
                if changed != call.path and name not in unordered and not is_hidden(changed):
                    yield f"{call.path.name} is {'removed' if removes else 'written'} before {changed.name} is flushed"
        flushed = call.path if call.name in ("write", "truncate") else call.path.parent
        unflushed[call.path, flushed] = call.name
    yield from (f"{path.name} is not flushed at the end" for path, _ in unflushed if not is_hidden(path))


def is_hidden(path: Path) -> bool:
    """Return whether a path is temporary, or the marker of a running program, or lies below one."""
    return any(part.startswith(".") and part.endswith((".tmp", ".json")) for part in path.parts)


def recorded_disk(studied: Path, folder: Path, writer: Writer) -> Disk:
    """Return the disk after a writer used it without a fault."""
    shutil.copytree(studied, folder)
    writer.prepare(folder)
    disk = Disk(folder.parent)
    with disk.used():
        assert run(writer, folder) == (0, "")
    return disk


@pytest.mark.slow
@pytest.mark.usefixtures("user")
def test_files_are_flushed_before_files_that_depend_on_them(studied: Path, tmp_path: Path) -> None:
    """Except the tables of a session that runs, which follow from its journal."""
    for name, writer in WRITERS.items():
        calls = recorded_disk(studied, tmp_path / name, writer).calls
        of_results = [call for call in calls if call.path.is_relative_to(tmp_path / name)]
        if name == "session":
            of_results = [call for call in of_results if "subject-P009" not in call.path.name]
        assert list(early_changes(of_results)) == [], name
    calls = recorded_disk(studied, tmp_path / "outputs", OTHERS["small files"]).calls
    early = list(early_changes([call for call in calls if call.path.is_relative_to(tmp_path / "outputs")]))
    assert [line for line in early if "takes its place" in line] == []
    copied = {path.name for path in (tmp_path / "outputs/copied").rglob("*")}
    assert copied - {call.path.name for call in calls if call.name == "fsync"} == set()
    disk = Disk(tmp_path)
    with disk.used():
        atomic.make_folder(tmp_path / "new" / "results")
    assert list(early_changes(disk.calls)) == []


@pytest.mark.slow
@pytest.mark.usefixtures("user")
def test_every_function_of_the_store_that_changes_the_disk_is_used_here(studied: Path, tmp_path: Path) -> None:
    """A new writer needs a line in `WRITERS`, or in `OTHERS` if it writes no results; only lists are not replaced."""
    disks = {name: recorded_disk(studied, tmp_path / name, writer) for name, writer in {**WRITERS, **OTHERS}.items()}
    names = [call.path.name if call.name == "write" else "" for call in disks["session"].calls]
    torn = Disk(tmp_path, "full", names.index("journal.jsonl"))
    shutil.copytree(studied, tmp_path / "torn")
    with torn.used(), pytest.raises(StudyError, match=r"journal\.jsonl cannot be written"):
        hold_session(tmp_path / "torn")
    paths = {call.path.relative_to(tmp_path) for disk in disks.values() for call in disk.calls if call.name == "write"}
    in_place = {path.name for path in paths if not any(part.startswith(".") for part in path.parts)}
    assert {name for name in in_place if not name.endswith(".jsonl")} == WRITTEN_IN_PLACE
    assert discovered() - set[str]().union(*(disk.writers for disk in (*disks.values(), torn))) == set()
