"""A study as text and document: rows of its keys, edits that change only the affected bytes, undo. No Qt here.

Reading order: toml_text; toml_edits; fields, study; additions, elements; document, steps.
"""
