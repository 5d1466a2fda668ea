"""Widgets that several windows share.

Reading order: accessible, background, boxes, live_plots, main_view; labels; cards; controls, numbers, row_table.
"""
