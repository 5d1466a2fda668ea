"""The form of one element: its rows, and the fields that edit them.

Reading order: rows, design_list; fields; drawn_fields, lists, special, head_and_foot; card; form.
"""
