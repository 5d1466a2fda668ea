"""Concealed allocation: permuted blocks of participants, drawn from the sealed secret.

The participant with entry k of a folder is in the group at place k of permuted blocks. A permuted block holds every
group as often as its share says, shuffled by a stream of the secret. So groups of share 1 never differ by more than
one participant, and without the secret the next allocation cannot be predicted.
"""

from __future__ import annotations

from collections.abc import Mapping

from study_app.protocol.streams import shuffle
from study_app.protocol.trials.keyed import keyed_stream


def group_of(shares: Mapping[str, int], secret: bytes, entry: int) -> str:
    """Return the group of the participant with an entry.

    Parameters
    ----------
    shares : mapping of str to int
        Group → how often it comes in each permuted block; the order of the groups does not matter.
    secret : bytes
        The nonce of the sealed key.
    entry : int
        Which participant of the folder it is, from 1.
    """
    groups = [name for name in sorted(shares) for _ in range(shares[name])]
    block, place = divmod(entry - 1, len(groups))
    return shuffle(groups, keyed_stream(secret, f"groups/{block + 1}").random)[place]
