import re

import pytest

from study_app.haptics.model.layout import LIMITER_NAMES
from study_app.store.tables.cells import cell_pattern, variable
from study_app.store.tables.column import Column, header
from study_app.store.tables.columns import TABLES, every_column


@pytest.mark.parametrize("table", TABLES)
def test_names_are_plain_and_unique(table: str) -> None:
    names = header(TABLES[table])
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[a-z][a-z0-9_]*", name) for name in names)


def test_columns_of_one_name_mean_the_same_in_every_table() -> None:
    for columns in TABLES.values():
        for column in columns:
            assert column in every_column()
    assert len({column.name for column in every_column()}) == len(every_column())


def test_every_column_is_described_in_a_sentence() -> None:
    for column in every_column():
        assert len(column.description) > 5
        assert column.description.endswith(".") or column.name == "outcome", column.name


def test_numbers_that_have_a_unit_carry_it_in_name_and_unit() -> None:
    units = {"_s": "s", "_ms": "ms", "_hz": "Hz", "_m": "m", "_mps": "m/s", "_n": "N"}
    for column in every_column():
        ending = re.search(r"_[a-z]+$", column.name)
        assert column.unit == (units.get(ending[0], "") if ending and column.kind == "number" else "")


def test_every_limiter_is_counted() -> None:
    assert {f"limiter_{name}" for name in LIMITER_NAMES} < set(header(TABLES["trials"]))


def test_responses_and_trials_name_what_the_contract_names() -> None:
    assert " ".join(header(TABLES["responses"])) == (
        "study participant session simulated pilot trial attempt block phase part index code item number response "
        "cannot_judge onset_s first_choice_s last_change_s changes answered_at"
    )


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
