"""Columns of one name in several tables: the description of the dataset is true of each of them."""

from study_app.analysis.export.psychds_dataset import variables
from study_app.store.tables.cells import variable
from study_app.store.tables.column import Column, optional
from study_app.store.tables.level_columns import EXPONENTS, SETTINGS, THRESHOLDS


def test_a_column_that_tables_define_differently_has_the_definition_of_each() -> None:
    tables = {"thresholds": THRESHOLDS, "settings": SETTINGS, "exponents": EXPONENTS}
    described = variables({f"study-x_description-{name}_data.csv": columns for name, columns in tables.items()})
    found = {one["name"]: one["description"] for one in described}
    assert len(found) == len(described)
    assert found["n"] == "In thresholds: Answers that count. In settings: Settings that count."
    assert found["low"] == (
        "In thresholds: Lower end of the threshold's equal-tailed 95 % interval. "
        "In settings: Lower end of the 95 % interval of the PSE (Student's t)."
    )
    assert found["block"] == "Id of the block."
    for columns in tables.values():
        for column in columns:
            assert variable(column)["description"] in found[column.name]


def test_units_and_ranges_hold_in_every_table() -> None:
    (one,) = variables(
        {
            "study-x_description-a_data.csv": (Column("n", "integer", "Points.", "s", minimum=1, maximum=7),),
            "study-x_description-b_data.csv": (optional("n", "number", "Seconds.", minimum=0),),
            "study-x_description-c_data.csv": (optional("n", "number", "Points.", minimum=2, maximum=9),),
        }
    )
    assert one == {
        "@type": "PropertyValue",
        "name": "n",
        "description": "In a, c: Points. In b: Seconds.",
        "minValue": 0,
    }
