"""Which limits an interval breaks, by its samples: level, clipping, pace, and the difference of two delays."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

from study_app.haptics.model.layout import LIMITER_GLITCH, LIMITER_NORM, SAMPLE
from study_app.protocol.load import parse
from study_app.protocol.model import Follow, Protocol
from study_app.protocol.trials.due import Due
from study_app.protocol.trials.stimuli import Stimulated
from study_app.store.tables.delivered import JUDGED, delivered, judged, missed, undelivered

STUDY = """\
format = 2
study.name = "delivered"
scene.fade_s = 0.3
[liquids.damper]
drag = { law = "linear", damping_nspm = 8 }
[tasks.follow]
kind = "follow"
[tasks.stir]
kind = "explore"
min_s = 1
max_s = 4
instruction = "Stir."
[stimuli.damping]
vary = "damping_nspm"
levels = [0.02, 0.6]
[blocks.thicker]
task = "follow"
stimulus = "damping"
design = "2ifc"
method = "constant"
[blocks.stirred]
task = "stir"
stimulus = "damping"
design = "2ifc"
method = "constant"
"""
DAMPING = Stimulated("damper", "damping_nspm", 8.0)
VISCOSITY = Stimulated("damper", "viscosity_pa_s", 4.0)
DELAY = Stimulated("damper", "delay_ms", 50.0)


@pytest.fixture(scope="module")
def protocol() -> Protocol:
    return parse(STUDY.encode(), "delivered.toml")


def samples(b_nspm: float = 8.0, *, pace: float = 1.0, lasts_s: float = 4.0) -> Any:
    """Return an interval of the paced motion, its amplitude ``pace`` times the target's, through an exact damper."""
    found = np.zeros(round(1000 * lasts_s), SAMPLE)
    t_s = np.arange(len(found)) * 1e-3
    found["time_ns"] = 5_000_000_000 + np.arange(len(found)) * 1_000_000
    found["position_m"][:, 0] = pace * 0.02 * np.sin(2 * np.pi * t_s)
    found["force_n"][:, 0] = -b_nspm * pace * 0.02 * 2 * np.pi * np.cos(2 * np.pi * t_s)
    found["device_force_n"] = found["force_n"]
    return found


def reasons(protocol: Protocol, found: Any, presented: Stimulated = DAMPING, task: str = "follow") -> list[str]:
    done = protocol.tasks[task]
    return [*undelivered(protocol.limits, presented, done, delivered(protocol, presented, done, judged(found)))]


@pytest.mark.parametrize(
    ("b_nspm", "broken"),
    [(8.0, []), (8.15, []), (7.85, []), (8.17, ["level_error_percent"]), (7.83, ["level_error_percent"])],
)
def test_a_damping_is_judged_by_its_limit(protocol: Protocol, b_nspm: float, broken: list[str]) -> None:
    assert reasons(protocol, samples(b_nspm)) == broken


@pytest.mark.parametrize(("share", "broken"), [(1.0, []), (0.985, []), (0.97, ["level_error_percent"])])
def test_another_number_is_judged_by_the_share_of_its_force(
    protocol: Protocol, share: float, broken: list[str]
) -> None:
    found = samples()
    found["device_force_n"] *= share
    assert reasons(protocol, found, VISCOSITY) == broken
    assert reasons(protocol, found, DELAY) == []


def test_a_hand_at_rest_was_presented_nothing(protocol: Protocol) -> None:
    assert reasons(protocol, samples(pace=0.0)) == ["level_error_percent", "pace_error_percent"]
    assert reasons(protocol, samples(pace=0.0), VISCOSITY) == ["level_error_percent", "pace_error_percent"]


@pytest.mark.parametrize(("pace", "broken"), [(0.62, []), (1.38, []), (0.58, True), (1.42, True)])
def test_the_pace_is_judged_where_there_is_one(protocol: Protocol, pace: float, broken: object) -> None:
    assert reasons(protocol, samples(pace=pace)) == (["pace_error_percent"] if broken else [])
    assert reasons(protocol, samples(pace=pace), task="stir") == []


@pytest.mark.parametrize(
    ("task", "at_s", "broken"),
    [("follow", 0.9, []), ("follow", 1.1, ["force_limit_n"]), ("stir", 0.4, []), ("stir", 0.6, ["force_limit_n"])],
)
def test_clipping_counts_after_the_lead_or_the_fade(
    protocol: Protocol, task: str, at_s: float, broken: list[str]
) -> None:
    found = samples()
    found["limiters"][round(1000 * at_s)] = LIMITER_NORM
    assert reasons(protocol, found, task=task) == broken
    assert reasons(protocol, found, DELAY, task) == []


def test_the_fade_and_refused_positions_are_not_judged(protocol: Protocol) -> None:
    found = samples()
    found["device_force_n"][:1000] = 0
    found["position_m"][2000:2003] = 1.0
    found["limiters"][2000:2003] = LIMITER_GLITCH
    assert reasons(protocol, found) == []
    found["limiters"] = 0
    assert "level_error_percent" in reasons(protocol, found)


def test_forces_are_judged_as_recordings_hold_them(protocol: Protocol) -> None:
    task, exact = protocol.tasks["follow"], samples()
    rounded = exact.copy()
    for name in ("force_n", "device_force_n"):
        rounded[name] = np.rint(exact[name] * 2**14) / 2**14
    one, other = (delivered(protocol, DAMPING, task, judged(found)) for found in (exact, rounded))
    assert one == other
    assert one.columns.keys() == {"value_delivered", "force_share", "apparent_mass_kg", "pace_mps"}


@pytest.mark.parametrize(
    ("errors_ms", "holds", "broken"),
    [
        ([6.0, 7.9], (False, True), []),
        ([6.0, 8.1], (False, True), ["level_error_ms"]),
        ([8.1, 6.0], (True, False), ["level_error_ms"]),
        ([6.0], (False, True), []),
        ([6.0, 60.0], (True, True), []),
        ([6.0, None], (False, True), []),
    ],
)
def test_delays_are_judged_by_the_difference_of_their_errors(
    protocol: Protocol, errors_ms: list[float | None], holds: tuple[bool, ...], broken: list[str]
) -> None:
    assert [*missed(protocol.limits, Due(10.0, 50.0, 0, (DELAY, DELAY)), holds, errors_ms)] == broken
    assert [*missed(protocol.limits, Due(0.1, 8.0, 0, (DAMPING, DAMPING)), holds, errors_ms)] == []


def test_without_limits_nothing_is_judged(protocol: Protocol) -> None:
    limits = type(protocol.limits)()
    found = delivered(protocol, DAMPING, protocol.tasks["follow"], judged(samples(20.0, pace=3.0)))
    assert [*undelivered(limits, DAMPING, protocol.tasks["follow"], found)] == ["force_limit_n"] * found.clipped


def test_the_end_of_an_interval_of_10_s_costs_at_most_5_ms(protocol: Protocol) -> None:
    task = protocol.tasks["follow"]
    assert isinstance(task, Follow)
    parts = [judged(part).tobytes() for part in np.array_split(samples(lasts_s=10.0), 600)]
    took_s = []
    for _ in range(20):
        began = time.thread_time()
        delivered(protocol, DAMPING, task, np.frombuffer(b"".join(parts), JUDGED))
        took_s.append(time.thread_time() - began)
    assert min(took_s) < 5e-3
