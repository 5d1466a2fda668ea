"""A single-blind study shows the operator force and wake; a double-blind one does not even look at them."""

from typing import Any

import numpy as np
import pytest

from study_app.app.session.bridge import SessionBridge
from study_app.gui.operator.force_plots import ForceCard
from study_app.gui.operator.plot_cards import HiddenForceCard
from study_app.haptics.model.layout import LIMITER_FADE, LIMITER_NORM, SAMPLE, records
from tests.app.world import World, begin_trial

pytestmark = pytest.mark.slow


def pushes(world: World, count: int = 400) -> Any:
    """Return samples of the scene now loaded with a force of 3 N, 1.5 N of it along x, limited now and then."""
    samples = records(SAMPLE, count)
    world.now_s += count / 1000
    samples.tick = np.arange(count)
    samples.time_ns = round(world.now_s * 1e9) - np.arange(count)[::-1] * 1_000_000
    samples.scene = world.serial
    samples.fresh = 1
    samples.device_force_n = (1.5, 0.0, np.sqrt(9 - 1.5**2))
    samples.wake_mps = (0.3, 0.0, 0.4)
    samples.permitted_n, samples.withheld_n = 4.0, 0.25
    samples.limiters = LIMITER_FADE
    samples.limiters[:7] |= LIMITER_NORM
    return samples


WITHHELD = "Force withheld, limit 5\u2009%"


def rows(bridge: SessionBridge) -> dict[str, str]:
    return dict(bridge.view().device.rows)


def looked(bridge: SessionBridge, world: World) -> None:
    begin_trial(bridge, world)
    world.samples = pushes(world)
    bridge.draw_frame()
    bridge.show_traces()
    bridge.show_tiles()


def test_force_wake_share_and_limiters_are_seen(make: Any, world: World) -> None:
    bridge = make(blinding="single", force_limit_n=6.0)
    looked(bridge, world)
    card = bridge.operator.force
    assert isinstance(card, ForceCard)
    x_n, size_n = (card.plot.curves[curve].getData()[1] for curve in (0, 3))
    assert x_n == pytest.approx(1.5)
    assert size_n == pytest.approx(3.0)
    assert card.wake.curve.getData()[1] == pytest.approx(0.5)
    assert rows(bridge)["Force, share of 6 N"] == "50\u2009%, most 50\u2009%"
    assert rows(bridge)["Limiters acted"] == "force 7"
    assert rows(bridge)[WITHHELD] == "6.2\u2009%"
    assert bridge.operator.header.blind.word == "Single-blind"


def test_double_blind_looks_at_no_force(bridge: SessionBridge, world: World) -> None:
    looked(bridge, world)
    assert bridge.monitor.forces is None
    assert isinstance(bridge.operator.force, HiddenForceCard)
    assert rows(bridge)["Force, share of 6 N"] == rows(bridge)["Limiters acted"] == rows(bridge)[WITHHELD] == "hidden"
    assert bridge.operator.header.blind.word == "Double-blind"


def test_the_participant_sees_the_same_in_both(make: Any, world: World) -> None:
    seen = []
    for blinding, limit_n in (("double", None), ("single", 6.0)):
        bridge = make(blinding=blinding, force_limit_n=limit_n)
        looked(bridge, world)
        seen.append((repr(bridge.participant.page), bridge.participant.grab().toImage()))
        bridge.leave_now()
        world.samples = records(SAMPLE, 0)
    assert seen[0][0] == seen[1][0]
    assert seen[0][1] == seen[1][1]
