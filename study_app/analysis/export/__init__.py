"""Tables for other programs: CSV, Parquet, SPSS, Psych-DS, and the codebook."""
