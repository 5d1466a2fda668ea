"""A block with a design in words, for who checks a protocol: its design, its levels and its comparisons."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

from study_app.haptics.model.device_dynamics import BELIEVED_TICKS
from study_app.haptics.model.overrides import override
from study_app.haptics.model.slope_limits import slope_limit
from study_app.haptics.model.steady_state import steady
from study_app.protocol.blocks import Block
from study_app.protocol.checks.expected_precision import precision_rows
from study_app.protocol.model import Protocol
from study_app.protocol.quantities import quantity
from study_app.protocol.trials.methods import Adjustment
from study_app.protocol.trials.presented_levels import FASTER, highest_damping
from study_app.protocol.trials.stimuli import DELAY, OF_LINK
from study_app.protocol.trials.tasks import Follow
from study_app.protocol.trials.tracks import (
    condition_of,
    design_of,
    has_correct_answer,
    method_of,
    standards_of,
    stimulus_of,
    success_name,
    tracks_of,
)

LEVELS = {"weber": "Weber fraction", "difference": "difference", "value": "value"}


def design_rows(protocol: Protocol, block: Block, delay_ticks: int = BELIEVED_TICKS) -> Iterator[tuple[str, str]]:
    """Yield the rows that describe the design of a block; ``delay_ticks`` is how many ticks late a force acts."""
    design = design_of(protocol, block)
    kind = design.kind.upper()
    intervals = "1 interval" if design.intervals == 1 else f"{design.intervals} intervals, {design.pause_s:g} s apart"
    if block.stimulus is None:
        yield "Design", f"{kind} against {block.standard}: {intervals}"
        yield from precision_rows(protocol, block)
        return
    stimulus, method = stimulus_of(protocol, block), method_of(protocol, block)
    standards = [one for one in standards_of(protocol, block) if one is not None]
    levels = sorted(method.asked(stimulus))
    against = f", standard {', '.join(f'{one:g}' for one in standards)}" if standards else ""
    yield "Design", f"{kind} of {stimulus.vary}{against}: {intervals}"
    name = LEVELS[stimulus.level_kind]
    of_each = " per standard" if standards else ""
    slots = [track.slots for track in tracks_of(protocol, block)]
    guess = design.guess_rate if has_correct_answer(design, stimulus) else 0.0
    target = method.target(guess, success_name(design, stimulus))
    aimed = "" if target is None else f": {target}"
    trials = slots[0] * method.tracks
    tracks = "" if method.tracks == 1 else f" in {method.tracks} tracks"
    yield (
        "Levels",
        f"{name} {levels[0]:.3g} to {levels[-1]:.3g} ({method.name}{aimed}), {trials} trials{of_each}{tracks}",
    )
    if isinstance(method, Adjustment):
        low, high = stimulus.domain
        steps = round((high - low) / method.step(stimulus))
        yield "Settings", f"{steps} steps from end to end, started near either, at most {method.most_s:g} s each"
    pairs = product(standards_of(protocol, block), levels)
    compared = [stimulus.comparison(standard, level) for standard, level in pairs]
    unit = quantity(stimulus.vary).unit
    yield "Comparisons", f"{stimulus.vary} from {min(compared):.4g} to {max(compared):.4g} {unit}".rstrip()
    task = protocol.tasks[block.task]
    if isinstance(task, Follow) and stimulus.vary != DELAY:
        pace_mps = task.fastest_stroke(protocol.device.workspace_m).speed_mps
        scene = protocol.scene_for(condition_of(protocol, stimulus))
        values = (*standards, *compared)
        scenes = [scene] if stimulus.vary in OF_LINK else [override(scene, stimulus.vary, one) for one in values]
        felt_n = [steady(one, pace_mps).drag_n for one in scenes]
        fast_n = max(steady(one, FASTER * pace_mps).drag_n for one in scenes[-len(compared) :])
        yield (
            "Force at the pace",
            f"{min(felt_n):.1f} to {max(felt_n):.1f} N at {pace_mps:.3g} m/s, at most {fast_n:.1f} N at {FASTER:g} "
            "times the pace",
        )
    if (highest_nspm := highest_damping(protocol, block)) > 0:
        scene = protocol.scene_for(condition_of(protocol, stimulus))
        limit_nspm = slope_limit(1 / scene.rate_hz, delay_ticks, scene.velocity)
        yield "Damping", f"at most {highest_nspm:.4g} N·s/m at the hand; the slope limit is {limit_nspm:.4g}"
    yield from precision_rows(protocol, block)
