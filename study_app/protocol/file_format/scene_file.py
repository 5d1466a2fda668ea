"""The writer of scene files, with the tables ``[scene]`` and ``[liquids.*]``, which ``load.load_scene`` reads."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, TypeAlias

from study_app.haptics.model.effects import EFFECTS
from study_app.haptics.model.scene import FADE_S, Ewma, Given, Kalman, Liquid, Scene
from study_app.protocol.model import FORMAT

_Place: TypeAlias = tuple[str, ...]

_COMMENT_LETTERS: Final = 110


def scene_text(scene: Scene, *, said: Sequence[str] = (), notes: Mapping[_Place, str] | None = None) -> str:
    """Return the text of a scene file; the estimator "given" is omitted, since a file cannot state it.

    The paragraphs ``said`` precede it as comments; ``notes`` are comments on single keys by path, such as
    ``("liquids", "water", "density_kg_m3")``.
    """
    comments = [f"# {line}" for paragraph in said for line in textwrap.wrap(paragraph, _COMMENT_LETTERS)]
    head = [*comments, *([""] if comments else []), f"format = {FORMAT}"]
    omitted = {"liquids", "link"} | ({"velocity"} if isinstance(scene.velocity, Given) else set())
    omitted |= {"fade_s"} if scene.fade_s == FADE_S else set()
    scene_table = scene.model_dump(exclude_none=True, exclude=omitted)
    lines = [*head, *_table_lines(("scene",), scene_table, notes or {})]
    for liquid in scene.liquids:
        lines += _table_lines(("liquids", liquid.id), _liquid_table(liquid), notes or {})
    return "\n".join(lines) + "\n"


def with_default_estimator(scene: Scene) -> Scene:
    """Return a scene with the program's default estimator: "kalman" instead of "ewma"."""
    return scene.model_copy(update={"velocity": Kalman()}) if scene.velocity == Ewma() else scene


def _liquid_table(liquid: Liquid) -> Mapping[str, Any]:
    """Return a liquid's table for a scene file, without tables that have no effect."""
    unused_tables = {
        effect.name
        for effect in EFFECTS
        if effect.default is not None and not effect.with_liquid and effect.name not in liquid.effects
        if getattr(liquid, effect.name) == effect.default
    }
    return liquid.model_dump(exclude_none=True, exclude={"id", *unused_tables})


def _table_lines(place: _Place, table: Mapping[str, Any], notes: Mapping[_Place, str]) -> Iterator[str]:
    yield ""
    yield f"[{'.'.join(place)}]"
    for key, value in table.items():
        if not isinstance(value, Mapping):
            note = notes.get((*place, key))
            yield f"{key} = {_toml_value(value)}" + (f"  # {note}" if note else "")
    for key, value in table.items():
        if isinstance(value, Mapping) and value:
            yield from _table_lines((*place, key), value, notes)


def _toml_value(value: object) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(_toml_value(entry) for entry in value)}]"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str | bool) else repr(value)
