"""Results: which sessions count, what they say, and how to hand it on."""
