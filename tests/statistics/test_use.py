"""Hours at which nobody looked are in the interval."""

from datetime import UTC

import numpy as np

from objstate.statistics.two_state import Looks
from objstate.statistics.use import use_of

DAY = 86400
MONDAY = 18267 * DAY  # 6 January 2020


def test_looks_in_office_hours_tell_little_of_the_night() -> None:
    rng = np.random.default_rng(0)
    hours = np.sort(rng.uniform(8, 18, (10, 4)), axis=1)
    days = np.array([0, 1, 2, 3, 4, 7, 8, 9, 10, 11])
    times = MONDAY + (days[:, None] * 24 + hours).ravel() * 3600
    looks = Looks((times * 1e9).astype(np.int64), rng.random(40) < 0.4)
    use = use_of(looks.summed(), UTC)
    assert use.share_open_seen.lower < 0.4 < use.share_open_seen.upper
    assert use.share_open.lower < 0.6 * use.share_open_seen.lower
    assert use.share_open.upper > 0.3
    wide, narrow = (each.upper - each.lower for each in (use.share_open, use.share_open_seen))
    assert wide > narrow
    assert 0 < use.moves_per_day.lower < use.moves_per_day.upper


def test_a_door_that_was_never_seen_to_move_may_have_moved_unseen() -> None:
    daily = Looks((MONDAY + np.arange(14) * DAY + 36000) * 10**9, np.zeros(14, dtype=bool))
    assert use_of(daily.summed(), UTC).moves_per_day.upper > 1
    watched = Looks((MONDAY + np.arange(0, DAY, 60)) * 10**9, np.zeros(DAY // 60, dtype=bool))
    assert use_of(watched.summed(), UTC).share_open_seen.value < 0.05
