"""The kinds of questions, one module each; a new kind is a new module here and its widget."""
