"""Orders are balanced within each group, whoever drops out and is replaced; pre-existing groups are recorded."""

import json
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

import pytest

from study_app.errors import StudyError
from study_app.protocol.load import parse
from study_app.protocol.model import Protocol
from study_app.session.resume import begun_schedule
from study_app.session.start import resumed_choices
from study_app.store.blinded.allocation import allocate, claims
from study_app.store.blinded.blinding import participant_group, read_key
from study_app.store.files.folders import StudyFolder
from study_app.store.journals.journal_events import start_of
from study_app.store.sessions.open_session import SessionStore
from study_app.store.verification.reproduction import reproduce_session
from study_app.store.verification.whole_study import verify_study
from study_app.store.withdrawals import withdraw
from tests import studies
from tests.protocol.groups.grouped import STUDY

GROUPS = """
[groups.experts]
sequence = ["hello", "thin", "thick"]

[groups.novices]
sequence = ["hello", "thin", "thick"]
"""
PREEXISTING = ('study.name = "grouped"\n', 'study.name = "grouped"\nstudy.group_assignment = "pre-existing"\n')


def source_of(*edits: tuple[str, str]) -> bytes:
    """Return the study with experts and novices, in whose sessions the two main blocks are counterbalanced."""
    text = STUDY + GROUPS
    for old, new in (('study.name = "grouped"\n', 'study.name = "grouped"\nstudy.block_order = "balanced"\n'), *edits):
        assert old in text, old
        text = text.replace(old, new)
    return text.encode()


def begin_session(folder: Path, source: bytes, participant: str, **given: object) -> SessionStore:
    return studies.begun(folder, participant, parse(source, "grouped"), source, **given)


def order_of(protocol: Protocol, store: SessionStore) -> tuple[str, ...]:
    """Return block and code of each trial of a session: its order, because the codes are not random here."""
    start = start_of(store.lines)
    own = protocol.for_session(participant_group(start, store.key), start.session)
    return tuple(trial.block for trial in begun_schedule(own, start, store.key).trials)


@dataclass
class Lab:
    """A study whose participants arrive, and sometimes drop out and are replaced."""

    folder: Path
    source: bytes
    orders: dict[str, tuple[str, tuple[str, ...]]] = field(default_factory=dict)  # of those who stayed
    lost: dict[str, str] = field(default_factory=dict)  # the group of each participant to be replaced

    def arrive(self, who: str, group: str | None, row_of: str | None = None, *, stays: bool) -> None:
        protocol = parse(self.source, "grouped")
        with begin_session(self.folder, self.source, who, group=group, row_of=row_of) as store:
            own = participant_group(start_of(store.lines), store.key)
            assert own is not None
            if row_of is not None:
                assert self.lost.pop(row_of) == own, "a replacement takes the group of who is replaced"
            if stays:
                self.orders[who] = own, order_of(protocol, store)
            else:
                self.lost[who] = own

    def counts(self, group: str) -> list[int]:
        order_counts = Counter(order for own, order in self.orders.values() if own == group)
        assert len(order_counts) <= 2
        return [*order_counts.values(), *[0] * (2 - len(order_counts))]


@pytest.mark.parametrize("seed", [1, 2, pytest.param(3, marks=pytest.mark.nightly)])
@pytest.mark.parametrize("edits", [(), (PREEXISTING,)], ids=["randomised", "pre-existing"])
def test_orders_are_even_in_each_group_when_participants_drop_out_and_are_replaced(
    tmp_path: Path, edits: tuple[tuple[str, str], ...], seed: int
) -> None:
    random, lab = Random(seed), Lab(tmp_path / "s", source_of(*edits))  # noqa: S311 - reproducible arrivals
    numbers = iter(random.sample(range(1, 1000), 60))  # so that IDs say nothing about the order
    waiting = 14
    while waiting or lab.lost:
        who = f"P{next(numbers):03d}"
        replaced = random.choice(list(lab.lost)) if lab.lost and (not waiting or random.random() < 0.5) else None
        waiting -= replaced is None
        chosen = lab.lost[replaced] if replaced else random.choice(["experts", "experts", "novices"])
        lab.arrive(who, chosen if edits else None, replaced, stays=random.random() < 0.7)
        if not lab.lost:
            for group in ("experts", "novices"):
                assert abs(int.__sub__(*lab.counts(group))) <= 1, f"{group} after {who}"
    assert len(lab.orders) == 14
    if not edits:
        assert Counter(group for group, _ in lab.orders.values()) == {"experts": 7, "novices": 7}
    assert not verify_study(lab.folder).errors


def test_sixteen_participants_have_each_order_four_times_in_each_group(tmp_path: Path) -> None:
    """With IDs as the place, as in earlier versions, 3:5 and 5:3 came out."""
    lab = Lab(tmp_path / "s", source_of())
    for number in range(1, 17):
        lab.arrive(f"P{number:03d}", None, stays=True)
    assert [lab.counts(group) for group in ("experts", "novices")] == [[4, 4], [4, 4]]


def test_a_preexisting_group_is_recorded_and_never_inferred(tmp_path: Path) -> None:
    source, study = source_of(PREEXISTING), StudyFolder(tmp_path / "s")
    with pytest.raises(StudyError, match=r"the group is missing: .* the group of P001 with --group: experts, novices"):
        begin_session(study.path, source, "P001")
    with pytest.raises(
        StudyError, match="group 'expert': grouped does not have this group; permitted: experts, novices"
    ):
        begin_session(study.path, source, "P001", group="expert")
    assert not study.path.exists()
    with begin_session(study.path, source, "P001", group="novices") as store:
        start = start_of(store.lines)
        assert (start.group, start.entry) == ("novices", 1)
        assert [line.event for line in store.lines] == ["session_started"]
        assert json.loads(store.folder.receipt.read_text("utf-8"))["group"] == "novices"
    assert resumed_choices(store.folder.path, protocol=_written(tmp_path, source)).group == "novices"
    with pytest.raises(StudyError, match="P001 is recorded in group novices, not experts"):
        begin_session(study.path, source, "P001", group="experts", session=2)
    with begin_session(study.path, source, "P001", session=2) as store:
        assert start_of(store.lines).group == "novices"
    assert read_key(study.path).groups == {}, "nothing is drawn"
    table = study.participants("grouped").read_text("utf-8").splitlines()
    assert table[0].endswith(",group")
    assert [line.rsplit(",", 1)[1] for line in table[1:]] == ["novices", "novices"], "shown while the key is sealed"
    variables = json.loads(study.description.read_text("utf-8"))["variableMeasured"]
    assert "group" in [variable["name"] for variable in variables]
    assert not verify_study(study.path).errors
    further = [allocate(study, store.key, who, group=group) for who, group in (("P7", "novices"), ("P8", "experts"))]
    assert [(allocation.group, allocation.entry) for allocation in further if allocation is not None] == [
        ("novices", 2),
        ("experts", 1),
    ]


def _written(folder: Path, source: bytes) -> str:
    path = folder / "grouped.toml"
    path.write_bytes(source)
    return str(path)


def test_a_stated_group_is_refused_if_groups_are_randomised_or_absent(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="group 'experts': grouped assigns participants to its groups at random"):
        begin_session(tmp_path / "s", source_of(), "P001", group="experts")
    with pytest.raises(StudyError, match="group 'experts': demo does not have groups"):
        studies.begun(tmp_path / "demo", "P001", "demo", group="experts")
    assert not (tmp_path / "s").exists()
    assert not (tmp_path / "demo").exists()


def test_a_replacement_needs_a_participant_of_the_same_group(tmp_path: Path) -> None:
    folder, source = tmp_path / "s", source_of(PREEXISTING)
    begin_session(folder, source, "P001", group="experts").close()
    with pytest.raises(StudyError, match="'P001' in group experts cannot be replaced by P002 in group novices"):
        begin_session(folder, source, "P002", group="novices", row_of="P001")
    with pytest.raises(
        StudyError, match="participant 'P009' cannot be replaced: this ID does not exist in this folder"
    ):
        begin_session(folder, source, "P002", group="novices", row_of="P009")
    begin_session(folder, source, "P002", group="experts", row_of="P001").close()
    with pytest.raises(StudyError, match="cannot be replaced: P002 is recorded as replacing P001"):
        begin_session(folder, source, "P002", session=2, row_of="P009")
    with begin_session(folder, source, "P002", session=2) as store:
        assert (start_of(store.lines).row_of, start_of(store.lines).entry) == ("P001", 1)
    assert [(claim.participant, claim.entry, claim.replaces) for claim in claims(StudyFolder(folder))] == [
        ("P001", 1, None),
        ("P002", 1, "P001"),
    ]


def test_a_participant_who_withdrew_is_replaced_in_the_group(tmp_path: Path) -> None:
    folder, source = tmp_path / "s", source_of()
    for who in ("P001", "P002"):
        with begin_session(folder, source, who) as store:
            group = participant_group(start_of(store.lines), store.key)
            order = order_of(parse(source, "grouped"), store)
            store.finish("withdrawn")
    withdraw(folder, "P002", by="AB", reason="asked for it")
    with begin_session(folder, source, "P050", row_of="P002") as store:
        assert participant_group(start_of(store.lines), store.key) == group
        assert order_of(parse(source, "grouped"), store) == order
        assert start_of(store.lines).row_of == "P002"
        store.finish("completed")
    assert not verify_study(folder).errors


@pytest.mark.parametrize("edits", [(), (PREEXISTING,)], ids=["randomised", "pre-existing"])
def test_verify_names_an_entry_that_was_changed(tmp_path: Path, edits: tuple[tuple[str, str], ...]) -> None:
    study, source = StudyFolder(tmp_path / "s"), source_of(*edits)
    group = {"group": "experts"} if edits else {}
    for who, row_of in (("P001", None), ("P002", "P001")):
        begin_session(study.path, source, who, row_of=row_of, **group).close()
    stem = "experts-001" if edits else "001"
    first, second = study.allocated / f"{stem}.json", study.allocated / f"{stem}-P002.json"
    whole = second.read_text("utf-8")
    second.write_text(whole.replace('"replaces": "P001"', '"replaces": "P003"'), encoding="utf-8", newline="\n")
    assert f"{second.name}: replaces participant P003, who does not have a matching entry" in _errors(study)
    second.write_text(whole.replace('"entry": 1', '"entry": 2'), encoding="utf-8", newline="\n")
    assert f"{second.name}: has been changed" in _errors(study)
    second.unlink()
    assert f"{second.name}: is missing, although participant P002 has entry 1" in _errors(study)
    second.write_text(whole, encoding="utf-8", newline="\n")
    assert _errors(study) == ""
    if edits:
        first.rename(study.allocated / "novices-001.json")
        assert "experts-001.json: is missing, although participant P001 has entry 1" in _errors(study)


def _errors(study: StudyFolder) -> str:
    return "\n".join(map(str, verify_study(study.path).errors))


def test_a_folder_of_an_earlier_version_continues_with_numbers_of_ids(tmp_path: Path) -> None:
    """Its entries lack the note that rows are assigned by the place in the group."""
    study, source = StudyFolder(tmp_path / "s"), source_of()
    begin_session(study.path, source, "P001").close()
    path = study.allocation(1)
    path.write_text(path.read_text("utf-8").replace(', "place_in_group": true', ""), encoding="utf-8", newline="\n")
    orders = {}
    for who, row_of in (("P002", None), ("P004", None), ("P003", None), ("P060", "P003")):
        with begin_session(study.path, source, who, row_of=row_of) as store:
            start = start_of(store.lines)
            assert start.place_in_group is None
            assert start.entry == len(claims(study)), "a replacement has an entry of its own"
            orders[who] = order_of(parse(source, "grouped"), store)
            store.finish("completed")
        assert not reproduce_session(store.folder.path).differences[1:], "only the trials that were not run"
    assert orders["P002"] != orders["P003"] or orders["P004"] != orders["P003"]
    assert orders["P060"] == orders["P003"]
    with pytest.raises(StudyError, match="assigns rows by the number in the ID"):
        begin_session(study.path, source, "P061", row_of="anna")
