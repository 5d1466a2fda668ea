"""Planned exclusions: which sessions meet a rule, what a person decides, and the conclusions both ways."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from study_app import api
from study_app.analysis.data.study_tables import Study, load_study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.planned_exclusions import check_rule, planned_exclusions, proposals, rule_sentences
from study_app.analysis.planning.preregistration import FILE, commitment, deviations, preregistration
from study_app.analysis.report.sections import conduct
from study_app.analysis.report.write_report import report
from study_app.analysis.wording import percent
from study_app.errors import AnalysisError, ProtocolError, StoreError
from study_app.protocol.load import load
from study_app.protocol.source.files import shipped_file
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.exclusions import exclude, keep
from study_app.store.unblinding import unblind
from tests.analysis.conftest import SAMPLE
from tests.analysis.made_up import liquids
from tests.analysis.made_up import study as made_up_study
from tests.compiled import needs_servo
from tests.studies import made_up

PAIRS = """
format = 2
sequence = ["thicker"]
study.name = "pairs"
liquids.damper.drag = { law = "linear", damping_nspm = 8 }
tasks.stir = { kind = "follow", cycles = 1 }
stimuli.damping = { vary = "damping_nspm", level = "weber", standards = [8], levels = [0.1, 0.6], spacing = "log" }
methods.constant = { kind = "constant", levels = 2, repetitions = 6 }
blocks.thicker = { stimulus = "damping", design = "2ifc", method = "constant" }
[[analysis.exclusions]]
rule = "below_chance"
"""


def with_rules(study: Study, *rules: dict[str, Any]) -> Study:
    return replace(study, protocol={**study.protocol, "analysis": {"exclusions": list(rules)}})


def test_each_rule_on_answers_counts_correctly() -> None:
    study = load_study(SAMPLE.path)
    first, second, uncounted, *_ = study.people
    responses, answered = study.responses.copy(), study.answered.copy()
    own = responses["participant"] == first
    responses.loc[own, "response"] = 4
    hurried = answered["participant"] == second
    answered.loc[hurried, "first_choice_s"] = answered.loc[hurried, "onset_s"] + 0.3
    for table in (responses, answered):
        table.loc[table["participant"] == uncounted, "counted"] = False
    responses.loc[responses["participant"] == uncounted, "response"] = 4
    answered.loc[answered["participant"] == uncounted, "first_choice_s"] = answered["onset_s"] + 0.1
    study = replace(study, responses=responses, answered=answered)
    constant, fast = {"rule": "constant_answers", "limit": 95.0}, {"rule": "fast_answers", "limit": 0.5}
    results = evaluate(study, recordings=False)
    assert rule_sentences(with_rules(study), results) == ()
    assert proposals(with_rules(study), results) == (), "rules that are not planned propose nothing"
    found_proposals = proposals(with_rules(study, constant, fast), results)
    assert [(proposal.participant, proposal.rule, proposal.decision) for proposal in found_proposals] == [
        (first, "constant_answers", "undecided"),
        (second, "fast_answers", "undecided"),
    ]
    lenient, chance = {"rule": "fast_answers", "limit": 0.2}, {"rule": "below_chance"}
    sealed = replace(with_rules(study, constant, lenient, chance), settings={})
    assert rule_sentences(sealed, results) == (
        "Planned rule: more than 95 % of the answers to statements are identical. 1 session met this rule.",
        "Planned rule: the median response time is below 0.2 s. No session met this rule.",
        "Planned rule: a block has fewer correct answers than expected by chance (binomial p below 0.001). The "
        "rule is applied after unblinding.",
    )
    page = "".join(conduct(with_rules(study, lenient), results))
    assert "There are no exclusions." in page
    assert "the median response time is below 0.2 s. No session met this rule." in page
    assert (
        found_proposals[0].why
        == f"100 % of the {int((own & responses['counted']).sum())} answers to statements are identical"
    )
    assert (
        found_proposals[1].why
        == f"half of the {int((hurried & answered['counted']).sum())} answers were given within 0.30 s"
    )


@pytest.mark.parametrize(("limit", "met"), [(54.0, True), (55.0, False)])
def test_a_percentage_that_is_exactly_the_limit_is_permitted(limit: float, met: bool) -> None:
    """Eleven of 20 answers are 4, which is 55 %; in floating point 100 * (11 / 20) is more."""
    ratings = [4] * 11 + [1, 2, 3, 5, 6, 7, 1, 2, 3]
    trials = [("P001", 1, f"L{place % 2 + 1}", ratings[2 * place : 2 * place + 2]) for place in range(10)]
    constant = {"rule": "constant_answers", "limit": limit}
    assert bool(proposals(with_rules(made_up_study(liquids(2), trials), constant), None)) == met


@pytest.fixture(scope="module")
def pairs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the unblinded results of two participants, of whom the second exchanged the keys."""
    folder = tmp_path_factory.mktemp("pairs")
    (folder / "pairs.toml").write_text(PAIRS, encoding="utf-8", newline="\n")

    def answer(*, exchanged: bool) -> Callable[[Any], str | None]:
        def of(question: Any) -> str | None:
            if len(question.felt) != 2:
                return None
            first, second = (feeling.force_mean_n for feeling in question.felt)
            return "first" if (first > second) != exchanged else "second"

        return of

    for number in (1, 2):
        observer = answer(exchanged=number == 2)
        with api.open_session(
            folder / "pairs.toml", f"P00{number}", results=folder / "results", seed=number, answer=observer
        ) as session:
            session.run()
    unblind(folder / "results", by="AB", reason="x")
    return folder / "results"


def table_text(page: str) -> str:
    return page.partition("Planned exclusions</h2>")[2].partition("<h2")[0]


@pytest.mark.slow
@needs_servo
@pytest.mark.usefixtures("png_figures_only")
def test_keys_that_were_exchanged_are_proposed_and_decided_by_a_person(pairs: Path, tmp_path: Path) -> None:
    def thresholds(study: Study) -> list[str | None]:
        return [
            estimate.participant for estimate in evaluate(study, recordings=False).levels[0].statistics["thresholds"]
        ]

    study = load_study(pairs)
    (proposed,) = proposals(study, evaluate(study, recordings=False))
    assert (proposed.what, proposed.rule, proposed.decision) == (("P002", 1), "below_chance", "undecided")
    assert "0 of 12" in proposed.why
    assert "p < .001" in proposed.why, "0.5 to the power of 12"
    assert thresholds(study) == [None, "P001"], "not in the mean without a decision"
    assert check_rule(study, "P002", 1, "below_chance")
    assert not check_rule(replace(study, settings={}), "P001", 1, "below_chance"), "the key is sealed"
    with pytest.raises(AnalysisError, match="the rule requires that a block has fewer correct answers than expected"):
        check_rule(study, "P001", 1, "below_chance")
    beyond = with_rules(study, {"rule": "threshold_beyond_levels"})
    proposed_beyond = proposals(beyond, evaluate(beyond))
    assert [check_rule(beyond, proposal.participant, 1, proposal.rule) for proposal in proposed_beyond] == [True, True]
    report(pairs, tmp_path / "open")
    page = (tmp_path / "open" / "report.html").read_text("utf-8")
    assert (
        "Under a planned rule, P002, session 1 (below chance) would be excluded; no decision has been made yet" in page
    )
    assert "two participants" in table_text(page)
    assert "1 participant)" in table_text(page)
    content = json.loads((tmp_path / "open" / "report.json").read_text("utf-8"))
    assert [exclusion["decision"] for exclusion in content["planned_exclusions"]] == ["undecided"]

    keep(pairs, "P002", 1, rule="below_chance", by="AB", reason="left-handed")
    with pytest.raises(StoreError, match="has already been kept"):
        keep(pairs, "P002", 1, rule="below_chance", by="AB", reason="left-handed")
    assert keep(pairs, "P002", 1, rule="fast_answers", by="AB", reason="practised").rule_or_person == "fast_answers"
    study = load_study(pairs)
    (proposed,) = proposals(study, evaluate(study, recordings=False))
    assert (proposed.decision, proposed.by.partition(": ")[2]) == ("kept", "left-handed (decided by AB)")
    assert thresholds(study) == [None, "P001", "P002"]
    report(pairs, tmp_path / "kept")
    assert "no decision has been made yet" not in (tmp_path / "kept" / "report.html").read_text("utf-8")

    with pytest.raises(StoreError, match="specify it as the rule, together with the name of the person who decides"):
        exclude(pairs, "P002", 1, by="below_chance", reason="keys exchanged")
    exclude(pairs, "P002", 1, rule="below_chance", by="CD", reason="keys exchanged")
    with pytest.raises(StoreError, match="is excluded: include it without --rule"):
        keep(pairs, "P002", 1, rule="constant_answers", by="AB", reason="left-handed")
    study = load_study(pairs)
    planned = planned_exclusions(study, evaluate(study, recordings=False))
    assert planned is not None
    assert [(proposal.decision, proposal.why) for proposal in planned.proposals] == [
        ("excluded", "keys exchanged (decided by CD)")
    ]
    assert [len(group.people) for group in (planned.included, planned.left_out)] == [2, 1]


def study_with(tmp_path: Path, rules: str, name: str = "demo") -> Path:
    path = tmp_path / f"{name}.toml"
    text = shipped_file(name).read_text("utf-8")
    path.write_text(f"{text}\n{rules}", encoding="utf-8", newline="\n")
    return path


@pytest.mark.slow
def test_an_exclusion_under_a_rule_that_the_session_does_not_meet_is_rejected_or_reported(tmp_path: Path) -> None:
    rules = "".join(
        f'[[analysis.exclusions]]\nrule = "{rule}"\nlimit = {limit}\n'
        for rule, limit in (("constant_answers", 97), ("fast_answers", 58))
    )
    path, folder = study_with(tmp_path, rules), tmp_path / "results"
    rehearse_answers(path, participants=4, seed=5, results=folder, features=made_up("demo"))
    study = load_study(folder)
    assert check_rule(study, "P001", 1, "fast_answers")
    with pytest.raises(AnalysisError, match=r"rule 'fast_answer' \(planned rules: constant_answers, fast_answers\)"):
        check_rule(study, "P001", 1, "fast_answer")
    with pytest.raises(AnalysisError, match=r"\(it does not plan any rules\); .* omit --rule"):
        check_rule(with_rules(study), "P001", 1, "fast_answers")
    responses = study.responses.loc[study.responses["counted"] & (study.responses["participant"] == "P002"), "response"]
    share = percent(responses.value_counts().max() / len(responses))
    why = f"{share} of its {len(responses)} answers to statements are identical, and the rule requires more than 97 %"
    with pytest.raises(AnalysisError, match=f"session 1 does not meet the rule constant_answers: {why}; "):
        check_rule(study, "P002", 1, "constant_answers")
    answers = study.answered[study.answered["counted"] & (study.answered["participant"] == "P003")]
    median = (answers["first_choice_s"] - answers["onset_s"]).median()
    hurried = with_rules(study, {"rule": "fast_answers", "limit": 0.2})
    with pytest.raises(AnalysisError, match=f"time is {median:.2f} s, and the rule requires less than 0.2 s; "):
        check_rule(hurried, "P003", 1, "fast_answers")

    exclude(folder, "P001", 1, rule="fast_answers", by="AB", reason="hasty")
    exclude(folder, "P002", 1, rule="constant_answers", by="AB", reason="bored")
    assert check_rule(load_study(folder), "P002", 1, "constant_answers"), "`exclude` rejects it"
    protocol = load(path)
    (folder / FILE).write_text(
        preregistration(protocol, str(study.participants["protocol_hash"][0])), encoding="utf-8", newline="\n"
    )
    study = load_study(folder)
    planned = planned_exclusions(study, evaluate(study, recordings=False))
    assert planned is not None
    assert [(proposal.participant, proposal.decision) for proposal in planned.proposals] == [
        ("P001", "excluded"), ("P003", "undecided"), ("P004", "undecided"),
    ]  # fmt: skip
    assert [len(results.people) for results in (planned.included, planned.left_out)] == [3, 0]
    assert [sentence.partition("identical. ")[2] for sentence in rule_sentences(study, None)] == [
        "No session met this rule. 1 session was excluded under this rule but does not meet it.", "",
    ]  # fmt: skip
    assert rule_sentences(study, None)[1].endswith("58 s. Three sessions met this rule.")
    assert (
        f"participant P002, session 1 was excluded under the rule constant_answers, but does not meet it: {why}; "
        "recorded reason: bored (decided by AB)"
    ) in deviations(study).found


def test_the_preregistration_quotes_the_rules(tmp_path: Path) -> None:
    rules = '[[analysis.exclusions]]\nrule = "constant_answers"\nlimit = 90\n'
    protocol = load(study_with(tmp_path, rules))
    text = preregistration(protocol, "0" * 64)
    assert "a session is proposed for exclusion if more than 90 % of the answers to statements are identical" in text
    assert commitment(protocol, "0" * 64).rules == ("constant_answers",)


@pytest.mark.parametrize(
    ("rule", "said"),
    [
        ('rule = "constant_answers"', "specify a number from 1 to 100"),
        ('rule = "fast_answers"\nlimit = 0', "specify a number from 0.05 to 600"),
        ('rule = "below_chance"\nlimit = 3', "is not used by the rule below_chance"),
        ('rule = "below_chance"', "no main block has questions with a correct answer"),
        ('rule = "threshold_beyond_levels"', "no main block has levels"),
    ],
)
def test_a_rule_that_cannot_apply_is_refused(tmp_path: Path, rule: str, said: str) -> None:
    with pytest.raises(ProtocolError, match=said):
        load(study_with(tmp_path, f"[[analysis.exclusions]]\n{rule}\n"))
