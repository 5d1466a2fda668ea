"""An own observer runs a session of viscosityjnd without windows: python own_observer.py RESULTS."""

import math
import random
import sys
from pathlib import Path

from study_app import api

NOISE = 0.12  # of the logarithm of the resistance in one interval


def observer_with(noise, seed):
    """Return an observer that compares force per speed, with noise of its own."""
    draw = random.Random(seed)

    def observer(question):
        if len(question.felt) < 2:  # a form: as the simulated participant answers
            return None
        first, second = (
            math.log(one.force_mean_n / one.speed_rms_mps) + draw.gauss(0.0, noise) for one in question.felt
        )
        return "first" if first > second else "second"

    return observer


def main(results, study="viscosityjnd"):
    """Run a session, open the key, and return the participant's thresholds."""
    answer = observer_with(NOISE, seed=3)
    with api.open_session(
        study, "P001", results=results, seed=7, answer=answer, recordings=False
    ) as session:  # left early, the same call resumes it
        session.run()
    api.unblind(results, by="own_observer.py", reason="simulated")
    return api.read(results)["thresholds"]


if __name__ == "__main__":
    print(main(Path(sys.argv[1]))[["participant", "threshold", "low", "high", "n"]])
