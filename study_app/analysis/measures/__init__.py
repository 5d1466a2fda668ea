"""What is computed of the answers to a question, one module for each measure; a new one is a new module here."""
