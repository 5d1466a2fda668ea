"""What check reports of paced motions: each row with its line and hint."""

from collections.abc import Iterable

import numpy as np
import pytest

from study_app.errors import ProtocolError
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Ewma, Foaw, Given, Kalman, Line, Raw, Scene
from study_app.haptics.model.steady_state import steady
from study_app.haptics.runtime.offline import simulate
from study_app.protocol.checks.estimator_response import fastest_hz, passed_share
from study_app.protocol.levels.presented_levels import FASTER
from study_app.protocol.load import parse
from study_app.protocol.model import Follow, Protocol
from tests.haptics.scenes import UNBENT, scene

STUDY = """\
format = 2
sequence = ["thicker"]
study.name = "pace"
[liquids.damper]
drag = { law = "linear", damping_nspm = 8 }
[conditions.damper]
liquid = "damper"
[tasks.stir]
kind = "follow"
amplitude_mm = 25
[stimuli.damping]
vary = "damping_nspm"
standards = [8]
levels = [0.02, 0.6]
[methods.few]
kind = "constant"
repetitions = 2
[blocks.thicker]
stimulus = "damping"
design = "2ifc"
method = "few"
task = "stir"
"""
CONDITIONS = ('stimulus = "damping"\ndesign = "2ifc"\nmethod = "few"', 'conditions = ["damper"]')
REACH = (
    'kind = "follow"\namplitude_mm = 25',
    'kind = "reach"\ntargets_mm = [[-20, 0, 0], [20, 0, 0]]\nradius_mm = 5\ndwell_s = 0.2\ncount = 2\n'
    'instruction = "Reach."',
)
EWMA = ("[liquids.damper]", '[scene.velocity]\nkind = "ewma"\n[liquids.damper]')
DELAYED = ('vary = "damping_nspm"\nstandards = [8]\nlevels = [0.02, 0.6]', 'vary = "force_delay_ms"\nlevels = [2, 50]')
VISCOUS = (
    'drag = { law = "linear", damping_nspm = 8 }',
    'density_kg_m3 = 1260\nviscosity_pa_s = 1\ndrag = { law = "haider-levenspiel" }',
)
SLOW = ("amplitude_mm = 25", "amplitude_mm = 20\nfrequency_hz = 0.5")
HIDDEN = ('liquid = "damper"\n[tasks', 'liquid = "damper"\nball = "hidden"\n[tasks')


def study(edits: Iterable[tuple[str, str]]) -> Protocol:
    text = STUDY
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    return parse(text.encode(), "pace.toml")


@pytest.mark.parametrize(
    ("edits", "place", "message", "hint"),
    [
        (
            [("[8]", "[40]"), ("amplitude_mm = 25", "amplitude_mm = 20")],
            "stimuli.damping.levels",
            "standard 40 at levels 0.34 and 0.6 gives up to 64 N·s/m at the hand; the slope limit (1000 Hz, kalman, "
            "1 tick) is 53",
            "levels to 0.325, or the standard to 33.1",
        ),
        (
            [("[8]", "[32]")],
            "stimuli.damping.levels",
            "standard 32 at levels 0.34 and 0.6 is up to 9.7 N at 1.2 times the paced 0.157 m/s; device.force_limit_n "
            "is 8",
            "amplitude_mm = 20.7 or frequency_hz = 0.82",
        ),
        (
            [DELAYED, ("damping_nspm = 8", "damping_nspm = 60"), ("amplitude_mm = 25", "amplitude_mm = 10")],
            "stimuli.damping.levels",
            '"damper" gives 60 N·s/m at the hand; the slope limit (1000 Hz, kalman, 1 tick) is 53',
            "damping_nspm = 53",
        ),
        (
            [CONDITIONS, ("damping_nspm = 8", "damping_nspm = 45")],
            "blocks.thicker.conditions",
            '"damper" is 8.5 N at 1.2 times the paced 0.157 m/s; device.force_limit_n is 8',
            "amplitude_mm = 23.5 or frequency_hz = 0.94",
        ),
        (
            [EWMA, ("amplitude_mm = 25", "amplitude_mm = 10\nfrequency_hz = 3")],
            "tasks.stir.frequency_hz",
            "at 3 Hz the velocity estimator passes 96.9 % of a damper's force",
            "at most 1.6 Hz, where it passes 99 %",
        ),
        (
            [("amplitude_mm = 25", "amplitude_mm = 60")],
            "tasks.stir.amplitude_mm",
            "60 mm with radius 6 mm leaves the tank",
            "device.workspace_mm reaches to 50 mm",
        ),
        (
            [HIDDEN, REACH],
            "conditions.damper.ball",
            'is hidden, but block "thicker" has a reaching task: it cannot be aimed',
            'a task of kind "follow" or "explore"',
        ),
        (
            [
                ("[8]", "[3.5]"),
                VISCOUS,
                ('vary = "damping_nspm"', 'vary = "viscosity_pa_s"'),
                ("repetitions = 2", "repetitions = 2\nlevels = [0.1, 0.2, 0.3, 0.6]"),
                SLOW,
            ],
            "stimuli.damping.levels",
            "standard 3.5 at levels 0.2, 0.3 and 0.6 is up to 5.1 N at 1.2 times the paced 0.0628 m/s; the slope limit "
            "(1000 Hz, kalman, 1 tick) leaves 4.0 N",
            "levels to 0.124",
        ),
        (
            [
                ("[8]", "[40, 45]"),
                ("amplitude_mm = 25", "amplitude_mm = 15"),
                ("repetitions = 2", "repetitions = 2\nlevels = [0.1, 0.2, 0.3, 0.5, 0.6]"),
            ],
            "stimuli.damping.levels",
            "standard 40 at levels 0.5 to 0.6 and standard 45 at levels 0.2 to 0.6 give up to 72 N·s/m at the hand; "
            "the slope limit (1000 Hz, kalman, 1 tick) is 53",
            "levels to 0.177, or the standard to 33.1",
        ),
    ],
)
def test_each_row_is_reported_at_its_line(edits: list[tuple[str, str]], place: str, message: str, hint: str) -> None:
    with pytest.raises(ProtocolError) as refused:
        study(edits)
    (problem,) = refused.value.problems
    assert problem.place.startswith(place)
    assert (problem.message, problem.hint) == (message, hint)
    assert problem.line is not None


def test_each_level_is_named_once_with_the_limit_that_clips_it() -> None:
    with pytest.raises(ProtocolError) as refused:
        study([("[8]", "[40]"), ("repetitions = 2", "repetitions = 2\nlevels = [0.1, 0.2, 0.6]")])
    said = [problem.message for problem in refused.value.problems]
    assert said == [
        "standard 40 at level 0.6 gives 64 N·s/m at the hand; the slope limit (1000 Hz, kalman, 1 tick) is 53",
        "standard 40 at levels 0.1 and 0.2 is up to 9.0 N at 1.2 times the paced 0.157 m/s; device.force_limit_n is 8",
    ]


@pytest.mark.parametrize(
    "edits",
    [
        [],
        [("[8]", "[32]"), ("amplitude_mm = 25", "amplitude_mm = 20.7")],
        [("[8]", "[32]"), ("amplitude_mm = 25", "amplitude_mm = 25\nfrequency_hz = 0.82")],
        [("[8]", "[33.1]"), ("amplitude_mm = 25", "amplitude_mm = 20")],
        [("amplitude_mm = 25", "amplitude_mm = 10\nfrequency_hz = 1.6")],
        [HIDDEN],
    ],
)
def test_what_a_hint_suggests_passes_and_is_not_clipped(edits: list[tuple[str, str]]) -> None:
    protocol = study(edits)
    task = protocol.tasks["stir"]
    assert isinstance(task, Follow)
    stimulus = protocol.stimuli["damping"]
    strongest = stimulus.comparison(stimulus.standards[0], stimulus.levels[1])
    scene = protocol.scene_for("damper")
    damper = scene.liquids[0]
    drag = damper.drag.model_copy(update={"damping_nspm": strongest})
    felt: Scene = scene.model_copy(update={"liquids": (damper.model_copy(update={"drag": drag}),)})
    assert steady(felt, FASTER * task.fastest_stroke((0.1, 0.06, 0.06)).speed_mps).limit is None


@pytest.mark.parametrize(
    ("line", "place"),
    [
        ('[conditions.x]\nliquid = "water"\nball = "hidden"', "conditions.x.ball: belongs to format 2"),
        ('[tasks.x]\nkind = "follow"', 'tasks.x.kind: "follow" belongs to format 2'),
    ],
)
def test_new_keys_and_values_belong_to_format_2(line: str, place: str) -> None:
    with pytest.raises(ProtocolError) as refused:
        parse(f'format = 1\nstudy.name = "old"\n{line}\n'.encode(), "old.toml")
    assert any(place in str(problem) for problem in refused.value.problems)


SWINGS = 4


def measured_share(velocity, rate_hz, frequency_hz):
    """Return Σ v̂v / Σ v² over whole swings, once the estimator has settled."""
    t_s = np.arange(round(rate_hz * (SWINGS + 2) / frequency_hz)) / rate_hz
    omega = 2 * np.pi * frequency_hz
    still = np.zeros_like(t_s)
    path = Motion(t_s, np.column_stack([0.1 * np.sin(omega * t_s), still, still]))
    seen = simulate(scene(velocity=velocity, rate_hz=rate_hz, knee=UNBENT), path).vx_mps
    true = 0.1 * omega * np.cos(omega * t_s)
    whole = slice(round(2 * rate_hz / frequency_hz), None)
    return np.sum(seen[whole] * true[whole]) / np.sum(true[whole] ** 2)


@pytest.mark.compiled
@pytest.mark.parametrize("frequency_hz", [0.5, 1.0, 4.0])
@pytest.mark.parametrize("rate_hz", [500.0, 1000.0])
@pytest.mark.parametrize("velocity", [Ewma(), Ewma(alpha=0.02), Line(), Line(samples=4), Raw()], ids=str)
def test_the_share_is_that_of_the_estimator(velocity, rate_hz, frequency_hz):
    found = passed_share(velocity, rate_hz, frequency_hz)
    assert found == pytest.approx(measured_share(velocity, rate_hz, frequency_hz), abs=1e-3)


def test_the_usual_estimator_passes_99_percent_up_to_1_6_hz():
    assert passed_share(Ewma(), 1000, 3) == pytest.approx(0.969, abs=5e-4)
    assert fastest_hz(Ewma(), 1000, 0.99) == pytest.approx(1.68, abs=0.02)


def test_a_known_velocity_is_passed_whole_and_a_window_is_judged_at_its_full_length():
    assert passed_share(Given(), 1000, 5) == 1
    assert passed_share(Foaw(samples=8), 1000, 5) == passed_share(Line(samples=8), 1000, 5)
    assert 0.99 < passed_share(Kalman(), 1000, 5) < 1
