"""Orders from a square: Williams designs and cyclic Latin squares, and which participant takes which row.

A Williams design (Williams 1949, Australian Journal of Scientific Research A 2, 149) of n codes is the sequence 0, 1,
n − 1, 2, n − 2, … with each of 0 … n − 1 added modulo n; for odd n also with every row reversed. Once through its rows,
n or 2n, each code comes in each position equally often and follows each other one equally often. A cyclic Latin square
is 0, 1, …, n − 1 with each shift: even in positions alone.

**Repetitions** go on in the same square. Where a row ends and the next begins, the new row is chosen by how far its
first code lies from the last one shown: 1, 2, …, n − 1 and round again (backwards in a reversed square). So no code
follows itself, each repetition is as even as the first, and after as many repetitions as `borders_even` says the
borders between them are even too.

**Rows** are assigned by enrolment: the last number in the participant's id (P007 is number 7). Numbers 1 … rows are the
first round, the next as many the second; each round assigns all rows in an order of its own. That order comes from a
stream of the *study*, not of the session, because sessions have seeds of their own and would not fill a round. So a
session's row depends on the study's name, the block's name and the id alone. It is predictable, which does no harm:
rows are rows of codes, and what a code stands for is sealed. An id without a number takes a row drawn from the id
itself: even on average only. Who replaces a participant can be given that participant's rows: the session then takes
the rows of that id.
"""

from __future__ import annotations

import re
from typing import Literal, TypeAlias

from study_app.protocol.streams import shuffle, study_stream

Square: TypeAlias = Literal["williams", "latin"]


def row_count(square: Square, codes: int) -> int:
    """Return how many rows there are: as many participants fill a round."""
    return 2 * codes if square == "williams" and codes % 2 and codes > 1 else codes


def row(square: Square, codes: int, number: int, repetitions: int = 1) -> tuple[int, ...]:
    """Return row ``number`` (from 0): codes as numbers from 0, each once in every repetition."""
    if codes == 1:
        return (0,) * repetitions
    reversed_square, shift = divmod(number, codes)
    base = _williams(codes) if square == "williams" else tuple(range(codes))
    if reversed_square:
        base = base[::-1]
    shown = tuple((code + shift) % codes for code in base)
    for border in range(repetitions - 1):
        distance = 1 + border % (codes - 1)
        first = shown[-1] + (-distance if reversed_square else distance)
        shown += tuple((code - base[0] + first) % codes for code in base)
    return shown


def _williams(codes: int) -> tuple[int, ...]:
    """Return 0, 1, n − 1, 2, n − 2, …: its n − 1 steps from one to the next are all different."""
    return tuple((step + 1) // 2 if step % 2 else -(step // 2) % codes for step in range(codes))


def borders_even(codes: int, repetitions: int) -> bool:
    """Return whether a Williams design's carry-over is even across the borders of its repetitions too."""
    period = (codes - 1) // 2 if codes % 2 else codes - 1
    return codes == 1 or (repetitions - 1) % period == 0


def enrolment(participant: str) -> int | None:
    """Return the number in a participant's id, the last one if there are several; None if there is none."""
    numbers = re.findall(r"[0-9]+", participant)
    return int(numbers[-1]) if numbers else None


def assigned_row(study: str, block: str, rows: int, participant: str) -> int:
    """Return the row (from 0) that a participant takes in a block of a study."""
    number = enrolment(participant)
    if number is None:
        return int(study_stream(study, f"row/{block}/{participant}").random() * rows)
    rounds, place = divmod(number - 1, rows)
    return shuffle(range(rows), study_stream(study, f"rows/{block}/{rounds}").random)[place]
