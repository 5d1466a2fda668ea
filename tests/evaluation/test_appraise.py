"""What a scene costs and how true it is, here and in the process that answers a lab."""

from __future__ import annotations

import io
import json
import os
import signal

import numba
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("costs are those of compiled code", allow_module_level=True)

from study_app.evaluation import appraise
from study_app.evaluation.appraised import Costs
from study_app.evaluation.appraiser import Appraiser, serve
from study_app.haptics.scene import Ewma, Line, Raw
from study_app.protocol.load import load_scenes

THESIS, PHYSICAL = load_scenes("rek2024"), load_scenes("physical_liquids")


def test_costs_name_every_effect_and_why_it_is_not_there() -> None:
    found = {it.effect: it for it in appraise.costs(THESIS["water"], batches=5).effects}
    assert found["wake"].ns is not None
    assert found["wake"].ns > 0
    assert (found["history"].ns, found["history"].why) == (None, "not asked for")
    chosen = {it.effect: it for it in appraise.costs(PHYSICAL["water"], batches=5).effects}
    assert chosen["buoyancy"].ns is None
    assert chosen["buoyancy"].why.startswith("out, 0.")
    assert chosen["current"].why == "not asked for"


@pytest.mark.parametrize("name", ["water", "light_oil", "syrup"])
def test_the_thesis_liquids_are_the_definition_to_rounding(name: str) -> None:
    found = appraise.errors(THESIS[name])
    assert found.wake is not None
    assert found.force_n is not None
    assert found.wake < 1e-12
    assert found.force_n < 1e-9
    assert found.left_out == ()


def test_an_error_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """A reference with a tail of one element less is another liquid."""
    true = appraise.references.respond

    def shorter(scene, motion, *, exact=False):  # type: ignore[no-untyped-def]
        liquid = scene.liquids[0]
        wake = liquid.wake.model_copy(update={"length": liquid.wake.length - 1})
        other = scene.model_copy(update={"liquids": (liquid.model_copy(update={"wake": wake}),)})
        return true(other, motion, exact=exact)

    monkeypatch.setattr(appraise.references, "respond", shorter)
    found = appraise.errors(THESIS["light_oil"])
    assert found.wake is not None
    assert found.wake > 1e-4


def test_effects_without_a_reference_are_named() -> None:
    found = appraise.errors(PHYSICAL["honey"])
    assert found.wake is None
    assert found.force_n is not None
    assert found.force_n < 1e-9
    assert found.left_out == ("buoyancy", "added_mass", "history")


@pytest.mark.parametrize(
    ("velocity", "lag_ms"),
    [(Ewma(), 9.5), (Ewma(alpha=0.5), 1.5), (Raw(), 0.5), (Line(samples=15), 7.0)],
    ids=["ewma", "quick", "raw", "line"],
)
def test_the_lag_of_a_filter_is_that_of_its_closed_form(velocity: Ewma, lag_ms: float) -> None:
    scene = THESIS["water"].model_copy(update={"velocity": velocity})
    assert 1e3 * appraise.lag_s(scene) == pytest.approx(lag_ms, rel=1e-6)


def test_the_process_answers_the_newest_question_and_ends_when_told() -> None:
    appraiser = Appraiser()
    try:
        appraiser.ask(THESIS["honey"])
        newest = appraiser.ask(THESIS["water"])
        answered: dict[int, list[object]] = {}
        while len(answered.get(newest, [])) < 2:
            told = appraiser.answers(wait_s=120.0)  # the first time it compiles
            assert told
            for number, answer in told:
                answered.setdefault(number, []).append(answer)
        first, second = answered[newest]
        assert isinstance(first, Costs)
        assert [it.effect for it in first.effects if it.ns is not None] == ["drag", "wake"]
        assert second == appraise.errors(THESIS["water"])
        assert appraiser.works
    finally:
        appraiser.close()
    assert not appraiser.works
    appraiser._listening.join(20.0)
    assert appraiser._process.returncode is not None
    appraiser.ask(THESIS["honey"])
    assert appraiser.answers() == []


def test_what_cannot_be_measured_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "nice", lambda _by: 0)  # the tests go on in this process
    wild = THESIS["water"].model_copy(update={"rate_hz": 100.0})  # slower than any loop that is known to be stable
    question = json.dumps({"number": 7, "scene": wild.model_dump(mode="json")})
    out = io.StringIO()
    before = signal.getsignal(signal.SIGINT)
    try:
        serve([question], out)
    finally:
        signal.signal(signal.SIGINT, before)
    (told,) = (json.loads(line) for line in out.getvalue().splitlines())
    assert told["number"] == 7
    assert "no stable force is known" in told["why"]
