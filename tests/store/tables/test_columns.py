from study_app.store.tables.cells import cell_pattern, variable
from study_app.store.tables.column import Column


def test_a_variable_is_a_property_value_with_unit_range_and_levels() -> None:
    duration = Column("duration_s", "number", "How long.", "s", minimum=0, may_miss=True)
    assert variable(duration) == {
        "@type": "PropertyValue",
        "name": "duration_s",
        "description": "How long.",
        "unitText": "s",
        "minValue": 0,
    }
    phase = Column("phase", "text", "What for.", levels=(("main", "analysed"), ("practice", "learning")))
    assert variable(phase)["description"] == "What for. Levels: main: analysed; practice: learning."
    assert cell_pattern(phase) == "(main|practice)"
