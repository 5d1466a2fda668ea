"""What the designer shows of each kind of element, compared with reviewed texts: outline, form, measures, file."""

from collections.abc import Iterable, Iterator
from pathlib import Path as File
from typing import Any

import pytest

from study_app.designer.document.additions import additions_for, repairs
from study_app.designer.document.document import template
from study_app.designer.document.elements import found_fields, outline, position_of, short_note, usage_text
from study_app.designer.document.study import Study, read_study
from study_app.designer.document.toml_edits import Set
from study_app.designer.file import file_text
from study_app.designer.form.form import form_of
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
from study_app.designer.outline import addable_elements, outline_rows
from study_app.designer.problems import problem_rows
from study_app.protocol.source.document import Path
from tests.designer.document.test_study_transcripts import elements, generic, studies
from tests.golden import compare
from tests.golden_values import changed, one_line, value_lines
from tests.protocol.edited_studies import CASES, cases_of

GOLDEN = File(__file__).parent / "golden"
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


class Shown:
    """What each view of the designer showed last, to note what changes."""

    def __init__(self) -> None:
        self.before: dict[str, list[str]] = {}

    def note(self, view: str, value: Any) -> Iterator[str]:
        """Yield the lines of a view that changed since it was last noted."""
        lines = list(value_lines(value))
        found = list(changed(self.before.get(view, []), lines))
        self.before[view] = lines
        yield from [f"{view}:", *found] if found else ()

    def of_study(self, study: Study) -> Iterator[str]:
        times = facts(study).steps_s
        yield from self.note("facts", facts(study))
        yield from self.note("rows of the outline", outline_rows(study, times))
        yield from self.note("outline", outline(study))
        for words in ("viscosity", "hon", "order"):
            yield f"find {words}"
            yield from self.note("rows found", outline_rows(study, times, words))
            yield from self.note("fields found", found_fields(study, words))

    def of_element(self, study: Study, path: Path) -> Iterator[str]:
        document = study.document
        marked = file_text(study, "study.toml", path)
        yield f"brief: {short_note(document, path)} | {usage_text(document, path)} | {position_of(document, path)}"
        yield f"lines: {marked.selected} {marked.faulty}"
        yield from value_lines(form_of(study, path), "form")
        view = measures_view(study, facts(study), path, Controls(participants=12), Simulated(), {})
        yield from self.note("measures", measures(view))
        yield from self.note("to add", tuple(addable_elements(study, path)))


def transcript(before: Iterable[str], names: Iterable[str]) -> Iterator[str]:
    """Yield what is shown of some studies, and of each kind of element that none of the studies before has."""
    seen = {generic(path) for _, study in studies(before) for path in elements(study.document)}
    shown = Shown()
    for name, study in studies(names):
        yield f"== {name}"
        yield from shown.of_study(study)
        for path in elements(study.document):
            if generic(path) not in seen:
                seen.add(generic(path))
                yield f"== {name} at {path}"
                yield from shown.of_element(study, path)


def of_faults(study: Study) -> Iterator[str]:
    """Yield the rows of a study's problems, and what each repair and addition is called and changes."""
    yield from value_lines(problem_rows(study))
    for fault in study.faults:
        for repair in (*repairs(study, fault), *additions_for(study, fault)):
            yield f"repair {one_line(fault.path)}: {repair.words}"
            yield from changed(
                study.text.split("\n"), study.with_edits(*repair.edits)[0].text.split("\n"), numbered=True
            )


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


@pytest.mark.parametrize("name", [STUDIES[0], *(pytest.param(one, marks=pytest.mark.slow) for one in STUDIES[1:])])
def test_what_is_shown_of_studies(name: str, pytestconfig: pytest.Config) -> None:
    before = STUDIES[: STUDIES.index(name)]
    compare(GOLDEN / f"shown_of_{name}.txt", transcript(before, (name,)), pytestconfig)


@pytest.mark.parametrize("name", SIMULATED)
def test_what_is_shown_of_simulations(name: str, pytestconfig: pytest.Config) -> None:
    (_, study), *_ = studies((name,))
    compare(GOLDEN / f"simulations_of_{name}.txt", list(of_blocks(study, SIMULATED[name])), pytestconfig)


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
    shown = Shown()
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
                    yield from shown.note(block, {"numbers": view.numbers, "clipped": clipped})
    (_, study), (_, late) = studies(("rek2024", "forcedelay"))
    for edit in (Set(("device", "force_limit_n"), 0.5), Set(("blocks", "liquids", "repetitions"), -1)):
        edited, _ = study.with_edits(edit)
        yield f"== {edit.path[-1]} {edit.value}"
        yield from shown.note(
            "study", measures_view(edited, facts(edited), ("study",), Controls(), Simulated(), {}).cards
        )
    view = measures_view(late, facts(late), ("blocks", "delay"), Controls(), Simulated(), {})
    yield f"simulated: {measures(view)['simulated']}"


@pytest.mark.slow
def test_what_is_said_of_limits(pytestconfig: pytest.Config) -> None:
    compare(GOLDEN / "limits.txt", of_limits(), pytestconfig)


FAULTS = ("designs", "formats", "adjustment", "groups", "impossible", "methods", "pace", "questions", "sound")
"""Files of faults that together have each kind of repair; the first two are read fastest."""


@pytest.mark.parametrize("name", [*FAULTS[:2], *(pytest.param(one, marks=pytest.mark.slow) for one in FAULTS[2:])])
def test_repairs_of_faults(name: str, pytestconfig: pytest.Config) -> None:
    found = list[str]()
    for case in cases_of(CASES / f"{name}.txt"):
        found += [f"== {case.study}, {case.name}", *of_faults(read_study(case.text.encode(), File()))]
    compare(GOLDEN / f"repairs_in_{name}.txt", found, pytestconfig)
