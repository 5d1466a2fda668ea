"""What check reports of trials, questions and groups: every row with its line, its message and its hint."""

import sys
from pathlib import Path

import pytest

from study_app.cli import main
from study_app.errors import ProtocolError
from study_app.protocol.checks.level_warnings import level_warnings
from study_app.protocol.describe import describe
from study_app.protocol.load import parse
from study_app.protocol.model import Protocol

STUDY = """\
format = 2
sequence = ["thicker", "about"]
study = { name = "rows", blinding = "single" }
[liquids.damper]
drag = { law = "linear", damping_nspm = 8 }
[liquids.oil]
density_kg_m3 = 1260
viscosity_pa_s = 4
effects = ["drag"]
[conditions.damper]
liquid = "damper"
[conditions.both]
liquids = ["damper", "oil"]
[conditions.oil]
liquid = "oil"
[tasks.stir]
kind = "follow"
[scales.five]
labels.en = ["1", "2", "3", "4", "5"]
[questionnaires.about]
intro = "You."
[[questionnaires.about.items]]
id = "age"
kind = "number"
from = 16
to = 99
text = "How old are you?"
short = "Age"
[[questionnaires.about.items]]
id = "hand"
kind = "choice"
options = [{ id = "left", text = "Left" }, { id = "right", text = "Right" }]
text = "Which hand?"
short = "Hand"
[stimuli.damping]
condition = "damper"
vary = "damping_nspm"
levels = [0.02, 0.6]
[designs.pair]
kind = "2ifc"
[methods.few]
kind = "constant"
repetitions = 2
[blocks.thicker]
stimulus = "damping"
design = "pair"
method = "few"
"""
DELAYS = (
    ('vary = "damping_nspm"', 'vary = "delay_ms"\nstandards = [194]'),
    ("levels = [0.02, 0.6]", "levels = [1, 944]"),
)
SHOWN = ('id = "hand"', 'id = "hand"\nshow_if = { item = "age", at_least = 18 }')
ESTIMATION = ('kind = "2ifc"', 'kind = "estimation"')
REPEATED = ("repetitions = 2", "repetitions = 20")


def edited(*edits: tuple[str, str]) -> str:
    text = STUDY
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def study(*edits: tuple[str, str]) -> Protocol:
    return parse(edited(*edits).encode(), "rows.toml")


@pytest.mark.parametrize(
    ("edits", "place", "line", "message", "hint"),
    [
        (
            [("levels = [0.02, 0.6]", 'level = "weber"\nlevels = [0.02, 0.6]\nstandards = [0]')],
            "stimuli.damping.level",
            'level = "weber"',
            "a Weber fraction of a standard of 0 does not exist",
            'level = "difference"',
        ),
        (
            [DELAYS[0], ("levels = [0.02, 0.6]", 'levels = [1, 200]\ndirection = "down"')],
            "stimuli.damping.levels",
            "levels = [1, 200]",
            "200 ms below a standard of 194 is -6; delay_ms may be no less than 0",
            "at most 194",
        ),
        (
            [('intro = "You."', 'intro = "You."\nitem_order = "shuffled"'), SHOWN],
            "questionnaires.about.items.2.show_if",
            'show_if = { item = "age", at_least = 18 }',
            "item_order is shuffled",
            'item_order = "fixed": an item comes after the one that it depends on',
        ),
        (
            [("[stimuli.damping]", '[questionnaires.sick]\ninstrument = "ssq"\n[stimuli.damping]'),
             ('["thicker", "about"]', '["thicker", "about", "sick"]')],
            "questionnaires.sick.instrument",
            'instrument = "ssq"',
            'the texts of "ssq" may not be shipped: 16 items need a text',
            "items with these ids: ",
        ),
    ],
)  # fmt: skip
def test_each_row_has_its_line_message_and_hint(
    edits: list[tuple[str, str]], place: str, line: str, message: str, hint: str
) -> None:
    text = edited(*edits)
    with pytest.raises(ProtocolError) as refused:
        parse(text.encode(), "rows.toml")
    found = [problem for problem in refused.value.problems if problem.message == message]
    assert len(found) == 1, [str(problem) for problem in refused.value.problems]
    assert found[0].place == place
    assert found[0].hint == hint if not hint.endswith(": ") else found[0].hint.startswith(hint)
    lines = text.splitlines()
    assert found[0].line is not None
    assert line in lines[found[0].line - 1]


@pytest.mark.parametrize("key", ["level_error_percent", "level_error_ms", "pace_error_percent", "attempts"])
def test_limits_of_intervals_belong_to_format_2(key: str) -> None:
    with pytest.raises(ProtocolError) as refused:
        parse(f"format = 1\n[limits]\n{key} = 3\n".encode(), "old.toml")
    (problem,) = [one for one in refused.value.problems if one.place == f"limits.{key}"]
    assert (problem.message, problem.line) == ("belongs to format 2", 3)


def test_limits_of_intervals_have_defaults_where_a_block_has_a_design() -> None:
    limits = study().limits
    found = limits.level_error_percent, limits.level_error_ms, limits.pace_error_percent, limits.attempts
    assert found == (2, 2, 40, 3)
    assert study(("[tasks.stir]", "[limits]\nattempts = 5\n[tasks.stir]")).limits.attempts == 5


@pytest.mark.parametrize(
    ("edits", "warning"),
    [
        (
            [('kind = "constant"\nrepetitions = 2', 'kind = "constant"\nlevels = 17\nrepetitions = 3')],
            "methods.few: 51 trials cannot balance 2 arrangements: choose an even number",
        ),
        (
            [('kind = "2ifc"', 'kind = "3ifc"'), REPEATED],
            "methods.few: 140 trials cannot balance 3 arrangements: choose a multiple of 3",
        ),
        (
            [('kind = "follow"', 'kind = "explore"\nmin_s = 2\nmax_s = 4\ninstruction = "Stir."'),
             ("levels = [0.02, 0.6]", "levels = [0.02, 0.6]\nstandards = [32]")],
            "tasks.stir: at 0.3 m/s the force of standard 32 at levels 0.02 to 0.6 is clipped at 8 N: such trials are "
            'repeated: choose a task of kind "follow"',
        ),
        (
            [('kind = "2ifc"', 'kind = "2ifc"\nfeedback = "always"'), ('blinding = "single"', 'blinding = "double"')],
            'designs.pair.feedback: "always" in a double-blind study: anyone who sees the participant\'s screen sees '
            'which answers were correct: choose feedback = "practice"',
        ),
    ],
)  # fmt: skip
def test_what_may_be_a_mistake_is_a_warning(edits: list[tuple[str, str]], warning: str) -> None:
    protocol = study(*edits)
    assert warning in list(level_warnings(protocol))
    assert warning in describe(protocol)


def test_a_sound_study_has_no_warning_of_its_levels() -> None:
    assert list(level_warnings(study())) == []


def test_the_summary_of_a_block_of_levels_names_design_unit_force_and_duration() -> None:
    said = " ".join(describe(study()).split())
    assert "Design 2IFC of damping_nspm, standard 8: 2 intervals, 0.6 s apart" in said
    assert "Levels Weber fraction 0.02 to 0.6 (constant), 14 trials per standard" in said
    assert "Comparisons damping_nspm from 8.16 to 12.8 N·s/m" in said
    assert "Force at the pace 1.0 to 1.6 N at 0.126 m/s" in said
    assert "Duration about 3 min" in said
    assert "2 % error of an interval's delivered level" in said


def test_hidden_and_shown_balls_make_different_conditions() -> None:
    conditions = (
        'stimulus = "damping"\ndesign = "pair"\nmethod = "few"\n',
        'conditions = ["damper", "unseen"]\nstandard = "damper"\ndesign = "pair"\n',
    )
    unseen = ("[tasks.stir]", '[conditions.unseen]\nliquid = "damper"\nball = "hidden"\n[tasks.stir]')
    assert study(conditions, unseen).conditions["unseen"].ball == "hidden"
    with pytest.raises(ProtocolError, match='"unseen" presents the same as "damper"'):
        study(conditions, (unseen[0], unseen[1].replace("hidden", "shown")))


@pytest.mark.parametrize(
    ("ticks", "code", "said"),
    [
        ("1", 0, "Duration"),
        ("2", 2, "gives up to 25.6 N·s/m at the hand; the slope limit (1000 Hz, kalman, 2 ticks) is 20.6"),
        ("5", 2, "5 is not in the range"),
    ],
)
def test_check_judges_levels_for_a_delay(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    ticks: str,
    code: int,
    said: str,
) -> None:
    path = tmp_path / "rows.toml"
    path.write_text(edited(("levels = [0.02, 0.6]", "levels = [0.02, 0.6]\nstandards = [16]")), encoding="utf-8")
    monkeypatch.setattr(sys, "argv", ["liquid-study", "check", str(path), "--delay-ticks", ticks])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == code
    printed = capsys.readouterr()
    assert said in printed.out + printed.err
