"""The head, sections and files of a report for studies made up by hand."""

import csv
import io
import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest

from study_app.analysis.data.motion import MovementQuartiles
from study_app.analysis.data.study_tables import Study
from study_app.analysis.page_layout import Picture
from study_app.analysis.report import study_figures, write_report
from study_app.analysis.results import BlockResult, Delivered, Failure, Failures
from study_app.store.exclusions import Exclusion
from tests.analysis.made_up import DECIDED, delays, everybody, liquids, study
from tests.golden_values import page_lines

MADE = study(liquids(2), list(everybody(liquids(2), 4, lambda *_: 4)))


def exclusion_of(person: str, rule: str, trial: int | None = None) -> Exclusion:
    return Exclusion(
        participant=person, session=1, trial=trial, rule_or_person=rule, reason="r", excluded_at="2026-03-02T09:00:00"
    )


def of_people(*states: tuple[str, int, bool, bool], **changes: Any) -> Study:
    """Return a study with these sessions: participant, session, is counted, is excluded."""
    rows = pd.concat([MADE.participants.iloc[:1]] * len(states), ignore_index=True)
    columns = dict(zip(("participant", "session", "counted", "excluded"), zip(*states, strict=True), strict=True))
    people = rows.assign(**columns, started_at=[f"2026-01-{place:02d}T10:00" for place in range(9, 9 + len(states))])
    people = people.assign(protocol_hash="h", version="0.9", seed=7, key_hash="k", device="falcon")
    return replace(MADE, participants=people, **changes)


IN, OUT, GONE = (True, False), (False, True), (False, False)


@pytest.mark.parametrize(
    ("states", "changes", "facts"),
    [
        ([("P1", 1, *IN)], {}, "1 participant. Sessions on 2026-01-09."),
        ([("P1", 1, *IN), ("P2", 1, *IN)], {},
         "Two participants. All were included. Sessions from 2026-01-09 to 2026-01-10."),
        ([("P1", 1, *IN), ("P2", 1, *IN), ("P2", 2, *GONE)], {"protocol": {"analysis": {"participants": 5}}},
         "Two participants. All were included, but 1 of 3 sessions was not; 5 were planned. Sessions from 2026-01-09 "
         "to 2026-01-10."),
        ([("P1", 1, *IN), ("P2", 1, *OUT), ("P3", 1, *GONE), ("P4", 1, *OUT), ("P5", 1, *OUT)],
         {"exclusions": (*(exclusion_of(who, by) for who, by in (("P2", "AK"), ("P4", "catch"), ("P5", "catch"))),
                         exclusion_of("P3", "BL", 2), exclusion_of("P4", "AK", 3))},
         "1 participant. 4 of 5 were not included (errors in catch trials: 2, a researcher's decision: 1, unfinished "
         "session: 1; see “How the study was run”). Sessions on 2026-01-09."),
        ([("P1", 1, *IN), ("P2", 1, *GONE)], {}, "1 participant. 1 of 2 was not included (unfinished session: 1; see "
         "“How the study was run”). Sessions on 2026-01-09."),
        ([("P1", 1, *GONE)], {}, "0 participants. 1 of 1 was not included (unfinished session: 1; see “How the study "
         "was run”). "),
    ],
)  # fmt: skip
def test_the_page_begins_with_participants_and_dates(states: Any, changes: dict[str, Any], facts: str) -> None:
    text = write_report._facts_sentences(of_people(*states, **changes))
    assert text.partition(". ")[2].replace("No participants", "0 participants") == facts


def test_marks_say_that_participants_are_simulated_and_that_the_study_is_a_pilot_or_blinded() -> None:
    simulated, blinded = (
        ("mark", "SIMULATED participants, not people"),
        ("sealed", "Blinded: conditions appear as codes"),
    )
    people = MADE.participants
    assert write_report._marks(MADE) == [simulated]
    assert write_report._marks(replace(MADE, settings={}, participants=people.assign(pilot=True))) == [
        simulated, ("mark", "PILOT"), blinded,
    ]  # fmt: skip
    assert write_report._marks(replace(MADE, participants=people.assign(simulated=False))) == []


def test_sessions_have_their_provenance_and_the_number_of_missing_trials() -> None:
    case_study = of_people(("P1", 2, *IN), ("P2", 1, *GONE))
    provenance = {
        "status": "completed",
        "seed": 7,
        "protocol_hash": "h",
        "key_hash": "k",
        "version": "0.9",
        "device": "falcon",
    }
    rows = write_report.sessions(case_study)
    assert rows == [
        {"participant": "P1", "session": 2, "counted": True, **provenance},
        {"participant": "P2", "session": 1, "counted": False, **provenance},
    ]
    lost = case_study.participants.assign(missing=[SimpleNamespace(count=3, asked=40), None])
    levels: Any = ("pitch",)
    counts = [
        row["trials_missing"] for row in write_report.sessions(replace(case_study, participants=lost, levels=levels))
    ]
    assert counts == [3, None]


def block(name: str, kind: Any = "liquids", n: int = 4) -> BlockResult:
    settings = delays((0, 40)) if kind == "delays" else liquids(2)
    return BlockResult(
        id=name, title=f"Block {name}", kind=kind, revealed=True, n=n, settings=settings, names=("Thin", "Wax"),
        items=(), labels=(), measures=(),
    )  # fmt: skip


def test_motion_has_the_trials_of_its_own_block_and_condition() -> None:
    def quartiles(of: str, code: str, median: float) -> MovementQuartiles:
        return MovementQuartiles(block=of, code=code, measure="path_mm", n=3, median=median, q1=1.0, q3=9.5)

    def delivered(of: str, code: str, trials: int) -> Delivered:
        return Delivered(
            block=of, code=code, delay_ms=None, trials=trials, measured=0, judged=trials - 1, valid=trials - 2,
            error_mean_ms=None, error_worst_ms=None, achieved_ms=None,
        )  # fmt: skip

    quartile_rows = quartiles("a", "L2", 4.5), quartiles("b", "L1", 5.5)
    counts = delivered("a", "L1", 10), delivered("a", "L2", 20), delivered("b", "L1", 30)
    results: Any = SimpleNamespace(
        performance=SimpleNamespace(moved=quartile_rows), trial_blocks=(block("a"), block("b")), delivered=counts
    )
    rows = list(csv.DictReader(io.StringIO(write_report.motion_csv(results).decode())))
    assert [list(row.values()) for row in rows] == [
        ["a", "L2", "Wax", "path_mm", "3", "4.5", "1.0", "9.5", "20", "19", "18"],
        ["b", "L1", "Thin", "path_mm", "3", "5.5", "1.0", "9.5", "30", "29", "28"],
    ]
    results.performance = None
    assert write_report.motion_csv(results).count(b"\n") == 1


def test_report_json_has_the_sealing_exclusions_doubts_and_failures(monkeypatch: pytest.MonkeyPatch) -> None:
    early, late = exclusion_of("P1", "AK"), exclusion_of("P2", "BL")
    doubt: Any = SimpleNamespace(path=MADE.folder / "data" / "x.csv", what="differs")
    case_study = of_people(("P1", 1, *IN), exclusions=(early, late), late=(late,), doubts=(doubt,), settings={})
    monkeypatch.setattr(write_report, "plug_ins", lambda _study: {})
    monkeypatch.setattr(write_report, "files", lambda _study: {"a.csv": "1f"})
    monkeypatch.setattr(write_report, "reveals_of", lambda _folder: [{"by": "AK"}])
    monkeypatch.setattr(write_report, "preregistration_folders", lambda _study: {"": Path("nowhere")})
    failures = Failures([Failure(what="figure x", error="ValueError: y", where="z.py, line 3", block="b")])
    texts = {"findings": ("one", "two"), "limits": ("few",), "methods": "We did."}
    content = json.loads(write_report.document(case_study, {"n": 3}, texts, failures))  # type: ignore[arg-type]
    assert {name: content[name] for name in (*texts, "files", "results", "format")} == {
        "findings": ["one", "two"], "limits": ["few"], "methods": "We did.", "files": {"a.csv": "1f"},
        "results": {"n": 3}, "format": 1,
    }  # fmt: skip
    assert [(row["participant"], row["after_unblinding"]) for row in content["exclusions"]] == [
        ("P1", False),
        ("P2", True),
    ]
    assert content["doubts"] == [{"file": "data/x.csv", "what": "differs"}]
    assert (content["study"]["blinded"], content["study"]["key_opened"]) == (True, [{"by": "AK"}])
    (failure,) = content["failures"]
    assert (failure["what"], failure["block"], failure["where"]) == ("figure x", "b", "z.py, line 3")
    assert "please report it" in failure["why"]
    assert "preregistration" not in content
    monkeypatch.setattr(write_report, "sessions", lambda _study: 1 / 0)
    broken = json.loads(write_report.document(case_study, {}, texts, failures))  # type: ignore[arg-type]
    assert broken["sessions"] is None
    assert broken["failures"][-1]["what"] == "report.json, sessions"


def test_the_page_has_its_sections_in_order_without_the_figures_of_the_first_page(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def section(name: str) -> Any:
        return lambda *arguments, **_: [
            write_report.heading(2, name),
            write_report.paragraph(",".join(map(shown, arguments))),
        ]

    def shown(value: Any) -> str:
        if isinstance(value, list):
            return "+".join(picture.name for picture in value)
        return value.title if isinstance(value, BlockResult) else value if isinstance(value, str) else "·"

    names = "question_section", "verdicts_mean", "groups", "planned_section", "conduct", "counts_of_answers"
    for name in (*names, "block"):
        monkeypatch.setattr(write_report.sections, name, section(name))
    monkeypatch.setattr(write_report.sections, "places", lambda _results: {"end": "Goodbye: form"})
    for name in (
        "contrast_section",
        "motion_section",
        "preregistration_section",
        "_reproduction_sentences",
        "appendix",
    ):
        monkeypatch.setattr(write_report, name, section(name))
    monkeypatch.setattr(write_report, "recorded_contents", lambda _folder: "contents")
    monkeypatch.setattr(write_report, "cards", lambda *_: ())
    monkeypatch.setattr(write_report, "figures_shown", lambda *_: {"late"})
    monkeypatch.setattr(write_report, "presented_in", lambda _study: {})
    monkeypatch.setattr(
        write_report, "first_page", lambda _results, limits, *_: write_report.paragraph(f"first {limits[0]}")
    )
    pictures = [Picture(block="b", name=name, caption="", files={}) for name in ("late", "early")]
    results: Any = SimpleNamespace(blocks=(block("a"), block("b")), contrasts=())
    texts = {"limits": ("few",), "methods": "We did."}
    page = write_report._render_page(of_people(("P1", 1, *IN)), results, {}, pictures, texts, None, Failures())
    lines = [line for line in page_lines(page.partition("<body")[2]) if not line.startswith("/")]
    order = [
        "contrast_section", "block", "block", "question_section", "verdicts_mean", "groups", "groups", "motion_section",
        "planned_section", "conduct", "preregistration_section", "Methods (text to paste)", "_reproduction_sentences",
        "Licence and citation", "counts_of_answers", "appendix",
    ]  # fmt: skip
    heads = [line for line in lines if line in order]
    assert heads == order
    assert "first few" in lines
    assert "Block a,·,early,·" in lines
    assert "end,·,·,early" in lines
    assert "·,·,site" in lines
    assert "We did." in lines
    assert "contents" in lines
    assert "Authors: not stated." in lines


@pytest.mark.parametrize(
    ("kinds", "names"),
    [
        (("liquids", "delays"), ["liquids effects-b0 recognition", "delays effects-b1 recognition"]),
        (("delays", "delays"), [f"delays-{of} effects-{of} recognition-{of}" for of in ("b0", "b1")]),
        (("liquids",), ["liquids effects recognition"]),
    ],
)
def test_figures_of_blocks_have_the_name_of_the_block_if_another_block_has_one_alike(
    kinds: tuple[Any, ...], names: list[str]
) -> None:
    blocks = tuple(
        replace(MADE.blocks[0], id=f"b{place}", kind=kind, settings=block("", kind).settings)
        for place, kind in enumerate(kinds)
    )
    case_study, of_blocks = replace(MADE, blocks=blocks), [block(f"b{place}", kind) for place, kind in enumerate(kinds)]
    results: Any = SimpleNamespace(blocks=of_blocks, decided=DECIDED)
    tasks = list(study_figures.block_figure_tasks(case_study, results, ("svg",)))
    for expected_names, of_block in zip(blocks, names, strict=True):
        assert " ".join([name for of, name, _ in tasks if of == expected_names.id][:3]) == of_block
    nobody: Any = SimpleNamespace(blocks=[replace(shown_block, n=0) for shown_block in of_blocks])
    assert list(study_figures.block_figure_tasks(case_study, nobody)) == []
