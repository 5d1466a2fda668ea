"""Before a study: how many participants it needs, how precise thresholds will be, and its preregistration.

Reading order: simulated_studies; smallest_differences, preregistration; power_curves; threshold_studies;
power_estimates.
"""

from typing import Final

MOST_PARTICIPANTS: Final = 1000
SIZES: Final = (5, 8, 12, 16, 20, 24)
"""Sample sizes of simulated studies, in addition to the planned one."""
STUDIES: Final = 1000
THRESHOLD_STUDIES: Final = 200
"""Simulated studies of each size: of statements, and of thresholds, d′, ratings or magnitude estimation."""
WANTED: Final = 0.8
"""The power at which detectable effects and required sample sizes are stated."""
