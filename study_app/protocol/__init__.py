"""Protocols: a TOML file becomes a frozen value; the value, participant and seed give a schedule.

``load`` reads and checks a file, ``model`` is the value, and ``orders.schedule`` makes its trials; read these first.
``checks`` finds what no type can express, ``trials`` has designs, stimuli and methods.
"""
