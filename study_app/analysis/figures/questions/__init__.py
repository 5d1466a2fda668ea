"""The figures of questions, one module each; a new one is a new module here."""
