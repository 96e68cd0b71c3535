"""Command line of the package.

`python -m stretch_gap convert run.mcap out.npz` converts a recording to a file that `stretch` reads.
"""

from __future__ import annotations

import argparse
import sys

from ._stretch import StretchError
from .arrays import listed
from .reading import convert


def main() -> int:
    """Run one command and return the exit status of the process."""
    parser = argparse.ArgumentParser(prog="python -m stretch_gap")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    told = "write a recording (MCAP, ROS bag, MAT, HDF5, Parquet, ...) as an NPZ file that `stretch` reads, with all its clocks"
    command = commands.add_parser("convert", help=told, description=told[0].upper() + told[1:] + ".")
    command.add_argument("recording", help="the recording: a file, or the folder of a ROS 2 bag")
    command.add_argument("out", help="the file to write, FILE.npz")
    command.add_argument("--force", action="store_true", help="replace the output file if it exists")
    asked = parser.parse_args()
    try:
        found = convert(asked.recording, asked.out, force=asked.force)
    except StretchError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    for note in found.notes:
        print(f"note: {asked.recording}: {note}", file=sys.stderr)
    print(f"wrote {asked.out}: {len(found.numbers)} arrays: {listed(list(found.numbers))}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
