"""Checks that need several valid tables: targets inside the tank, perceptible and different liquids, codes, parts.

The checks work on a :class:`Draft` of all valid entries, so that one invalid table does not hide inconsistencies
between the others.

The force of a scene is estimated without the compiler, for a ball that moves through the liquid at rest in the fastest
stroke of the block's task.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final

from pydantic import BaseModel, ConfigDict

from study_app.haptics.model.effects import EFFECTS
from study_app.haptics.model.gate import Extremes, resolve
from study_app.haptics.model.scene import MAX_LIQUIDS, Box, Everywhere, Liquid, MotionBox, Scene
from study_app.protocol.checks import cross_references
from study_app.protocol.checks.designs import check_kinds
from study_app.protocol.model import (
    Block,
    Condition,
    DeviceNeeds,
    Follow,
    Named,
    PageText,
    Protocol,
    Reach,
    SceneDefaults,
    StudyLiquid,
    compared,
    scene_with,
)
from study_app.protocol.source.document import Path, names
from study_app.protocol.source.problems import Fault
from study_app.protocol.trials.stimuli import OF_CONDITION
from study_app.protocol.trials.tasks import AnyTask, Stroke

LEAST_N: Final = 0.01
"""Smallest force that counts as perceptible [N]: a tenth of the force that a hand at rest notices. [choice]"""
_DIGITS = 6
"""Decimals of a condition's numbers that are compared; delays [ms] may differ by up to a nanosecond."""
_VARIED = {"liquids": "liquid_ids", "delays": "delay_ms", "views": "seen"}
"""The attribute of conditions that varies, for each quantity that a block can compare."""

_TABLES = ("liquids", "conditions", "tasks", "pages", "blocks")


class Draft(BaseModel):
    """The valid entries of a document; ``is_complete`` means that no block was omitted."""

    model_config = ConfigDict(frozen=True, extra="ignore", defer_build=True)

    device: DeviceNeeds | None = None
    scene: SceneDefaults | None = None
    liquids: Named[StudyLiquid] = {}
    conditions: dict[str, Condition] = {}
    tasks: dict[str, AnyTask] = {}
    pages: dict[str, PageText] = {}
    blocks: Named[Block] = {}
    sequence: tuple[str, ...] = ()
    is_complete: bool = True
    sessions_differ: bool = False

    def scene_of(self, condition: Condition) -> Scene | None:
        """Return the scene of a condition; None unless all of its parts are valid."""
        liquids = [self.liquids[name] for name in condition.liquid_ids if name in self.liquids]
        if (
            self.device is None
            or self.scene is None
            or not 0 < len(liquids) == len(set(condition.liquid_ids)) <= MAX_LIQUIDS
        ):
            return None
        return scene_with(self.scene, self.device, liquids)


def _make_draft(document: Mapping[str, Any], broken: Iterable[Path], valid: Protocol | None) -> Draft:
    """Return the valid entries of ``document``; ``broken`` are the paths of faults that are already reported."""
    sessions_differ = bool(document.keys() & {"groups", "sequences"})
    if valid is not None:
        return Draft.model_construct(**dict(valid), sessions_differ=sessions_differ)
    valid_tables = {key: dict(value) if isinstance(value, Mapping) else value for key, value in document.items()}
    for path in filter(None, broken):
        section = str(path[0])
        if section in _TABLES and len(path) > 1:
            valid_tables.get(section, {}).pop(path[1], None)
        else:
            valid_tables.pop(section, None)
    valid_tables.setdefault("scene", None if "scene" in document else {})
    has_all_blocks = len(names(document, "blocks")) == len(names(valid_tables, "blocks"))
    return Draft.model_validate(
        {**valid_tables, "is_complete": has_all_blocks, "sessions_differ": sessions_differ}, strict=True
    )


def check(document: Mapping[str, Any], broken: Iterable[Path], valid: Protocol | None) -> Iterator[Fault]:
    """Yield every inconsistency between the tables of ``document``.

    ``broken`` are the paths of faults that are already reported. Without any, ``valid`` is the validated document, so
    that its tables are not validated again.
    """
    for check_document in (
        cross_references.check_references,
        check_kinds,
        cross_references.check_sequences,
        cross_references.check_groups,
        cross_references.check_repeats,
        cross_references.check_items,
        cross_references.check_statements_differ,
        cross_references.check_languages,
        cross_references.check_questions,
        cross_references.check_decisions,
    ):
        yield from check_document(document)
    draft = _make_draft(document, broken, valid)
    for check_draft in (
        _check_targets,
        _check_liquids,
        _check_forces,
        _check_liquids_differ,
        _check_conditions_differ,
        _check_comparisons,
        _check_blocks,
        _check_parts,
    ):
        yield from check_draft(draft)


def _check_targets(draft: Draft) -> Iterator[Fault]:
    """Check that every target lies completely inside the tank."""
    if draft.device is None:
        return
    half_sizes_mm = tuple(size / 2 for size in draft.device.workspace_mm)
    for name, task in draft.tasks.items():
        if isinstance(task, Follow) and task.amplitude_mm + task.radius_mm > half_sizes_mm[0]:
            message = (
                f"with an amplitude of {task.amplitude_mm:g} mm and a radius of {task.radius_mm:g} mm, the target "
                "leaves the tank"
            )
            yield Fault(
                ("tasks", name, "amplitude_mm"),
                message,
                f"device.workspace_mm extends only {half_sizes_mm[0]:g} mm to either side",
            )
        if not isinstance(task, Reach):
            continue
        for index, target in enumerate(task.targets_mm):
            for axis, (centre_mm, limit_mm) in enumerate(zip(target, half_sizes_mm, strict=True)):
                if abs(centre_mm) + task.radius_mm > limit_mm:
                    path = ("tasks", name, "targets_mm", index)
                    farthest_mm = math.floor(limit_mm - task.radius_mm)
                    yield Fault(
                        path,
                        f"at {'xyz'[axis]} = {centre_mm:g} mm, a target with a radius of {task.radius_mm:g} mm extends "
                        "beyond the tank",
                        f"device.workspace_mm extends only {limit_mm:g} mm to either side",
                        use=((*path, axis), int(math.copysign(farthest_mm, centre_mm))) if farthest_mm >= 0 else None,
                    )


def _check_liquids(draft: Draft) -> Iterator[Fault]:
    """Check that a condition's liquids share one ball, fit into a scene, and can be reached in the tank."""
    for name, condition in draft.conditions.items():
        path, liquid_ids = (
            ("conditions", name, "liquids"),
            [liquid for liquid in condition.liquid_ids if liquid in draft.liquids],
        )
        if draft.scene is not None and len({draft.liquids[liquid].body_in(draft.scene) for liquid in liquid_ids}) > 1:
            message = "its liquids have different balls, but the same ball moves through all of them"
            yield Fault(path, message, "use the same ball for all of them")
        if len(condition.liquids) > MAX_LIQUIDS:
            yield Fault(path, f"has {len(condition.liquids)} liquids", f"specify at most {MAX_LIQUIDS}")
        for liquid in liquid_ids:
            if draft.device is None or draft.scene is None:
                continue
            if not _is_within_tank(draft.liquids[liquid], draft.scene, draft.device):
                message = f'the region of "{liquid}" lies outside the tank, so the hand cannot reach it'
                yield Fault(path[:2], message, "move or enlarge the region, or scene.origin_m")


def _check_forces(draft: Draft) -> Iterator[Fault]:
    """Check that every condition exerts a force in the fastest stroke of its block's task."""
    for name, block in draft.blocks.items():
        task = draft.tasks.get(block.task)
        if task is None or draft.device is None:
            continue
        stroke = task.fastest_stroke(draft.device.workspace_m)
        for index, condition in enumerate(block.conditions):
            scene = draft.scene_of(draft.conditions[condition]) if condition in draft.conditions else None
            if scene is not None and (exerted_n := force_n(scene, stroke)) < LEAST_N:
                yield Fault(
                    ("blocks", name, "conditions", index),
                    f'"{condition}" exerts only {exerted_n:.2g} N in the fastest stroke of task "{block.task}" '
                    f"({stroke.speed_mps:.2g} m/s): participants cannot perceive a force below {LEAST_N:g} N",
                    "select effects such as drag, or increase the density, the scale or the ball's diameter",
                )


def _check_liquids_differ(draft: Draft) -> Iterator[Fault]:
    """Check that no two liquids have the same numbers."""
    first: dict[str, str] = {}
    for name, liquid in draft.liquids.items():
        if (earlier := first.setdefault(repr(felt_numbers(liquid)), name)) != name:
            yield Fault(
                ("liquids", name),
                f'has the same values as "{earlier}"',
                "change one of them; to present a liquid twice, list its condition twice",
            )


def _check_conditions_differ(draft: Draft) -> Iterator[Fault]:
    """Check that the conditions of a block differ, unless the block states that some are replicates."""
    for name, block in draft.blocks.items():
        presented = {
            condition_id: draft.conditions[condition_id]
            for condition_id in block.conditions
            if condition_id in draft.conditions
        }
        compares_delays = compared(list(presented.values())) == "delays"  # the analysis pools replicates
        first: dict[tuple[Any, ...], str] = {}
        for index, condition in enumerate(() if compares_delays and block.replicates else block.conditions):
            if (settings := presented.get(condition)) is None:
                continue
            numbers = (round(getattr(settings, key), _DIGITS) for key in OF_CONDITION)
            content = (settings.liquid_ids, settings.ball, settings.view, settings.overlay, *numbers)
            earlier = first.setdefault(content, condition)
            if earlier != condition:
                message = f'"{condition}" is identical to "{earlier}"'
                hint = "change it, or use repetitions" + (", or write replicates = true" if compares_delays else "")
                yield Fault(("blocks", name, "conditions", index), message, hint)


def _check_comparisons(draft: Draft) -> Iterator[Fault]:
    """Check that a main block's conditions differ only in the quantity that the block states.

    In a block of views, delays may also differ if they equalise the latency of the views.
    """
    for name, block in draft.blocks.items():
        presented = [
            draft.conditions[condition_id] for condition_id in block.conditions if condition_id in draft.conditions
        ]
        if block.phase != "main" or block.design is not None or len(presented) < len(block.conditions):
            continue
        varied = [
            varied_quantity
            for varied_quantity, key in _VARIED.items()
            if len({getattr(condition, key) for condition in presented}) > 1
        ]
        if block.compares == "views" and {"views", "delays"} <= {*varied}:
            varied.remove("delays")
        if len(varied) > 1:
            differences = " and in ".join(quantity.removesuffix("s") for quantity in varied)
            message = f"its conditions differ in {differences}, and the analysis cannot separate these effects"
            yield Fault(
                ("blocks", name, "conditions"), message, "vary only one of them, or use a separate block for each"
            )
        elif block.compares is not None and varied not in ([], [block.compares]):
            message = f'is "{block.compares}", but its conditions differ in {compared(presented)}'
            yield Fault(("blocks", name, "compares"), message, kind="surplus")


def _check_blocks(draft: Draft) -> Iterator[Fault]:
    """Check that the codes of different blocks differ, and that a break is a page of that kind."""
    owners: dict[str, str] = {}
    for name, block in draft.blocks.items():
        if block.code_prefix is not None and owners.setdefault(block.code_prefix, name) != name:
            message = f'block "{owners[block.code_prefix]}" already uses the prefix "{block.code_prefix}"'
            yield Fault(("blocks", name, "code_prefix"), message, "choose a different letter")
        page = draft.pages.get(block.break_page or "")
        if page is not None and page.kind != "break":
            message = f'page "{block.break_page}" is of kind "{page.kind}"'
            yield Fault(("blocks", name, "break_page"), message, 'a break needs a page with kind = "break"')


def _check_parts(draft: Draft) -> Iterator[Fault]:
    """Check that parts count 1, 2, … in the order of the sequence, and that at least one block is analysed.

    If sessions differ, each one numbers its parts separately (`own_protocol`).
    """
    if not (draft.is_complete and draft.blocks):
        return
    if all(block.phase != "main" for block in draft.blocks.values()):
        yield Fault(("blocks",), "there is no main block", 'at least one block needs phase = "main"')
    last_part = 0
    for name in dict.fromkeys(() if draft.sessions_differ else draft.sequence):
        part = draft.blocks[name].part if name in draft.blocks else None
        if part is None:
            continue
        if part not in {last_part, last_part + 1}:
            expected, path = f"{last_part} or {last_part + 1}" if last_part else "1", ("blocks", name, "part")
            message = f"is {part}, but at this position in the sequence it must be {expected}"
            yield Fault(path, message, use=(path, last_part or 1), kind="part")
        last_part = max(last_part, part)


def force_n(scene: Scene, stroke: Stroke) -> float:
    """Return an upper estimate of a scene's force in a stroke [N]: the sum of its strongest liquid's effects."""
    motion = MotionBox(
        speed_mps=_clamp_value(scene.scale * stroke.speed_mps),
        acceleration_mps2=_clamp_value(scene.scale * stroke.acceleration_mps2),
        depth_m=scene.motion.depth_m,
    )
    moved = scene.model_copy(update={"motion": motion})
    strongest_n = 0.0
    for liquid in resolve(scene).liquids:
        exerted_n = Extremes(moved, liquid).exerted_n
        strongest_n = max(strongest_n, sum(exerted_n[effect] for effect in exerted_n if effect in liquid.effects))
    return min(strongest_n, scene.force_limit_n)


def _clamp_value(value: float) -> float:
    return min(max(value, 1e-3), 1000.0)


def _is_within_tank(liquid: Liquid, scene: SceneDefaults, device: DeviceNeeds) -> bool:
    """Return whether the ball's centre can be in the liquid somewhere in the tank."""
    region = liquid.region
    if isinstance(region, Everywhere):
        return True
    gaps_m = [
        max(abs(origin - centre) - scene.scale * size / 2, 0.0)
        for origin, centre, size in zip(scene.origin_m, region.centre_m, device.workspace_m, strict=True)
    ]
    if isinstance(region, Box):
        return all(gap <= size / 2 for gap, size in zip(gaps_m, region.size_m, strict=True))
    return math.hypot(gaps_m[0], gaps_m[2]) <= region.radius_m and gaps_m[1] <= region.height_m / 2


def felt_numbers(liquid: Liquid) -> dict[str, Any]:
    """Return the values that determine the force of a liquid: all except its name and the tables of unused effects."""
    values = liquid.model_dump(exclude={"id"})
    if liquid.effects != "auto":
        values["effects"] = sorted(liquid.effects)
        for effect in EFFECTS:
            if effect.name not in liquid.effects:
                values.pop(effect.name, None)
    return values
