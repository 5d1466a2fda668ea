"""Texts of figures: titles, n, and captions that can be read without the report."""

from collections import Counter
from typing import Final

import pandas as pd

from study_app.analysis.figures.small_multiples import line_words
from study_app.analysis.tables.compared_blocks import Block
from study_app.analysis.tables.measures import QUARTILES
from study_app.analysis.tables.study_tables import Study

REASONS: Final = 5
REASON_SIGNS: Final = 80
"""How many reasons for exclusions a caption names; the codebook of an export holds all."""

FILES: Final = 3
"""Of files that are not as recorded so many are named."""

_NUMBERS: Final = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


def title(block: Block) -> str:
    """Return the heading of a block's figure."""
    if block.kind == "delays":
        return "Answers over added delay" if block.revealed else "Answers by delay setting"
    return f"Agreement for each {_noun(block)}"


def counts(study: Study, block: Block) -> list[str]:
    """Return what a figure says about n and about answers that are missing, the longest wording first."""
    people = people_a_setting(study, block)
    n = len(set(study.answers(block)["participant"]))
    gaps, missing = _missing(study, block)
    if set(people.values()) != {n}:
        low, high = min(people.values()), max(people.values())
        short = f"n = {low} to {high} of {n} participants" if low < high else f"n = {low} of {n} participants"
        whole, least = f"{short} in a {_noun(block)}", f"n = {low}–{high}"
    else:
        short, least = f"n = {n} participant" + ("s" if n != 1 else ""), f"n = {n}"
        presented = set(study.presented(block).values())
        whole = f"{short}, {_listed(presented)} presentations of a {_noun(block)}"
        if presented == {n}:
            whole = f"{short}, every {_noun(block)} {'presented to' if gaps else 'rated by'} all" if n > 1 else short
    return [f"{whole}{gaps}", *([f"{whole}{missing}"] if gaps else []), f"{short}{missing}", f"{least}{missing}"]


def _missing(study: Study, block: Block) -> tuple[str, str]:
    """Return how many of the ratings that were asked for are not there, in more and in fewer words; empty if none."""
    table = study.aggregate(block)
    there, asked = int(table["n"].sum()), int(table["presented"].sum())
    if there == asked:
        return "", ""
    return f", {asked - there} of {asked} ratings missing", f", {asked - there} missing"


def people_a_setting(study: Study, block: Block) -> dict[str, int]:
    """Return how many participants were presented each setting of a block."""
    rows = _counted_trials(study, block)
    return {code: int(rows.loc[rows["code"] == code, "participant"].nunique()) for code in block.codes}


def foot(block: Block) -> str:
    """Return the line under the plots over delay."""
    scale = f"1 = {block.labels[0]}, 7 = {block.labels[-1]}."
    if block.revealed:
        return f"Added delay, ms.   {scale}"
    return f"Delay settings by code; the order of the codes says nothing.   {scale}"


def caption(study: Study, block: Block) -> str:
    """Return the caption of a block's figure."""
    return " ".join(sentence for sentence in _sentences(study, block) if sentence)


def _sentences(study: Study, block: Block) -> list[str]:
    statements = f"{_number(len(block.items))} statement" + ("s" if len(block.items) != 1 else "")
    settings = f"{_number(len(block.settings))} {_noun(block)}" + ("s" if len(block.settings) != 1 else "")
    simulated = "SIMULATED participants, no people; " if study.simulated else ""
    start = f"{'Pilot. ' if study.pilot else ''}Agreement with {statements} on {settings}"
    head = f"{start} ({simulated}{counts(study, block)[0]})."
    drawn = _plots(study, block) if block.kind == "delays" else _bars(block)
    gone = [_left_out(study), _excluded_sessions(study), _excluded_trials(study, block)]
    return [
        head,
        *drawn,
        _blinded(study),
        _achieved(study, block),
        _unanswered(study, block),
        *gone,
        _invalid(study, block),
        _doubtful(study),
    ]


def _bars(block: Block) -> list[str]:
    return [
        "Bars: number of answers, disagreement left and agreement right of the line; neutral answers apart in grey, on "
        "the same scale.",
        "Numbers: counts of answers; a segment too narrow for its number carries none (all counts are in the exported "
        "aggregate table). n next to a bar: valid answers where some are missing.",
        f"Levels, from 1 to 7: {', '.join(block.labels)}.",
    ]


def _plots(study: Study, block: Block) -> list[str]:
    quartiles = f"the middle half of the answers; quartiles {QUARTILES}."
    scale = f"Answers from 1 ({block.labels[0]}) to 7 ({block.labels[-1]})."
    if block.revealed:
        return [
            f"Thin lines: {line_words(len(set(study.answers(block)['participant'])))}, slightly apart in height where "
            f"they coincide; thick line: median; band: {quartiles}",
            scale,
        ]
    return ["Dots: participants, equal answers side by side; ring: median; band: " + quartiles, scale]


def _blinded(study: Study) -> str:
    if study.revealed:
        return ""
    return "Settings are shown by code in the order of the codes, since the key is sealed; the order says nothing."


def _achieved(study: Study, block: Block) -> str:
    """Say how far the delays that were shown differed from those on the axis."""
    errors = _counted_trials(study, block)["delay_error_mean_ms"].dropna()
    if block.kind != "delays" or not block.revealed or errors.empty:
        return ""
    return (
        "The axis shows the delay asked for; the delay achieved differed from it by "
        f"{errors.mean():+.1f} ms on average (trials: {errors.min():+.1f} to {errors.max():+.1f} ms)."
    ).replace("-", "−")


def _unanswered(study: Study, block: Block) -> str:
    table = study.aggregate(block)
    return f"Cannot judge: {table['cannot_judge'].sum()}; not answered: {table['missing'].sum()}."


def _left_out(study: Study) -> str:
    if not study.left_out:
        return ""
    sessions = "session is" if study.left_out == 1 else "sessions are"
    return f"{study.left_out} {sessions} left out, not having been completed."


def _excluded_sessions(study: Study) -> str:
    rows = study.excluded_sessions
    if rows.empty:
        return ""
    sessions = "session is" if len(rows) == 1 else "sessions are"
    return f"{len(rows)} {sessions} excluded ({_reasons(rows)})."


def _excluded_trials(study: Study, block: Block) -> str:
    """Say which cells of the figure are empty, the session of each being in it."""
    rows = study.excluded_trials(block)
    if rows.empty:
        return ""
    answers = "trial is excluded, its answers" if len(rows) == 1 else "trials are excluded, their answers"
    return f"{len(rows)} {answers} missing here ({_reasons(rows)})."


def _reasons(rows: pd.DataFrame) -> str:
    """List why rows are excluded: each reason once, with its number where it is not the only one."""
    counted = Counter(_shortened(str(reason)) for reason in rows["exclusion_reason"].fillna("no reason given"))
    reasons = [f"{count} × {reason}" if len(counted) > 1 else reason for reason, count in counted.most_common(REASONS)]
    more = sum(counted.values()) - sum(count for _, count in counted.most_common(REASONS))
    return "; ".join([*reasons, *([f"{more} × other"] if more else [])])


def _shortened(reason: str) -> str:
    words = " ".join(reason.split())
    return words if len(words) <= REASON_SIGNS else f"{words[: REASON_SIGNS - 1].rstrip()}…"


def _invalid(study: Study, block: Block) -> str:
    rows = _counted_trials(study, block)
    invalid = int((~rows["valid"].fillna(value=True)).sum())
    if not invalid:
        return ""
    return f"{invalid} of {len(rows)} trials exceeded the protocol's limits of timing and are included."


def _doubtful(study: Study) -> str:
    if not study.doubts:
        return ""
    names = sorted({doubt.path.relative_to(study.folder).as_posix() for doubt in study.doubts})
    more = f" and {len(names) - FILES} more" if len(names) > FILES else ""
    files = "file is" if len(names) == 1 else "files are"
    return f"{len(names)} {files} not as recorded, and used as found: {', '.join(names[:FILES])}{more}."


def _counted_trials(study: Study, block: Block) -> pd.DataFrame:
    return study.trials[study.trials["counted"] & (study.trials["block"] == block.id)]


def _noun(block: Block) -> str:
    return block.kind.removesuffix("s") if block.revealed else "setting"


def _number(count: int) -> str:
    return _NUMBERS[count] if count < len(_NUMBERS) else str(count)


def _listed(values: set[int]) -> str:
    low, high = min(values), max(values)
    return str(low) if low == high else f"{low} to {high}"
