"""The participant's window.

Reading order: pages; forms, intervals; tank; tank_widget; window.
"""
