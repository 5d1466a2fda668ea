"""The force on a ball in a viscous liquid by a fluid solver, a reference that is independent of our models.

``solved_cases`` has the liquids and motions, ``flow`` solves them (with the extra ``cfd``), ``solver`` checks and
stores the results: the ``*.csv`` in this folder, which ``stored_flows`` reads without the extra. ``fits`` and
``law_fit`` fit models to them and report how well they agree.

Reading order: flow, score, solved_cases; stored_flows; fits, solver; law_fit, yield_flow.
"""
