"""The tab *Measures*: what the open study can measure; some numbers are instant, others simulated.

Reading order: cards, levels, study_facts; simulation; measures_view; measures_page.
"""
