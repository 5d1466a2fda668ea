"""Colours, fonts and icons of every window."""
