"""Tables as Parquet: whole numbers stay whole where some are missing, and every column carries its description.

Answers are Int8, not ordered categories: categories of whole numbers come back as floats without their order.
"""

import io
from typing import Final

import pyarrow as pa  # type: ignore[import-untyped]
from pyarrow import parquet

from study_app.analysis.export.delivered import Delivered
from study_app.store.tables.column import Column

_TYPES: Final = {
    "text": pa.string(),
    "time": pa.string(),
    "integer": pa.int64(),
    "number": pa.float64(),
    "flag": pa.bool_(),
}


def parquet_bytes(table: Delivered) -> bytes:
    """Return a table as a Parquet file; the same table gives the same bytes."""
    fields = [_field(column) for column in table.columns]
    held = pa.Table.from_pandas(table.frame, schema=pa.schema(fields), preserve_index=False, safe=True)
    target = io.BytesIO()
    parquet.write_table(held, target, compression="zstd")
    return target.getvalue()


def _field(column: Column) -> pa.Field:
    """Return a column's type, as small as its range permits, with its description."""
    kind = _TYPES[column.kind]
    if column.kind == "integer" and column.maximum is not None and column.maximum <= 127:
        kind = pa.int8()
    texts = {"description": column.description, "unit": column.unit}
    return pa.field(column.name, kind, metadata={name: text for name, text in texts.items() if text})
