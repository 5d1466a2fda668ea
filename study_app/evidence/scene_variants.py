"""Variants of a scene: another wake, other effects, another drag law."""

from typing import Any

from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.gate import resolve
from study_app.haptics.model.laws import Law
from study_app.haptics.model.scene import Effect, Everywhere, Scene


def with_wake(scene: Scene, **changes: Any) -> Scene:
    """Return the scene with other parameters of its wake."""
    wake = scene.liquids[0].wake.model_copy(update=changes)
    return scene.model_copy(update={"liquids": (scene.liquids[0].model_copy(update={"wake": wake}),)})


def with_effects(scene: Scene, *effects: Effect, law: Law | None = None) -> Scene:
    """Return the scene with other effects, and perhaps another law of drag."""
    changes: dict[str, Any] = {"effects": effects} | ({} if law is None else {"drag": Drag(law=law)})
    return scene.model_copy(update={"liquids": (scene.liquids[0].model_copy(update=changes),)})


def without_buoyancy(scene: Scene) -> Scene:
    """Return the scene with its liquid's other effects, named."""
    scene = resolve(scene)
    return with_effects(scene, *(name for name in scene.liquids[0].effects if name != "buoyancy"))


def _only(scene: Scene, liquid: Any) -> Scene:
    """Return the scene with one liquid, that is everywhere and does not flow by itself."""
    alone = liquid.model_copy(update={"region": Everywhere(), "current": None})
    return scene.model_copy(update={"liquids": (alone,)})
