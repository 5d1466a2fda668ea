"""The conditions of a block: what each presents, by how much it is late, and its force."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from study_app.designer.document.edited_study import Study
from study_app.designer.document.elements import title_of
from study_app.designer.document.fields import Row
from study_app.designer.form.row_facts import RowFacts
from study_app.designer.measures.number_cards import UNKNOWN
from study_app.designer.measures.valid_part import valid_part
from study_app.haptics.model.slope_limits import HAND_MPS, steady
from study_app.protocol.source.document import Path

CAPTION: Final = f"force at {HAND_MPS:g} m/s of the hand"


@dataclass(frozen=True, slots=True)
class ConditionLine:
    """One condition of a block.

    Attributes
    ----------
    liquid : tuple of str or None
        The place of its liquid, None where it has several or is not in the study.
    note : str
        Its liquid where it is named otherwise, and by how much the picture is late.
    force : str
        Its force with unit, "–" where it is not known.
    clipped : bool
        Whether a limit takes part of the force away.
    """

    liquid: Path | None
    note: str
    force: str
    clipped: bool = False


def condition_lines(study: Study, row: Row) -> tuple[ConditionLine, ...]:
    """Return a line for each condition that a block presents."""
    names = row.value if isinstance(row.value, tuple) else ()
    return tuple(_line(study, name) for name in names)


def _line(study: Study, name: Any) -> ConditionLine:
    document = study.document
    conditions, liquids = document.get("conditions", {}), document.get("liquids", {})
    table = conditions.get(name) if isinstance(conditions, Mapping) and isinstance(name, str) else None
    if not isinstance(table, Mapping):
        return ConditionLine(None, "not in the study", UNKNOWN)
    named = table.get("liquid")
    known = isinstance(named, str) and isinstance(liquids, Mapping) and named in liquids
    liquid: Path | None = ("liquids", str(named)) if known else None
    several = table.get("liquids")
    words = [title_of(document, liquid)] if liquid is not None and named != name else []
    if isinstance(several, tuple):
        words.append(f"{len(several)} liquids")
    delay_ms = table.get("delay_ms", 0)
    if isinstance(delay_ms, int | float):
        words.append(f"{delay_ms:g} ms late")
    valid = valid_part(study)
    protocol = valid.protocol if valid.forces else None
    if protocol is None or liquid is None or name not in protocol.conditions:
        return ConditionLine(liquid, ", ".join(words), UNKNOWN)
    found = steady(protocol.scene_for(str(name)))
    return ConditionLine(liquid, ", ".join(words), f"{found.force_n:.2f} N", found.limit is not None)


FACTS: Final = RowFacts((("Block", "conditions"),), condition_lines)
