"""What a study can find, while it is made: numbers for the designer, some instant and some simulated."""
