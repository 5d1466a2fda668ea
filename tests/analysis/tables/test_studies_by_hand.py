"""What a study says of itself, made up in memory with values that all differ: people, versions, sites, decisions."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from study_app.analysis.data import blocks, measures, motion, session_files, study_tables
from study_app.analysis.data.blocks import Block, OwnDynamics, Setting
from study_app.analysis.data.study_tables import Study, group_means, groups_shown, pool_sites, split_study
from study_app.protocol.model import Published
from study_app.protocol.participants.groups import EACH_GROUP
from study_app.store.exclusions import Exclusion
from tests.analysis.made_up import DECIDED, ITEMS, delays, everybody, liquids, study

PEOPLE = {"P2": ("1.2", "h", "0.2"), "P1": ("1.1", "i", "0.3"), "P4": ("1.0", "k", "0.1"), "P3": ("0.9", "l", "0.4")}


@pytest.fixture
def made() -> Study:
    """Return a study whose P4 is not complete and whose P3 is excluded."""
    trials = [(person, 1, code, [1 + at, 7 - at]) for at, person in enumerate(PEOPLE) for code in ("L1", "L2")]
    shown = study(liquids(2), trials)
    names = shown.participants["participant"]
    columns = {
        name: names.map({person: values[at] for person, values in PEOPLE.items()})
        for at, name in enumerate(("protocol_version", "protocol_hash", "version"))
    }
    people = shown.participants.assign(counted=names.isin(["P1", "P2"]), excluded=names == "P3", **columns)
    return replace(shown, participants=people)


def test_a_study_counts_included_sessions_alone(made: Study) -> None:
    assert (made.people, made.n, made.left_out, list(made.excluded_sessions["participant"])) == (
        ("P1", "P2"),
        2,
        1,
        ["P3"],
    )
    assert (made.versions, made.programs, made.contents, made.revealed) == (("1.1", "1.2"), ("0.2", "0.3"), 2, True)
    nobody = replace(made, participants=made.participants.assign(counted=False), version="7")
    assert (nobody.versions, nobody.programs, nobody.contents, nobody.people) == (("7",), (), 0, ())
    codes = {"study": {"codes": "participant"}}
    assert [replace(made, settings=settings, protocol=codes).own_codes for settings in ({}, made.settings)] == [
        True,
        False,
    ]
    assert (made.site_of("A-P1"), replace(made, sites=("A",)).site_of("A-P1")) == ("", "A")
    doubt: Any = "x.csv differs"
    warned: list[str] = []
    replace(made, doubts=(doubt,)).tell_doubts(warned.append)
    assert warned == ["warning: x.csv differs; the file is still used"]


def test_presentations_are_those_of_the_block_that_count(made: Study) -> None:
    (block,) = made.blocks
    trials = made.trials.assign(attempt=range(1, 9), excluded=[False, True] * 4)
    trials["counted"] = [True, False, True, False, True, True, True, False]
    other = replace(made, trials=pd.concat([trials, trials.assign(block="c")]))
    assert other.presented(block) == {"L1": 4, "L2": 1}
    gone = other.excluded_trials(block)
    assert list(zip(gone["participant"], gone["code"], strict=True)) == [("P2", "L2"), ("P1", "L2")]
    counted = made.responses.assign(counted=made.responses["participant"] == "P1")
    answers = replace(made, responses=pd.concat([counted, counted.assign(block="c")])).answers(block)
    assert {(row.participant, row.block) for row in answers.itertuples()} == {("P1", "b")}


def test_a_split_study_has_the_members_of_its_group_alone(made: Study) -> None:
    group = made.participants["participant"].map({"P1": "zoo", "P2": "art", "P3": "zoo", "P4": "art"}).astype("string")
    grouped = replace(made, participants=made.participants.assign(group=group))
    each = split_study(grouped, EACH_GROUP)
    assert [(name, one.split, one.people) for name, one in groups_shown(each)] == [
        ("art", "art", ("P2",)), ("zoo", "zoo", ("P1",)),
    ]  # fmt: skip
    assert set(split_study(grouped, "art").trials["participant"]) == {"P2"}
    assert groups_shown(grouped) == [("", grouped)]
    rows = [(row.item, row.code, row.group, row.n, row.mean) for row in group_means(grouped)]
    assert rows == [
        (item, code, name, 1, mean)
        for item, means in zip(ITEMS, ((1.0, 2.0), (7.0, 6.0)), strict=True)
        for code in ("L1", "L2")
        for name, mean in zip(("art", "zoo"), means, strict=True)
    ]


@pytest.mark.parametrize("is_open", [False, True])
def test_a_merged_study_joins_each_table_and_fact_of_its_sites(made: Study, is_open: bool) -> None:
    def site(estimator: str, sessions: int, changed: bool, by: str) -> Study:
        row = Exclusion(participant="P1", session=1, trial=None, rule_or_person=by, reason=by, excluded_at=by)
        dynamics = OwnDynamics(
            damping_nspm=sessions, friction_n=10 * sessions, mass_kg=100 * sessions, sessions=sessions, of=4
        )
        codes = {"exclusions": (row,), "late": (replace(row, session=2),), "kept": (replace(row, session=3),)}
        settings = made.blocks[0].settings if is_open else tuple(Setting(code=f"L{number}") for number in (1, 2))
        block = replace(made.blocks[0], settings=settings)
        return replace(
            made, blocks=(block,), settings=made.settings if is_open else {}, own_dynamics=dynamics, doubts=(by,),
            estimator=estimator, decided=replace(DECIDED, changed=changed), **codes,
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
    said = "Kox: Weber fraction 0.2 (standard 8 N·s/m, 0.1 to 0.3, at 75 % correct, n = 17)"
    assert blocks.published_words(published, "N·s/m") == said
    equal = Published(block="b", measure="pse", value=3, source="")
    assert [blocks.published_words(equal, unit) for unit in ("ms", None)] == ["PSE 3 ms", "PSE 3"]
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
    assert decided.alpha_words() == "0.04"
    assert decided.at(9).alpha_words().startswith("0.04 across all looks, ")


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
    said = [
        motion._explain_missing_recording(Path("nowhere"), {**row, name: None}) for name in ("recording", "duration_s")
    ]
    assert said == ["no recording was stored", "the trial's duration was not recorded"]
    assert motion._explain_missing_recording(Path("nowhere"), row) == "the recording is missing from the folder"
    rows = pd.DataFrame(
        [("D1", "P1", 1.0), ("D1", "P1", 3.0), ("D1", "P2", 8.0), ("D2", "P1", None)],
        columns=["code", "participant", "path_mm"],
    ).assign(block="b")
    found = list(
        motion._movement_quartiles(block, pd.concat([rows, rows.assign(block="c", path_mm=99.0)]), ("path_mm",))
    )
    assert [(one.block, one.code, one.measure, one.n, one.median) for one in found] == [
        ("b", "D1", "path_mm", 2, 5.0), ("b", "D2", "path_mm", 0, None),
    ]  # fmt: skip
    assert measures.quartiles_or_none(np.array([2.0, 8.0])).median == 5.0


def test_bench_masking_and_estimators_of_receipts_are_read() -> None:
    bench = session_files._own_dynamics({"damping_nspm": [1, 3], "friction_n": [5, 5.5], "mass_kg": [0.5]})
    assert bench == (2.0, 5.25, 0.5)
    masked = [
        session_files._masking_text(one) for one in (None, {"means": "headphones"}, {"means": "noise", "noise_db": 60})
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
