"""What a habit is learnt from: moments, and how likely each region was what was seen then."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.geometry import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class RegionLooks:
    """Looks at one door, in time order."""

    stamps_ns: IntArray  # (n,)
    likelihood: FloatArray  # (n, r) of what was seen, given each region; 1 at the largest

    @staticmethod
    def of(stamps_ns: IntArray, likelihood: FloatArray) -> RegionLooks:
        """Looks in any order, with likelihoods of any scale."""
        order = np.argsort(stamps_ns, kind="stable")
        scaled = np.asarray(likelihood, dtype=float)[order]
        most = scaled.max(axis=1, keepdims=True, initial=0.0)
        scaled = np.where(most > 0.0, scaled / np.where(most > 0.0, most, 1.0), 1.0)
        return RegionLooks(np.asarray(stamps_ns, dtype=np.int64)[order], scaled)

    @staticmethod
    def certain(stamps_ns: IntArray, regions: IntArray, count: int) -> RegionLooks:
        """Looks that told the region (n,) out of ``count``."""
        return RegionLooks.of(stamps_ns, np.eye(count)[np.asarray(regions, dtype=np.int64)])

    def __len__(self) -> int:
        return len(self.stamps_ns)

    def part(self, chosen: slice) -> RegionLooks:
        """Some of them."""
        return RegionLooks(self.stamps_ns[chosen], self.likelihood[chosen])
