"""What only sound tables together can show: targets inside the tank, liquids that are felt and differ, codes in order.

The checks work on a :class:`Draft` of every entry that is sound by itself, so that one broken table does not hide what
is wrong between the others.

The force of a scene is estimated without the compiler, as its ball moves through the liquid at rest in the fastest
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
from study_app.protocol.checks import cross_references as named
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
"""Less is not felt: a tenth of the force that a hand at rest notices. [choice]"""
_DIGITS = 6
"""Conditions whose delays differ by less than a nanosecond present the same."""
_VARIED = {"liquids": "liquid_ids", "delays": "delay_ms", "views": "seen"}
"""What a block compares, and the attribute of its conditions that then varies."""

_TABLES = ("liquids", "conditions", "tasks", "pages", "blocks")


class Draft(BaseModel):
    """The valid entries of a document; ``whole`` tells whether no block had to be omitted."""

    model_config = ConfigDict(frozen=True, extra="ignore", defer_build=True)

    device: DeviceNeeds | None = None
    scene: SceneDefaults | None = None
    liquids: Named[StudyLiquid] = {}
    conditions: dict[str, Condition] = {}
    tasks: dict[str, AnyTask] = {}
    pages: dict[str, PageText] = {}
    blocks: Named[Block] = {}
    sequence: tuple[str, ...] = ()
    whole: bool = True
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


def _sound_draft(document: Mapping[str, Any], broken: Iterable[Path], valid: Protocol | None) -> Draft:
    """Return the valid entries of ``document``; ``broken`` are the paths of the problems already found."""
    differ = bool(document.keys() & {"groups", "sequences"})
    if valid is not None:
        return Draft.model_construct(**dict(valid), sessions_differ=differ)
    sound = {key: dict(value) if isinstance(value, Mapping) else value for key, value in document.items()}
    for path in filter(None, broken):
        section = str(path[0])
        if section in _TABLES and len(path) > 1:
            sound.get(section, {}).pop(path[1], None)
        else:
            sound.pop(section, None)
    sound.setdefault("scene", None if "scene" in document else {})
    all_blocks = len(names(document, "blocks")) == len(names(sound, "blocks"))
    return Draft.model_validate({**sound, "whole": all_blocks, "sessions_differ": differ}, strict=True)


def check(document: Mapping[str, Any], broken: Iterable[Path], valid: Protocol | None) -> Iterator[Fault]:
    """Yield every inconsistency between the tables of ``document``; its ``broken`` places are already reported.

    ``valid`` is the validated document if nothing is broken, so that its tables are not validated again.
    """
    of_items = (
        named.check_items,
        named.check_statements_differ,
        named.check_languages,
        named.check_questions,
        named.check_decisions,
    )
    for of_names in (
        named.check_references,
        check_kinds,
        named.check_sequences,
        named.check_groups,
        named.check_repeats,
        *of_items,
    ):
        yield from of_names(document)
    parts = _sound_draft(document, broken, valid)
    for of_tables in (
        _check_targets,
        _check_liquids,
        _check_forces,
        _check_liquids_differ,
        _check_conditions_differ,
        _check_comparisons,
        _check_blocks,
        _check_parts,
    ):
        yield from of_tables(parts)


def _check_targets(parts: Draft) -> Iterator[Fault]:
    """Check that every target lies inside the tank with its whole radius."""
    if parts.device is None:
        return
    half = tuple(size / 2 for size in parts.device.workspace_mm)
    for name, task in parts.tasks.items():
        if isinstance(task, Follow) and task.amplitude_mm + task.radius_mm > half[0]:
            message = (
                f"with an amplitude of {task.amplitude_mm:g} mm and a radius of {task.radius_mm:g} mm, the target "
                "leaves the tank"
            )
            yield Fault(
                ("tasks", name, "amplitude_mm"),
                message,
                f"device.workspace_mm extends only {half[0]:g} mm to either side",
            )
        if not isinstance(task, Reach):
            continue
        for index, target in enumerate(task.targets_mm):
            for axis, (place, room) in enumerate(zip(target, half, strict=True)):
                if abs(place) + task.radius_mm > room:
                    path = ("tasks", name, "targets_mm", index)
                    most = math.floor(room - task.radius_mm)
                    yield Fault(
                        path,
                        f"at {'xyz'[axis]} = {place:g} mm, a target with a radius of {task.radius_mm:g} mm extends "
                        "beyond the tank",
                        f"device.workspace_mm extends only {room:g} mm to either side",
                        use=((*path, axis), int(math.copysign(most, place))) if most >= 0 else None,
                    )


def _check_liquids(parts: Draft) -> Iterator[Fault]:
    """Check that a condition's liquids fit into a scene with one ball, which can reach each of them in the tank."""
    for name, condition in parts.conditions.items():
        place, known = (
            ("conditions", name, "liquids"),
            [liquid for liquid in condition.liquid_ids if liquid in parts.liquids],
        )
        if parts.scene is not None and len({parts.liquids[liquid].body_in(parts.scene) for liquid in known}) > 1:
            message = "its liquids have different balls, but the same ball moves through all of them"
            yield Fault(place, message, "use the same ball for all of them")
        if len(condition.liquids) > MAX_LIQUIDS:
            yield Fault(place, f"has {len(condition.liquids)} liquids", f"specify at most {MAX_LIQUIDS}")
        for liquid in known:
            if parts.device is None or parts.scene is None:
                continue
            if not _is_within_tank(parts.liquids[liquid], parts.scene, parts.device):
                message = f'the region of "{liquid}" lies outside the tank, so the hand cannot reach it'
                yield Fault(place[:2], message, "move or enlarge the region, or scene.origin_m")


def _check_forces(parts: Draft) -> Iterator[Fault]:
    """Check that every condition exerts a force in the fastest stroke of its block's task."""
    for name, block in parts.blocks.items():
        task = parts.tasks.get(block.task)
        if task is None or parts.device is None:
            continue
        stroke = task.fastest_stroke(parts.device.workspace_m)
        for index, condition in enumerate(block.conditions):
            scene = parts.scene_of(parts.conditions[condition]) if condition in parts.conditions else None
            if scene is not None and (exerted_n := force_n(scene, stroke)) < LEAST_N:
                yield Fault(
                    ("blocks", name, "conditions", index),
                    f'"{condition}" exerts only {exerted_n:.2g} N in the fastest stroke of task "{block.task}" '
                    f"({stroke.speed_mps:.2g} m/s): participants cannot perceive a force below {LEAST_N:g} N",
                    "select effects such as drag, or increase the density, the scale or the ball's diameter",
                )


def _check_liquids_differ(parts: Draft) -> Iterator[Fault]:
    """Check that no two liquids have the same numbers."""
    first: dict[str, str] = {}
    for name, liquid in parts.liquids.items():
        if (earlier := first.setdefault(repr(felt_numbers(liquid)), name)) != name:
            yield Fault(
                ("liquids", name),
                f'has the same values as "{earlier}"',
                "change one of them; to present a liquid twice, list its condition twice",
            )


def _check_conditions_differ(parts: Draft) -> Iterator[Fault]:
    """Check that the conditions of a block differ, unless the block says that some are replicates."""
    for name, block in parts.blocks.items():
        presented = {
            condition_id: parts.conditions[condition_id]
            for condition_id in block.conditions
            if condition_id in parts.conditions
        }
        delays = compared(list(presented.values())) == "delays"  # which the analysis pools
        first: dict[tuple[Any, ...], str] = {}
        for index, condition in enumerate(() if delays and block.replicates else block.conditions):
            if (settings := presented.get(condition)) is None:
                continue
            numbers_of = (round(getattr(settings, key), _DIGITS) for key in OF_CONDITION)
            presents = (settings.liquid_ids, settings.ball, settings.view, settings.overlay, *numbers_of)
            earlier = first.setdefault(presents, condition)
            if earlier != condition:
                message = f'"{condition}" is identical to "{earlier}"'
                hint = "change it, or use repetitions" + (", or write replicates = true" if delays else "")
                yield Fault(("blocks", name, "conditions", index), message, hint)


def _check_comparisons(parts: Draft) -> Iterator[Fault]:
    """Check that a main block's conditions differ only in the quantity that the block states.

    In a block of views, delays may also differ if they equalise the latency of the views.
    """
    for name, block in parts.blocks.items():
        presented = [
            parts.conditions[condition_id] for condition_id in block.conditions if condition_id in parts.conditions
        ]
        if block.phase != "main" or block.design is not None or len(presented) < len(block.conditions):
            continue
        varied = [of for of, key in _VARIED.items() if len({getattr(condition, key) for condition in presented}) > 1]
        if block.compares == "views" and {"views", "delays"} <= {*varied}:
            varied.remove("delays")
        if len(varied) > 1:
            differ = " and in ".join(quantity.removesuffix("s") for quantity in varied)
            message = f"its conditions differ in {differ}, and the analysis cannot separate these effects"
            yield Fault(
                ("blocks", name, "conditions"), message, "vary only one of them, or use a separate block for each"
            )
        elif block.compares is not None and varied not in ([], [block.compares]):
            message = f'is "{block.compares}", but its conditions differ in {compared(presented)}'
            yield Fault(("blocks", name, "compares"), message, kind="surplus")


def _check_blocks(parts: Draft) -> Iterator[Fault]:
    """Check that the codes of different blocks differ, and that a break is a page of that kind."""
    owners: dict[str, str] = {}
    for name, block in parts.blocks.items():
        if block.code_prefix is not None and owners.setdefault(block.code_prefix, name) != name:
            message = f'block "{owners[block.code_prefix]}" already uses the prefix "{block.code_prefix}"'
            yield Fault(("blocks", name, "code_prefix"), message, "choose a different letter")
        page = parts.pages.get(block.break_page or "")
        if page is not None and page.kind != "break":
            message = f'page "{block.break_page}" is of kind "{page.kind}"'
            yield Fault(("blocks", name, "break_page"), message, 'a break needs a page with kind = "break"')


def _check_parts(parts: Draft) -> Iterator[Fault]:
    """Check that parts count 1, 2, … in the order of the sequence, and that at least one block is analysed.

    If sessions differ, each one numbers its parts separately (`own_protocol`).
    """
    if not (parts.whole and parts.blocks):
        return
    if all(block.phase != "main" for block in parts.blocks.values()):
        yield Fault(("blocks",), "there is no main block", 'at least one block needs phase = "main"')
    latest = 0
    for name in dict.fromkeys(() if parts.sessions_differ else parts.sequence):
        part = parts.blocks[name].part if name in parts.blocks else None
        if part is None:
            continue
        if part not in {latest, latest + 1}:
            expected, path = f"{latest} or {latest + 1}" if latest else "1", ("blocks", name, "part")
            message = f"is {part}, but at this position in the sequence it must be {expected}"
            yield Fault(path, message, use=(path, latest or 1), kind="part")
        latest = max(latest, part)


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
    """Return whether the ball's centre meets the liquid somewhere in the tank."""
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
    said = liquid.model_dump(exclude={"id"})
    if liquid.effects != "auto":
        said["effects"] = sorted(liquid.effects)
        for effect in EFFECTS:
            if effect.name not in liquid.effects:
                said.pop(effect.name, None)
    return said
