"""What the designer shows of a study: each element once, repairs that repair, and the words of measures."""

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path as File
from typing import Any

import pytest

from study_app.designer.document.additions import additions_for, repairs
from study_app.designer.document.document import template
from study_app.designer.document.elements import found_fields
from study_app.designer.document.study import Study, read_study
from study_app.designer.document.toml_edits import Set
from study_app.designer.measures.measures_page import clipped_sentence
from study_app.designer.measures.measures_view import MeasuresView, measures_view
from study_app.designer.measures.plots import forces_sentence, function_sentence, track_sentence
from study_app.designer.measures.simulation import (
    Asked,
    Controls,
    Detectable,
    Finding,
    GroupPrecision,
    Measurable,
    Observed,
    Planted,
    Simulated,
)
from study_app.designer.measures.study_facts import facts
from study_app.designer.outline import outline_rows
from study_app.designer.problems import problem_rows
from tests.designer.document.grown import PROTOCOLS
from tests.designer.document.test_commands import edited, elements, studies
from tests.golden import compare, each_once
from tests.golden_values import one_line, value_lines
from tests.protocol.edited_studies import CASES, cases_of

GOLDEN = File(__file__).parent / "golden"
SINGLE = ("study", "sequence", "device", "scene", "limits", "analysis")
STUDIES = ("rows", "sound", "every_design", "grouped", "slime")
"""Studies of which each has kinds of elements that none before it has; the first is short."""


def measures(view: MeasuresView) -> dict[str, Any]:
    """Return what is shown of an element: numbers, cards, and each plot in a sentence."""
    of, observed = view.levels, view.simulated.observed
    return {
        "simulated": None if view.words is None else view.words.words(view.controls.threshold),
        "numbers": view.numbers,
        "cards": view.cards,
        "function": function_sentence(of.words, observed) if of is not None and observed is not None else "",
        "track": track_sentence(of.words, observed) if of is not None and observed is not None else "",
        "forces": "" if of is None else forces_sentence(of),
        "clipped": "" if of is None else clipped_sentence(of),
    }


@pytest.mark.parametrize("name", [STUDIES[0], *(pytest.param(one, marks=pytest.mark.slow) for one in STUDIES[1:])])
def test_the_outline_shows_each_element_once_with_its_name(name: str) -> None:
    ((_, study),) = studies((name,))
    rows = outline_rows(study, facts(study).steps_s)
    parts = rows[next(at for at, row in enumerate(rows) if row.title == "Elements") :]
    shown, in_parts = Counter(row.path for row in rows), Counter(row.path for row in parts)
    for path in elements(study.document):
        if len(path) == 1 and path[0] in {*SINGLE} & {*study.document}:
            assert shown[path] == 1, path
        elif path[2:3] == ("items",):
            assert shown[path] >= 1, "below each step that asks it"
        elif len(path) == 2 and path[0] not in SINGLE:
            assert in_parts[path] == 1, path
    for row in rows:
        assert row.title, row
        assert row.name.startswith(row.title), row
    steps = [row.step for row in rows if row.step and row.step[0] == "sequence"]
    assert steps == [("sequence", at) for at in range(len(study.document.get("sequence", ())))]


@pytest.mark.parametrize("words", ["viscosity", "hon", "order"])
def test_what_is_found_has_the_words(words: str) -> None:
    ((_, study),) = studies(("slime",))
    found = outline_rows(study, facts(study).steps_s, words)
    assert {row.path for row in found} <= {row.path for row in outline_rows(study, facts(study).steps_s)}
    fields = found_fields(study, words)
    assert found or fields
    for row in (*found, *fields):
        assert words in one_line(row).lower() or any(words in one_line(other).lower() for other in found), row


OBSERVED = Observed(
    threshold=0.19,
    lapses=0.02,
    observers=400,
    at_threshold=0.75,
    levels=(0.02, 0.05, 0.1, 0.2, 0.4),
    planted=(0.5, 0.55, 0.66, 0.78, 0.97),
    found=((0.5, 0.53, 0.6, 0.7, 0.95), (0.5, 0.6, 0.7, 0.85, 0.98)),
    asked=((0.05, 0.3), (0.2, 0.7)),
    course=((1, (0.1, 0.15, 0.2, 0.3, 0.5)), (40, (0.15, 0.18, 0.19, 0.2, 0.24))),
    one=(Asked(1, 1, 0.2, True), Asked(2, 2, 0.1, False), Asked(3, 1, 0.17, True)),
    error=0.06,
    trials=80,
)
GROUP = GroupPrecision(
    participants=12,
    studies=60,
    precision=0.15,
    trials=80,
    share=0.7,
    more_trials=107,
    more_share=0.9,
    most=60,
    enough=14,
)
SIMULATED = {
    "viscosityjnd": Simulated(
        OBSERVED,
        Measurable((0.05, 0.4), (Planted(threshold=0.19, bias=0.01, coverage=0.95),)),
        GROUP,
        warnings=("methods.adaptive.trials: few trials",),
    ),
    "thickness": Simulated(measurable=Measurable(None, ()), failed="The process ended."),
    "physical2": Simulated(
        detectable=Detectable(
            participants=12,
            studies=200,
            points=7,
            findings=(Finding("thick", 0.5, "0.5 (0.3–0.9)"), Finding("wet", None, "beyond")),
        )
    ),
}
"""What simulations could answer, by study: the cards of blocks show it."""


def of_blocks(study: Study, simulated: Simulated) -> Iterator[str]:
    for name in study.document["blocks"]:
        for people in (1, 13):
            controls = Controls(participants=people, threshold=0.19, planned=12)
            view = measures_view(study, facts(study), ("blocks", name), controls, simulated, {})
            yield from value_lines(measures(view))


DAMPING = ("stimuli", "damping")
WIDE = Set((*DAMPING, "levels"), [0.02, 2.0])
FREE = Set(("tasks", "stir"), {"kind": "explore", "min_s": 2, "max_s": 4, "instruction": "Feel."})
LIMITED: dict[str, tuple[Set, ...]] = {
    "levels below the error": (Set((*DAMPING, "levels"), [0.005, 0.03]),),
    "high levels are clipped": (WIDE, Set((*DAMPING, "standards"), [32])),
    "levels are clipped in fast motions": (WIDE, Set((*DAMPING, "standards"), [12]), FREE),
    **{
        f"standards {standards}": (Set((*DAMPING, "standards"), standards),)
        for standards in ([52], [8, 52], [60], [8, 60])
    },
}


def of_limits() -> Iterator[str]:
    """Yield what is said where limits clip levels, before and after observers were simulated, and of weak forces."""
    for name, edits in {"as it is": (), **LIMITED}.items():
        study, _ = template("viscosity-jnd").with_edits(*edits)
        for threshold in (0.019, 0.19):
            observed = Observed(
                threshold=threshold,
                lapses=0.02,
                observers=400,
                at_threshold=0.75,
                levels=(0.1,),
                planted=(0.7,),
                found=((0.7,),),
                asked=(),
                course=((1, (0.1,) * 5),),
                one=(),
                error=0.03,
                trials=80,
            )
            group = GroupPrecision(
                participants=12,
                studies=60,
                precision=0.15,
                trials=80,
                share=0.9,
                more_trials=107,
                more_share=1.0,
                most=60,
                enough=9,
            )
            for simulated in (Simulated(measurable=Measurable(None, ())), Simulated(observed, group=group)):
                yield f"== {name}, {'' if simulated.observed else 'not '}simulated at {threshold}"
                controls = Controls(threshold=threshold)
                for block in ("viscosity", "training"):
                    view = measures_view(study, facts(study), ("blocks", block), controls, simulated, {})
                    clipped = "" if view.levels is None else clipped_sentence(view.levels)
                    yield from value_lines({"numbers": view.numbers, "clipped": clipped})
    (_, study), (_, late) = studies(("rek2024", "forcedelay"))
    for edit in (Set(("device", "force_limit_n"), 0.5), Set(("blocks", "liquids", "repetitions"), -1)):
        edited, _ = study.with_edits(edit)
        yield f"== {edit.path[-1]} {edit.value}"
        yield from value_lines(measures_view(edited, facts(edited), ("study",), Controls(), Simulated(), {}).cards)
    view = measures_view(late, facts(late), ("blocks", "delay"), Controls(), Simulated(), {})
    yield f"simulated: {measures(view)['simulated']}"


@pytest.mark.slow
def test_what_measures_say(pytestconfig: pytest.Config) -> None:
    lines = list(of_limits())
    for name, study in studies(SIMULATED):
        lines += [f"== {name}", *of_blocks(study, SIMULATED[name])]
    words = (line.strip() for line in lines if not re.search(r"icon:|NumberCard$|path:", line))
    compare(GOLDEN / "measures.txt", each_once(words), pytestconfig)


FAULTS = ("designs", "formats", "adjustment", "groups", "impossible", "methods", "pace", "questions", "sound")
"""Files of faults that together have each kind of repair; the first two are read fastest."""


@pytest.mark.parametrize("name", [*FAULTS[:2], *(pytest.param(one, marks=pytest.mark.slow) for one in FAULTS[2:])])
def test_each_repair_removes_its_problem_and_undo_gives_the_text_back(name: str, pytestconfig: pytest.Config) -> None:
    words = list[str]()
    for case in cases_of(CASES / f"{name}.txt"):
        study = read_study(case.text.encode(), PROTOCOLS)
        rows = problem_rows(study)
        assert Counter(row.fault for row in rows) == Counter(study.faults)
        assert all(row.line is None or row.line <= study.text.count("\n") + 1 for row in rows)
        for fault in study.faults:
            for repair in (*repairs(study, fault), *additions_for(study, fault)):
                after = edited(study, *repair.edits)
                known, left = ({(fault.path, fault.message) for fault in one.faults} for one in (study, after))
                assert (fault.path, fault.message) not in left, (case.name, repair.words)
                assert len(left) <= len(known), (case.name, repair.words)
                words.append(repair.words)
    assert words
    compare(GOLDEN / f"repairs_in_{name}.txt", each_once(words), pytestconfig)
