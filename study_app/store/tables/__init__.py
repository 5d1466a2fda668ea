"""Tables of sessions and studies, their columns and descriptions."""

from study_app.store.tables.column_dictionary import table_markdown
from study_app.store.tables.session_tables import SessionRows, participant_row
from study_app.store.tables.study_files import (
    check_study,
    has_intervals,
    participant_rows,
    participants_of,
    refuse_earlier_columns,
    row_of,
    study_folders,
)

__all__ = [
    "SessionRows",
    "check_study",
    "has_intervals",
    "participant_row",
    "participant_rows",
    "participants_of",
    "refuse_earlier_columns",
    "row_of",
    "study_folders",
    "table_markdown",
]
