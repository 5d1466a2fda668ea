"""A table that is handed out: its columns and its frame, and what every table says of whether its rows count."""

from dataclasses import dataclass
from typing import Final

import pandas as pd

from study_app.analysis.tables.study_tables import Study
from study_app.store.tables.columns import PARTICIPANTS
from study_app.store.tables.csv_files import Column, header, optional

_STATUS: Final = next(column for column in PARTICIPANTS if column.name == "status")

JUDGED: Final = (
    Column("session_status", "text", "How the row's session ended.", levels=_STATUS.levels),
    Column("excluded", "flag", "true where exclusions.csv leaves out the row's session or trial."),
    optional("exclusion_reason", "text", "Why it is left out."),
    Column(
        "counted",
        "flag",
        "true where the row is in the aggregate and the figures: main trial, completed session, last attempt, not "
        "excluded.",
    ),
)


@dataclass(frozen=True, eq=False)
class Delivered:
    """A table: its name, its columns in their order, and a frame that has them."""

    name: str
    columns: tuple[Column, ...]
    frame: pd.DataFrame


SITE: Final = Column("site", "text", "The site whose participant this is: the part of the ID before the dash.")


def with_site(study: Study, table: Delivered) -> Delivered:
    """Return a table of a merged study with the column ``site`` after that of participants; any other as it is."""
    if not study.sites or "participant" not in header(table.columns):
        return table
    place = header(table.columns).index("participant") + 1
    sites = pd.array([study.site_of(str(one)) for one in table.frame["participant"]], dtype="string")
    columns = (*table.columns[:place], SITE, *table.columns[place:])
    return delivered(table.name, columns, table.frame.assign(site=sites))


def delivered(name: str, columns: tuple[Column, ...], frame: pd.DataFrame) -> Delivered:
    """Return a table with these columns of a frame."""
    return Delivered(name, columns, frame[list(header(columns))])
