"""Participants come into groups: one entry each, whoever begins at the same time or is killed, and sealed."""

import contextlib
import json
import re
import signal
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from study_app.errors import StoreError, StudyError
from study_app.protocol.orders.schedule import stream
from study_app.protocol.simulated import NO_FEATURES
from study_app.session.resume import begun_schedule
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.session.simulated.rehearsal import ConditionFeatures
from study_app.store.blinded import allocation
from study_app.store.blinded.allocation import allocate, allocation_of, claims, session_protocol, simulated_groups
from study_app.store.blinded.blinding import open_or_draw_key
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.journals.journal_events import start_of
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.recovery import reopen_store
from study_app.store.unblinding import unblind
from study_app.store.verification.reproduction import reproduce_session
from study_app.store.verification.whole_study import verify_study
from tests import studies
from tests.faults.support.killer import die, forked
from tests.faults.support.racers import race
from tests.journal_lines import raw
from tests.platforms import needs_fork, needs_links
from tests.protocol.groups.grouped import GROUPS, STUDY, grouped

SOURCE = (STUDY + GROUPS).encode()
GROUP_NAMES = ("first_thin", "first_thick")
PREEXISTING = ('study.name = "grouped"\n', 'study.name = "grouped"\nstudy.group_assignment = "pre-existing"\n')


def begin_session(folder: Path, participant: str, session: int = 1) -> SessionStore:
    who = {"seed": 11, "operator": "AB", "device": {"name": "scripted"}, "session": session}
    return studies.begun(folder, participant, grouped(), SOURCE, **who)


def events(store: SessionStore) -> list[str]:
    return [line.event for line in store.lines]


def test_participants_have_entries_in_the_order_of_their_first_sessions(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[Path] = []
    monkeypatch.setattr(allocation, "sync_folder", synced.append)
    for number, participant in enumerate(("P009", "P001", "X"), start=1):
        with begin_session(tmp_path / "s", participant) as store:
            assert store.lines[0].entry == number
            assert events(store) == ["session_started", "allocated"]
            assert allocate(StudyFolder(tmp_path / "s"), store.key, participant).entry == number  # type: ignore[union-attr]
    (StudyFolder(tmp_path / "s").allocated / "notes.json").write_text("{}", encoding="utf-8", newline="\n")
    assert [claim.participant for claim in claims(StudyFolder(tmp_path / "s"))] == ["P009", "P001", "X"]
    assert synced == [StudyFolder(tmp_path / "s").allocated] * 3, "before they count"
    (StudyFolder(tmp_path / "s").allocated / "notes.json").unlink()
    assert not verify_study(tmp_path / "s").errors


def test_a_participant_keeps_the_group_in_session_2(tmp_path: Path) -> None:
    study = StudyFolder(tmp_path / "s")
    groups = {}
    for participant in ("P001", "P002"):
        for session in (1, 2):
            with begin_session(study.path, participant, session) as store:
                allocation = allocation_of(study, store.key, participant)
                assert allocation is not None
                assert groups.setdefault(participant, allocation.group) == allocation.group
                assert ("allocated" in events(store)) == (session == 1), "once per participant"
    assert set(groups.values()) == set(GROUP_NAMES)
    own = session_protocol(study, grouped(), "P002", 2)
    assert own.sequence == grouped().for_session(groups["P002"], 2).sequence
    assert len(claims(study)) == 2


@pytest.mark.slow
def test_readable_files_do_not_reveal_the_group_of_a_participant(tmp_path: Path) -> None:
    """Folders that differ only in the secret have the same readable content although the groups differ."""
    readable: dict[str, str] = {}
    for number in range(12):
        study = StudyFolder(tmp_path / f"s{number}")
        with begin_session(study.path, "P001") as store:
            allocation = allocation_of(study, store.key, "P001")
            line = next(line for line in raw(store.lines) if line["event"] == "allocated")
            (claim,) = (json.loads(path.read_text("utf-8")) for path in study.allocated.iterdir())
        assert allocation is not None
        assert set(line) == {"n", "event", "t_s", "at", "entry", "sealed", "previous"}
        assert (claim.pop("sealed"), line["sealed"]) == (allocation.sealed, allocation.sealed)
        assert claim == {"entry": 1, "participant": "P001", "place_in_group": True}
        readable[allocation.group] = allocation.sealed
        receipt = json.loads(store.folder.receipt.read_text("utf-8"))
        assert "entry" not in receipt
        assert "group" not in receipt
    assert len(readable) == 2
    assert len({len(sealed) for sealed in readable.values()}) == 1, "the length tells nothing"


@pytest.mark.slow
@needs_fork
def test_two_programs_at_once_never_share_an_entry(tmp_path: Path) -> None:
    key, study = open_or_draw_key(tmp_path, grouped()), StudyFolder(tmp_path)

    @contextmanager
    def entered(program: int, number: int) -> Iterator[int]:
        allocation = allocate(study, key, f"{'AB'[program]}{number}", waits=False)
        assert allocation is not None
        yield allocation.entry

    assert sorted(entry for answers in race(entered, 40) for entry in answers) == list(range(1, 81))
    counts = Counter(allocation_of(study, key, claim.participant).group for claim in claims(study))  # type: ignore[union-attr]
    assert counts == dict.fromkeys(GROUP_NAMES, 40)


@needs_fork
@pytest.mark.slow
def test_a_program_killed_between_claim_and_first_line_leaves_a_consistent_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = StudyFolder(tmp_path / "s")
    begin_session(study.path, "P000").close()
    with monkeypatch.context() as patched:
        patched.setattr("study_app.store.sessions.begin.first_records", die)
        assert forked(lambda: begin_session(study.path, "P001")) == -signal.SIGKILL
    assert [claim.participant for claim in claims(study)] == ["P000", "P001"]
    verification = verify_study(study.path)
    assert not verification.errors
    assert any("who does not have a session yet" in str(warning) for warning in verification.warnings)
    with begin_session(study.path, "P002") as other, begin_session(study.path, "P001") as store:
        assert (store.lines[0].entry, other.lines[0].entry) == (2, 3)
        assert "allocated" in events(store)


def test_a_session_resumed_before_its_allocation_was_journalled_journals_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patched:
        patched.setattr("study_app.store.sessions.begin.note_allocation", lambda _: None)
        with begin_session(tmp_path / "s", "P001") as store:
            assert events(store) == ["session_started"]
    with reopen_store(store.folder.path, grouped(), SOURCE, operator="", device={}, screens={}) as again:
        assert events(again)[-1] == "allocated"
    with reopen_store(store.folder.path, grouped(), SOURCE, operator="", device={}, screens={}) as again:
        assert events(again).count("allocated") == 1


@pytest.mark.slow
def test_verify_names_entries_that_were_removed_changed_or_doubled(tmp_path: Path) -> None:
    study = StudyFolder(tmp_path / "s")
    for participant in ("P001", "P002", "P003"):
        with begin_session(study.path, participant):
            pass
    first, second, third = sorted(study.allocated.iterdir())
    content = [path.read_text("utf-8") for path in (first, second, third)]

    def errors() -> str:
        return "\n".join(str(error) for error in verify_study(study.path).errors)

    assert errors() == ""
    second.unlink()
    assert "is missing, although participant P002 has entry 2" in errors()
    with pytest.raises(StoreError, match=r"\b002\.json is missing, although participant P002 has entry 2"):
        begin_session(study.path, "P002", 2)
    second.write_text(content[0].replace('"entry": 1', '"entry": 2'), encoding="utf-8", newline="\n")
    assert "002.json: has been changed" in errors()
    second.write_text(content[1], encoding="utf-8", newline="\n")
    third.write_text(content[2].replace("P003", "P004"), encoding="utf-8", newline="\n")
    assert "has been changed" in errors()
    with pytest.raises(StoreError, match="restore it from a backup"):
        begin_session(study.path, "P003", 2)
    third.write_text(re.sub('"sealed": "[^"]*"', '"group": "first_thin"', content[2]), encoding="utf-8", newline="\n")
    assert "003.json: has been changed" in errors()
    third.write_text(content[2], encoding="utf-8", newline="\n")
    first.write_text(re.sub(r'(..)"}', '00"}', content[0]), encoding="utf-8", newline="\n")
    with pytest.raises(StoreError, match="has been changed: restore it from a backup"):
        begin_session(study.path, "P001", 2)
    first.write_text(content[0], encoding="utf-8", newline="\n")
    key = open_or_draw_key(study.path, grouped())
    extra = allocate(study, key, "P009")
    assert extra is not None
    (study.allocated / "004.json").write_bytes(b"")  # of a program that ended before it wrote it
    with begin_session(study.path, "P005") as store:
        assert store.lines[0].entry == 5
    assert errors() == ""
    assert "it will remain unused" in "\n".join(map(str, verify_study(study.path).warnings))
    (study.allocated / "\u00b2.json").write_text("{}", encoding="utf-8", newline="\n")  # a digit that int() refuses
    assert errors() == ""


@needs_links
def test_an_entry_that_cannot_be_read_counts_as_changed(tmp_path: Path) -> None:
    study = StudyFolder(tmp_path / "s")
    with begin_session(study.path, "P001"):
        pass
    (loop := study.allocated / "006.json").symlink_to(loop)
    (error,) = verify_study(study.path).errors
    assert str(error) == "blinding/allocated/006.json: has been changed: restore it from a backup"


def test_a_session_that_the_group_does_not_have_is_refused_before_anything_is_claimed(tmp_path: Path) -> None:
    study = grouped(("format = 2\n", 'format = 2\nsequences = [["hello", "thin"], ["thick", "end"]]\n'), groups="")
    with pytest.raises(StudyError, match="permitted: 1 to 2"):
        studies.begun(tmp_path / "s", "P001", study, SOURCE, session=3)
    assert not (tmp_path / "s").exists()


def test_a_session_that_the_participants_own_group_does_not_have_is_refused(tmp_path: Path) -> None:
    """The second group has three sessions and the first one two; a participant's group is drawn in session 1."""
    groups = GROUPS.replace('sequence = ["hello", "thin", "thick", "end"]', 'sequences = [["hello", "thin"], ["end"]]')
    groups = groups.replace('sequence = ["hello", "thick", "thin"]', 'sequences = [["hello"], ["thick"], ["thin"]]')
    protocol, folder = grouped(groups=groups), StudyFolder(tmp_path / "s")
    permitted = {}
    for participant in ("P001", "P002"):
        with studies.begun(folder.path, participant, protocol, (STUDY + groups).encode()) as store:
            own_allocation = allocation_of(folder, store.key, participant)
        assert own_allocation is not None
        allocation.check_session(folder, protocol, participant, 2)
        with contextlib.suppress(StudyError):
            allocation.check_session(folder, protocol, participant, 3)
            permitted[own_allocation.group] = participant
    assert permitted.keys() == {"first_thick"}


@pytest.mark.slow
def counting(whole: Callable[[StudyFolder], Any], calls: Counter[str]) -> Callable[[StudyFolder], Any]:
    def counted(study: StudyFolder) -> Any:
        calls[whole.__name__] += 1
        return whole(study)

    return counted


@pytest.mark.slow
def test_the_entries_are_read_once_however_many_participants_follow(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = tmp_path / "grouped.toml"
    source.write_bytes(SOURCE)
    reads = Counter[str]()
    for name in ("claims", "recorded_entries"):
        monkeypatch.setattr(allocation, name, counting(getattr(allocation, name), reads))
    for people in (2, 6):
        rehearse_answers(str(source), participants=people, seed=3, results=tmp_path / str(people), features=_felt())
    assert reads == {"claims": 2 * 2, "recorded_entries": 2}, "before the participants, and once for all of them"
    assert [claim.entry for claim in claims(StudyFolder(tmp_path / "6"))] == [1, 2, 3, 4, 5, 6]


def test_a_rehearsal_allocates_from_its_seed_and_reproduces(tmp_path: Path) -> None:
    source = tmp_path / "grouped.toml"
    source.write_bytes(SOURCE)
    folder = rehearse_answers(str(source), participants=4, seed=3, results=tmp_path / "r", features=_felt())
    study = StudyFolder(folder)
    key = open_or_draw_key(folder, grouped(), stream(3, "blinding").random)
    for session in study.sessions():
        allocation = allocation_of(study, key, session.participant)
        assert allocation is not None
        own = grouped().for_session(allocation.group, 1)
        lines = journal.read(session.journal)
        trials = [line["code"] for line in raw(lines) if line["event"] == "trial_started"]
        assert trials == [trial.code for trial in begun_schedule(own, start_of(lines), key).trials]
        assert reproduce_session(session.path).differences == []
    assert not verify_study(folder).errors
    unblind(folder, "AB", "a test")
    assert not verify_study(folder).errors
    assert verify_study(folder).is_sound
    table = study.participants("grouped").read_text("utf-8").splitlines()
    assert table[0].endswith(",group")
    assert Counter(line.rsplit(",", 1)[1] for line in table[1:]) == dict.fromkeys(GROUP_NAMES, 2)
    trials = study.sessions()[0].table("grouped", "trials").read_text("utf-8").splitlines()
    assert trials[0].endswith(",group")
    assert trials[1].rsplit(",", 1)[1] in GROUP_NAMES


def _felt() -> ConditionFeatures:
    return {(block, condition): (NO_FEATURES,) for block in ("thin", "thick") for condition in ("water", "honey")}


def test_simulated_participants_come_into_pre_existing_groups_by_their_shares(tmp_path: Path) -> None:
    """With shares of one to two, each joins the group furthest below its share, the first one in a tie."""
    shares = GROUPS.replace("[groups.first_thick]\n", "[groups.first_thick]\nshare = 2\n")
    protocol, folder = grouped(PREEXISTING, groups=shares), StudyFolder(tmp_path / "s")
    source = (STUDY.replace(*PREEXISTING) + shares).encode()
    thin, thick = GROUP_NAMES
    new = ("S1", "S2", "S3", "S4", "S5", "S6")
    assert list(simulated_groups(folder, protocol, new, None).values()) == [thin, thick, thick, thin, thick, thick]
    assert simulated_groups(folder, protocol, new[:2], thick) == {"S1": thick, "S2": thick}
    for participant, group, row_of in (("P1", thin, None), ("P2", thin, None), ("P3", thin, "P2")):
        studies.begun(folder.path, participant, protocol, source, group=group, row_of=row_of).close()
    assert simulated_groups(folder, protocol, ("P1", *new), None) == {
        # 2/1 against 0/2: four come into the second one, and then the first in a tie; P1 has a group, P3 only replaces
        "P1": None, "S1": thick, "S2": thick, "S3": thick, "S4": thick, "S5": thin, "S6": thick,
    }  # fmt: skip
    with pytest.raises(StudyError, match="P1 is recorded in group first_thin, not first_thick"):
        simulated_groups(folder, protocol, ("P1",), thick)
    with pytest.raises(StudyError, match="does not have this group; permitted: first_thin, first_thick"):
        simulated_groups(folder, protocol, ("S1",), "third")
    with pytest.raises(StudyError, match="assigns participants to its groups at random; omit the group"):
        simulated_groups(folder, grouped(), ("S1",), thin)
    assert simulated_groups(StudyFolder(tmp_path / "t"), grouped(), ("S1", "S2"), None) == {"S1": None, "S2": None}


def test_a_session_is_that_of_the_participants_group_which_must_be_known(tmp_path: Path) -> None:
    groups = GROUPS.replace('sequence = ["hello", "thin", "thick", "end"]', 'sequences = [["hello", "thin"], ["end"]]')
    groups = groups.replace('sequence = ["hello", "thick", "thin"]', 'sequences = [["hello"], ["thick"], ["thin"]]')
    protocol, folder = grouped(PREEXISTING, groups=groups), StudyFolder(tmp_path / "s")
    source = (STUDY.replace(*PREEXISTING) + groups).encode()
    for participant, group in zip(("P1", "P2"), GROUP_NAMES, strict=True):
        studies.begun(folder.path, participant, protocol, source, group=group).close()
    assert [allocation.planned_sessions(folder, protocol, participant) for participant in ("P1", "P2")] == [2, 3]
    steps = [session_protocol(folder, protocol, *which).steps for which in (("P1", 1), ("P1", 2), ("P2", 2), ("P2", 3))]
    assert steps == [("hello", "thin"), ("end",), ("thick",), ("thin",)]
    unknown = r"participant P9 does not have an entry in .*allocated: restore it from a backup$"
    with pytest.raises(StoreError, match=unknown):
        session_protocol(folder, protocol, "P9", 1)
    with pytest.raises(StoreError, match=unknown):
        allocation.planned_sessions(folder, protocol, "P9")
    study = grouped(("format = 2\n", 'format = 2\nsequence = ["hello", "thin", "thick"]\n'), groups="")
    assert allocation.planned_sessions(folder, study, "P9") == 1
    assert session_protocol(folder, study, "P9", 1).steps == ("hello", "thin", "thick")
