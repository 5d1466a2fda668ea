"""What the trials of a session present, for each design, method and rule of a block, compared with a reviewed file.

The participant is right above a level of 0.4 and in every second trial below it. A later version has to present the
same, or sessions are not reproduced: no option rewrites the files.
"""

from pathlib import Path

import pytest

from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.orders.tracks import tracks_of
from study_app.protocol.presented.presentation import next_level, trial_result
from study_app.protocol.trials.methods import TrialResult
from tests.golden import compare
from tests.golden_values import one_line
from tests.protocol.trials.level_studies import FIVE_POINTS, key_of, study
from tests.protocol.trials.matching import ALONE, DELAY, matching

CONSTANT = 'kind = "constant"\nlevels = [0.2, 0.4, 0.8]\nrepetitions = 8'
TWO = ("standards = [1, 2]", "standards = [2]")
FROM_ZERO = ("levels = [0.1, 0.8]", 'levels = [0, 0.8]\nspacing = "linear"')
VALUE = ("levels = [0.1", 'level = "value"\nlevels = [0.1')
CATCH = ("task =", "catch = { share = 0.1 }\ntask =")
CONDITIONS = (
    'stimulus = "viscosity"\ndesign = "2ifc"\nmethod = "few"',
    'conditions = ["oil", "other", "late"]\nstandard = "oil"\ndesign = "abx"\nrepetitions = 8',
)
PRACTICE = """
[blocks.{name}]
phase = "practice"
title = "Practice"
setting_label = "Pair"
task = "stir"
stimulus = "viscosity"
design = "2ifc"
method = "few"
"""
PRACTISED = ('sequence = ["viscosity"]', 'sequence = ["first", "second", "viscosity"]')
MODULUS = '[designs.number]\nkind = "estimation"\nmodulus = { level = 0.5, number = 10 }\n'
RATED = FIVE_POINTS + '\n[blocks.rate]\ntask = "stir"\nstimulus = "value"\ndesign = "rated"\nmethod = "few"\n'
RATING = (
    ('sequence = ["viscosity"]', 'sequence = ["viscosity", "rate"]'),
    ("[0.2, 0.4, 0.8]", "[0.5, 0.6, 0.8]"),
    ("part = 1\n", ""),
    ('code_prefix = "V"\n', ""),
)


def design(kind: str) -> tuple[str, str]:
    return 'design = "2ifc"', f'design = "{kind}"'


def until(right: int, of: int) -> tuple[str, str]:
    return "task =", f"until = {{ right = {right}, of = {of} }}\ntask ="


def method(text: str) -> tuple[str, str]:
    return CONSTANT, text


STUDIES: dict[str, Protocol] = {
    "constant": study(),
    "one standard": study(TWO),
    "the present value": study(("standards = [1, 2]\n", "")),
    "some of the standards": study(("design =", "standards = [2]\ndesign =")),
    "levels as a number": study(("levels = [0.2, 0.4, 0.8]", "levels = 4")),
    **{kind: study(design(kind), TWO) for kind in ("3ifc", "4ifc", "abx", "oddity", "samedifferent", "yesno")},
    **{f"values, {kind}": study(design(kind), VALUE) for kind in ("2ifc", "oddity", "abx", "samedifferent")},
    "estimation": study(
        design("estimation"), ("standards = [1, 2]", 'level = "value"'), ("[0.1, 0.8]", "[0.1, 9]")
    ),
    "modulus": study(design("number"), ("standards = [1, 2]", 'level = "value"'), more=MODULUS),
    "conditions": study(CONDITIONS),
    "criterion": study(until(4, 5)),
    "criterion, yes or no": study(until(4, 5), design("yesno")),
    "last answers": study(until(5, 5), ("repetitions = 8", "repetitions = 40")),
    "catch trials": study(("repetitions = 8", "repetitions = 20"), CATCH),
    "catch trials, yes or no": study(("repetitions = 8", "repetitions = 20"), CATCH, design("yesno")),
    **{
        f"{kind}{name}": study(method(f'kind = "{kind}"\ntrials = 40{more}'), TWO, *edits)
        for kind in ("updown", "questplus")
        for name, more, edits in (
            ("", "", ()),
            (", begin", "\nbegin = 0.41", ()),
            (", yes or no", "\nbegin = 0.4", (design("yesno"),)),
            (", catch trials", "", (CATCH,)),
            (", from zero", "\nbegin = 0", (FROM_ZERO,)),
        )
    },
    "tracks": study(method('kind = "updown"\ntrials = 24\ntracks = 2\nbegin = [0.8, 0.2]')),
    "rule": study(method('kind = "updown"\nrule = "1down1up"\nratio = 1\nstep_up = 0.2\nbegin = 0'), TWO, FROM_ZERO),
    "reversals": study(method('kind = "updown"\ntrials = 200\nstop = { reversals = 6 }'), TWO),
    "reversals after": study(method('kind = "updown"\ntrials = 200\nstop = { reversals = 1, after = 50 }'), TWO),
    "ratio after": study(method('kind = "questplus"\ntrials = 200\nstop = { ratio = 1000, after = 25 }'), TWO),
    "ended tracks": study(method('kind = "updown"\ntrials = 60\nstop = { reversals = 2, after = 5 }'), CATCH,
                          design("yesno")),
    "practice": study(method('kind = "updown"\ntrials = 20\nbegin = 0.8'), TWO, PRACTISED,
                      more=PRACTICE.format(name="first") + PRACTICE.format(name="second")),
    "rating": study(*RATING, more=RATED),
    "adjustment": matching(("repetitions = 4", "repetitions = 20")),
    "adjustment alone": matching(ALONE),
    "adjusted delay": matching(ALONE, DELAY),
}  # fmt: skip


def presented(protocol: Protocol) -> list[str]:
    """Return a line for each trial that is not passed over, and one for each track."""
    key, schedule, results = key_of(protocol), build_schedule(protocol, "P001", 1), list[TrialResult]()
    lines = [
        f"{name} {track.name}: {track.slots} slots, catch {list(track.catch)}"
        for name, block in protocol.blocks.items()
        for track in tracks_of(protocol, block)
    ]
    for trial in schedule.trials:
        due = next_level(protocol, key, schedule, trial, results)
        if due is None:
            continue
        block = protocol.blocks[trial.block]
        design = protocol.design_of(block)
        right = due.level is None or due.level > 0.4 or trial.number % 2 == 0
        answers = sorted(design.answers, key=lambda answer: (answer != design.correct(due.arrangement)) == right)
        results.append(
            trial_result(protocol, block, trial.number, trial.code, due.level, due.arrangement, (answers or ["0"])[0])
        )
        intervals = [
            f"{interval.condition} {interval.vary or ''} {interval.value if interval.vary else ''}".strip()
            for interval in due.intervals
        ]
        letters = design.arrangement_text(due.arrangement) if design.arrangements else ""
        answered = results[-1]
        lines.append(
            f"{trial.number} {trial.code} {key.codes[trial.block][trial.code]} {due.level} of {due.standard} {letters}"
            f"{' catch' if due.catch else ''}: {', '.join(intervals)} | {answered.correct} {answered.success}"
        )
        if (setting := protocol.adjusting(block, due.standard, due.level)) is not None:
            lines.append(f"    {one_line(setting)}")
    return lines


@pytest.mark.parametrize("name", STUDIES)
def test_the_presented_levels_of_a_session_are_as_recorded(name: str, pytestconfig: pytest.Config) -> None:
    file = Path(__file__).parents[1] / "presented" / f"{name.replace(', ', '_').replace(' ', '_')}.txt"
    compare(file, presented(STUDIES[name]), pytestconfig, fixed=True)
