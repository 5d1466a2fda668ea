"""A session's orders made again from its receipt and compared with its journal; the key stays sealed."""

from __future__ import annotations

from pathlib import Path

from study_app.errors import StoreError
from study_app.protocol.orders.reproduce import recorded_trials, reproduce
from study_app.store import receipt
from study_app.store.folders import locate
from study_app.store.journals import journal


def reproduced(session_folder: Path) -> tuple[str, ...]:
    """Return how the orders of trials and items that were run differ from those the receipt gives: () if nowhere.

    Raises
    ------
    StoreError
        It is no session's folder, or its receipt or journal cannot be read.
    """
    _, folder = locate(session_folder)
    ran = receipt.read(folder.receipt)
    try:
        recorded = recorded_trials(journal.read(folder.journal))
        complete = ran["status"] == "completed"
        return reproduce(ran["protocol"], ran["seed"], ran["participant"], recorded, complete=complete)
    except (KeyError, TypeError) as error:
        raise StoreError(f"{folder.path}: receipt or journal lack {error}: verify the study's folder") from error
