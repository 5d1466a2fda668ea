"""Designs of trials: one module per kind; a new kind is a new module here."""
