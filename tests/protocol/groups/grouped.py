"""A study with two groups, as text, and edits of it."""

from study_app.protocol.load import parse
from study_app.protocol.model import Protocol

GROUPS = """
[groups.first_thin]
sequence = ["hello", "thin", "thick", "end"]

[groups.first_thick]
sequence = ["hello", "thick", "thin"]
"""
STUDY = """\
format = 2
study.name = "grouped"

[liquids.water]
density_kg_m3 = 1000

[liquids.honey]
density_kg_m3 = 1400

[tasks.stir]
kind = "explore"
min_s = 1
max_s = 3
instruction = "Stir."

[scales.agreement]
labels.en = ["a", "b", "c", "d", "e", "f", "g"]

[questionnaires.judgement]
intro = "How was it?"
scale = "agreement"
items = [{ id = "heavy", text = "It is heavy.", short = "Heavy" }]

[questionnaires.end]
intro = "Last questions"
items = [{ id = "comment", kind = "text", text = "Any comment?", short = "Comment", required = false }]

[pages.hello]
kind = "consent"
title = "Hello"
body = "Read this."

[blocks.thin]
conditions = ["water", "honey"]
order = "shuffled"
questionnaire = "judgement"

[blocks.thick]
conditions = ["honey", "water"]
repetitions = 2
order = "shuffled"
questionnaire = "judgement"
"""


def grouped(*edits: tuple[str, str], groups: str = GROUPS) -> Protocol:
    """Return the study with some of its text replaced."""
    text = STUDY + groups
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return parse(text.encode(), "grouped")
