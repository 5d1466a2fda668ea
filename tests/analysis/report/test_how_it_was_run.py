"""The sentences and tables about how a study was run, for values that all differ.

People change ``how_it_was_run.txt``; no option regenerates it.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest

from study_app.analysis.data.study_tables import Study
from study_app.analysis.figures.summary_figures import Numbers
from study_app.analysis.report import first_page, methods, practice_and_breaks, sections
from study_app.analysis.report.motion_section import motion_section
from study_app.analysis.results import BlockResult, Delivered, GroupAnswers, LevelsResult, QuestionResult
from study_app.protocol.questions import ShowIf
from study_app.store.exclusions import Exclusion
from study_app.store.session_progress.missing_trials import MISSING_PERCENT
from study_app.store.withdrawals import Tombstone
from tests.analysis.made_up import delays, everybody, liquids, study
from tests.analysis.report.read_report import seen
from tests.golden import check_kept

LIQUIDS = study(liquids(3), list(everybody(liquids(3), 3, lambda *_: 4)))
DELAYS = study(delays([50, 10.5]), list(everybody(delays([50, 10.5]), 2, lambda *_: 4)))
GROUPS = {"old": {"share": 2, "sequence": ["c", "b"]}, "new": {"share": 1, "sequence": ["b", "c"]}}


def exclusion(participant: str, trial: int | None = None, by: str = "AK") -> Exclusion:
    """Return an exclusion whose reason names its participant."""
    return Exclusion(
        participant=participant, session=2, trial=trial, rule_or_person=by, reason=f"{participant} spoke",
        excluded_at="2026-03-02T09:00:00+00:00",
    )  # fmt: skip


def result_of(of: Study) -> BlockResult:
    """Return the result of a study's block without answers."""
    (block,) = of.blocks[:1]
    return BlockResult(
        id="b", title="Stirring", kind=block.kind, revealed=True, n=3, settings=block.settings,
        names=tuple(f"Name {setting.code}" for setting in block.settings), items=block.items, labels=(), measures=(),
    )  # fmt: skip


def results(of: Study, **values: Any) -> Any:
    """Return results with one block."""
    fields = {
        "blocks": [result_of(of)],
        "contrasts": (),
        "questions": (),
        "levels": (),
        "delivered": (),
        "orders": {},
        "scores": (),
        "block_orders": None,
        "unrated_blocks": (),
    } | values
    return SimpleNamespace(decided=of.decided, trial_blocks=fields["blocks"], **fields)


def text_of(parts: Iterable[Any]) -> str:
    """Return the text of parts of a page without its tags."""
    return seen("".join(map(str, parts))).strip()


def conduct() -> Iterator[str]:
    people = LIQUIDS.participants.assign(
        participant=["A-P1", "A-P2", "B-P1"], status=["completed", "aborted", "completed"],
        counted=[True, False, True], excluded=[False, False, False], motors_masked=["no", "with noise", "no"],
    )  # fmt: skip
    withdrawal = Tombstone(participant="A-P9", at="2026-02-03T10:00:00", by="BL", reason="asked", sessions=())
    out = exclusion("B-P1", 7), exclusion("A-P1")
    changed: Any = SimpleNamespace(path=Path("nowhere/data/x.csv"), what="differs")
    case_study = replace(
        LIQUIDS,
        participants=people,
        sites=("A", "B"),
        withdrawn=(withdrawal,),
        exclusions=out,
        late=out[1:],
        doubts=(changed,),
    )
    yield text_of(sections.conduct(case_study, results(case_study, blocks=())))
    yield methods.late_exclusions(case_study)
    yield methods.late_exclusions(replace(case_study, exclusions=out[:1]))
    yield methods._exclusion_sentences(case_study)
    yield methods._exclusion_sentences(replace(LIQUIDS, exclusions=(exclusion("P001", 7), *out)))
    yield methods._exclusion_sentences(replace(LIQUIDS, exclusions=(exclusion("P1", by="fast_answers"),), settings={}))
    yield from (" ".join(sections._first_lines([*map(str, range(count))])) for count in (20, 23))


def delivered() -> Iterator[str]:
    limits = {"delay_error_p95_ms": 4.0, "withheld_percent": 2.5}
    case_study = replace(DELAYS, protocol={**DELAYS.protocol, "limits": limits})
    fields = (
        "block", "code", "delay_ms", "trials", "measured", "judged", "valid", "error_mean_ms", "error_worst_ms",
        "achieved_ms",
    )  # fmt: skip
    rows: list[tuple[Any, ...]] = [
        ("b", "D1", 50.0, 9, 8, 7, 6, 1.24, -3.5, 53.06), ("b", "D2", 10.5, 5, 5, 0, 0, None, None, None),
        ("b", None, None, 14, 13, 7, 5, -0.5, 2.26, None), ("b", "D2", 0.0, 5, 5, 5, 4, 0.5, 1.0, 2.0),
    ]  # fmt: skip
    study_results = results(case_study, delivered=[Delivered(**dict(zip(fields, row, strict=True))) for row in rows])
    yield text_of(sections._delivered_delays_part(case_study, study_results))
    yield text_of(sections._delivered_delays_part(replace(case_study, settings={}), study_results)).rpartition(
        "Trials that exceed"
    )[2]
    yield text_of(sections._delivered_delays_part(replace(case_study, settings={}), study_results)).partition(
        "Delay error is"
    )[0]
    yield "; ".join(sections._limit_text(what, 7.0) for what in ("frame_gap_ms", "hz", "withheld_percent"))
    yield "; ".join(sections._signed_ms(value) for value in (None, 0.0, 1.5, -1.5))
    yield from methods._delay_sentences(case_study, study_results)
    study_results.delivered = [replace(delivery, achieved_ms=None) for delivery in study_results.delivered]
    yield from methods._delay_sentences(case_study, study_results)


def lost_trials() -> Iterator[str]:
    lost = [SimpleNamespace(count=n, asked=40, tracks={("b", "D1"): n}, reason_texts=["late"]) for n in (3, 0)]
    people = DELAYS.participants.assign(missing=lost, counted=[False, True])
    levels: Any = (SimpleNamespace(id="b", title="Tracks"),)
    some = replace(DELAYS, levels=levels, participants=people, protocol={"limits": {MISSING_PERCENT: 12.5}})
    measured = pd.DataFrame({"counted": [True], "valid": [True]})
    none = replace(some, participants=people[1:], protocol={}, intervals=measured)
    yield from (text_of(sections._missing_trials_part(blocks)) for blocks in (some, none, replace(none, levels=())))
    yield methods._missing_trials_sentence(none)


def groups() -> Iterator[str]:
    ids = {f"P00{number}": f"{'BBA'[number]}-P00{number}" for number in range(3)}
    renamed = {
        name: getattr(LIQUIDS, name).assign(participant=getattr(LIQUIDS, name)["participant"].map(ids))
        for name in ("participants", "responses", "trials")
    }
    case_study = replace(LIQUIDS, sites=("A", "B"), **renamed)
    values = case_study.responses["participant"].map({"B-P000": 1, "B-P001": 3, "A-P002": 6}).astype("Int64")
    people = case_study.participants.assign(group=pd.array(["zoo", "zoo", "art"], "string"))
    case_study = replace(case_study, participants=people, responses=case_study.responses.assign(response=values))
    by: Any
    for by, group in (("group", "randomised"), ("group", "pre-existing"), ("site", "pre-existing")):
        of = {**case_study.protocol, "groups": {"zoo": {}}, "study": {"group_assignment": group}}
        yield text_of(sections.groups(replace(case_study, protocol=of), results(case_study), by))
    yield text_of(sections.groups(LIQUIDS, results(LIQUIDS)))


def methods_of_a_study() -> Iterator[str]:
    base = replace(LIQUIDS, title="Oils", estimator="kalman")
    scene = {"scale": 4.0, "body": {"diameter_m": 0.068}}
    device = replace(base, protocol={"device": {"rate_hz": 2000.0, "force_limit_n": 3.5}, "scene": scene})
    used = base.participants.assign(device=["falcon:2", "mouse", None])
    yield methods._apparatus_sentence(replace(device, participants=used))
    yield methods._apparatus_sentence(replace(device, participants=used[1:], estimator="device"))
    yield methods._apparatus_sentence(replace(device, participants=used.assign(device="answers-only"), estimator=None))
    tables = {
        f"liquid{number}": {"density_kg_m3": 900 + number, "drag": {"damping_nspm": None}, "effects": ()}
        for number in (1, 2)
    }
    yield methods._liquid_sentence(replace(base, liquids=tables))
    yield methods._liquid_sentence(replace(base, liquids={"liquid2": tables["liquid2"]}))
    two = replace(base, blocks=(base.blocks[0], replace(base.blocks[0], id="c", title="Second")))
    for order in ("fixed", "random", "balanced"):
        yield methods._block_order_sentence(replace(two, protocol={"study": {"block_order": order}, "groups": GROUPS}))
    yield methods._block_order_sentence(replace(two, protocol={}))
    members = base.participants.assign(group=["new", "new", "old"])
    yield methods._group_sentence(replace(base, protocol={"study": {}, "groups": GROUPS}))
    existing = {"study": {"group_assignment": "pre-existing"}, "groups": GROUPS}
    yield methods._group_sentence(replace(base, protocol=existing, participants=members))
    yield f"{methods._block_order_sentence(base)}{methods._group_sentence(base)}none"
    for order in ("fixed", "shuffled", "constrained", "williams", "latin"):
        for of in (LIQUIDS, DELAYS):
            shown_in = replace(of, protocol={"blocks": {"b": {"order": order}}})
            yield methods._presentation_sentence(
                shown_in, of.blocks[0], replace(result_of(of), revealed=order != "latin")
            )


def planned() -> Iterator[str]:
    included, out = SimpleNamespace(name="kept"), SimpleNamespace(name="out")
    listed_tests = {
        "kept": [("Liquids", "Same?", "shown", "yes")],
        "out": [("Liquids", "Same?", "open", "no"), ("Delays", "When?", "shown", "50")],
    }
    row = SimpleNamespace(
        participant="P7", session=3, rule="fast_answers", why="too fast", decision="excluded", by="AK"
    )
    rules: Any = SimpleNamespace(proposals=(row,), included=included, left_out=out)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sections, "conclusions", lambda results: listed_tests[results.name])
        patch.setattr(sections, "level_sentences", lambda results: (f"Track: {results.name}",))
        yield text_of(sections.planned_section(rules))
        rules.left_out = included
        yield text_of(sections.planned_section(rules)).rpartition("AK ")[2]
        yield text_of(sections.planned_section(rules, sealed=True)).rpartition("AK ")[2]
    yield f"{[*sections.planned_section(None)]}"


def motion() -> Iterator[str]:
    measures = ("L1", "duration_s", 3), ("L1", "path_mm", 2), ("L3", "path_mm", 4), ("L2", "path_mm", 0)
    motion_rows = [
        SimpleNamespace(block="b", code=code, measure=what, n=n, median=at + 0.26, q1=at - 1.5, q3=at + 2.0)
        for at, (code, what, n) in enumerate(measures, start=7)
    ]
    elsewhere = SimpleNamespace(block="c", code="L1", measure="path_mm", n=9, median=99.0, q1=98.0, q3=100.0)
    motion_rows = [elsewhere, *motion_rows, elsewhere]
    measured: Any = SimpleNamespace(
        moved=motion_rows, reaching=("b",), recorded_in=lambda _block: True, trials=9, recorded=8, unread=(), judged=0,
        invalid=0,
    )  # fmt: skip
    rows = [
        SimpleNamespace(block=block, code=f"L{at}", valid=at, judged=9)
        for block, at in zip("bbbc", (1, 2, 3, 1), strict=True)
    ]
    rows[-1].valid = 8
    study_results = results(LIQUIDS, performance=measured, delivered=rows)
    yield text_of(motion_section(study_results)).partition("duration, s: from")[0]
    study_results.performance = None
    yield text_of(motion_section(study_results))


def limitation_lines() -> Iterator[str]:
    cases: list[dict[str, Any]] = [
        {}, {"settings": {}}, {"settings": {}, "protocol": {"study": {"codes": "participant"}}},
        {"settings": {}, "sites": ("A",)}, {"simulated": True}, {"pilot": True}, {"made": False}, {"changed": True},
        {"people": 1}, {"people": 2},
    ]  # fmt: skip
    for case in cases:
        changes = dict(case)
        case_study = study(liquids(2), list(everybody(liquids(2), changes.pop("people", 12), lambda *_: 4)))
        decided = replace(
            case_study.decided, **{name: changes.pop(name) for name in ("made", "changed") if name in changes}
        )
        flags = {name: changes.pop(name, False) for name in ("simulated", "pilot")}
        case_study = replace(
            case_study, participants=case_study.participants.assign(**flags, protocol_hash="h"), **changes
        )
        yield f"-- {case}"
        yield from (line[:90] for line in sections._general_sentences(case_study, replace_decided(case_study, decided)))


def replace_decided(shown: Study, decided: Any) -> Any:
    study_results = results(shown)
    study_results.decided = decided
    return study_results


def first_page_of_questions() -> Iterator[str]:
    for of in (LIQUIDS, DELAYS):
        yield from (presented.sentence for presented in first_page.presented_in(of).values())
    groups = [
        GroupAnswers(code, name, {"n": n, "participants": n, "counts": {"left": n - 2, "right": 2}})
        for code, name, n in (("L1", "Water", 9), ("L2", "Honey", 7), ("L3", "Oil", 0))
    ]
    question_results = [
        QuestionResult(
            where=where, title=title, is_form=is_form, item=item, text="Which hand?", short=f"Hand {item}",
            kind="choice", measure=measure, figure=None, groups=tuple(groups[:count]),
        )
        for where, title, is_form, item, measure, count in (
            ("b", "Stirring", False, "i1", "counts", 2), ("end", "Goodbye", True, "i2", "counts", 1),
            ("end", "Goodbye", True, "i3", "quartiles", 1),
        )
    ]  # fmt: skip
    fields = {"P1": 2.0, "P2": 5.0, "P3": 3.5}
    numbers = {
        "b": (
            Numbers("Warm", (1.0, 7.0), False, (("Water", fields), ("Honey", {"P1": 1.0, "P2": 3.0, "P3": 1.0}))),
            Numbers("SUS", None, True, (("", fields),)),
        ),
        "end": (Numbers("Age", None, False, (("", {"P1": 20.0, "P2": 31.0}),)),),
    }
    study_results = results(LIQUIDS, questions=question_results, blocks=[])
    yield from map(str, first_page.cards(study_results, numbers))
    levels = [
        SimpleNamespace(block=block, revealed=revealed, vary=vary)
        for block, revealed, vary in (("end", True, None), ("c", False, None), ("b", True, "delay_ms"))
    ]
    for shown_levels in (levels, levels[1:2], [SimpleNamespace(block="b", revealed=True, vary=None)]):
        yield str(sections.places(results(LIQUIDS, questions=question_results, blocks=[], levels=shown_levels)))
    repeated = replace(question_results[1], groups=(replace(groups[0], code="b"), replace(groups[1], code="c")))
    for main in (levels[1:], levels[2:]):
        yield sections.place_title(repeated, results(LIQUIDS, questions=question_results[:1], levels=main, blocks=[]))
    yield from (first_page._setting_text(name) for name in ("Water", "After Stirring"))
    lines = ["Oils: too few (P1).", "Waxes: too few (P2).", "sealed", "Oils: late", "Waxes: late", "Oils: few (P1)."]
    titles = [SimpleNamespace(title=title) for title in ("Oils", "Waxes")]
    yield from map(str, first_page._limits_by_subject(lines, results(LIQUIDS, blocks=[], levels=titles)))


def first_page_of_levels() -> Iterator[str]:
    group = [SimpleNamespace(standard=at, threshold=at / 40, low=0.1, high=0.1 * at, n=int(at)) for at in (8.0, 12.0)]
    of_pse = [SimpleNamespace(standard=None, pse=9.5, low=None, high=None, n=5)]
    level = LevelsResult(
        block="b", title="Thickness", design="pair", revealed=True, times=(), summary="share", counts="correct",
        unit="N·s/m", level_kind="weber",
    )  # fmt: skip
    for shown_level, attribute, words, rows in (
        (level, "threshold", "threshold", group), (replace(level, level_kind="value"), "pse", "PSE", of_pse),
        (replace(level, revealed=False), "pse", "PSE", of_pse),
    ):  # fmt: skip
        with pytest.MonkeyPatch.context() as patch:
            estimates = SimpleNamespace(attribute=attribute, words=words, group=rows)
            patch.setattr(first_page, "estimates_of", lambda _level, estimates=estimates: estimates)
            patch.setattr(first_page, "place_of", lambda level: level.standard)
            study_results = results(LIQUIDS, blocks=[], levels=[shown_level])
            yield from map(str, first_page.cards(study_results, presented={"b": first_page.Presented("With oil.")}))


def hypotheses() -> Iterator[str]:
    def side(name: str, low: float, high: float, n: int, sd: float) -> Any:
        return SimpleNamespace(name=name, low=low, high=high, values=dict.fromkeys(range(n), 1.0), sd=sd)

    def hypothesis(measure: str, sides: tuple[Any, ...], **changes: Any) -> Any:
        contrast = SimpleNamespace(measure=measure, groups=None, expected=None, is_interaction=False, blocks=("b",))
        fields = {"p_adjusted": 0.3, "verdict": "inconclusive", "members": 2, "n": 12, "sd": 1.5, "ratio": False}
        fields |= {"standard_error": None, "largest": 6.0}
        of_contrast = {name: changes.pop(name) for name in ("groups", "expected") if name in changes}
        return SimpleNamespace(
            contrast=SimpleNamespace(**(vars(contrast) | of_contrast)), sides=sides, **(fields | changes)
        )

    two = side("water", -0.5, 0.5, 12, 0.8), side("oil", 0.1, 0.9, 12, 1.1)
    groups = side("old", -1.0, 0.0, 9, 0.8), side("new", 0.2, 0.9, 14, 1.1)
    for rows in (
        [hypothesis("d_prime", two), hypothesis("item", two, expected="higher", n=9)],
        [hypothesis("item", groups, groups=("old", "new"), ratio=True)],
        [hypothesis("d_prime", groups, verdict="equivalent")],
        [hypothesis("item", (side("a", 0, 1, 3, 5.0), side("b", 0, 1, 3, 5.0)), sd=40.0)],
    ):
        yield from sections._low_power_sentences(results(LIQUIDS, contrasts=rows))
        yield from sections._chance_level_sentences(results(LIQUIDS, contrasts=rows))
    trials = LIQUIDS.trials.assign(worst_gap_ms=[31.0, 5.0, 40.0, *[3.0] * 6], lateness_p99_ms=[9.0, *[1.0] * 8])
    kept_limits = {"worst_gap_ms": 20.0, "lateness_ms": 2.0}
    yield sections._violated_limits_sentence(replace(LIQUIDS, trials=trials), kept_limits)
    yield sections._violated_limits_sentence(replace(LIQUIDS, trials=trials[3:]), kept_limits) + "none"


PARTS = (
    first_page_of_questions,
    first_page_of_levels,
    hypotheses,
    conduct,
    delivered,
    lost_trials,
    groups,
    methods_of_a_study,
    planned,
    motion,
    limitation_lines,
)


def test_each_sentence_and_table_has_its_own_values() -> None:
    lines = (line for part in PARTS for line in (f"== {part.__name__}", *part()))
    check_kept(Path(__file__).with_name("how_it_was_run.txt"), lines)


def test_the_methods_state_practice_trials_and_breaks() -> None:
    trials = LIQUIDS.trials.assign(block="warm_up")
    blocks = {
        "warm_up": {"phase": "practice", "title": "Warm-up", "until": {"right": 4, "of": 4, "missed": "end"}},
        "b": {"phase": "main", "title": "Stirring", "break_every": 3, "break_page": "rest"},
        "c": {"phase": "main", "title": "Lifting"},
    }
    pages = {"rest": {"kind": "break", "min_s": 30}, "pause": {"kind": "break", "min_s": None}}
    parts = {"blocks": blocks, "pages": pages, "sequence": ["warm_up", "b", "pause", "c"]}
    protocol = LIQUIDS.protocol | {"study": {"languages": ["en"]}} | parts
    study = replace(LIQUIDS, protocol=protocol, trials=pd.concat([LIQUIDS.trials, trials]))
    counts = trials[trials["participant"].isin(study.people)].drop_duplicates(["participant", "session", "trial"])
    per_person = counts["participant"].value_counts()
    (sentence,) = practice_and_breaks.practice_sentences(study)
    assert sentence.startswith(f"Participants completed {per_person.min()}")
    assert sentence.endswith(
        " in “Warm-up”; practice ended as soon as 4 answers in a row were correct; if this never happened, the session "
        "ended."
    )
    assert practice_and_breaks.break_sentence(study) == (
        "Participants had a break of at least 30 s after every 3 trials of “Stirring” and a break between parts of the "
        "session."
    )
    empty = replace(LIQUIDS, protocol={})
    assert ([*practice_and_breaks.practice_sentences(empty)], practice_and_breaks.break_sentence(empty)) == ([], "")


@pytest.mark.parametrize(
    ("versions", "files", "counted", "words"),
    [
        (["1.1"] * 3, "hhh", [True] * 3, "version 1.1"),
        (["1.2", "1.1", "1.1"], "hik", [False, True, True], "version 1.1, from 2 different files"),
        (["1.2", "1.1", "1.1"], "hii", [True] * 3, "versions 1.1 and 1.2, pooled"),
        (["1.2", "1.1", "1.1"], "hik", [True] * 3, "versions 1.1 and 1.2, pooled, from 3 different files"),
    ],
)
def test_versions_are_those_of_the_included_sessions(
    versions: list[str], files: str, counted: list[bool], words: str
) -> None:
    people = LIQUIDS.participants.assign(protocol_version=versions, protocol_hash=[*files], counted=counted)
    assert methods.version_text(replace(LIQUIDS, participants=people)) == words


@pytest.mark.parametrize(
    ("found", "trends", "blocks", "words"),
    [
        (["DelayTrend", "Effects"], "ranks", "cb", "Means were not tested."),
        (["DelayTrend"], "slopes", "bc", "Means were used for the hypotheses and the trend tests."),
        (["ContrastsWithControl"], "slopes", "c", "Means were used for the equivalence tests."),
        (["MeanTests"], "slopes", "", "Means were used for the exploratory tests of means."),
    ],
)
def test_the_methods_name_the_uses_of_means(
    found: list[str], trends: str, blocks: str, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("Effects", "ContrastsWithControl", "DelayTrend", "MeanTests"):
        monkeypatch.setattr(
            methods, name, SimpleNamespace(**dict.fromkeys(("value_in", "tested"), lambda _, n=name: n in found))
        )
    contrasts = [SimpleNamespace(contrast=SimpleNamespace(blocks=[*blocks]))] if blocks else []
    evaluated: Any = SimpleNamespace(contrasts=contrasts, decided=SimpleNamespace(trends=trends))
    *sentences, used = methods._mean_sentences(evaluated, [result_of(LIQUIDS)])
    assert [line.startswith("Mean differences from the first condition") for line in sentences] == [True] * (
        "Effects" in found
    )
    assert used == words


@pytest.mark.parametrize(("settings", "are"), [({}, "are"), (LIQUIDS.settings, "were")])
def test_conditions_are_codes_or_were_until_the_key_was_opened(settings: dict[Any, Any], are: str) -> None:
    case_study = replace(LIQUIDS, settings=settings)
    (conditions_line,) = (
        line for line in methods._design_sentences(case_study, results(case_study)) if line.startswith("Conditions")
    )
    assert (
        conditions_line
        == f"Conditions {are} identified only by codes{' until the key was opened' if settings else ''}."
    )


def test_questions_that_are_not_always_asked_name_the_answer_on_which_they_depend() -> None:
    place = SimpleNamespace(id="b", is_form=False)

    def question(item: str, *, required: bool, rule: ShowIf | None = None) -> Any:
        asked = SimpleNamespace(required=required, show_if=rule)
        return SimpleNamespace(id=item, short=item.title(), where=place, levels={"left": "Left one"}, question=asked)

    questions = (
        question("hand", required=True),
        question("why", required=False, rule=ShowIf(item="harder", at_most=3)),
        question("ring", required=True, rule=ShowIf(item="hand", values="left")),
    )
    case_study: Any = replace(LIQUIDS, others=SimpleNamespace(questions=questions))
    assert list(methods._other_question_sentences(case_study)) == [
        "In “Block”, participants also answered 1 other question after each presentation.",
        "In “Block”, participants could also answer 1 other question after each presentation if their answer to "
        "“Harder” was at most 3.",
        "In “Block”, participants also answered 1 other question after each presentation if their answer to “Hand” "
        "was “Left one”.",
    ]


def test_participants_who_are_not_analysed_are_counted_with_their_reasons() -> None:
    people = LIQUIDS.participants.assign(
        participant=["P1", "P2", "P3"], counted=[False, False, True], excluded=[True, False, False]
    )
    gone = Tombstone(participant="P9", at="2026-02-03T10:00:00", by="BL", reason="asked", sessions=())
    sentence = methods._sample_sentence(replace(LIQUIDS, participants=people, withdrawn=(gone, gone)))
    assert sentence.startswith("Three participants (SIMULATED, not people) took part in “Made up”")
    assert "); two more participants withdrew, and their data were erased. 1 participant did not" in sentence
    assert "did not complete the session and 1 participant was excluded, so 1 participant was analysed" in sentence
    alone = methods._sample_sentence(replace(LIQUIDS, withdrawn=(gone,)))
    assert alone.endswith(", each in all conditions; 1 more participant withdrew, and their data were erased.")
