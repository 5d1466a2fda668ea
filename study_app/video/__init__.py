"""Videos behind the tank's ball and targets: live from a camera, or footage from a file (optional extra ``video``).

``sources`` has cameras and footage with their threads, ``frames`` the pictures as values and their statistics in a
trial, and ``decoding`` alone imports PyAV; read these first.

Public modules: encoding, frames, sources.
"""
