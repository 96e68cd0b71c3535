"""Which tests of the damper were measured with another tension of its band than the rest?

    python tension.py FOLDER

FOLDER is the folder `data` of the data set. The simulator computes the force of the damper from the pulls at the two ends of its
band. Its only parameter is re-tuned for each test. A test whose value differs from the median by more than a tenth is marked
"told". The authors flag five of the eleven tests at 0 lb whose files could be obtained.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import record


def leverage(columns: dict[str, np.ndarray]) -> tuple[float, float]:
    """Returns the least-squares leverage, and the share of the force's variance that remains."""
    pull, force = columns["pull_2_kn"] - columns["pull_1_kn"], columns["force_kn"]
    fitted = float(pull @ force / (pull @ pull))
    return fitted, float(np.var(force - fitted * pull) / np.var(force))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    data = parser.parse_args().data
    found = {name: leverage(record.test(data, name)) for name in (*record.FLAGGED, *record.SOUND)}
    middle = float(np.median([value for value, _ in found.values()]))
    for name, (value, left) in found.items():
        marks = [", flagged"] * (name in record.FLAGGED) + [", told"] * (abs(value / middle - 1.0) > 0.1)
        print(f"{name}: leverage {value:.3f}, {100 * left:.0f} % of the force left{''.join(marks)}")


if __name__ == "__main__":
    main()
