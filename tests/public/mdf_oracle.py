"""MDF oracle: reads an MDF file by mdfreader, a library that the product does not use.

It runs in a Python that has mdfreader and imports nothing of the product:
`python mdf_oracle.py FILE N` prints the first N numeric channels (by name, without masters) as
JSON: `{name: {"count": number of samples, "values": first values, "times": first stamps [s]}}`.
"""

from __future__ import annotations

import json
import sys
from typing import Any

MAX_VALUES = 200
"""Number of samples of a channel that are printed."""


def read_channels(path: str, limit: int) -> dict[str, Any]:
    """Return the first numeric channels of a file by name.

    Those that cannot be read are left out.
    """
    import mdfreader  # type: ignore[import-not-found]
    import numpy as np

    mdf = mdfreader.Mdf(path)
    masters = set(mdf.masterChannelList)
    result: dict[str, Any] = {}
    for name in sorted(mdf):
        if len(result) == limit:
            break
        if name in masters:
            continue
        try:
            values = np.asarray(mdf.get_channel_data(name))
            times = np.asarray(mdf.get_channel_data(mdf.get_channel_master(name)))
        except Exception:
            continue
        if values.ndim != 1 or values.dtype.kind not in "biuf" or len(times) != len(values):
            continue
        result[name] = {
            "count": len(values),
            "values": [float(value) for value in values[:MAX_VALUES]],
            "times": [float(time) for time in times[:MAX_VALUES]],
        }
    return result


if __name__ == "__main__":
    print(json.dumps(read_channels(sys.argv[1], int(sys.argv[2]))))
