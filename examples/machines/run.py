"""Diagnoses a simple simulator of a machine that others measured: which effects does the simulator lack?

    python run.py SYSTEM DATA [--problem viscous.toml] [--every 2] [--set joint=wpitch] [--out FOLDER] [--compare]

SYSTEM is a folder next to this file, DATA the folder of its recordings (see its DOCUMENTED.md). The program is the
`stretch` on the search path, or the one that --program names.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import machines


def row(answer: dict) -> str:
    """Returns a text of a few lines about the answer."""
    candidates = answer["candidates"]
    best = candidates[0]
    probabilities = ", ".join(f"{' + '.join(c['effects']) or 'nothing'} {c['probability']:.2f}" for c in candidates[:4])
    values = ", ".join(f"{v['effect']}.{v['name']} {v['value']:.4g}" for v in best["parameter_values"])
    tuned = ", ".join(f"{p['name']} {p['nominal']:.4g} -> {p['fitted']:.4g}" for p in answer["parameters"])
    lines = [
        answer["sentence"],
        f"  verdict {answer['verdict']}, named {', '.join(answer['named']) or 'nothing'}; not ruled out "
        f"{', '.join(answer['ambiguous']) or 'nothing'}",
        f"  probabilities {probabilities}",
        f"  closed {best['closed']:.3f} ({best['closed_ci'][0]:.3f} to {best['closed_ci'][1]:.3f})",
        f"  values of the most probable {values}",
        f"  parameters {tuned}",
        f"  runs {answer['model_runs']['count']}, seconds {answer['seconds']:.0f}",
    ]
    lines += [f"  gross: {one}" for one in answer.get("gross", [])]
    lines += [f"  note: {note}" for note in answer["notes"]]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("system", choices=machines.SYSTEMS)
    parser.add_argument("data", type=Path)
    parser.add_argument("--problem", default="problem.toml", help="another problem of the system's folder")
    parser.add_argument("--every", type=int, default=1, help="keep every so many rows")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="an argument of the system's recordings")
    parser.add_argument(
        "--out", type=Path, help="folder for recordings, problem, diagnosis, and report; a temporary one otherwise"
    )
    parser.add_argument("--program", default="stretch")
    parser.add_argument("--compare", action="store_true", help="re-tuning alone, and all candidates free, by least squares")
    args = parser.parse_args()
    how = {key: float(value) if key.endswith("_s") else value for key, _, value in (one.partition("=") for one in args.set)}
    with tempfile.TemporaryDirectory() as temporary:
        out = args.out or Path(temporary)
        problem = machines.prepare(args.system, args.data, out, args.every, args.problem, **how)
        print(row(machines.diagnose(problem, args.program)))
        if args.compare:
            import compare

            print(compare.text(problem))


if __name__ == "__main__":
    main()
