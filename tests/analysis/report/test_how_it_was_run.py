"""The sentences and tables about how a study was run, against texts written by hand for values that all differ."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest

from study_app.analysis.data.study_tables import Study
from study_app.analysis.planned_exclusions import PlannedExclusions
from study_app.analysis.report import methods, sections
from study_app.analysis.results import BlockResult, Delivered
from study_app.store.exclusions import Exclusion
from study_app.store.missing_trials import MISSING_PERCENT
from study_app.store.withdrawals import Tombstone
from tests.analysis.made_up import delays, everybody, liquids, study
from tests.analysis.report.read_report import seen


def made(**changes: Any) -> Study:
    """Return a study of three participants and three liquids with changed fields."""
    settings = liquids(3)
    return replace(study(settings, list(everybody(settings, 3, lambda p, s, c, i: 4))), **changes)


def exclusion(participant: str, trial: int | None = None, by: str = "AK") -> Exclusion:
    """Return an exclusion whose reason names its participant."""
    return Exclusion(
        participant=participant, session=2, trial=trial, rule_or_person=by, reason=f"{participant} spoke",
        excluded_at="2026-03-02T09:00:00+00:00",
    )  # fmt: skip


def result_of(of: Study) -> BlockResult:
    """Return the result of a study's block without answers."""
    (block,) = of.blocks
    return BlockResult(
        id="b", title="Stirring", kind=block.kind, revealed=True, n=3, settings=block.settings,
        names=tuple(f"Name {setting.code}" for setting in block.settings), items=block.items, labels=(), measures=(),
    )  # fmt: skip


def text_of(parts: Any) -> str:
    """Return the text of parts of a page without its tags."""
    return seen("".join(map(str, parts))).strip()


def test_sessions_sites_withdrawals_exclusions_and_masked_motors_are_listed() -> None:
    base = made()
    people = base.participants.assign(
        participant=["A-P1", "A-P2", "B-P1"], status=["completed", "aborted", "completed"],
        counted=[True, False, True], excluded=[False, False, False], motors_masked=["no", "with noise", "no"],
    )  # fmt: skip
    gone = Tombstone(participant="A-P9", at="2026-02-03T10:00:00", by="BL", reason="asked", sessions=())
    out = exclusion("B-P1", 7), exclusion("A-P1")
    changed = SimpleNamespace(path=Path("nowhere/data/x.csv"), what="differs")
    shown = replace(
        base, participants=people, sites=("A", "B"), withdrawn=(gone,), exclusions=out, late=out[1:],
        doubts=(changed,),  # type: ignore[arg-type]
    )  # fmt: skip
    results: Any = SimpleNamespace(delivered=(), blocks=(), orders={}, contrasts=())
    text = text_of(sections.conduct(shown, results))
    for said in (
        "Three sessions: 2 completed and 1 aborted. The analysis includes two participants.",
        "The results from these sites are merged: A (1 participant) and B (1 participant).",
        "1 participant withdrew; their data were erased. 2026-02-03, recorded by BL: asked",
        "Motors masked: no in two sessions and with noise in 1 session.",
        "participant B-P1, session 2, trial 7: B-P1 spoke (AK, 2026-03-02T09:00:00+00:00)",
        "participant A-P1, session 2: A-P1 spoke (AK, 2026-03-02T09:00:00+00:00, after the key was opened)",
        "1 session was not completed and therefore not analysed",
        "Files that have changed since recording data/x.csv differs",
    ):
        assert said in text, said
    assert methods.late_exclusions(shown) == "1 of 2 exclusions"
    assert methods.late_exclusions(replace(shown, exclusions=out[:1])) == "the reversal of 1 exclusion"
    assert methods._exclusions(shown) == (
        "The analysis does not include 1 unfinished session and 1 excluded trial. Some decisions about exclusions "
        "were made after the key was opened: 1 of 2 exclusions."
    )
    assert methods._exclusions(replace(base, exclusions=out)).endswith(
        "All exclusions were decided while the key was sealed."
    )
    planned = replace(base, exclusions=(exclusion("P1", by="fast_answers"),), settings={})
    assert methods._exclusions(planned) == ""
    assert sections._first([*map(str, range(23))])[-2:] == ["19", "and 3 more, listed in report.json"]
    assert sections._first([*map(str, range(20))])[-1] == "19"


def test_delivered_delays_have_a_row_with_their_own_numbers() -> None:
    shown = study(delays([10, 50]), list(everybody(delays([10, 50]), 2, lambda p, s, c, i: 4)))
    shown = replace(shown, protocol={**shown.protocol, "limits": {"delay_error_p95_ms": 4.0, "withheld_percent": 2.5}})
    fields = (
        "block", "code", "delay_ms", "trials", "measured", "judged", "valid", "error_mean_ms", "error_worst_ms",
        "achieved_ms",
    )  # fmt: skip
    rows: list[tuple[Any, ...]] = [
        ("b", "D1", 10.0, 9, 8, 7, 6, 1.24, -3.5, 11.26), ("b", "D2", 50.0, 5, 5, 0, 0, None, None, None),
        ("b", None, None, 14, 13, 7, 5, -0.5, 2.26, None),
    ]  # fmt: skip
    delivered = tuple(Delivered(**dict(zip(fields, row, strict=True))) for row in rows)
    results: Any = SimpleNamespace(delivered=delivered, blocks=[result_of(shown)])
    text = text_of(sections._delivered(shown, results))
    for said in (
        "Block Setting requested achieved mean error worst trial trials within limits",
        "Stirring 10 ms 10 ms 11.3 ms +1.2 ms −3.5 ms 9, 8 measured 6 of 7",
        "Stirring 50 ms 50 ms – – – 5 not measured",
        "Stirring all – – −0.5 ms +2.3 ms 14, 13 measured 5 of 7",
        "Limits: delay error p95 at most 4 ms; force held back at most 2.5 %. ",
    ):
        assert said in text, said
    sealed = text_of(sections._delivered(replace(shown, settings={}), results))
    assert "Stirring 10 ms sealed sealed sealed sealed 9 6 of 7" in sealed
    assert sealed.endswith("the delay error and the proportion of force held back are sealed and cannot be checked.")
    words = {
        "frame_gap_ms": "frame gap at most 7 ms",
        "hz": "at most 7 hz",
        "withheld_percent": "force held back at most 7 %",
    }
    assert {what: sections._limit(what, 7.0) for what in words} == words
    assert [sections._signed_ms(value) for value in (None, 0.0, 1.5, -1.5)] == ["–", "0.0 ms", "+1.5 ms", "−1.5 ms"]


@pytest.mark.parametrize(
    ("by", "group", "said"),
    [
        ("group", "randomised", "Differences between groups are not tested."),
        ("group", "pre-existing", "are not tested. The groups were not randomised, so a difference may have other cau"),
        ("site", "pre-existing", "Differences between sites are not tested."),
    ],
)
def test_groups_and_sites_have_their_size_and_means(by: Any, group: str, said: str) -> None:
    shown = made()
    ids = {f"P00{number}": f"{'BBA'[number]}-P00{number}" for number in range(3)}
    renamed = {
        name: getattr(shown, name).assign(participant=getattr(shown, name)["participant"].map(ids))
        for name in ("participants", "responses", "trials")
    }
    shown = replace(shown, sites=("A", "B"), **renamed)
    members = pd.array(["zoo", "zoo", "art"], "string")
    shown = replace(
        shown, participants=shown.participants.assign(group=members),
        responses=shown.responses.assign(
            response=shown.responses["participant"].map({"B-P000": 1, "B-P001": 3, "A-P002": 6}).astype("Int64")
        ),
        protocol={**shown.protocol, "groups": {"zoo": {}}, "study": {"group_assignment": group}},
    )  # fmt: skip
    results: Any = SimpleNamespace(blocks=[result_of(shown)], contrasts=())
    text = text_of(sections.groups(shown, results, by))
    first, second = ("art", "zoo") if by == "group" else ("A", "B")
    assert text.startswith(
        f"{by.capitalize()}s {by.capitalize()} participants {first} 1 {second} 2 Stirring Statement "
    )
    assert said in text
    for item, code in (("Different", "L1"), ("Harder", "L3")):
        assert f"{item} Name {code} {first} 1 6.00 – {item} Name {code} {second} 2 2.00 1.41" in text
    assert list(sections.groups(replace(shown, sites=(), participants=made().participants), results, by)) == []


def test_a_planned_rule_lists_its_sessions_and_the_conclusions_that_depend_on_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    kept, out = SimpleNamespace(name="kept"), SimpleNamespace(name="out")
    told = {
        "kept": [("Liquids", "Same?", "shown", "yes")],
        "out": [("Liquids", "Same?", "open", "no"), ("Delays", "When?", "shown", "50")],
    }
    monkeypatch.setattr(sections, "conclusions", lambda results: told[results.name])
    monkeypatch.setattr(sections, "of_levels", lambda results: (f"Track: {results.name}",))
    row = SimpleNamespace(
        participant="P7", session=3, rule="fast_answers", why="too fast", decision="excluded", by="AK"
    )
    planned: Any = SimpleNamespace(proposals=(row,), included=kept, left_out=out)
    text = text_of(sections.planned_section(planned))
    assert text == (
        "Planned exclusions Session rule reason decision P7, session 3 fast answers too fast excluded, AK Conclusion "
        "with these sessions without these sessions Liquids: Same? shown: yes open: no Track kept out Delays: When? "
        "– shown: 50"
    )
    planned.left_out = kept
    assert text_of(sections.planned_section(planned)).endswith(
        "No conclusion depends on whether these sessions are analysed."
    )
    assert PlannedExclusions.__annotations__.keys() >= {"proposals", "included", "left_out"}
    assert list(sections.planned_section(None)) == []


def test_methods_name_versions_devices_liquids_and_orders() -> None:
    base = made(title="Oils", estimator="kalman", sites=("A", "B"))
    versions = base.participants.assign(protocol_version=["1.2", "1.1", "1.1"], protocol_hash=["h", "i", "k"])
    assert methods.version_words(base) == "version 1"
    assert (
        methods.version_words(replace(base, participants=versions))
        == "versions 1.1 and 1.2, pooled, from 3 different files"
    )
    left_out = versions.assign(counted=[False, True, True])
    assert methods.version_words(replace(base, participants=left_out)) == "version 1.1, from 2 different files"
    device = {
        "device": {"rate_hz": 2000.0, "force_limit_n": 3.5},
        "scene": {"scale": 4.0, "body": {"diameter_m": 0.068}},
    }
    used = base.participants.assign(device=["falcon:2", "mouse", None])
    assert methods._apparatus(replace(base, protocol=device, participants=used)) == (
        "Participants used a haptic device (falcon and mouse); forces were computed at 2000 Hz and limited to 3.5 N. A "
        "virtual ball with a diameter of 68 mm moved 4 times as far as the hand; its velocity was estimated with the "
        "kalman filter."
    )
    alone = replace(base, protocol=device, participants=used[1:], estimator="device")
    assert methods._apparatus(alone).startswith("Participants used a device without force feedback (mouse). A virtual")
    assert methods._apparatus(alone).endswith("as far as the hand; its velocity was measured by the device.")
    tables = {
        f"liquid{number}": {"density_kg_m3": 900 + number, "drag": {"damping_nspm": None}, "effects": ()}
        for number in (1, 2)
    }
    assert methods._liquids(replace(base, liquids=tables)) == (
        "The simulated liquids were liquid1 (901 kg/m³) and liquid2 (902 kg/m³)."
    )
    del tables["liquid1"]
    assert methods._liquids(replace(base, liquids=tables)) == "The simulated liquid was liquid2 (902 kg/m³)."
    groups = {"old": {"share": 2, "sequence": ["c", "b"]}, "new": {"share": 1, "sequence": ["b", "c"]}}
    two = replace(base, blocks=(base.blocks[0], replace(base.blocks[0], id="c", title="Second")))
    for order, says in (
        (
            "fixed",
            "The order of the blocks was “Second” and “Block” in the group old; “Block” and “Second” in the group new.",
        ),
        ("random", "The blocks were presented in a random order for each participant."),
        ("balanced", "The blocks were presented in an order counterbalanced across participants (Williams design)."),
    ):
        assert methods._block_order(replace(two, protocol={"study": {"block_order": order}, "groups": groups})) == says
    assert methods._block_order(base) == ""
    assert methods._block_order(replace(two, protocol={})) == (
        "The blocks were presented in the same order for all participants."
    )
    randomised = replace(base, protocol={"study": {}, "groups": groups})
    assert methods._groups(randomised) == (
        "Participants were randomised in permuted blocks to the groups old and new, with an allocation ratio of 2:1."
    )
    existing = replace(
        base, protocol={"study": {"group_assignment": "pre-existing"}, "groups": groups},
        participants=base.participants.assign(group=["new", "new", "old"]),
    )  # fmt: skip
    assert methods._groups(existing).startswith(
        "Participants were assigned to the groups old (n = 1) and new (n = 2) by an existing attribute, which was"
    )
    assert methods._groups(base) == ""


@pytest.mark.parametrize(
    ("order", "words"),
    [
        ("fixed", "in the same order for all participants"), ("shuffled", "in a random order for each participant"),
        ("constrained", "in a constrained random order for each participant"),
        ("williams", "in orders from a Williams design"), ("latin", "in orders from a Latin square"),
    ],
)  # fmt: skip
def test_methods_name_the_conditions_of_a_block_and_their_order(order: str, words: str) -> None:
    of_liquids, of_delays = made(), study(delays([50, 10.5]), list(everybody(delays([50, 10.5]), 2, lambda *_: 4)))
    said = {}
    for unordered in (of_liquids, of_delays):
        shown = replace(unordered, protocol={"blocks": {"b": {"order": order}}})
        (block,) = shown.blocks
        said[block.kind] = methods._presented(shown, block, result_of(shown))
        sealed = methods._presented(shown, block, replace(result_of(shown), revealed=False))
        assert sealed.startswith(
            f"In “Stirring”, {'two' if block.kind == 'delays' else 'three'} settings were presented {words};"
        )
    assert said == {
        "liquids": f"In “Stirring”, three liquids (name l1, name l2 and name l3) were presented {words}; participants "
        "rated two statements after each presentation.",
        "delays": f"In “Stirring”, two visual delays (10.5 and 50 ms) in water were presented {words}; participants "
        "rated two statements after each presentation.",
    }


def test_achieved_delays_and_lost_trials_are_stated_by_condition() -> None:
    shown = study(delays([10, 50]), list(everybody(delays([10, 50]), 2, lambda *_: 4)))
    rows = [
        SimpleNamespace(block="b", delay_ms=ms, achieved_ms=got)
        for ms, got in ((10.0, 12.34), (50.0, 53.06), (None, 9.0))
    ]
    results: Any = SimpleNamespace(blocks=[result_of(shown)], delivered=rows)
    assert list(methods._delays(shown, results)) == [
        "The mean achieved delays in “Stirring” (requested delays in parentheses) were 12.3 ms (10 ms) and 53.1 ms (50 "
        "ms), measured with the program's clock and excluding display latency."
    ]
    for row in rows:
        row.achieved_ms = None
    assert list(methods._delays(shown, results)) == ["The achieved delays in “Stirring” were not measured."]
    lost = [
        SimpleNamespace(count=count, asked=40, tracks={("b", "D1"): count}, reason_texts=["late"]) for count in (3, 0)
    ]
    people = shown.participants.assign(missing=lost, counted=[False, True])
    levels: Any = (SimpleNamespace(id="b", title="Tracks"),)
    some = replace(shown, levels=levels, participants=people, protocol={"limits": {MISSING_PERCENT: 12.5}})
    assert text_of(sections._missing(some)) == (
        "Trials that were not delivered Session missing of which reason session P000, session 1 3 of 40 Tracks, "
        "delay_1: 3 late not included The study permits up to 12.5 % of a session's trials to be missing. A session "
        "with more missing trials counts as incomplete and is excluded, unless it has been included again."
    )
    none = replace(some, participants=people[1:], protocol={})
    assert text_of(sections._missing(none)) == "Trials that were not delivered All trials were delivered."
    assert methods._missing_trials(none) == "All interval trials in the main blocks met the limits for valid trials."
    assert list(sections._missing(replace(none, levels=()))) == []


def test_motion_has_a_row_for_each_condition_with_its_measures() -> None:
    shown = made()
    moved = [
        SimpleNamespace(
            block="b", code=code, measure=measure, n=n, median=number + 0.26, q1=number - 1.5, q3=number + 2.0
        )
        for number, (code, measure, n) in enumerate(
            (("L1", "duration_s", 3), ("L1", "path_mm", 2), ("L3", "path_mm", 4), ("L2", "path_mm", 0)), start=7
        )
    ]
    measured: Any = SimpleNamespace(
        moved=moved,
        reaching=("b",),
        recorded_in=lambda _block: True,
        trials=9,
        recorded=8,
        unread=(),
        judged=0,
        invalid=0,
    )
    rows = [
        SimpleNamespace(block="b", code=code, valid=number, judged=9) for number, code in enumerate(("L1", "L2", "L3"))
    ]
    results: Any = SimpleNamespace(blocks=[result_of(shown)], performance=measured, delivered=rows)
    text = text_of(sections.motion(results))
    assert text.startswith(
        "Motion and force Stirring Liquid n duration, s path, mm trials within limits Name L1 3 7.26 (5.50–9.00) 8.3 "
        "(6.5–10.0) 0 of 9 Name L3 4 – 9.3 (7.5–11.0) 2 of 9 Reaching measures are based on the recordings of 8 of 9 "
        "reaching trials. No data are available on"
    )
    results.performance = None
    assert text_of(sections.motion(results)).endswith("only after unblinding, because they reveal liquids and delays.")


@pytest.mark.parametrize(
    ("changes", "begins"),
    [
        ({"settings": {}}, "The key is sealed: conditions appear as codes, and the report shows only counts and"),
        (
            {"settings": {}, "protocol": {"study": {"codes": "participant"}}},
            "Until unblinding, each participant has separate codes, so conditions cannot be compared.",
        ),
        ({"settings": {}, "sites": ("A",)}, "Each site has its own key. Until all sites are unblinded, each code begi"),
        ({"simulated": True}, "The participants were SIMULATED, so this report is not evidence about people."),
        ({"pilot": True}, "These are pilot sessions, so do not report them as results of the study."),
        ({"made": False}, "The study file does not plan the analysis (the table [analysis] is missing), so all re"),
        ({"changed": True}, "The decisions about the analysis changed between sessions, so all results are expl"),
        ({"people": 1}, "There is only one participant, so the results do not generalise to other people."),
        ({"people": 2}, "Intervals for mean rank correlations and exploratory tests of means need at least"),
    ],
)  # fmt: skip
def test_each_limitation_is_stated_where_it_applies_alone(changes: dict[str, Any], begins: str) -> None:
    settings, decided = liquids(2), {name: changes.pop(name) for name in ("made", "changed") if name in changes}
    shown = study(settings, list(everybody(settings, changes.pop("people", 12), lambda *_: 4)))
    flags = {name: changes.pop(name, False) for name in ("simulated", "pilot")}
    shown = replace(shown, participants=shown.participants.assign(**flags, protocol_hash="h"), **changes)
    results: Any = SimpleNamespace(
        decided=replace(shown.decided, **decided), contrasts=(), questions=(), blocks=[result_of(shown)], levels=()
    )
    lines = list(sections._in_general(shown, results))
    assert [line for line in lines if line.startswith(begins)]
    assert len(lines) == 1 + ("codes" in str(shown.protocol.get("study")) or bool(shown.sites)) + (shown.n == 1)
