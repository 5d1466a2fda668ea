"""A scene pays only for what it calls for: memory of effects left out is neither read nor written."""

import numpy as np
import pytest

from study_app.haptics.runtime.pack import pack, pack_into
from tests.haptics.scenes import ALL_EFFECTS, COMPILED, PLACES, POOL, Hand, scene, stroke

TICKS = 1000 if COMPILED else 60
ROWS = {"wake": ("elements", "segments"), "local_wake": ("cells",), "history": ("intervals", "exponentials")}
THROUGH_DRAG = {"wake", "local_wake", "current"}
EFFECTS = (*ALL_EFFECTS, "local_wake", "unsteady_drag")


def without(effect):
    """Return a liquid with every effect but this one and those that need it."""
    base = PLACES if effect == "wake" else POOL
    gone = {effect} | (THROUGH_DRAG if effect == "drag" else set())
    return base.model_copy(update={"effects": tuple(one for one in base.effects if one not in gone)})


def records_of(model, effect):
    """Return all memory of an effect."""
    records = [rows[effect] for rows in (model.liquids, model.liquid_states) if effect in rows.dtype.names]
    return records + [getattr(model.rows, name) for name in ROWS.get(effect, ())]


def poison(record):
    """Fill every float with NaN, integers with -1."""
    for name in record.dtype.names:
        if record.dtype[name].names:
            poison(record[name])
        else:
            record[name][...] = np.nan if record.dtype[name].base == np.float64 else -1


def is_poisoned(record):
    """Return whether all of it still is what `poison` made of it."""
    copy = record.copy()
    poison(copy)
    return copy.tobytes() == record.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("refilled", [False, True], ids=["packed", "refilled"])
@pytest.mark.parametrize("effect", EFFECTS)
def test_an_effect_left_out_is_neither_read_nor_written(effect, refilled):
    felt = scene(without(effect))
    hand, clean = Hand(felt), Hand(felt)
    if refilled:
        hand.model = pack(scene(POOL), capacity=1000)
        pack_into(hand.model, felt)
    memory = records_of(hand.model, effect)
    for record in memory:
        poison(record)
    for place in stroke(TICKS):
        felt_now, expected = hand.tick(place), clean.tick(place)
        assert felt_now.tobytes() == expected.tobytes()
        assert np.isfinite(felt_now.force_n).all()
    assert any(sample.any() for sample in (felt_now.force_n, felt_now.velocity_mps))
    assert all(is_poisoned(record) for record in memory)
