"""Tables for other programs: CSV, Parquet, SPSS, Psych-DS, and the codebook."""

from study_app.analysis.export.psychds_dataset import FOLDER
from study_app.analysis.export.table_files import Extra
from study_app.analysis.export.tables import exported_tables

__all__ = ["FOLDER", "Extra", "exported_tables"]
