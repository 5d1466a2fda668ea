"""The small sound protocol with mistakes, and what check says of each."""

from tests.protocol.edited_studies import CASES as FOLDER
from tests.protocol.edited_studies import Case, cases_of

__all__ = ["CASES", "Case"]

CASES = tuple(cases_of(FOLDER / "sound.txt"))
