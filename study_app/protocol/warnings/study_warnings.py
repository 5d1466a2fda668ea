"""Warnings about valid parts of a study that may be mistakes, one sentence each."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from itertools import combinations, pairwise

from study_app.haptics.model.effects import REFERENCE, resistance_n
from study_app.haptics.model.gate import effective_speed_mps
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.slope_limits import HAND_MPS, Steady, steady_force
from study_app.number_text import counted
from study_app.protocol.blocks import Block
from study_app.protocol.checks.consistency import LEAST_N, force_n
from study_app.protocol.checks.force_limits import PACED, fastest_hz, unpaced_clipping_warning
from study_app.protocol.model import Follow, Protocol, Published, Reach
from study_app.protocol.orders.balance import planned_participants
from study_app.protocol.orders.durations import variants
from study_app.protocol.orders.tracks import tracks_of
from study_app.protocol.participants.sample_sizes import fewest_participants
from study_app.protocol.presented.presented_levels import highest_damping
from study_app.protocol.questionnaires import Instrument
from study_app.protocol.questions import POINTS
from study_app.protocol.trials.stimuli import DELAY, OF_CONDITION, OF_LINK
from study_app.protocol.warnings.delayed_force import delay_warnings
from study_app.protocol.warnings.expected_precision import imprecise
from study_app.protocol.warnings.group_names import suggests_attribute
from study_app.protocol.warnings.question_warnings import question_warnings
from study_app.protocol.wording.languages import language_name

_DISCRIMINABLE = 0.39
"""The relative difference at which two liquids are reliably discriminated.

It is twice the just noticeable difference of viscosity, 19 % (Jones, Hunter & Lafontaine 1997); the thesis' water and
honey differ by 40 %.
"""

_FRAME_MS = 8.0
"""About the duration of a frame at 120 Hz."""
_MIN_PRIOR_FACTOR = 1.3
"""With a smaller factor, a log-normal prior determines the width: 95 % lie within a factor of 1.7. [choice]"""


def warnings(protocol: Protocol, *, simulates: bool = True, without_force: str = "") -> tuple[str, ...]:
    """Return warnings about valid parts of a study that may be mistakes, one sentence each.

    ``simulates`` includes warnings that need simulated observers, up to a second per block; ``without_force`` is the
    name of the sessions' device, if it has no force.
    """
    return (
        *liquid_warnings(protocol),
        *level_warnings(protocol, simulates=simulates),
        *delay_warnings(protocol),
        *dict.fromkeys(_imperceptible_settings(protocol, without_force)),
        *_analysis_warnings(protocol),
        *_tasks_without_target(protocol),
        *_recalled_instruments(protocol),
        *_untitled_forms(protocol),
        *question_warnings(protocol),
        *dict.fromkeys(_shared_titles(protocol)),
    )


def liquid_warnings(protocol: Protocol) -> tuple[str, ...]:
    """Return warnings about possible mistakes in the liquids, one sentence each."""
    forces = {name: steady_force(protocol.scene_of(name)) for name in protocol.liquids}
    return (
        *_similar_liquids(protocol, forces),
        *_clipped_liquids(protocol, forces),
        *_ignoring_viscosity(protocol, forces),
        *_practised_liquids(protocol),
        *_balls_of_different_sizes(protocol),
    )


def _similar_liquids(protocol: Protocol, forces: dict[str, Steady]) -> Iterator[str]:
    reported: set[frozenset[str]] = set()
    for block in protocol.main_blocks:
        for liquid, other in combinations(_liquids_of(protocol, block), 2):
            pair = frozenset((liquid, other))
            smaller_n, greater_n = sorted((forces[liquid].force_n, forces[other].force_n))
            if (greater_n > 0 and greater_n - smaller_n >= _DISCRIMINABLE * smaller_n) or pair in reported:
                continue
            reported.add(pair)
            yield (
                f"{liquid} and {other} in block {block.id} are hard to tell apart: at a hand speed of {HAND_MPS:g} "
                f"m/s their forces ({forces[liquid].force_n:.2f} and {forces[other].force_n:.2f} N) "
                f"differ by less than {_DISCRIMINABLE:.0%}"
            )


def _liquids_of(protocol: Protocol, block: Block) -> dict[str, None]:
    """Return the liquids of a block without duplicates."""
    conditions = (protocol.conditions[name] for name in protocol.conditions_in(block.id))
    return dict.fromkeys(name for condition in conditions for name in condition.liquid_ids)


def _clipped_liquids(protocol: Protocol, forces: dict[str, Steady]) -> Iterator[str]:
    for name, force in forces.items():
        if force.limit is not None:
            limit = "the force limit" if force.limit == "norm" else "the slope limit (which keeps the servo stable)"
            scale = _unclipped_scale(protocol.scene_of(name))
            most_percent = protocol.limits.withheld_percent
            is_valid = 100 * (1 - force.force_n / force.drag_n) <= most_percent
            beyond = "" if is_valid else ", which is more than limits.withheld_percent permits"
            advice = "" if scale is None else f"; with scene.scale = {scale} it is not clipped"
            yield (
                f"{name} is clipped: at a hand speed of {HAND_MPS:g} m/s {limit} reduces its force of "
                f"{force.drag_n:.2f} N to {force.force_n:.2f} N{beyond}{advice}"
            )


def _unclipped_scale(scene: Scene) -> int | None:
    """Return the highest lower whole scale at which the liquid of a scene is not clipped, or None."""
    lower_scales = range(math.ceil(scene.scale) - 1, 0, -1)
    return next(
        (scale for scale in lower_scales if steady_force(scene.model_copy(update={"scale": scale})).limit is None), None
    )


def _ignoring_viscosity(protocol: Protocol, forces: dict[str, Steady]) -> Iterator[str]:
    """Yield warnings about liquids whose drag ignores their viscosity."""
    for name in protocol.liquids:
        scene = protocol.scene_of(name)
        (liquid,) = scene.liquids
        if liquid.viscosity_pa_s is None:
            continue
        speed_mps = effective_speed_mps(scene, liquid, scene.scale * HAND_MPS)
        named_n, true_n = (resistance_n(scene, liquid, speed_mps, law) for law in ("constant", REFERENCE))
        if "drag" in liquid.effects and liquid.drag.law == "constant":
            reason, correction = "its constant drag coefficient ignores it", f'drag = {{ law = "{REFERENCE}" }}'
        elif forces[name].drag_n == 0.0:
            named_n, reason, correction = 0.0, "its effects do not include drag", 'add "drag" to its effects'
        else:
            continue
        if abs(named_n - true_n) > max(scene.accuracy.relative * true_n, scene.accuracy.absolute_n):
            yield (
                f"{name} has a viscosity, but {reason}: at a hand speed of {HAND_MPS:g} m/s its drag is {named_n:.2f} "
                f'instead of {true_n:.2f} N, an error of {abs(named_n - true_n):.2f} N; write effects = "auto", or '
                f"{correction}"
            )


def _practised_liquids(protocol: Protocol) -> Iterator[str]:
    """Yield warnings about liquids that are presented in practice and in a main block, unless levels are practised."""
    liquids = {block.id: _liquids_of(protocol, block) for block in protocol.blocks_in_order}
    main_block_ids = {name: block.id for block in reversed(protocol.main_blocks) for name in liquids[block.id]}
    for block in protocol.blocks_in_order:
        if block.phase != "practice" or block.stimulus is not None:
            continue
        for name in liquids[block.id]:
            if name in main_block_ids:
                yield (
                    f"practice block {block.id} presents {name}, which is also in block {main_block_ids[name]}, so "
                    "participants will already know it from practice"
                )


def _balls_of_different_sizes(protocol: Protocol) -> Iterator[str]:
    """Yield warnings about blocks whose conditions can be told apart by the size of the ball."""
    for block in protocol.main_blocks:
        sizes = {1000 * protocol.scene_for(name).body.diameter_m for name in protocol.conditions_in(block.id)}
        if len(sizes) > 1:
            listed = ", ".join(f"{size:g}" for size in sorted(sizes))
            yield (
                f"block {block.id} shows balls of different sizes ({listed} mm): participants can see which "
                "condition is which"
            )


def level_warnings(protocol: Protocol, *, simulates: bool = True) -> Iterator[str]:
    """Yield warnings about blocks with a design; ``simulates`` includes those that need simulated observers."""
    blocks = (block for block in protocol.blocks_in_order if block.design is not None)
    yield from dict.fromkeys(warning for block in blocks for warning in _design_warnings(protocol, block, simulates))


def _design_warnings(protocol: Protocol, block: Block, simulates: bool) -> Iterator[str]:
    design, track = protocol.design_of(block), tracks_of(protocol, block)[0]
    count, trials = len(design.arrangements), track.slots - len(track.catch)
    if not design.has_noise and trials % count:  # some arrangements are presented more often than others
        place = f"blocks.{block.id}.repetitions" if block.stimulus is None else f"methods.{block.method}"
        divisible = "an even number" if count == 2 else f"a multiple of {count}"
        yield f"{place}: {count} arrangements cannot be balanced over {counted(trials, 'trial')}; choose {divisible}"
    if block.stimulus is not None:
        for key, sentence in protocol.method_of(block).warnings():
            yield f"methods.{block.method}.{key}: {sentence}"
    if block.catch is not None and not track.catch:
        proportion = math.ceil(100 / track.slots) / 100
        yield (
            f"blocks.{block.id}.catch.share: with a share of {block.catch.share:g}, a track of {track.slots} trials "
            f"does not contain any catch trials; choose {proportion:g}"
        )
    if design.feedback == "always" and protocol.study.blinding == "double":
        yield (
            f'designs.{block.design}.feedback: "always" in a double-blind study shows the correct answers to '
            'anyone who sees the participant\'s screen; choose feedback = "practice"'
        )
    yield from _unpaced_blocks(protocol, block)
    if simulates:
        yield from imprecise(protocol, block)


def _unpaced_blocks(protocol: Protocol, block: Block) -> Iterator[str]:
    if isinstance(protocol.tasks[block.task], Follow) or block.stimulus is None:
        return
    similar_blocks = [
        other for other in protocol.blocks.values() if (other.stimulus, other.task) == (block.stimulus, block.task)
    ]
    if (warning := unpaced_clipping_warning(protocol, similar_blocks)) is not None:
        yield warning
    error_percent = protocol.limits.level_error_percent
    if highest_damping(protocol, block) > 0 and error_percent is not None:
        fast_hz = fastest_hz(protocol.scene.velocity, protocol.device.rate_hz, 1 - error_percent / 100)
        yield (
            f"tasks.{block.task}: in motions above {fast_hz:.1f} Hz the velocity estimator removes more than "
            f"{error_percent:g} % of a damper's force; such trials are repeated, so {PACED}"
        )


def _imperceptible_settings(protocol: Protocol, without_force: str) -> Iterator[str]:
    """Yield warnings about settings without perceptible effect, such as a delay of a hidden ball."""
    for block in protocol.blocks_in_order:
        conditions = {name: protocol.conditions[name] for name in protocol.conditions_in(block.id)}
        vary = None if block.stimulus is None else protocol.stimuli[block.stimulus].vary
        hidden = [
            name for name, condition in conditions.items() if condition.ball == "hidden" and not condition.shows_video
        ]
        for name, condition in conditions.items():
            places = {key: f"conditions.{name}.{key}" for key in OF_CONDITION if getattr(condition, key)}
            if vary in OF_CONDITION:
                places[vary] = f"stimuli.{block.stimulus}.vary"
            stroke = protocol.tasks[block.task].fastest_stroke(protocol.device.workspace_m)
            is_forceless = force_n(protocol.scene_for(name), stroke) < LEAST_N
            for key, place in places.items():
                value = getattr(condition, key)
                if key.endswith("_ms") and 0 < value < 1:
                    yield f"{place}: {value:g} ms cannot be perceived: write {1000 * value:g} for {value:g} s"
                if key == DELAY and name in hidden:
                    yield f'{place}: the ball is hidden, so participants cannot see its delay: write ball = "shown"'
                elif key in OF_LINK and (without_force or is_forceless):
                    cause = f"{without_force or 'the condition'} does not produce force"
                    yield f"{place}: {cause}, so participants cannot feel whether the force is late or lost"
        compares_liquids = protocol.compared_in(block.id) == "liquids" if vary is None else vary not in OF_CONDITION
        if without_force and compares_liquids and block.phase == "main":
            consequence = ", so participants see but do not feel how the liquids slow the ball down"
            consequence = (
                ", and the ball is hidden, so participants cannot perceive the block's liquids"
                if len(hidden) == len(conditions)
                else consequence
            )
            yield f"blocks.{block.id}: {without_force} does not produce force{consequence}"


def _analysis_warnings(protocol: Protocol) -> Iterator[str]:
    """Yield warnings about confounds and other reasons why the study may not answer its question."""
    analysis = protocol.analysis
    for block in protocol.main_blocks:
        if block.order == "fixed" and block.design is None and len(block.conditions) > 1:
            yield (
                f"blocks.{block.id}.order: all participants experience the {protocol.compared_in(block.id)} in the "
                "same order, so their effect is confounded with practice and fatigue; choose shuffled, latin or "
                "williams"
            )
        yield from _forced_choice_warnings(protocol, block)
        yield from _condition_warnings(protocol, block)
    half = (POINTS - 1) / 2
    if analysis is not None and (analysis.equivalence_bound or 0.0) > half:
        yield (
            f"analysis.equivalence_bound: {analysis.equivalence_bound:g} points are more than half the scale "
            f"({half:g}), so almost any answers would count as equivalent"
        )
    if analysis is not None and analysis.participants is None:
        yield (
            "analysis.participants is missing: a study that stops at the first significant result has a "
            "false-positive rate above alpha"
        )
    yield from _attribute_groups(protocol)
    yield from _untested_trends(protocol)
    yield from _too_few_for_equivalence(protocol)
    yield from _too_few_for_pairs(protocol)
    yield from _different_standards(protocol)
    yield from _block_order_warnings(protocol)
    yield from dict.fromkeys(_repeated_pages(protocol))
    for number, value in enumerate(() if analysis is None else analysis.published, start=1):
        yield from _unbracketed_value(protocol, number, value)


def _attribute_groups(protocol: Protocol) -> Iterator[str]:
    """Yield warnings about randomised groups whose names suggest attributes of participants."""
    for name in protocol.groups if protocol.randomises else ():
        if suggests_attribute(name):
            yield (
                f"groups.{name}: the name suggests an attribute that participants already have, but groups are "
                'assigned at random; if participants have it, set study.group_assignment = "pre-existing"'
            )


def _untested_trends(protocol: Protocol) -> Iterator[str]:
    """Yield warnings about trends with the delay in statements that no block asks after several delays."""
    asked_after_delays = {
        item.id
        for block in protocol.blocks_with_statements
        if protocol.compared_in(block.id) == "delays" and (questionnaire := protocol.questionnaire_of(block.id))
        for item in questionnaire.statements
    }
    analysis = protocol.analysis
    trends = {} if analysis is None else {"rising": analysis.rising, "falling": analysis.falling}
    for key, names in trends.items():
        for name in names:
            if name not in asked_after_delays:
                yield (
                    f"analysis.{key}: the trend in {name} is not tested, because no block that asks it compares "
                    "delays; to compare two conditions, specify [[analysis.contrasts]]"
                )


def _too_few_for_equivalence(protocol: Protocol) -> Iterator[str]:
    """Yield warnings about bounds within which the planned participants cannot show equivalence."""
    analysis = protocol.analysis
    if analysis is None or analysis.participants is None:
        return
    bounds = sum(contrast.bound is not None for contrast in analysis.contrasts)
    for number, contrast in enumerate(analysis.contrasts, start=1):
        if contrast.bound is None:
            continue
        largest = contrast.largest_difference if protocol.compares_statement(contrast) else None
        fewest = fewest_participants(analysis.alpha / bounds, contrast.bound, largest)
        planned = min(planned_participants(protocol, group) or 0 for group in contrast.groups or (None,))
        if planned < fewest:
            each = " in each group" if contrast.groups else ""
            yield (
                f"analysis.contrasts.{number}.bound: equivalence within this bound requires at least {fewest} "
                f"participants{each}, but {planned} are planned"
            )


def _too_few_for_pairs(protocol: Protocol) -> Iterator[str]:
    """Yield warnings about blocks in which no comparison of two conditions may be significant after Holm's correction.

    The smallest two-sided p of Wilcoxon's signed-rank test is 2^(1 − n).
    """
    analysis = protocol.analysis
    for block in protocol.blocks_with_statements if analysis is not None and analysis.participants is not None else ():
        if protocol.compared_in(block.id) == "delays" or len(block.conditions) < 2 or analysis is None:
            continue
        questionnaire = protocol.questionnaire_of(block.id)
        statements = [] if questionnaire is None else [item.id for item in questionnaire.statements]
        primary = [name for name in statements if not analysis.primary or name in analysis.primary]
        groups = protocol.groups_with(block.id)
        planned = sum(planned_participants(protocol, group) or 0 for group in groups or (None,))
        tests = math.comb(len(block.conditions), 2) * len(primary)
        smallest_p = 2.0 ** (1 - planned)
        if tests < 2 or smallest_p > analysis.alpha or tests * smallest_p <= analysis.alpha:
            continue
        several = "" if len(block.conditions) == 2 else "if all statements differ between conditions, "
        yield (
            f"blocks.{block.id}: {several}{tests} comparisons are Holm-corrected, so with {planned} planned "
            f"participants the smallest possible p is {smallest_p:.2g} × {tests} = {tests * smallest_p:.2g}, which is "
            f"above {analysis.alpha:g}; at least {math.ceil(1 + math.log2(tests / analysis.alpha))} participants are "
            "needed"
        )


def _different_standards(protocol: Protocol) -> Iterator[str]:
    """Yield warnings about contrasts of blocks whose values are at, or are averaged over, different standards."""
    for number, contrast in enumerate(() if protocol.analysis is None else protocol.analysis.contrasts, start=1):
        blocks = [protocol.blocks[name] for name in contrast.blocks]
        if contrast.measure not in ("threshold", "pse") or any(block.stimulus is None for block in blocks):
            continue
        standards = {block.id: sorted(filter(None, protocol.standards_of(block))) for block in blocks}
        is_averaged = any(len(values) > 1 for values in standards.values())
        if len(set(map(tuple, standards.values()))) > 1 and (is_averaged or contrast.measure == "pse"):
            listed = " and ".join(
                f"{block} at {', '.join(f'{value:g}' for value in values)}" for block, values in standards.items()
            )
            yield (
                f"analysis.contrasts.{number}: the blocks have different standards ({listed}), so the difference "
                "between them is confounded with the standard; use the same standards"
            )


def _repeated_pages(protocol: Protocol) -> Iterator[str]:
    """Yield warnings about pages other than breaks that a session shows several times."""
    for steps in (variant.protocol.steps for variant in variants(protocol)):
        for name, page in protocol.pages.items():
            if page.kind != "break" and (times := steps.count(name)) > 1:
                yield f"pages.{name}: this {page.kind} page occurs {times} times in a session"


def _block_order_warnings(protocol: Protocol) -> Iterator[str]:
    """Yield warnings about contrasts of blocks in a fixed order, and about fixed blocks among varying ones."""
    for number, contrast in enumerate(() if protocol.analysis is None else protocol.analysis.contrasts, start=1):
        if len(contrast.blocks) < 2 or protocol.groups:
            continue
        sentence = (
            f"analysis.contrasts.{number}: all participants complete {' and '.join(contrast.blocks)} in the same "
            "order, so the difference between them is confounded with"
        )
        if not any({*contrast.blocks} <= {*steps} for steps in protocol.every_session()):
            yield f"{sentence} practice and with everything else that differs between the sessions; add a control group"
        elif protocol.study.block_order == "fixed":
            yield f'{sentence} practice and fatigue; choose study.block_order = "balanced"'
    blocks = protocol.blocks_in_order
    main_indices = [index for index, block in enumerate(blocks) if block.phase == "main"]
    if not main_indices or protocol.study.block_order == "fixed":
        return
    for block in blocks[main_indices[0] : main_indices[-1]]:
        if block.phase != "main":
            yield (
                f"study.block_order: block {block.id} ({block.phase}) keeps its position while the order of the "
                "main blocks varies; put it before the first main block"
            )


def _condition_warnings(protocol: Protocol, block: Block) -> Iterator[str]:
    """Yield warnings about conditions that cannot be compared, or that a label reveals."""
    conditions = [protocol.conditions[name] for name in block.conditions]
    is_single = block.design is None and block.questionnaire is not None and len(conditions) == 1
    if is_single and len(protocol.main_blocks) > 1:
        yield (
            f"blocks.{block.id}.conditions: there is only one condition, so there is nothing to compare it with; a "
            "main block needs at least two"
        )
    if protocol.compared_in(block.id) == "delays":
        for delay_ms, next_ms in pairwise(sorted({condition.delay_ms for condition in conditions})):
            if next_ms - delay_ms < _FRAME_MS:
                yield (
                    f"blocks.{block.id}.conditions: delays of {delay_ms:g} and {next_ms:g} ms differ by less than "
                    f"one frame ({_FRAME_MS:g} ms), so the screen cannot show the difference"
                )
    if block.design is not None and block.standard is not None:
        yield from _mixed_differences(protocol, block, block.standard)
    texts = [block.setting_label] if isinstance(block.setting_label, str) else list(block.setting_label.values())
    title_words = {word for text in texts for word in re.findall(r"\w+", text.casefold())}
    for name in sorted(
        {*block.conditions, *(liquid for condition in conditions for liquid in condition.liquid_ids)} & title_words
    ):
        yield (
            f"blocks.{block.id}.setting_label: the label names the condition “{name}” and so reveals it to participants"
        )


def _mixed_differences(protocol: Protocol, block: Block, standard: str) -> Iterator[str]:
    """Yield warnings about conditions that differ from the standard in several noticeable ways."""
    keys_by_difference = {
        "liquid": ("liquid_ids",),
        "view": ("seen",),
        "visual delay": (DELAY,),
        "delay or loss of the force": tuple(OF_LINK),
    }
    for name in block.conditions:
        pair = [protocol.conditions[condition] for condition in (name, standard)]
        differing = [
            difference
            for difference, keys in keys_by_difference.items()
            if len({tuple(getattr(condition, key) for key in keys) for condition in pair}) > 1
        ]
        if len(differing) > 1:
            yield (
                f"blocks.{block.id}.conditions: “{name}” and the standard “{standard}” differ in "
                f"{' and '.join(differing)}: answers cannot show which of these differences participants noticed"
            )


def _forced_choice_warnings(protocol: Protocol, block: Block) -> Iterator[str]:
    """Yield warnings about missing catch trials and a narrow prior in a block of levels."""
    if block.stimulus is None or block.design is None or block.method is None:
        return
    design, stimulus = protocol.design_of(block), protocol.stimulus_of(block)
    if block.catch is None and design.can_be_correct(stimulus):
        yield (
            f"blocks.{block.id}.catch: catch trials are missing, so participants who merely guess cannot be told "
            "apart from participants with a high threshold"
        )
    factor = protocol.method_of(block).assumed(stimulus, design).width_prior[1]
    if factor < _MIN_PRIOR_FACTOR:
        yield (
            f"methods.{block.method}.width_prior: a factor of {factor:g} is so narrow that the prior determines the "
            f"slope and biases the thresholds of participants with other slopes; choose {_MIN_PRIOR_FACTOR:g} or more"
        )


def _unbracketed_value(protocol: Protocol, number: int, published: Published) -> Iterator[str]:
    """Yield a warning about a published value outside the study's levels."""
    block = protocol.blocks[published.block]
    if published.measure == "exponent" or block.stimulus is None or block.method is None:
        return
    levels = protocol.method_of(block).levels_of(protocol.stimulus_of(block))
    if not min(levels) <= published.value <= max(levels):
        yield (
            f"analysis.published.{number}.value: {published.value:g} is outside the levels of block {block.id} "
            f"({min(levels):g} to {max(levels):g}), so such a threshold cannot be measured"
        )


def _tasks_without_target(protocol: Protocol) -> Iterator[str]:
    """Yield warnings about reaching tasks whose trials are valid without a reached target."""
    if protocol.limits.targets_percent is not None:
        return
    for name in dict.fromkeys(block.task for block in protocol.main_blocks):
        if isinstance(protocol.tasks[name], Reach):
            yield (
                f"tasks.{name}: a trial is valid even if no target is reached; set limits.targets_percent to the "
                "minimum proportion of targets"
            )


def _recalled_instruments(protocol: Protocol) -> Iterator[str]:
    for name, questionnaire in protocol.questionnaires.items():
        instrument = questionnaire.instrument
        if instrument is not None and (recalled := Instrument(instrument).table.get("from_memory")) is not None:
            yield (
                f"questionnaires.{name}: the wording was written from memory and has not been checked "
                f"against a source ({recalled}); check it against your copy"
            )


def _untitled_forms(protocol: Protocol) -> Iterator[str]:
    """Yield warnings about forms whose heading would be their ID, in a study that is not in English."""
    languages = protocol.study.languages
    for name in protocol.forms if {*languages} != {"en"} else ():
        if protocol.questionnaires[name].title is None:
            yield (
                f"questionnaires.{name}.title: there is no title, so participants see the ID as the heading; add a "
                f"title in {', '.join(map(language_name, languages))}"
            )


def _shared_titles(protocol: Protocol) -> Iterator[str]:
    """Yield a warning for each main block that has the title of an earlier main block in some language."""
    reported: set[str] = set()
    for language in protocol.study.languages:
        blocks_by_title: dict[str, str] = {}
        for block in protocol.main_blocks:
            title = protocol.text(block.title, language)
            other = blocks_by_title.setdefault(title, block.id)
            if other != block.id and block.id not in reported:
                reported.add(block.id)
                yield (
                    f"blocks.{block.id}.title: block {other} has the same title, “{title}”, so the report adds the "
                    "IDs to both; use a different title for each block"
                )
