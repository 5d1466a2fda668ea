"""The form of one element: its rows, and the fields that edit them.

Reading order: rows; fields; drawn_fields, lists, special; card; form.
"""
