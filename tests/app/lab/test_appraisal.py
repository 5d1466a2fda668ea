"""Computation times and errors beside the liquid in hand: asked for once it rests."""

from collections.abc import Callable
from typing import Any

import pytest

from study_app.app.lab.controller import LabController
from study_app.workers.messages import Crashed
from tests.app.lab.worlds import COSTS, ERRORS, OPENS_MS, SOON_MS, Prices
from tests.compiled import needs_servo

pytestmark = [pytest.mark.slow, needs_servo, pytest.mark.usefixtures("qapp")]


def test_an_appraiser_that_died_is_not_waited_for(felt: LabController, prices: Prices, qtbot: Any) -> None:
    qtbot.waitUntil(lambda: bool(prices.asked), timeout=SOON_MS)
    assert felt.view().measuring
    prices.works, prices.told = False, [(1, Crashed(-9))]
    qtbot.waitUntil(lambda: not felt.view().measuring, timeout=SOON_MS)


def test_prices_are_asked_for_once_the_hand_rests_and_old_answers_do_not_count(
    felt: LabController, prices: Prices, qtbot: Any
) -> None:
    qtbot.waitUntil(lambda: len(prices.asked) == 1, timeout=SOON_MS)
    for k in range(10):
        felt.place.changed.emit("liquid.density_kg_m3", 1300.0 - k, True)
    assert felt.view().measuring
    qtbot.waitUntil(lambda: len(prices.asked) == 2, timeout=SOON_MS)
    assert prices.asked[1].liquids[0].density_kg_m3 == 1291.0
    prices.told = [(1, COSTS)]
    qtbot.waitUntil(lambda: not prices.told, timeout=SOON_MS)
    assert felt.view().cost == ()
    prices.told = [(2, COSTS), (2, ERRORS)]
    qtbot.waitUntil(lambda: not felt.view().measuring, timeout=SOON_MS)
    view = felt.view()
    assert [(row.effect, row.ns) for row in view.cost] == [("Servo alone", 60.0), ("Drag", 10.0), ("History", None)]
    assert view.tick_ns == 160.0
    assert [row.value for row in view.errors] == ["2e−15", "< 0.001 N", "9.5 ms"]
    felt.place.changed.emit("liquid.density_kg_m3", 900.0, False)
    assert felt.view().cost == ()  # it was the price of something else


def test_no_price_is_no_reason_to_stop(make_lab: Callable[..., LabController], qtbot: Any) -> None:
    def nobody() -> Prices:
        raise OSError("no more processes")

    visit = make_lab(make_appraiser=nobody)
    visit.place.show()
    qtbot.waitUntil(lambda: visit.live is not None, timeout=OPENS_MS)
    qtbot.waitUntil(lambda: not visit.view().measuring, timeout=SOON_MS)
    assert visit.live is not None
    assert visit.view().trouble == ""
