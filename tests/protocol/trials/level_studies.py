"""A study with a block of levels, as text: its designs and methods are added by each test."""

from study_app.protocol.load import parse
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Schedule, build_schedule, draw_key
from study_app.protocol.presented.presentation import Presentation, next_level, trial_result
from study_app.protocol.randomization.streams import Key, stream
from study_app.protocol.trials.methods import TrialResult
from tests.protocol.edited_studies import text_of as text_of_study

LEVELS = text_of_study("levels")
HEAD = LEVELS[: LEVELS.index("\n[blocks")]
BLOCK = LEVELS.removeprefix(HEAD)
FIVE_POINTS = """
[scales.thickness]
labels.en = ["very thin", "thin", "medium", "thick", "very thick"]

[designs.rated]
kind = "rating"
scale = "thickness"

[stimuli.value]
condition = "oil"
vary = "viscosity_pa_s"
level = "value"
levels = [0.5, 8]
"""
SHORT = (
    ("repetitions = 8", "repetitions = 2"),
    ("min_s = 1", "min_s = 0.3"),
    ("part = 1\n", ""),
    ('code_prefix = "V"\n', ""),
)
"""Edits that make a rehearsal short, and let blocks follow one another without parts."""
OF_DAMPER = """
format = 2
study.name = "{name}"

[liquids.damper]
drag = {{ law = "linear", damping_nspm = 8 }}

[tasks.stir]
kind = "follow"
lead_s = 0.5
cycles = 1

[stimuli.damping]
vary = "damping_nspm"
levels = [0.02, 0.6]
standards = {standards}
{more}"""
"""A study of Weber fractions of damping, by a short paced motion."""
SECRET = bytes(range(32))


def text_of(*edits: tuple[str, str], more: str = "") -> str:
    """Return the study's text with edits and more tables."""
    text = LEVELS + more
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    return text


def text_of_damper(name: str, more: str, standards: tuple[float, ...] = (8,)) -> str:
    """Return the text of a study of damping, with its methods and blocks."""
    return OF_DAMPER.format(name=name, standards=list(standards), more=more)


def study(*edits: tuple[str, str], more: str = "") -> Protocol:
    """Return the study with edits of its text and more tables."""
    return parse(text_of(*edits, more=more).encode(), "levels.toml")


def key_of(protocol: Protocol, secret: bytes = SECRET) -> Key:
    """Return a key drawn with a fixed seed."""
    return Key(draw_key(protocol, stream(1, "key").random), secret)


def run(protocol: Protocol, key: Key, answer: str = "", participant: str = "P001", seed: int = 1) -> list[Presentation]:
    """Return the presented levels of a session; each answer is ``answer``, or correct if that is empty."""
    schedule = build_schedule(protocol, participant, seed)
    return [due for due, _ in answered(protocol, key, schedule, answer)]


def answered(
    protocol: Protocol, key: Key, schedule: Schedule, answer: str = ""
) -> list[tuple[Presentation, TrialResult]]:
    """Return the presentation and the answer of each trial that is not passed over."""
    heard_results: list[TrialResult] = []
    results = []
    for trial in schedule.trials:
        due = next_level(protocol, key, schedule, trial, heard_results)
        if due is None:
            continue
        design = protocol.design_of(protocol.blocks[trial.block])
        answer_given = answer or design.correct(due.arrangement) or ""
        block, level = protocol.blocks[trial.block], due.level
        heard_results.append(
            trial_result(protocol, block, trial.number, trial.code, level, due.arrangement, answer_given)
        )
        results.append((due, heard_results[-1]))
    return results
