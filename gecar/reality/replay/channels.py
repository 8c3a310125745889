"""The channels residuals are of, and where each residual comes from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

CHANNELS = ("left_angle", "right_angle", "battery", "yaw_rate", "x", "y", "heading", "reflection")
ENCODERS, BATTERY, POSE, REFLECTION = (0, 1), 2, (4, 5, 6), 7


@dataclass(frozen=True)
class ResidualIndex:
    """Where each residual comes from.

    Attributes
    ----------
    recording, channel
        Numbers of its recording and of its channel in `CHANNELS`, shape (n,).
    t_s
        Time since its recording began [s], shape (n,).
    """

    recording: npt.NDArray[np.int32]
    channel: npt.NDArray[np.int32]
    t_s: npt.NDArray[np.float64]

    def kept(self, mask: npt.NDArray[np.bool_]) -> ResidualIndex:
        """Return the entries of some residuals."""
        return ResidualIndex(self.recording[mask], self.channel[mask], self.t_s[mask])
