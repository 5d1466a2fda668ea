"""A table that is handed out as CSV and as Parquet."""

import io

from study_app.analysis.export.delivered import Delivered
from study_app.store.tables.csv_files import csv_bytes, header


def table_bytes(table: Delivered) -> bytes:
    """Return a table as CSV, as `csv_bytes` writes it."""
    plain = table.frame.astype(object).where(table.frame.notna(), None)
    return csv_bytes(
        table.columns, (dict(zip(header(table.columns), row, strict=True)) for row in plain.itertuples(index=False))
    )


def parquet_bytes(table: Delivered) -> bytes:
    """Return a table as Parquet; every column with its description and unit, points of a scale as Int8."""
    import pyarrow as pa  # type: ignore[import-untyped]  # noqa: PLC0415 - takes long to load
    from pyarrow import parquet  # noqa: PLC0415

    types = {"integer": pa.int64(), "number": pa.float64(), "flag": pa.bool_()}
    fields = [
        pa.field(
            one.name,
            pa.int8() if one.kind == "integer" and (one.maximum or 128) < 128 else types.get(one.kind, pa.string()),
            metadata={name: text for name in ("description", "unit") if (text := getattr(one, name))},
        )
        for one in table.columns
    ]
    target = io.BytesIO()
    frame = pa.Table.from_pandas(table.frame, schema=pa.schema(fields), preserve_index=False, safe=True)
    parquet.write_table(frame, target, compression="zstd")
    return target.getvalue()
