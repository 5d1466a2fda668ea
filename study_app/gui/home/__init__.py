"""Home: which studies there are, which sessions were held, and the way into the next."""
