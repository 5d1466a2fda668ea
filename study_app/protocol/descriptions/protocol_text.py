"""A protocol as text: the output of ``liquid-study check``, for authors to verify their specification."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import product

from study_app.haptics.model.device_dynamics import ASSUMED_TICKS
from study_app.haptics.model.gate import describe_gate, resolve
from study_app.haptics.model.overrides import override_value
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.slope_limits import slope_limit, steady_force
from study_app.number_text import capitalised, counted
from study_app.protocol.model import Block, Condition, Limits, Protocol
from study_app.protocol.orders.balance import block_order_text, planned_participants
from study_app.protocol.orders.block_orders import block_codes, order_of, orders_of
from study_app.protocol.orders.durations import Variant, expected_duration_s, variants
from study_app.protocol.orders.tracks import tracks_of
from study_app.protocol.presented.presentation import link_descriptions
from study_app.protocol.presented.presented_levels import FASTER, highest_damping
from study_app.protocol.quantities import liquid_text
from study_app.protocol.questionnaires import Instrument
from study_app.protocol.questions import Context, Question
from study_app.protocol.randomization.sequences import row_count
from study_app.protocol.trials.methods import Adjustment, Constant
from study_app.protocol.trials.stimuli import DELAY, DELAYS, OF_CONDITION, OF_LINK
from study_app.protocol.trials.tasks import Follow
from study_app.protocol.warnings.expected_precision import precision_rows
from study_app.protocol.warnings.study_warnings import warnings

_LEVELS = {"weber": "Weber fraction", "difference": "difference", "value": "value"}
_BLINDINGS = {
    "double": "double-blind: the operator does not see the force",
    "single": "single-blind: the operator sees the force and the wake",
}
_ASSIGNMENTS = {
    "randomised": "randomised in permuted blocks",
    "pre-existing": "pre-existing: entered by the operator for each participant, not randomised",
}


def describe(protocol: Protocol, delay_ticks: int = ASSUMED_TICKS, without_force: str = "") -> str:
    """Return the description of a study in its first language.

    Forces act ``delay_ticks`` ticks late; ``without_force`` is the name of the sessions' device, if it has no force.
    """
    language = protocol.study.languages[0]
    effects = [line for name in protocol.liquids for line in (*describe_gate(protocol.scene_of(name)), "")]
    conditions = [
        (name, " + ".join(condition.liquid_ids), ", ".join(_condition_notes(condition)))
        for name, condition in protocol.conditions.items()
    ]
    warning_lines = [f"  {sentence}" for sentence in warnings(protocol, without_force=without_force)]
    decision_rows = [("nothing", "there is no [analysis] table, so the report will label all findings as exploratory")]
    if protocol.analysis is not None:
        recognised = [
            f"{name} by {condition.label}" for name, condition in protocol.conditions.items() if condition.label
        ]
        units = {block.id: protocol.stimulus_of(block).unit for block in protocol.main_blocks if block.stimulus}
        decision_rows = list(
            protocol.analysis.described(
                recognised,
                units=units,
                statements=bool(protocol.blocks_with_statements),
                measure_text=protocol.measure_text,
            )
        )
    people = protocol.simulated_participants
    sections = (
        _head_lines(protocol, language),
        *(
            _session_lines(variant, planned_participants(protocol, variant.group), language)
            for variant in variants(protocol)
        ),
        *(_block_lines(protocol, block, language, delay_ticks) for block in protocol.blocks_in_order),
        _titled_lines("Liquids", _liquid_rows(protocol)),
        ("Effects in each liquid", *(f"  {line}".rstrip() for line in effects[:-1])),
        _titled_lines("Conditions", conditions),
        *(_question_lines(protocol, name, language) for name in protocol.questionnaires),
        _titled_lines("Decisions about the analysis", decision_rows),
        *([] if people is None else [_titled_lines("Simulated participants", [("Answers", people.described())])]),
        _titled_lines("Limits for a valid trial", limit_rows(protocol)),
        *([("Warnings", *warning_lines)] if warning_lines else []),
    )
    return "\n\n".join("\n".join(section) for section in sections)


def describe_scenes(scenes: Mapping[str, Scene]) -> str:
    """Return the description of the liquids in a file without a study; ``scenes`` are by liquid."""
    scene = next(iter(scenes.values()))
    ball_mm = scene.body.diameter_m * 1000
    rows = [
        ("Force limit", f"{scene.force_limit_n:g} N"),
        ("Servo", f"{scene.rate_hz:g} Hz"),
        ("Scale", f"{scene.scale:g} times the hand's motion"),
        ("Ball", f"{ball_mm:g} mm in the scene ({ball_mm / scene.scale:.3g} mm in the hand frame)"),
    ]
    effects = ("\n".join(f"  {line}".rstrip() for line in describe_gate(each_scene)) for each_scene in scenes.values())
    head = ("Liquids that are not part of a study", *_align_columns(rows))
    return "\n\n".join(("\n".join(head), "Effects in each liquid", *effects))


def _align_columns(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yield rows as lines with aligned columns."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    for row in rows:
        yield "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()


def _titled_lines(title: str, rows: Sequence[Sequence[str]]) -> Iterable[str]:
    return (title, *_align_columns(rows))


def _head_lines(protocol: Protocol, language: str) -> Iterable[str]:
    study, device, scene = protocol.study, protocol.device, protocol.scene
    sizes = " × ".join(f"{size:g}" for size in device.workspace_mm)
    ball_mm = scene.body.diameter_m * 1000
    sessions = [variant.protocol for variant in variants(protocol)]
    counts = [orders_of(session).answers for session in sessions]
    has_fewer = any(map(_has_conditional_items, sessions)) or any(map(_can_end_early, sessions))
    answers = f"up to {max(counts)}" if has_fewer else number_range(counts)
    description = " ".join(study.description.split())
    rows = [
        *([("Description", description)] if description else ()),
        ("Languages", ", ".join(study.languages)),
        ("Parts", f"{protocol.parts}"),
        *([("Groups", _ASSIGNMENTS[study.group_assignment])] if protocol.groups else ()),
        *(("Group", f"{name}, share {group.share}") for name, group in protocol.groups.items()),
        ("Answers", f"{answers} per {'session' if protocol.sessions_differ else 'participant'}"),
        ("Blinding", _BLINDINGS[study.blinding]),
        ("Expected duration", _session_duration_text(*sessions)),
        ("Force limit", f"{device.force_limit_n:g} N"),
        ("Servo", f"{device.rate_hz:g} Hz"),
        ("Tank", f"{sizes} mm in the hand frame, {scene.scale:g} times as large in the scene"),
        ("Ball", f"{ball_mm:g} mm in the scene ({ball_mm / scene.scale:.3g} mm in the hand frame)"),
    ]
    return (f"{protocol.text(study.title, language)} ({study.name}, version {study.version})", *_align_columns(rows))


def number_range(numbers: Sequence[float], digits: str = "") -> str:
    """Return the range of numbers as text, "4 to 8", or a single number if both ends have the same text."""
    minimum, largest = f"{min(numbers):{digits}}", f"{max(numbers):{digits}}"
    return minimum if minimum == largest else f"{minimum} to {largest}"


def _duration_text(*durations_s: float, at_most: bool = False) -> str:
    """Return the range of expected durations as text: "about 4 min", "about 2 to 3 min", "less than 1 min".

    Durations that are upper limits (``at_most``) become "up to about 4 min".
    """
    minutes = [round(duration_s / 60) for duration_s in durations_s]
    if max(minutes) == 0:
        return "less than 1 min"
    return f"up to about {max(minutes)} min" if at_most or 0 in minutes else f"about {number_range(minutes)} min"


def _session_duration_text(*sessions: Protocol) -> str:
    """Return the expected duration of sessions, as an upper limit if blocks can end early."""
    return _duration_text(*map(expected_duration_s, sessions), at_most=any(map(_can_end_early, sessions)))


def _can_end_early(protocol: Protocol) -> bool:
    return any(_can_block_end_early(protocol, block) for block in protocol.blocks_in_order)


def _can_block_end_early(protocol: Protocol, block: Block) -> bool:
    """Whether answers can make a block shorter than its number of trials."""
    return block.until is not None or (block.stimulus is not None and protocol.method_of(block).can_end_early)


def shows_feedback(protocol: Protocol, block: Block) -> bool:
    """Return whether participants see after each trial of a block whether their answer was correct."""
    if block.design is None:
        return False
    design, stimulus = protocol.design_of(block), protocol.stimulus_of(block) if block.stimulus else None
    return design.can_be_correct(stimulus) and design.shows_feedback(block.phase == "practice")


def trials_text(protocol: Protocol, block: Block) -> str:
    """Return the number of trials of a block: "80 trials", or "at most 80 trials" if it can end early."""
    return "at most " * _can_block_end_early(protocol, block) + counted(order_of(protocol, block).trials, "trial")


def _has_conditional_items(protocol: Protocol) -> bool:
    """Whether a question of a session is asked only after certain answers."""
    asked = (*(protocol.questionnaire_of(block.id) for block in protocol.main_blocks), *protocol.forms.values())
    return any(item.show_if is not None for questionnaire in asked if questionnaire for item in questionnaire.items)


def _session_lines(variant: Variant, planned: int | None, language: str) -> Iterable[str]:
    protocol, title = variant.protocol, "Session"
    if variant.name:
        answers = counted(orders_of(protocol).answers, "answer")
        at_most = "up to " if _has_conditional_items(protocol) or _can_end_early(protocol) else ""
        title = f"{variant.name[0].upper()}{variant.name[1:]} ({_session_duration_text(protocol)}, {at_most}{answers})"
    rows: list[tuple[str, str, str]] = []
    kind: str
    for number, step in enumerate(protocol.steps, start=1):
        if step in protocol.pages:
            kind, description = protocol.pages[step].kind, protocol.text(protocol.pages[step].title, language)
        elif step in protocol.forms:
            kind, description = "form", f"{step}: {counted(len(protocol.forms[step].items), 'question')}"
        else:
            block = protocol.blocks[step]
            kind, trials = f"{block.phase} trials", trials_text(protocol, block)
            description = f"{protocol.text(block.title, language)}: {trials}"
        rows.append((f"{number:>2}", kind, description))
    if len(protocol.main_blocks) < 2:
        return _titled_lines(title, rows)
    order = block_order_text(protocol, planned, in_group=variant.group is not None)
    return (*_titled_lines(title, rows), f"  Block order: {order}")


def _block_lines(protocol: Protocol, block: Block, language: str, delay_ticks: int) -> Iterable[str]:
    part = "" if block.part is None else f"Part {block.part}: "
    questionnaire, compared = protocol.questionnaire_of(block.id), protocol.compared_in(block.id)
    trials = order_of(protocol, block).trials
    unit = "condition" if block.design is None else "comparison"
    times = f"each {unit} {block.repetitions} times" if block.repetitions > 1 else ""
    rows = [
        ("Trials", ", ".join(filter(None, (trials_text(protocol, block), times, _order_text(block))))),
        *([("Ends early", f"{until.condition_text()}; {until.missed_text}")] if (until := block.until) else []),
        *_assignment_and_break_rows(protocol, block, language),
        ("Shown as", protocol.text(block.setting_label, language) + (" 1, 2, …" if trials > 1 else "")),
        ("Recorded as", ", ".join(block_codes(protocol, block))),
        ("Conditions", ", ".join(protocol.conditions_in(block.id))),
        *([] if block.design is not None or compared is None else [("Compared", compared)]),
        *([("Replicates", "conditions with the same delay are analysed as one condition")] if block.replicates else []),
    ]
    if block.design is not None:
        rows += _design_rows(protocol, block, delay_ticks)
        if shows_feedback(protocol, block):
            rows.append(("Feedback", "after every trial"))
        at_most = _can_block_end_early(protocol, block)
        rows.append(("Duration", _duration_text(expected_duration_s(protocol, block.id), at_most=at_most)))
    rows.append(("Task", protocol.tasks[block.task].summary))
    if block.design is None and questionnaire is None:
        rows.append(("Questions", "none"))
    elif block.design is None and questionnaire is not None:
        order = ", in the order of the file" if questionnaire.item_order == "fixed" else ", in a new order each time"
        order = "" if len(questionnaire.items) == 1 else order
        noun = "statement" if len(questionnaire.statements) == len(questionnaire.items) else "question"
        questions = counted(len(questionnaire.items), noun)
        rows.append(("Questions", f"{questions} (questionnaire {block.questionnaire}){order}"))
    return _titled_lines(f"{part}{protocol.text(block.title, language)} (block {block.id}, {block.phase})", rows)


def _design_rows(protocol: Protocol, block: Block, delay_ticks: int) -> Iterator[tuple[str, str]]:
    """Yield the rows about a block's design, levels and comparisons."""
    design = protocol.design_of(block)
    kind = capitalised(design.paper_name.removeprefix("the method of "))
    if design.kind == "abx" or design.kind.endswith("ifc"):
        kind = design.kind.upper()
    intervals = "1 interval" if design.intervals == 1 else f"{design.intervals} intervals, {design.pause_s:g} s apart"
    if block.stimulus is None:
        yield "Design", f"{kind} against {block.standard}: {intervals}"
        yield from precision_rows(protocol, block)
        return
    stimulus, method = protocol.stimulus_of(block), protocol.method_of(block)
    standards = [standard for standard in protocol.standards_of(block) if standard is not None]
    levels = sorted(method.levels_of(stimulus))
    unit = stimulus.unit
    against = ""
    if standards:
        standards_text = ", ".join(f"{standard:g}" for standard in standards)
        against = f", {'standard' if len(standards) == 1 else 'standards'} {standards_text} {unit}".rstrip()
    yield "Design", f"{kind} of {stimulus.vary}{against}: {intervals}"
    name = _LEVELS[stimulus.level_kind]
    per_standard = " per standard" if standards else ""
    slots = [track.slots for track in tracks_of(protocol, block)]
    guess = design.guess_rate if design.can_be_correct(stimulus) else 0.0
    target = method.target(guess, design.success_of(stimulus))
    target_text = "" if target is None else f": {target}"
    if isinstance(method, Constant):
        target_text = f": {counted(len(levels), 'level')}, {counted(method.repetitions, 'presentation')} each"
    trials = slots[0] * method.tracks
    at_most = "at most " * method.can_end_early
    tracks = "" if method.tracks == 1 else f" in {method.tracks} tracks"
    yield (
        "Levels",
        f"{name} {number_range(levels, '.3g')}{f' {unit}' if unit and stimulus.level_kind != 'weber' else ''} "
        f"({method.kind}{target_text}), {at_most}{trials} trials{per_standard}{tracks}",
    )
    yield from (row for row in method.track_rules(stimulus).items() if row[0] != "Tracks")
    if (modulus := design.first) is not None:
        yield (
            "Modulus",
            f"the number {modulus.number:g} for {f'{modulus.level:g} {unit}'.rstrip()}, presented in the first trial, "
            "which is not analysed",
        )
    if isinstance(method, Adjustment):
        low, high = stimulus.domain
        steps = round((high - low) / method.step(stimulus))
        longest = f"at most {method.most_s:g} s per setting"
        yield "Settings", f"{steps} steps from one end to the other, starting near either end, {longest}"
    pairs = product(protocol.standards_of(block), levels)
    comparisons = [stimulus.comparison(standard, level) for standard, level in pairs]
    yield "Comparisons", f"{stimulus.vary} {number_range(comparisons, '.4g')} {unit}".rstrip()
    task = protocol.tasks[block.task]
    if isinstance(task, Follow) and stimulus.vary != DELAY:
        pace_mps = task.fastest_stroke(protocol.device.workspace_m).speed_mps
        scene = protocol.scene_for(protocol.condition_of(stimulus))
        values = (*standards, *comparisons)
        scenes = (
            [scene] if stimulus.vary in OF_LINK else [override_value(scene, stimulus.vary, value) for value in values]
        )
        paced_n = [steady_force(level_scene, pace_mps).drag_n for level_scene in scenes]
        fast_n = max(steady_force(level_scene, FASTER * pace_mps).drag_n for level_scene in scenes[-len(comparisons) :])
        yield (
            "Force at the paced speed",
            f"{number_range(paced_n, '.1f')} N at {pace_mps:.3g} m/s, and at most {fast_n:.1f} N at "
            f"{FASTER:g} times that speed",
        )
    if (highest_nspm := highest_damping(protocol, block)) > 0:
        scene = protocol.scene_for(protocol.condition_of(stimulus))
        limit_nspm = slope_limit(1 / scene.rate_hz, delay_ticks, scene.velocity)
        yield "Damping", f"at most {highest_nspm:.4g} N·s/m at the hand; the slope limit is {limit_nspm:.4g} N·s/m"
    yield from precision_rows(protocol, block)


def _order_text(block: Block) -> str:
    if len(block.conditions) < 2:
        return ""
    if block.design is not None:
        return "a different order for each participant"
    match block.order:
        case "fixed":
            return (
                "in the order in which they appear in the file, so anyone who reads the protocol can work out "
                "what the codes stand for"
            )
        case "shuffled":
            return "a different order for each participant"
        case "constrained":
            max_repeats, min_distance = block.max_repeats, block.min_distance
            rules = [] if max_repeats is None else [f"each condition at most {max_repeats} times in a row"]
            rules += (
                []
                if min_distance is None
                else [(f"at least {min_distance} trials from one presentation of a condition to the next")]
            )
            return f"a different order for each participant, with {' and '.join(rules)}"
        case "williams" | "latin" as square:
            rows = row_count(square, len(block.conditions))
            name = "a Williams design" if square == "williams" else "a Latin square"
            return f"in {name} with {rows} rows"


def _assignment_and_break_rows(protocol: Protocol, block: Block, language: str) -> Iterator[tuple[str, str]]:
    """Yield the rows about the assignment of square rows and about breaks."""
    if block.order in ("williams", "latin") and len(block.conditions) > 1:
        by_id = "assigned by the number in the participant's ID (P007 is number 7), not by the seed"
        yield (
            "Rows",
            ("assigned by the participant's position in the group, not by the seed") if protocol.groups else by_id,
        )
    if block.break_page is not None:
        title = protocol.text(protocol.pages[block.break_page].title, language)
        yield (
            "Breaks",
            f"{order_of(protocol, block).breaks}, after every {counted(block.break_every or 0, 'trial')}: {title}",
        )


def _liquid_rows(protocol: Protocol) -> list[tuple[str, ...]]:
    """Return each liquid's density, parameters and effects; a note if no condition uses it."""
    used = {liquid for condition in protocol.conditions.values() for liquid in condition.liquid_ids}
    rows: list[tuple[str, ...]] = []
    for name in protocol.liquids:
        body = protocol.liquids[name].model_dump(mode="json").get("body")
        description = liquid_text(resolve(protocol.scene_of(name)).liquids[0].model_dump(mode="json") | {"body": body})
        rows.append((name, description if name in used else f"{description}; not used in any condition"))
    return rows


def _condition_notes(condition: Condition) -> Iterator[str]:
    """Yield notes on a condition's display and force link where they differ from the defaults."""
    if condition.delay_ms:
        yield f"shown with a delay of {condition.delay_ms:g} ms"
    if condition.shows_video:
        without_overlay = ", without the ball and the targets" if condition.overlay == "hidden" else ""
        yield f"video: {condition.view}{without_overlay}"
    if condition.ball == "hidden":
        yield "ball hidden"
    yield from link_descriptions(condition.force_delay_ms, condition.force_jitter_ms, condition.force_loss)


def _question_lines(protocol: Protocol, name: str, language: str) -> Iterable[str]:
    questionnaire = protocol.questionnaires[name]
    context = questionnaire.context(protocol.scales, language)
    title = f"Questions in {name}"
    if len(questionnaire.statements) == len(questionnaire.items):
        scale = protocol.scales[questionnaire.scale or ""]
        labels = scale.labels[language]
        off_scale = "" if scale.cannot_judge is None else f', or "{protocol.text(scale.cannot_judge, language)}"'
        title = f"Statements in {name}, from 1 ({labels[0]}) to {len(labels)} ({labels[-1]}){off_scale}"
    rows = [
        (
            item.id,
            *(() if title.startswith("Statements") else (_question_kind(item, context),)),
            protocol.text(item.text, language),
            "" if item.required else "(optional)",
        )
        for item in questionnaire.items
    ]
    more = [f"  Scores: {', '.join(questionnaire.scores)}"] if questionnaire.scores else []
    if questionnaire.instrument is not None:
        standard = Instrument(questionnaire.instrument).table
        more += [f"  Source: {standard['source']}", f"  Compared: {standard['compared']}"]
    return (title, *_align_columns(rows), *more)


def _question_kind(item: Question, context: Context) -> str:
    """Return the kind of a question with its answers or bounds."""
    levels, bounds = item.levels(context), item.bounds(context)
    if levels:
        answers = f" ({', '.join(levels)})" if item.value_type == "text" else f" of {len(levels)} points"
    else:
        answers = "" if bounds is None else f" from {bounds[0]:g} to {bounds[1]:g}"
    condition = "" if item.show_if is None else f", depending on the answer to {item.show_if.item}"
    return f"{item.kind_id}{answers}{condition}"


def limit_label(key: str) -> str:
    """Return the meaning of a limit, such as "maximum time between two ticks"; "" for an unknown key."""
    field = Limits.model_fields.get(key)
    label = "" if field is None else re.sub(r" \[.*|; .*|\.$", "", field.description or "")
    return label[:1].lower() + label[1:]


def limit_rows(protocol: Protocol) -> list[tuple[str, str]]:
    """Return the limits of a valid trial that the study's blocks can exceed: each value with its meaning."""
    units, rows = {"ms": " ms", "percent": " %"}, []
    blocks_with_design = [block for block in protocol.blocks_in_order if block.design is not None]
    varied = {protocol.stimulus_of(block).vary for block in blocks_with_design if block.stimulus is not None}
    applies = {
        "level_error_percent": bool(varied - {*OF_CONDITION}),
        "level_error_ms": bool(varied & {*DELAYS}),
        "pace_error_percent": any(isinstance(protocol.tasks[block.task], Follow) for block in blocks_with_design),
        "attempts": bool(blocks_with_design),
        "missing_percent": bool(blocks_with_design),
    }
    for key in Limits.model_fields:
        if not applies.get(key, True):
            continue
        if (value := getattr(protocol.limits, key)) is not None:
            rows.append((f"{value:g}{units.get(key.rpartition('_')[2], '')}", limit_label(key)))
    return rows
