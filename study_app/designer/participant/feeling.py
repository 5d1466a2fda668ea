"""Feel it: liquids of the draft in the lab, and what was changed there put back as one step."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path as File
from typing import Any, Final

from PySide6.QtCore import QObject, Signal

from study_app.designer.document.elements import title_of
from study_app.designer.document.toml_edits import Edit, Set, Unset
from study_app.designer.document.toml_text import Refused
from study_app.designer.participant.playable import NotPlayableError, playable
from study_app.designer.place.editing import Editing
from study_app.designer.place.view import DesignerPlace
from study_app.haptics.model.scene import Liquid
from study_app.lab.ab_comparison import Setting, Side
from study_app.lab.parameters import parameter
from study_app.protocol.model import Protocol
from study_app.protocol.source.document import Path, has, value_at
from study_app.protocol.source.files import file_of

OF_THE_STUDY: Final = frozenset({"scene", "velocity", "knee", "body"})
"""Tables of the lab's parameters that a study has once for all of its liquids."""


@dataclass(frozen=True, slots=True)
class LabLiquids:
    """Settings A and B for the lab; ``study`` is what takes them back, "" where the study cannot be changed."""

    a: Setting
    b: Setting
    study: str


class Feeling(QObject):
    """Opens liquids of the open study in the lab.

    ``asked`` carries a `LabLiquids`, ``returned`` comes when a liquid was put back.
    """

    asked = Signal(object)
    returned = Signal()

    def __init__(self, editing: Editing, place: DesignerPlace) -> None:
        super().__init__(editing)
        self.editing, self.place = editing, place
        self._sides: dict[Side, Liquid] = {}
        self._file = File()
        place.form.head.feel_asked.connect(self.feel)

    def feel(self, path: Path) -> None:
        """Open the liquids of an element in the lab, unsaved values included: as A, and a second one as B."""
        self.place.flush()
        opened = self.editing.opened
        if opened is None:
            return
        study = opened.study
        try:
            protocol = study.protocol or playable(study, path).protocol
        except NotPlayableError as refused:
            self.place.message.emit("It cannot be opened in the lab yet", f"Correct this first: {refused.problems[0]}.")
            return
        names = _liquids(protocol, path)
        if not names:
            self.place.message.emit("It cannot be opened in the lab", "It has no liquid.")
            return
        titled = [
            (title_of(study.document, ("liquids", name)), protocol.scene_of(name)) for name in (names[0], names[-1])
        ]
        settings = [Setting(title, scene, scene) for title, scene in titled]
        self._sides = {"A": settings[0].scene.liquids[0], "B": settings[1].scene.liquids[0]}
        self._file = opened.file
        self.asked.emit(LabLiquids(settings[0], settings[1], "" if opened.read_only else opened.file.stem))

    def put_back(self, side: Side, setting: Setting) -> None:
        """Give the liquid of a side the values of a setting, as one step."""
        opened, before = self.editing.opened, self._sides.get(side)
        if opened is None or before is None or opened.file != self._file:
            self.place.message.emit("It was not put back", "Another study is open in the designer now.")
            return
        if opened.read_only:
            self.place.message.emit("It was not put back", opened.read_only)
            return
        path: Path = ("liquids", before.id)
        document = opened.study.document
        if value_at(document, path) is None:
            self.place.message.emit("It was not put back", f"The study has no liquid {before.id} any more.")
            return
        title = title_of(document, path)
        if file_of(value_at(document, path)) is not None:
            sentence = f"{title} is in a liquid file of its own. Save it there as a preset."
            self.place.message.emit("It was not put back", sentence)
            return
        after = setting.scene.liquids[0]
        edits = tuple(_edits(document, path, _values(before), _values(after)))
        try:
            if edits:
                self.editing.make(f"Put {title} back from the lab", *edits, select=path)
        except Refused as refusal:
            self.place.message.emit("It was not put back", f"{refusal}.")
            return
        self._sides[side] = after.model_copy(update={"id": before.id})
        self.editing.select(path)
        self.returned.emit()
        shared = [name for name in setting.changed_names() if name.partition(".")[0] in OF_THE_STUDY]
        if shared:
            words = ", ".join(parameter(setting.scene, name).label.lower() for name in shared)
            self.place.message.emit(f"{title} was put back", f"The study has these once for all liquids: {words}.")


def _liquids(protocol: Protocol, path: Path) -> tuple[str, ...]:
    """Return the ids of at most two liquids of an element."""
    section, name = str(path[0]), str(path[1])
    if section == "liquids":
        return (name,)
    conditions = protocol.conditions_in(name) if section == "blocks" else (name,)
    found = (liquid for condition in conditions for liquid in protocol.conditions[condition].liquid_ids)
    return tuple(dict.fromkeys(found))[:2]


def _values(liquid: Liquid) -> dict[str, Any]:
    return liquid.model_dump(exclude_none=True, exclude={"id"})


def _edits(
    document: Mapping[str, Any], path: Path, before: Mapping[str, Any], after: Mapping[str, Any]
) -> Iterator[Edit]:
    """Yield the edits of what differs between two tables of a liquid."""
    for key in before:
        if key not in after and has(value_at(document, path), key):
            yield Unset((*path, key))
    for key, value in after.items():
        place, old = (*path, key), before.get(key)
        if old == value:
            continue
        if isinstance(value, Mapping) and isinstance(old, Mapping) and has(value_at(document, path), key):
            yield from _edits(document, place, old, value)
        else:
            yield Set(place, _plain(value))


def _plain(value: Any) -> Any:
    """Return a value as it is written: lists, and whole numbers without a decimal point."""
    if isinstance(value, Mapping):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, tuple):
        return [_plain(one) for one in value]
    return int(value) if isinstance(value, float) and value.is_integer() else value
