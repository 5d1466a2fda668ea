"""The protocol of a session, combined from its receipt and the study's key."""

from collections.abc import Mapping
from typing import Any, Final

from study_app.protocol.model import Protocol
from study_app.store.blinded.blinding import Key

_OF_RECEIPT: Final = ("codes", "slots", "order", "compares")
"""Keys that a receipt adds to a block with a design."""


def whole_protocol(published: Mapping[str, Any], key: Key) -> Protocol:
    """Return the protocol of a receipt completed from the key.

    Raises
    ------
    KeyError, TypeError, AttributeError, ValueError
        They give no protocol that this version knows.
    """
    blocks = {name: dict(block) for name, block in published["blocks"].items()}
    questionnaires = dict(published["questionnaires"])
    for name, block in blocks.items():
        if (design := key.tables.get("blocks", {}).get(name)) is not None:
            questionnaires.pop(block.pop("questionnaire"), None)
            for written in (*_OF_RECEIPT, *(("repetitions",) if design.get("stimulus") else ())):
                block.pop(written, None)
            block |= {what: value for what, value in design.items() if value}
        else:
            block["conditions"] = [key.condition(name, code) for code in block.pop("codes")]
    tables = {name: table for name, table in key.tables.items() if name != "blocks"}
    if "analysis" in tables:
        tables["analysis"] = {**published["analysis"], **tables["analysis"]}
    whole = {**published, **tables, "questionnaires": questionnaires, "blocks": blocks}
    if not whole.get("sequence"):  # each group has its own, or each session
        whole.pop("sequence", None)
    return Protocol.model_validate(whole)
