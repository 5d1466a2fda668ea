"""The tab *Measures*: what the open study can find, some numbers at once and some simulated.

Reading order: cards, levels, study_facts; simulation; measures_view; measures_page.
"""
