"""Screens, graphics card and frame clock."""
