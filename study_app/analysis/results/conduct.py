"""How the study was run: whether delays were what they should be, and in which orders settings came."""

from collections.abc import Iterator

import pandas as pd

from study_app.analysis.results.delivered_delay import Delivered
from study_app.analysis.tables.compared_blocks import Block
from study_app.analysis.tables.study_tables import Study
from study_app.protocol.orders.balance import Evenness, evenness


def delivered(study: Study) -> tuple[Delivered, ...]:
    """Return the check of the manipulation: by setting, or over all settings of a block while they are sealed.

    Errors by code would tell little, and delays nothing may tell before the key is opened.
    """
    return tuple(one for block in study.blocks for one in _delivered(study, block))


def _delivered(study: Study, block: Block) -> Iterator[Delivered]:
    rows = study.trials[study.trials["counted"] & (study.trials["block"] == block.id)]
    if not block.revealed:
        yield _measured(block, None, None, rows)
        return
    for setting in block.settings:
        yield _measured(block, setting.code, setting.delay_ms, rows[rows["code"] == setting.code])


def _measured(block: Block, code: str | None, delay_ms: float | None, rows: pd.DataFrame) -> Delivered:
    errors = rows["delay_error_mean_ms"].dropna().astype(float)
    mean = float(errors.mean()) if len(errors) else None
    return Delivered(
        block=block.id,
        code=code,
        delay_ms=delay_ms,
        trials=len(rows),
        measured=len(errors),
        judged=int(rows["valid"].notna().sum()),
        valid=int(rows["valid"].fillna(value=False).sum()),
        error_mean_ms=mean,
        error_worst_ms=float(errors.iloc[errors.abs().argmax()]) if len(errors) else None,
        achieved_ms=None if delay_ms is None or mean is None else delay_ms + mean,
    )


def orders(study: Study) -> dict[str, Evenness]:
    """Return how even the orders of trials were, as run (block id → counts), excluded trials included.

    Of a merged study that is sealed nothing is known, since each site has codes of its own.
    """
    if study.sites and not study.revealed:
        return {}
    here = study.participants.loc[study.participants["counted"], ["participant", "session"]]
    rows = study.trials[study.trials["phase"] == "main"].merge(here, on=["participant", "session"])
    rows = rows.drop_duplicates(["participant", "session", "trial"], keep="last")
    rows = rows.sort_values(["participant", "session", "index"])
    return {
        block.id: evenness(
            block.codes_as_dealt,
            [
                list(map(str, session["code"]))
                for _, session in rows[rows["block"] == block.id].groupby(["participant", "session"])
            ],
        )
        for block in study.blocks
    }
