"""What a study says of itself, made up in memory with values that all differ: people, versions, sites, decisions."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from study_app.analysis.data import blocks, measures, motion, session_files, study_tables
from study_app.analysis.data.blocks import Block, OtherQuestions, OwnDynamics, Setting
from study_app.analysis.data.study_tables import Study, group_means, groups_shown, pool_sites, split_study
from study_app.protocol.model import Published
from study_app.protocol.participants.groups import EACH_GROUP
from study_app.store.exclusions import Exclusion
from study_app.store.files.columns import INTERVALS
from study_app.store.verification import Discrepancy
from tests.analysis.made_up import DECIDED, ITEMS, delays, everybody, liquids, study

PEOPLE = {"P2": ("1.2", "h", "0.2"), "P1": ("1.1", "i", "0.3"), "P4": ("1.0", "k", "0.1"), "P3": ("0.9", "l", "0.4")}


@pytest.fixture
def four_people() -> Study:
    """Return a study whose P4 is not complete and whose P3 is excluded."""
    trials = [(person, 1, code, [1 + at, 7 - at]) for at, person in enumerate(PEOPLE) for code in ("L1", "L2")]
    case_study = study(liquids(2), trials)
    names = case_study.participants["participant"]
    columns = {
        name: names.map({person: values[at] for person, values in PEOPLE.items()})
        for at, name in enumerate(("protocol_version", "protocol_hash", "version"))
    }
    people = case_study.participants.assign(counted=names.isin(["P1", "P2"]), excluded=names == "P3", **columns)
    return replace(case_study, participants=people)


def test_a_study_counts_only_included_sessions(four_people: Study) -> None:
    assert (
        four_people.people,
        four_people.n,
        four_people.left_out,
        list(four_people.excluded_sessions["participant"]),
    ) == (("P1", "P2"), 2, 1, ["P3"])
    assert (four_people.versions, four_people.programs, four_people.contents, four_people.revealed) == (
        ("1.1", "1.2"),
        ("0.2", "0.3"),
        2,
        True,
    )
    nobody = replace(four_people, participants=four_people.participants.assign(counted=False), version="7")
    assert (nobody.versions, nobody.programs, nobody.contents, nobody.people) == (("7",), (), 0, ())
    codes = {"study": {"codes": "participant"}}
    assert [
        replace(four_people, settings=settings, protocol=codes).own_codes for settings in ({}, four_people.settings)
    ] == [True, False]
    assert (four_people.site_of("A-P1"), replace(four_people, sites=("A",)).site_of("A-P1")) == ("", "A")
    warned: list[str] = []
    doubts = [Discrepancy(Path("x.csv"), "differs", "verify", used=used) for used in (True, False)]
    replace(four_people, doubts=tuple(doubts)).tell_doubts(warned.append)
    assert warned == ["warning: x.csv differs: verify; the file is still used", "warning: x.csv differs: verify"]


def test_presentations_are_those_of_the_block_that_count(four_people: Study) -> None:
    (block,) = four_people.blocks
    trials = four_people.trials.assign(attempt=range(1, 9), excluded=[False, True] * 4)
    trials["counted"] = [True, False, True, False, True, True, True, False]
    other = replace(four_people, trials=pd.concat([trials, trials.assign(block="c")]))
    assert other.presented(block) == {"L1": 4, "L2": 1}
    excluded_trials = other.excluded_trials(block)
    assert list(zip(excluded_trials["participant"], excluded_trials["code"], strict=True)) == [
        ("P2", "L2"),
        ("P1", "L2"),
    ]
    counted_study = four_people.responses.assign(counted=four_people.responses["participant"] == "P1")
    answers = replace(four_people, responses=pd.concat([counted_study, counted_study.assign(block="c")])).answers(block)
    assert {(row.participant, row.block) for row in answers.itertuples()} == {("P1", "b")}


def test_a_split_study_has_only_the_members_of_its_group(four_people: Study) -> None:
    group = (
        four_people.participants["participant"]
        .map({"P1": "zoo", "P2": "art", "P3": "zoo", "P4": "art"})
        .astype("string")
    )
    grouped = replace(four_people, participants=four_people.participants.assign(group=group))
    each = split_study(grouped, EACH_GROUP)
    assert [(name, group.split, group.people) for name, group in groups_shown(each)] == [
        ("art", "art", ("P2",)), ("zoo", "zoo", ("P1",)),
    ]  # fmt: skip
    tables = ("trials", "responses", "answered", "participants")
    art = split_study(grouped, "art")
    assert {name: set(getattr(art, name)["participant"]) for name in tables} == {name: {"P2"} for name in tables}
    assert groups_shown(grouped) == [("", grouped)]
    rows = [(row.item, row.code, row.group, row.n, row.mean) for row in group_means(grouped)]
    assert rows == [
        (item, code, name, 1, mean)
        for item, means in zip(ITEMS, ((1.0, 2.0), (7.0, 6.0)), strict=True)
        for code in ("L1", "L2")
        for name, mean in zip(("art", "zoo"), means, strict=True)
    ]


@pytest.mark.parametrize("is_open", [False, True])
def test_a_merged_study_joins_each_table_and_fact_of_its_sites(four_people: Study, is_open: bool) -> None:
    def site(estimator: str, sessions: int, changed: bool, by: str) -> Study:
        row = Exclusion(participant="P1", session=1, trial=None, rule_or_person=by, reason=by, excluded_at=by)
        dynamics = OwnDynamics(
            damping_nspm=sessions, friction_n=10 * sessions, mass_kg=100 * sessions, sessions=sessions, of=4
        )
        codes = {"exclusions": (row,), "late": (replace(row, session=2),), "kept": (replace(row, session=3),)}
        settings = four_people.blocks[0].settings if is_open else tuple(Setting(code=f"L{number}") for number in (1, 2))
        block = replace(four_people.blocks[0], settings=settings)
        return replace(
            four_people, blocks=(block,), settings=four_people.settings if is_open else {}, own_dynamics=dynamics,
            doubts=(by,), estimator=estimator, decided=replace(DECIDED, changed=changed), **codes,
        )  # fmt: skip

    sites = {"A": site("kalman", 1, False, "first"), "B": site("device or kalman", 3, True, "second")}
    pooled = pool_sites(Path("both"), sites, ())
    assert (pooled.folder, pooled.sites, pooled.estimator) == (Path("both"), ("A", "B"), "kalman or device")
    assert pooled.people == ("A-P1", "A-P2", "B-P1", "B-P2")
    assert pooled.decided.changed
    assert pooled.doubts == ("first", "second")
    for name, session in (("exclusions", 1), ("late", 2), ("kept", 3)):
        rows = [(row.participant, row.session, row.reason) for row in getattr(pooled, name)]
        assert rows == [("A-P1", session, "first"), ("B-P1", session, "second")]
    assert pooled.own_dynamics == OwnDynamics(damping_nspm=2.5, friction_n=25.0, mass_kg=250.0, sessions=4, of=8)
    codes = ["c1", "c2"] if is_open else ["A-L1", "A-L2", "B-L1", "B-L2"]
    assert list(pooled.blocks[0].codes) == codes
    assert sorted({*pooled.trials["code"]}) == codes
    assert [*pooled.settings] == ([("b", "c1"), ("b", "c2")] if is_open else [])
    of_b = pooled.responses[pooled.responses["participant"] == "B-P1"]
    assert [(row.code, row.item, row.response) for row in of_b.itertuples()] == [
        (code, item, value) for code in codes[-2:] for item, value in zip(ITEMS, ("2", "6"), strict=True)
    ]
    assert study_tables._pooled_dynamics([None, None], 3) is None


def test_delays_that_several_conditions_share_have_one_column() -> None:
    settings = tuple(
        Setting(code=code, condition=f"c{code}", liquid="water", delay_ms=ms)
        for code, ms in (("D10", 50.0), ("D2", 10.0), ("D1", 50.0))
    )
    block = Block(id="b", title="B", kind="delays", settings=settings, items=(), labels=(), cannot_judge=None)
    assert (block.codes, block.codes_as_dealt) == (("D10", "D2", "D1"), ("D1", "D2", "D10"))
    assert (block.columns, block.delays_ms) == ({"D10": 1, "D2": 0, "D1": 1}, (10.0, 50.0))
    assert replace(block, kind="liquids").columns == {"D10": 0, "D2": 1, "D1": 2}
    assert [block.name(setting) for setting in settings] == [
        "Water, 50 ms (cD10)",
        "Water, 10 ms",
        "Water, 50 ms (cD1)",
    ]
    tracks = [Setting(code="T", condition=name) for name in ("8/1", "plain", None)]
    assert [track.standard for track in tracks] == ["8", None, None]


def test_published_values_and_decisions_are_read_and_put_in_words() -> None:
    values = {"block": "b", "measure": "weber", "value": 0.2, "standard": 8.0, "low": 0.1, "high": 0.3, "percent": 75.0}
    published = Published(**values, n=17, source="Kox")  # type: ignore[arg-type]
    message = "Kox: Weber fraction 0.2 (standard 8 N·s/m, 0.1 to 0.3, at 75 % correct, n = 17)"
    assert blocks.published_text(published, "N·s/m") == message
    equal = Published(block="b", measure="pse", value=3, source="")
    assert [blocks.published_text(equal, unit) for unit in ("ms", None)] == ["PSE 3 ms", "PSE 3"]
    slope = published.model_copy(update={"measure": "exponent", "percent": 60.0})
    assert blocks.compared_percent([published, slope]) == 75.0
    assert blocks.compared_percent([published, published.model_copy(update={"percent": 60.0})]) is None
    table = {
        "alpha": 0.04, "equivalence_bound": 1.5, "noticed": "n", "primary": ["a"], "names": ["b"], "rising": ["c"],
        "falling": ["d"], "looks": [5, 9], "spending": "pocock", "trends": "slopes",
    }  # fmt: skip
    decided = blocks.read_decided([table, table])
    assert {name: getattr(decided, name) for name in table} == {
        name: tuple(value) if isinstance(value, list) else value for name, value in table.items()
    }
    assert (decided.made, decided.changed, blocks.read_decided([table, None]).changed) == (True, False, True)
    assert (decided.direction("c"), decided.direction("d"), decided.direction("a")) == (
        "increasing",
        "decreasing",
        None,
    )
    assert [decided.at(n).look for n in (4, 5, 8, 9)] == [0, 1, 1, 2]
    first, second = decided.alphas
    assert max(first, second) < 0.04
    assert first != second
    assert (decided.at(4).alpha, decided.at(9).alpha, decided.at(9).planned_alpha) == (first, second, 0.04)
    assert decided.alpha_text() == "0.04"
    assert decided.at(9).alpha_text().startswith("0.04 across all looks, ")


def test_reaches_overshoot_and_paths_are_those_of_a_drawn_line() -> None:
    task = {"kind": "reach", "targets_mm": [[0, 0, 0], [100, 0, 0]], "radius_mm": 20, "dwell_s": 0.3}
    protocol = {"blocks": {"b": {"task": "t"}}, "tasks": {"t": task}}
    (block,) = study(delays([10, 50]), list(everybody(delays([10, 50]), 1, lambda *_: 4))).blocks
    targets = motion._targets(protocol, block)
    assert targets is not None
    assert (targets.centres_m.tolist(), targets.radius_m, targets.dwell_s) == ([[0, 0, 0], [0.1, 0, 0]], 0.02, 0.3)
    assert motion._targets({**protocol, "tasks": {"t": {"kind": "explore"}}}, block) is None
    way = np.array([[0.0, 0, 0], [0.15, 0, 0], [0.11, 0, 0]])
    assert motion._overshoot_m(way, targets, 1) == pytest.approx(0.03)
    assert motion.path_length_m(way) == pytest.approx(0.19)
    row: dict[str, Any] = {"recording": "r", "duration_s": 2.0, "participant": "P1", "session": 1}
    sentences = [
        motion._explain_missing_recording(Path("nowhere"), {**row, name: None}) for name in ("recording", "duration_s")
    ]
    assert sentences == ["no recording was stored", "the trial's duration was not recorded"]
    assert motion._explain_missing_recording(Path("nowhere"), row) == "the recording is missing from the folder"
    rows = pd.DataFrame(
        [("D1", "P1", 1.0), ("D1", "P1", 3.0), ("D1", "P2", 8.0), ("D2", "P1", None)],
        columns=["code", "participant", "path_mm"],
    ).assign(block="b")
    quartiles = list(
        motion._movement_quartiles(block, pd.concat([rows, rows.assign(block="c", path_mm=99.0)]), ("path_mm",))
    )
    assert [(measure.block, measure.code, measure.measure, measure.n, measure.median) for measure in quartiles] == [
        ("b", "D1", "path_mm", 2, 5.0), ("b", "D2", "path_mm", 0, None),
    ]  # fmt: skip
    assert measures.quartiles_or_none(np.array([2.0, 8.0])).median == 5.0


def test_bench_masking_and_estimators_of_receipts_are_read() -> None:
    bench = session_files._own_dynamics({"damping_nspm": [1, 3], "friction_n": [5, 5.5], "mass_kg": [0.5]})
    assert bench == (2.0, 5.25, 0.5)
    masked = [
        session_files._masking_text(masking)
        for masking in (None, {"means": "headphones"}, {"means": "noise", "noise_db": 60})
    ]
    assert masked == [None, "headphones", "noise of 60 dB"]

    def session(device: bool, own: Any = bench) -> Any:
        scene = {"scene": {"velocity": {"kind": "kalman"}}}
        return SimpleNamespace(protocol=scene, device_velocity=device, own_dynamics=own)

    both = session(device=True), session(device=False)
    assert [session_files.estimators_of(some) for some in (both, both[:1], both[1:])] == [
        "kalman or device",
        "device",
        "kalman",
    ]
    means = session_files.mean_dynamics([*both, session(device=True, own=None)])
    assert means == OwnDynamics(damping_nspm=2.0, friction_n=5.25, mass_kg=0.5, sessions=2, of=3)
    lengths = np.array([3, 2])
    assert [session_files._row_location(lengths, index) for index in (0, 2, 3, 4)] == [(0, 2), (0, 4), (1, 2), (1, 3)]


def test_a_merged_study_reads_each_site_alike_and_stays_sealed_until_all_keys_are_open(
    four_people: Study, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    merged: Any = SimpleNamespace(path=tmp_path, names=("A", "B", "C"), folder=lambda name: tmp_path / name)
    load_calls: list[tuple[str, bool, bool]] = []

    def load(path: Path, *, sealed: bool = False, planned: bool = True) -> Study:
        load_calls.append((path.name, sealed, planned))
        return four_people

    for name in merged.names:
        (tmp_path / name).mkdir()
    monkeypatch.setattr(study_tables, "_load", load)
    monkeypatch.setattr(study_tables.StudyFolder, "sessions", lambda site: [] if site.path.name == "B" else [1])
    monkeypatch.setattr(study_tables, "tombstones", lambda site: {"P9": f"gone from {site.path.name}"})
    for is_open, planned in ((True, False), (False, True)):
        load_calls.clear()
        monkeypatch.setattr(study_tables, "has_opened_keys", lambda _path, is_open=is_open: is_open)
        pooled = study_tables._load_sites(merged, planned=planned)
        assert load_calls == [(name, not is_open, planned) for name in "AC"]
        assert pooled.withdrawn == ("gone from A", "gone from B", "gone from C")


def test_groups_and_sites_are_those_of_counted_rows_of_an_opened_study(four_people: Study) -> None:
    """P3 and P4 are not included; P1 gave a third answer in a row that does not count."""
    names = {"P1": "zoo", "P2": "art", "P3": "bus", "P4": "bus"}
    rows = four_people.trials.assign(group=four_people.trials["participant"].map(names).astype("string"))
    randomised = replace(four_people, trials=rows.assign(counted=rows["participant"].isin(["P1", "P2"])))
    assert study_tables.group_counts(randomised) == {"art": 1, "zoo": 1}
    assert study_tables.group_counts(replace(randomised, settings={})) == {}
    assert study_tables.group_assignment(randomised) is None
    protocol = {"groups": {"zoo": {}}, "study": {}}
    assert study_tables.group_assignment(replace(randomised, protocol=protocol)) == "randomised"
    merged = replace(four_people, sites=("P1", "P2"))
    assert study_tables.group_counts(merged, "site") == {"P1": 1, "P2": 1}
    assert study_tables.group_counts(replace(merged, settings={}), "site") == {}
    extra = four_people.responses[four_people.responses["participant"] == "P1"].assign(counted=False, response="7")
    means = group_means(replace(randomised, responses=pd.concat([four_people.responses, extra])))
    assert [(row.code, row.group, row.mean) for row in means if row.item == ITEMS[0]] == [
        ("L1", "art", 1.0), ("L1", "zoo", 2.0), ("L2", "art", 1.0), ("L2", "zoo", 2.0),
    ]  # fmt: skip


def test_answers_to_a_form_are_those_of_its_place_with_the_block_that_they_follow(four_people: Study) -> None:
    rows = [
        ("load", "sure", None, True), ("load", "sure", "b", True), ("load", "age", "b", True),
        ("end", "sure", "b", True),
        (None, "sure", None, True), ("load", "sure", "c", False),
    ]  # fmt: skip
    answered = pd.DataFrame(rows, columns=["form", "item", "after_block", "counted"]).assign(code="L1")
    answered["block"], answered["session"] = ["x", "x", "x", "x", "b", "x"], [2, 1, 1, 1, 1, 3]
    form_study = replace(four_people, answered=answered.convert_dtypes())

    def asked(where: str, item: str, *, is_form: bool, settings: tuple[int, ...], by_session: bool = False) -> Any:
        place = SimpleNamespace(id=where, is_form=is_form, settings=settings, by_session=by_session)
        return SimpleNamespace(id=item, where=place)

    repeated = asked("load", "sure", is_form=True, settings=(1, 2))
    assert list(form_study.rows_of(repeated)["code"]) == [study_tables.START, "b", "c"]
    assert list(form_study.answers_to(repeated)["code"]) == [study_tables.START, "b"]
    by_session = asked("load", "sure", is_form=True, settings=(1, 2), by_session=True)
    assert list(form_study.rows_of(by_session)["code"]) == [f"{study_tables.START}__2", "b__1", "c__3"]
    assert list(form_study.answers_to(asked("end", "sure", is_form=True, settings=()))["code"]) == ["L1"]
    assert list(form_study.answers_to(asked("b", "sure", is_form=False, settings=(1,))).index) == [4]


def test_a_folder_is_read_with_its_key_exclusions_and_last_attempts(monkeypatch: pytest.MonkeyPatch) -> None:
    """P1 repeated trial 2; P2 did not finish; P3 lacks too many trials; P4 is excluded by a planned rule."""

    def record(person: str, status: str, plan: Any) -> Any:
        folder = SimpleNamespace(participant=person, number=1)
        visit = {
            "participant": person,
            "session": 1,
            "status": status,
            "missing": f"{person} lacks",
            "simulated": False,
            "pilot": False,
            "seed": 1,
            "ended_at": f"{person} end",
        }
        return SimpleNamespace(
            folder=folder, visit=visit, study="oils", title="Oils", version="2", protocol={"analysis": plan},
            blocks=("b",),
            levels=("l",), unrated_blocks=(), others=OtherQuestions(), own_dynamics=None, device_velocity=False,
        )  # fmt: skip

    plan = {"alpha": 0.04, "equivalence_bound": None, "noticed": None, "primary": [], "names": [], "rising": []}
    plan |= {"falling": []}
    states = {"P1": "completed", "P2": "aborted", "P3": study_tables.INCOMPLETE, "P4": "completed"}
    records = {person: record(person, status, plan) for person, status in states.items()}
    records["P4"].protocol = {"analysis": {**plan, "alpha": 0.01}}
    rule = Exclusion(
        participant="P4", session=1, trial=None, rule_or_person="fast_answers", reason="fast", excluded_at="t"
    )
    places = [
        ("P1", 1, 1, "main", "sure"), ("P1", 2, 1, "main", "sure"), ("P1", 2, 2, "main", "sure"),
        ("P1", 3, 1, "practice", "sure"), ("P2", 1, 1, "main", "sure"), ("P3", 1, 1, "main", "sure"),
        ("P4", 1, 1, "main", "sure"), ("P1", None, None, None, "age"), ("P2", None, None, None, "age"),
        ("P3", None, None, None, "age"), ("P4", None, None, None, "age"),
    ]  # fmt: skip
    rows = pd.DataFrame(places, columns=["participant", "trial", "attempt", "phase", "item"]).convert_dtypes()
    rows = rows.assign(
        session=1, kind=np.where(rows["trial"].isna(), "number", "statement"), value=range(11), force_mean_n=0.5,
        session_status=rows["participant"].map(states),
    )  # fmt: skip
    tables = {"responses": rows, "trials": rows[rows["trial"].notna()]}
    stand_ins: dict[str, Any] = {
        "is_never_begun": lambda _path: False, "refuse_earlier_columns": lambda _place: None,
        "read_sessions": lambda sessions, _key: ([records[session.participant] for session in sessions], ()),
        "read_tables": lambda _records, name: tables[name], "exclusions": lambda _path: (rule,),
        "reversals": lambda _path: (), "late_exclusions": lambda _path, listed: listed[:1],
        "tombstones": lambda _place: {"P9": "gone"}, "check_exclusions_exist": lambda *_: None,
        "session_discrepancies": lambda place: [f"{place.folder.participant} changed"],
        "has_intervals": lambda _protocol: False,
        "settings_from_key": lambda key: {("b", "L1"): key}, "contrasts_of": lambda _key: ("contrast",),
        "_check_poolable": lambda *_: None,
    }  # fmt: skip
    for name, value in stand_ins.items():
        monkeypatch.setattr(study_tables, name, value)
    monkeypatch.setattr(study_tables, "Place", lambda _place, folder, _study: SimpleNamespace(folder=folder))
    sessions = [SimpleNamespace(participant=person, path=Path(person)) for person in states]
    monkeypatch.setattr(study_tables.StudyFolder, "sessions", lambda _place: sessions)
    key = SimpleNamespace(tables={"liquids": {"oil": {}}})
    monkeypatch.setattr(study_tables, "_read_key", lambda *_: key)
    study_read = study_tables._load(Path("oils"))
    assert (study_read.name, study_read.title, study_read.version, study_read.blocks, study_read.levels) == (
        "oils",
        "Oils",
        "2",
        ("b",),
        ("l",),
    )
    assert [(row.participant, row.rule_or_person, row.reason, row.excluded_at) for row in study_read.exclusions] == [
        ("P4", "fast_answers", "fast", "t"), ("P3", study_tables.MISSING_RULE, "P3 lacks", "P3 end"),
    ]  # fmt: skip
    assert (study_read.late, study_read.kept, study_read.withdrawn) == (study_read.exclusions[:1], (), ("gone",))
    assert (study_read.settings, study_read.contrasts, study_read.liquids) == (
        {("b", "L1"): key},
        ("contrast",),
        {"oil": {}},
    )
    assert study_read.doubts == tuple(f"{person} changed" for person in states)
    assert (study_read.decided.alpha, study_read.decided.changed) == (0.04, True)
    assert dict(zip(study_read.participants["participant"], study_read.participants["counted"], strict=True)) == {
        "P1": True, "P2": False, "P3": False, "P4": False,
    }  # fmt: skip
    counted_rows = study_read.responses[study_read.responses["counted"]]
    assert list(zip(counted_rows["participant"], counted_rows["trial"], counted_rows["response"], strict=True)) == [
        ("P1", 1, 0), ("P1", 2, 2),
    ]  # fmt: skip
    assert list(study_read.trials["counted"]) == [True, False, True, False, False, False, False]
    forms = study_read.answered[study_read.answered["trial"].isna()]
    assert list(zip(forms["participant"], forms["counted"], strict=True)) == [
        ("P1", True), ("P2", False), ("P3", False), ("P4", False),
    ]  # fmt: skip
    assert study_read.trials["force_mean_n"].notna().all()
    monkeypatch.setattr(study_tables, "_read_key", lambda *_: None)
    sealed = study_tables._load(Path("oils"), planned=False)
    assert (sealed.settings, sealed.contrasts, sealed.liquids) == ({}, (), {})
    assert sealed.trials["force_mean_n"].isna().all()
    assert [row.participant for row in sealed.exclusions] == ["P3"]
    assert sealed.people == ("P1", "P4"), "a planned rule does not exclude P4"
    fields = SimpleNamespace(what=("P3", 1, None))
    monkeypatch.setattr(study_tables, "reversals", lambda _path: (fields,))
    again = study_tables._load(Path("oils"))
    assert [row.participant for row in again.exclusions] == ["P4"], "a person has kept P3"
    assert (again.people, again.kept) == (("P1", "P3"), (fields,))


def test_the_look_at_a_study_is_that_of_its_included_participants(
    four_people: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of four sessions, those of two participants are included."""
    looking = replace(four_people, decided=replace(DECIDED, looks=(2, 4)))
    monkeypatch.setattr(study_tables, "read_merged", lambda _path: None)
    monkeypatch.setattr(study_tables, "_load", lambda _path, planned: replace(looking, title=f"planned {planned}"))
    for planned in (True, False):
        study_read = study_tables.load_study(Path("oils"), planned=planned)
        assert (study_read.decided.look, study_read.title) == (1, f"planned {planned}")


@pytest.mark.parametrize("opened", [True, False])
def test_sealed_columns_of_intervals_are_empty_until_the_key_is_open(
    opened: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    sealed, *_ = (column.name for column in INTERVALS if column.sealed)
    place = {"participant": ["P1", "P1"], "session": [1, 1], "trial": [1, 1], "attempt": [1, 2]}
    table = pd.DataFrame(
        {**place, sealed: [0.5, 0.25], "interval": [1, 2], "phase": "main", "session_status": "completed"}
    )
    monkeypatch.setattr(study_tables, "has_intervals", lambda protocol: protocol == "levels")
    monkeypatch.setattr(study_tables, "read_tables", lambda _records, name: {"intervals": table}[name])
    records: Any = [SimpleNamespace(protocol="levels")]
    last = pd.Series([2], index=pd.MultiIndex.from_tuples([("P1", 1, 1)], names=["participant", "session", "trial"]))
    intervals_read = study_tables._read_intervals(records, (), last.rename("last_attempt"), opened=opened)
    assert list(intervals_read[sealed].fillna(-1)) == ([0.5, 0.25] if opened else [-1, -1])
    assert (list(intervals_read["interval"]), list(intervals_read["counted"])) == ([1, 2], [False, True])
    statements: Any = [SimpleNamespace(protocol="statements")]
    assert study_tables._read_intervals(statements, (), last, opened=opened).empty
