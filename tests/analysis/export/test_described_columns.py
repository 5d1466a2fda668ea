"""Columns of one name in several tables: the description of the dataset is true of each of them."""

from study_app.analysis.export.psychds_dataset import variables
from study_app.store.tables.column import Column, optional


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
