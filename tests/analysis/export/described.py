"""What a dataset's description lacks of its tables."""

import csv
import json
from pathlib import Path


def undescribed(folder: Path) -> set[str]:
    """Return the columns of the dataset's tables without a description, and descriptions without a column."""
    variables = {
        variable["name"]
        for variable in json.loads((folder / "dataset_description.json").read_bytes())["variableMeasured"]
    }
    tables = list((folder / "data").rglob("*_data.csv"))
    assert tables
    column_names = {
        name for path in tables for name in next(csv.reader([path.read_text(encoding="utf-8").split("\n")[0]]))
    }
    return variables ^ column_names
