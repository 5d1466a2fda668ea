"""What a study's liquids will feel like, before anyone feels them: effects in and out, and what to think over."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from study_app.haptics.model.bounds import met_mps
from study_app.haptics.model.effects.drag import REFERENCE, resistance_n
from study_app.haptics.model.gate import describe_gate
from study_app.haptics.model.steady_state import HAND_MPS, Steady, steady
from study_app.protocol.model import Protocol

TELLING = 0.39
"""Twice the difference of viscosity that people just tell, 19 % (Jones, Hunter & Lafontaine 1997): what two liquids
need for reliable discrimination; the thesis' water and honey differ by 40 %."""


def effects(protocol: Protocol) -> tuple[str, ...]:
    """Return which effects act in each liquid, and why, as lines of text."""
    lines: list[str] = []
    for name in protocol.liquids:
        lines += [*describe_gate(protocol.scene_of(name)), ""]
    return tuple(lines[:-1])


def warnings(protocol: Protocol) -> tuple[str, ...]:
    """Return what is permitted and may still be a mistake, a sentence each."""
    felt = {name: steady(protocol.scene_of(name)) for name in protocol.liquids}
    return (
        *_alike(protocol, felt),
        *_clipped(felt),
        *_ignoring_viscosity(protocol, felt),
        *_practised(protocol),
        *_of_different_sizes(protocol),
    )


def _alike(protocol: Protocol, felt: dict[str, Steady]) -> Iterator[str]:
    """Yield the pairs of liquids of a block that are hard to tell apart."""
    seen: set[frozenset[str]] = set()
    for block in protocol.main_blocks:
        names = dict.fromkeys(
            name for it in protocol.conditions_in(block.id) for name in protocol.conditions[it].liquid_ids
        )
        for one, other in combinations(names, 2):
            pair = frozenset((one, other))
            if _differ(felt[one].force_n, felt[other].force_n) or pair in seen:
                continue
            seen.add(pair)
            yield (
                f"{one} and {other} of block {block.id} are hard to tell apart: {felt[one].force_n:.2f} and "
                f"{felt[other].force_n:.2f} N at {HAND_MPS:g} m/s of the hand, less than {TELLING:.0%} of the smaller "
                "between them"
            )


def _differ(one_n: float, other_n: float) -> bool:
    """Return whether two forces differ by at least 39 % of the smaller."""
    smaller_n, greater_n = sorted((one_n, other_n))
    return greater_n > 0 and greater_n - smaller_n >= TELLING * smaller_n


def _clipped(felt: dict[str, Steady]) -> Iterator[str]:
    """Yield the liquids whose drag the safety limits shorten."""
    for name, it in felt.items():
        if it.limit is not None:
            limit = "the force limit" if it.limit == "norm" else "the slope limit, which keeps the servo stable,"
            yield (
                f"{name} is clipped: at {HAND_MPS:g} m/s of the hand {limit} lets {it.force_n:.2f} of its "
                f"{it.drag_n:.2f} N through"
            )


def _ignoring_viscosity(protocol: Protocol, felt: dict[str, Steady]) -> Iterator[str]:
    """Yield the liquids with a viscosity whose drag does not depend on it, and how wrong that is."""
    for name in protocol.liquids:
        scene = protocol.scene_of(name)
        (liquid,) = scene.liquids
        if liquid.viscosity_pa_s is None:
            continue
        speed_mps = met_mps(scene, liquid, scene.scale * HAND_MPS)
        named_n, true_n = (resistance_n(scene, liquid, speed_mps, law) for law in ("constant", REFERENCE))
        if "drag" in liquid.effects and liquid.drag.law == "constant":
            why, instead = "its constant drag coefficient ignores it", f'drag = {{ law = "{REFERENCE}" }}'
        elif felt[name].drag_n == 0.0:
            named_n, why, instead = 0.0, "its effects leave out drag", 'name "drag" among them'
        else:
            continue
        if abs(named_n - true_n) > max(scene.accuracy.relative * true_n, scene.accuracy.absolute_n):
            yield (
                f"{name} has a viscosity, but {why}: at {HAND_MPS:g} m/s of the hand its drag is {named_n:.2f} instead "
                f'of {true_n:.2f} N, an error of {abs(named_n - true_n):.2f} N: write effects = "auto" or {instead}'
            )


def _practised(protocol: Protocol) -> Iterator[str]:
    """Yield the liquids that are practised in and judged in another block; levels are practised for their task."""
    used = {
        block.id: dict.fromkeys(
            name for it in protocol.conditions_in(block.id) for name in protocol.conditions[it].liquid_ids
        )
        for block in protocol.blocks_in_order
    }
    judged = {name: block.id for block in reversed(protocol.main_blocks) for name in used[block.id]}
    for block in protocol.blocks_in_order:
        if block.phase != "practice" or block.stimulus is not None:
            continue
        for name in used[block.id]:
            if name in judged:
                yield (
                    f"practice {block.id} is in {name}, which block {judged[name]} presents too: participants know it "
                    "from the practice when they judge it"
                )


def _of_different_sizes(protocol: Protocol) -> Iterator[str]:
    """Yield the blocks whose conditions show balls of different sizes, by which participants can tell them apart."""
    for block in protocol.main_blocks:
        sizes = {1000 * protocol.scene_for(it).body.diameter_m for it in protocol.conditions_in(block.id)}
        if len(sizes) > 1:
            listed = ", ".join(f"{size:g}" for size in sorted(sizes))
            yield (
                f"block {block.id} shows balls of different sizes ({listed} mm): participants can tell its conditions "
                "apart by sight"
            )
