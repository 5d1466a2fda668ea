"""The force link: delay, jitter and loss of sent forces; the safety layer acts on the sent force."""

import numpy as np
import pytest
from pydantic import ValidationError

from study_app.errors import StudyError
from study_app.haptics.kernels.safety import begin_scene, delay_force, uniform
from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.layout import LIMITER_FADE, LIMITER_STOP
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.overrides import number_names, override_value
from study_app.haptics.model.scene import PROMPT_LINK, STORED_FORCES, Box, ForceLink, Liquid, Scene
from study_app.haptics.runtime.offline import samples_along
from study_app.haptics.runtime.pack import is_built_alike, pack, pack_into
from study_app.protocol.file_format.scene_file import scene_text
from tests.haptics.scenes import EVERYTHING, Hand, liquid, scene, stroke

TICKS = 3000


def damper(damping_nspm=0.2, **link):
    """Return a scene of a linear damper with a force link."""
    liquid = Liquid(id="damper", density_kg_m3=1000, drag=Drag(law="linear", damping_nspm=damping_nspm))
    return Scene(liquids=(liquid,), link=ForceLink(**link))


def arrivals(ticks=TICKS, **link):
    """Return, for each tick, the number of the tick whose force is sent, or -1 without a force."""
    model = pack(damper(**link))
    force_n, sent_ticks = np.zeros(3), []
    for tick in range(ticks):
        force_n[:] = tick, -tick, 0.5
        arrived = delay_force(model.parameters[0].link, model.state[0].link, model.forces_n, force_n)
        assert arrived == bool(force_n[2])
        sent_ticks.append(int(force_n[0]) if arrived else -1)
    return np.array(sent_ticks)


def sine(lasts_s=3.0, amplitude_m=0.02, hz=1.0):
    """Return a hand's motion along x, in the scene."""
    t_s = np.arange(round(1000 * lasts_s)) / 1000
    x = 10 * amplitude_m * np.sin(2 * np.pi * hz * t_s)
    return Motion(t_s, np.column_stack([x, 0 * x, 0 * x]))


@pytest.mark.parametrize("delay", [1, 15, 100, 200])
def test_the_force_of_a_tick_is_sent_so_many_ticks_later(delay):
    prompt, late = (samples_along(damper(delay_s=delay_ms / 1000), sine()) for delay_ms in (0, delay))
    np.testing.assert_array_equal(late.force_n, prompt.force_n)  # the force of the effects is recorded as it is
    begun = delay + 60  # the fade-in begins with the first force that arrives
    np.testing.assert_array_equal(late.device_force_n[begun:], prompt.device_force_n[begun - delay : -delay])
    assert not late.device_force_n[:delay].any()
    assert np.abs(prompt.device_force_n).max() > 0.02


@pytest.mark.slow
def test_a_link_that_does_nothing_leaves_every_bit_and_needs_no_memory():
    for each_scene in EVERYTHING.values():
        idle = each_scene.model_copy(update={"link": ForceLink(seed=5)})
        hand, idle_hand = Hand(each_scene), Hand(idle)
        for place in stroke(400):
            assert hand.tick(place).tobytes() == idle_hand.tick(place).tobytes()
    assert len(pack(damper()).forces_n) == 0


@pytest.mark.slow
def test_jitter_is_uniform_and_keeps_forces_in_order():
    sent_ticks = arrivals(20_000, delay_s=0.02, jitter_s=0.05, seed=3)
    ages = np.arange(len(sent_ticks)) - sent_ticks
    assert (sent_ticks[:20] == -1).all()
    assert (np.diff(sent_ticks) >= 0).all()
    assert ages[100:].min() == 20
    assert ages[100:].max() <= 20 + 50
    drawn = np.array([int(51 * uniform(3, 2 * tick + 1)) for tick in range(20_000)])
    due = np.arange(20_000) - 20 - drawn
    np.testing.assert_array_equal(sent_ticks, np.maximum(np.maximum.accumulate(due), -1))
    counts = np.bincount(drawn, minlength=51)
    assert ((counts - 20_000 / 51) ** 2 / (20_000 / 51)).sum() < 90  # chi-squared of 50 degrees of freedom, p 0.0005


@pytest.mark.slow
@pytest.mark.parametrize("loss", [0.1, 0.5])
def test_a_lost_force_is_replaced_by_the_last_one(loss):
    sent_ticks = arrivals(20_000, loss=loss, seed=9)
    held = np.diff(sent_ticks) == 0
    assert held.mean() == pytest.approx(loss, abs=4 * np.sqrt(loss * (1 - loss) / 20_000))
    assert (sent_ticks[1:][~held] == np.arange(1, 20_000)[~held]).all()
    after = held[1:][held[:-1]].mean()  # losses do not come in bursts
    assert after == pytest.approx(loss, abs=5 * np.sqrt(loss * (1 - loss) / held.sum()))


def test_a_stop_is_zero_at_once_and_the_force_returns_with_a_fade():
    hand = Hand(damper(8.0, delay_s=0.05))
    places = np.outer(0.02 * np.sin(2 * np.pi * np.arange(900) / 500), (1, 0, 0))
    for place in places[:130]:
        sample = hand.tick(place)
    assert np.linalg.norm(sample.device_force_n) > 0.1
    hand.safety[0].stop = 1
    sample = hand.tick(places[130])
    assert sample.limiters & LIMITER_STOP
    assert not sample.device_force_n.any()
    for place in places[131:300]:
        assert not hand.tick(place).device_force_n.any()
    hand.safety[0].stop = 0
    assert hand.tick(places[300]).limiters & LIMITER_FADE


def test_the_first_force_that_arrives_fades_in():
    """A force at its full value after the scene has faded in would be a knock."""
    delayed_scene = scene(liquid(4000, effects=("buoyancy",)), link=ForceLink(delay_s=0.15))
    prompt, late = (
        Hand(delayed_scene.model_copy(update={"link": PROMPT_LINK}), faded_in=False),
        Hand(delayed_scene, faded_in=False),
    )
    forces = np.array([[hand.tick((0.0, 0.0, 0.0)).device_force_n[1] for _ in range(900)] for hand in (prompt, late)])
    assert forces[0, -1] > 1
    assert not forces[1, :150].any()
    assert 0 < forces[1, 150] < 0.02  # two steps of the fade
    np.testing.assert_array_equal(forces[1, 150:], forces[0, 2:-148])


@pytest.mark.slow
def test_a_body_that_bobs_through_a_surface_gets_no_energy_from_late_buoyancy():
    """Buoyancy near the surface acts as a spring; a late spring drives the hand, which the observer must detect."""
    pool = Liquid(
        id="pool",
        density_kg_m3=2000,
        region=Box(centre_m=(0, -0.5, 0), size_m=(2, 1, 2)),
        effects=("buoyancy", "surface"),
        drag=Drag(law="constant"),
    )
    t_s = np.arange(8000) / 1000
    place_m = np.column_stack([0 * t_s, 0.003 * np.sin(2 * np.pi * 3 * t_s), 0 * t_s])

    def per_cycle_j(link):
        hand = Hand(Scene(liquids=(pool,), scale=10, link=link))
        forces = np.array([hand.tick(place).device_force_n for place in place_m])
        return float(np.einsum("ij,ij->", forces[1000:-1], np.diff(place_m[1000:], axis=0))) / 21

    assert per_cycle_j(PROMPT_LINK) < 0.2e-3  # its force is held for a tick
    assert per_cycle_j(ForceLink(delay_s=0.08)) < 0.5e-3  # 16 mJ where the observer left late buoyancy out


def balance(hand, places):
    """Return the lowest energy balance [J] of hand and liquid, the strongest force and the longest step."""
    energy_j = lowest_j = strongest_n = longest_m = 0.0
    before_m, force_n = places[0], np.zeros(3)
    for place in places:
        energy_j = min(energy_j - force_n @ (place - before_m), hand.safety[0].passivity.reserve_j)
        lowest_j = min(lowest_j, energy_j)
        longest_m = max(longest_m, np.linalg.norm(place - before_m))
        before_m, force_n = place, np.array(hand.tick(place).device_force_n)
        strongest_n = max(strongest_n, np.linalg.norm(force_n))
    return lowest_j, strongest_n, longest_m


@pytest.mark.slow
@pytest.mark.parametrize("link", [{"delay_s": 0.1}, {"delay_s": 0.2, "jitter_s": 0.05, "loss": 0.3}])
def test_a_late_force_gives_no_more_than_the_allowance_however_long_it_lasts(link):
    """A debt of 1 mJ, forgiven at 1 mW, would grow by 15 mJ."""
    t_s = np.arange(15_000) / 1000
    places = np.outer(0.02 * np.sin(2 * np.pi * 2.5 * t_s), (1.0, 0.0, 0.0))
    lowest_j, strongest_n, longest_m = balance(Hand(damper(8.0, **link)), places)
    assert strongest_n > 0.1
    assert -1e-3 - 2 * strongest_n * longest_m <= lowest_j < -0.5e-3


@pytest.mark.slow
def test_the_gain_returns_only_with_the_next_scene():
    t_s = np.arange(3000) / 1000
    hand = Hand(damper(8.0, delay_s=0.1))
    for place in np.outer(0.02 * np.sin(2 * np.pi * 2.5 * t_s), (1.0, 0.0, 0.0)):
        hand.tick(place)
    gain = hand.safety[0].passivity.gain
    assert gain < 0.8
    for _ in range(3000):
        hand.tick((0.0, 0.0, 0.0))
    assert hand.safety[0].passivity.gain <= gain
    begin_scene(hand.safety[0])
    assert hand.safety[0].passivity.gain == 1


def test_a_link_survives_overrides_and_is_not_a_scene_parameter():
    linked_scene = damper(delay_s=0.02, seed=4)
    assert override_value(linked_scene, "damping_nspm", 3.0).link == linked_scene.link
    assert not {"delay_s", "jitter_s", "loss", "seed"} & set(number_names(linked_scene))
    with pytest.raises(StudyError, match="the parameter 'link'"):
        override_value(linked_scene, "link", "{delay_s=0.1}")
    assert "link" not in scene_text(linked_scene)
    assert is_built_alike(linked_scene, override_value(linked_scene, "damping_nspm", 3.0))
    assert not is_built_alike(linked_scene, damper(delay_s=0.03, seed=4))


def test_delay_and_jitter_beyond_the_kept_forces_are_refused():
    assert ForceLink(delay_s=0.2, jitter_s=0.05).refusal_reason(4000) is None
    assert ForceLink(delay_s=0.2, jitter_s=0.05).refusal_reason(5000)
    with pytest.raises(ValidationError, match=r"below 204\.8 ms"):
        Scene.model_validate(damper(delay_s=0.2, jitter_s=0.05).model_copy(update={"rate_hz": 5000.0}).model_dump())
    with pytest.raises(StudyError, match="specify a capacity when you pack it"):
        pack_into(pack(damper()), damper(delay_s=0.001))
    assert len(pack(damper(loss=0.1)).forces_n) == STORED_FORCES
