"""A small study of format 2 with a question of every kind, after trials and in forms."""

from pathlib import Path

MIXED = """\
format = 2
sequence = ["start", "stir", "load", "usability", "end"]

[study]
name = "mixed"

[liquids.thin]
density_kg_m3 = 1000
[liquids.thick]
density_kg_m3 = 1400

[tasks.explore]
kind = "explore"
min_s = 1
max_s = 3
instruction = "Explore."

[scales.five]
labels.en = ["Not at all", "Slightly", "Somewhat", "Rather", "Very"]
cannot_judge = "Cannot judge"
[scales.agreement]
labels.en = ["a", "b", "c", "d", "e", "f", "g"]

[questionnaires.start]
intro = "Please tell us about yourself."
[[questionnaires.start.items]]
id = "age"
kind = "number"
from = 16
to = 99
whole = true
unit = "years"
text = "How old are you?"
short = "Age"
[[questionnaires.start.items]]
id = "hand"
kind = "choice"
options = [{ id = "left", text = "Left" }, { id = "right", text = "Right" }, { id = "both", text = "Both" }]
text = "Which hand do you write with?"
short = "Hand"
[[questionnaires.start.items]]
id = "since"
kind = "number"
show_if = { item = "hand", is = "both" }
text = "Since when?"
short = "Since"
[[questionnaires.start.items]]
id = "used"
kind = "choice"
several = true
required = false
options = [{ id = "mouse", text = "A mouse" }, { id = "falcon", text = "A haptic device" }]
text = "What have you used before?"
short = "Used"

[questionnaires.after]
intro = "How was it?"
scale = "agreement"
[[questionnaires.after.items]]
id = "feels_liquid"
text = "It feels like a liquid."
short = "Liquid"
[[questionnaires.after.items]]
id = "thickness"
kind = "rating"
scale = "five"
text = "How thick was it?"
short = "Thickness"
[[questionnaires.after.items]]
id = "pleasant"
kind = "slider"
low = "Unpleasant"
high = "Pleasant"
step = 5
text = "How pleasant was it?"
short = "Pleasant"

[questionnaires.load]
instrument = "nasa-tlx"
[questionnaires.usability]
instrument = "sus"

[questionnaires.end]
intro = "At the end."
[[questionnaires.end.items]]
id = "comment"
kind = "text"
required = false
text = "Anything else?"
short = "Comment"

[blocks.stir]
questionnaire = "after"
order = "shuffled"
conditions = ["thin", "thick"]
"""


def mixed_file(folder: Path, *edits: tuple[str, str]) -> Path:
    """Write the study with edits of its text, and return the file."""
    text = MIXED
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new, 1)
    path = folder / "mixed.toml"
    path.write_text(text, encoding="utf-8")
    return path
