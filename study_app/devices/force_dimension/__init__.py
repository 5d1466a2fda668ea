"""Force Dimension's devices (omega, delta, sigma, lambda) and the Falcon, through the maker's installed library."""
