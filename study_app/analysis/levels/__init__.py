"""Blocks of levels: their tracks, and each statistic of participants and groups as one declaration.

Reading order: columns, tracks; statistic; answers, conduct; evaluate, thresholds; exponents; sensitivities.
"""
