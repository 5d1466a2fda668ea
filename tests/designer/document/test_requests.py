"""Each request of the designer: title, selection, announcement, and the changed lines of the file.

``requests.txt`` has a part for each; its first line is the request. It is changed by hand: no option regenerates it.
"""

import difflib
from dataclasses import fields
from pathlib import Path

import pytest

from study_app.designer.document import steps
from study_app.designer.document.document import template
from study_app.designer.document.steps import Step, StepContext
from study_app.designer.document.study import read_study
from tests.designer.support.designer import DEMO
from tests.transcripts import value_of

PARTS = [
    part.split("\n") for part in Path(__file__).with_name("requests.txt").read_text("utf-8").strip("\n").split("\n\n")
]
REQUESTS = {kind.__name__: kind for kind in steps.Request.__subclasses__()}
STUDIES = {
    "demo": read_study(DEMO.encode()),
    "jnd": template("viscosity-jnd"),
    "two": read_study(DEMO.replace('languages = ["en"]', 'languages = ["en", "nl"]\ncredits = {}').encode()),
}
PLAIN = Step("", ())
MOST, WIDE = 12, 64


def request_lines(line: str) -> list[str]:
    """Return the title of a request, its other fields, and the lines that it removes and adds."""
    name, _, call = line.partition(": ")
    study = STUDIES[name]
    try:
        step = value_of(call, REQUESTS).step(StepContext(study, ("questionnaires", "liquid", "items", 0)))
    except steps.Refused as refusal:
        return [f"refused: {refusal}"]
    facts = {
        field.name: getattr(step, field.name)
        for field in fields(Step)
        if field.name not in {"title", "edits", "text"} and getattr(step, field.name) != getattr(PLAIN, field.name)
    }
    after = study.with_edits(*step.edits)[0].text if step.text is None else step.text
    changes = difflib.unified_diff(study.text.split("\n"), after.split("\n"), n=0, lineterm="")
    lines = [line[:WIDE].rstrip() for line in changes if line[:1] in "+-" and line.strip("+- ")]
    more = [f"and {len(lines) - MOST} more"] * (len(lines) > MOST)
    return [step.title, *(f"{key}: {value}" for key, value in facts.items()), *lines[:MOST], *more]


@pytest.mark.parametrize(
    ("line", "expected"), [(line, rest) for line, *rest in PARTS], ids=[part[0][:60] for part in PARTS]
)
def test_a_request_changes_these_lines(line: str, expected: list[str]) -> None:
    assert request_lines(line) == expected


def test_every_request_is_in_the_table() -> None:
    used = {line.partition(": ")[2].partition("(")[0] for line, *_ in PARTS}
    assert used == REQUESTS.keys() - {"LeaveText"}
