"""The files of a study: journals, receipts, tables, recordings, sealed conditions, and their verification.

A session is begun, reopened and rebuilt in ``sessions``; while it runs, ``journals`` and ``recorder`` write its files.
``progress`` computes a session's progress from its journal; ``tables`` derives rows from it; ``verification`` proves
that files were not changed; ``blinded`` controls access to the conditions.
"""
