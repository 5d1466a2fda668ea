"""Output to other programs while a session runs: markers of its events, and samples of the servo.

``session_outlets`` opens and closes all of them, ``markers`` decides what is sent, and ``sinks`` sends it; read these
first. ``streams`` sends samples over the Lab Streaming Layer. Nothing here may delay the servo or stop a session.

Public modules: markers, session_outlets, streams.
"""
