"""Output to other programs while a session runs: markers of its events, and the servo's samples.

``session_outlets`` opens and closes all of them, ``markers`` decides what is sent, ``sinks`` sends it.
"""
