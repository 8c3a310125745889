"""ROS topics as CSV (``rostopic echo -p``, bagpy, PlotJuggler): headings from quaternions, times from two columns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gecar.reality.recordings.columns import Series
from gecar.reality.recordings.importing.table import ForeignTable


def with_plain_names(table: ForeignTable) -> ForeignTable:
    """Return a table with a heading [rad] in place of each quaternion, and times [s] in place of secs and nsecs.

    A planar robot's heading is 2 atan2(z, w). Tables without such columns come back as they are.
    """
    columns = {name: table.values[:, k] for k, name in enumerate(table.names)}
    if len(columns) < len(table.names):  # a name stands twice
        return table
    plain: dict[str, Series] = {}
    for name, values in columns.items():
        head, axis = name[:-1], name[-1]
        of_stamp = name.removesuffix("secs")
        if name.endswith("orientation" + name[-2:]) and axis == "z" and head + "w" in columns:
            plain[f"{head}yaw_rad"] = 2.0 * np.arctan2(values, columns[head + "w"])
        elif of_stamp != name and of_stamp + "nsecs" in columns:
            plain[f"{of_stamp}time_s"] = values + 1e-9 * columns[of_stamp + "nsecs"]
        elif not (name.endswith("nsecs") and name.removesuffix("nsecs") + "secs" in columns):
            plain[name] = values
    if list(plain) == list(table.names):
        return table
    return replace(table, names=tuple(plain), values=np.column_stack(list(plain.values())))
