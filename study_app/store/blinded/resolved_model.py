"""The force model as resolved in a session: stored in its receipt, so that resume and replay do not resolve it again.

A file may leave the choice of effects and laws to the program (``effects = "auto"``) and its estimator to the format's
default; another version of the program may choose otherwise. The receipt's protocol names the estimator. Effects and
laws of each liquid reveal a condition: the receipt contains them as one sealed text, ``resolved``. Where a stimulus
varies a liquid, the file names its effects, so they hold at every level.
"""

from collections.abc import Mapping
from typing import Any

from study_app.errors import StoreError
from study_app.haptics.model.effects import EFFECTS
from study_app.haptics.model.gate import resolve
from study_app.protocol.model import Protocol, SceneDefaults, StudyLiquid
from study_app.store.blinded.blinding import Key
from study_app.store.blinded.sealing import open_text, seal


def sealed_model(protocol: Protocol, participant: str, session: int, key: Key) -> str:
    """Return effects and chosen laws of each liquid, sealed for one session."""
    return seal(_whose(participant, session), {"liquids": _resolved(protocol)}, key)


def as_recorded(protocol: Protocol, receipt: Mapping[str, Any], key: Key) -> Protocol:
    """Return the protocol with the estimator, effects and laws that a session's receipt records.

    Receipts of earlier versions record the estimator alone.

    Raises
    ------
    StoreError
        What is sealed in the receipt was changed, or is of another session.
    """
    recorded: dict[str, Any] = {}
    if (text := receipt.get("resolved")) is not None:
        whose = _whose(receipt["participant"], receipt["session"])
        opened = open_text(whose, str(text), key, frozenset({"liquids"}))
        if not opened:
            raise StoreError(
                f"the receipt of {receipt['participant']} cannot be decrypted with the study's key (resolved): it was "
                "changed; restore it from a copy"
            )
        recorded = opened["liquids"]
    liquids = {name: _changed(liquid, recorded.get(name, {})) for name, liquid in protocol.liquids.items()}
    velocity = receipt["protocol"]["scene"]["velocity"]
    scene = SceneDefaults.model_validate(protocol.scene.model_dump() | {"velocity": velocity})
    return protocol.model_copy(update={"liquids": liquids, "scene": scene})


def _resolved(protocol: Protocol) -> dict[str, Any]:
    chosen = [effect.name for effect in EFFECTS if effect.choose is not None]
    found = {}
    for name in sorted(protocol.liquids):
        (liquid,) = resolve(protocol.scene_of(name)).liquids
        laws = {table: getattr(liquid, table).model_dump(mode="json") for table in chosen}
        found[name] = {"effects": list(liquid.effects), **laws}
    return found


def _changed(liquid: StudyLiquid, recorded: Mapping[str, Any]) -> StudyLiquid:
    return StudyLiquid.model_validate(liquid.model_dump() | dict(recorded)) if recorded else liquid


def _whose(participant: str, session: int) -> list[object]:
    return ["resolved", participant, session]
