"""Offline regressors that see a long window of the signal: the bar that a live calibration is compared with.

    python3 reference/accuracy/offline.py SIMULATED_7 SIMULATED_8 ...

Each argument is a folder made by `stretch simulate --rig paper --seed N --out SIMULATED_N`; the measured
sessions are those of the folder knit_sleeve below STRETCH_DATA (default ../shared/data next to the project; the
project carries none), in the pairs and with the signals of reference/accuracy/measured.csv (written by the accuracy example). Writes reference/accuracy/offline.csv.
"""

import csv
import os
import pathlib
import sys
import tomllib

import numpy as np
import sklearn
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

HERE = pathlib.Path(__file__).parent
LAGS = [0, 1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 15, 18, 22, 27, 33, 40, 50, 60, 75, 90, 120]
TAUS_S = [0.05, 0.2, 0.8, 3.0, 10.0]
PERIOD_S = 0.01
SETTLE = 20


def window(signal):
    """The signal at 22 lags up to 1.2 s, and five low-passes of it: causal."""
    padded = np.concatenate([np.full(LAGS[-1], signal[0]), signal])
    columns = [padded[LAGS[-1] - lag : LAGS[-1] - lag + len(signal)] for lag in LAGS]
    for tau in TAUS_S:
        share, slow, out = 1 - np.exp(-PERIOD_S / tau), signal[0], []
        for x in signal:
            slow += share * (x - slow)
            out.append(slow)
        columns.append(np.array(out))
    return np.stack(columns, 1)


def read(path, signal, reference):
    table = np.genfromtxt(path, delimiter=",", names=True)
    return window(table[signal]), table[reference]


def regressors():
    yield "gradient boosting", HistGradientBoostingRegressor(
        max_iter=400, learning_rate=0.05, min_samples_leaf=40, random_state=1
    )
    yield "multi-layer perceptron 48-24", make_pipeline(
        StandardScaler(),
        MLPRegressor(hidden_layer_sizes=(48, 24), max_iter=60, early_stopping=True,
                     learning_rate_init=2e-3, random_state=1),
    )


def judge(rows, case, fit, tests):
    inputs = np.concatenate([x[5:] for x, _ in fit])
    targets = np.concatenate([y[5:] for _, y in fit])
    for name, model in regressors():
        model.fit(inputs, targets)
        for kind, trials in tests.items():
            errors = np.concatenate([(model.predict(x) - y)[SETTLE:] for x, y in trials])
            rows.append([case, kind, name, f"{np.sqrt(np.mean(errors**2)):.3f}"])
            print(*rows[-1], flush=True)


def main():
    rows = []
    for folder in map(pathlib.Path, sys.argv[1:]):
        entries = tomllib.loads((folder / "dataset.toml").read_text())["trial"]
        load = lambda e: read(folder / e["file"], "bridge_v", "length_mm")
        fit = [load(e) for e in entries if e["split"] == "fit"]
        tests = {
            kind: [load(e) for e in entries if e["split"] == "test" and e["kind"] == kind]
            for kind in ("arbitrary", "pulses")
        }
        judge(rows, f"simulated {folder.name}", fit, tests)
    lines = (HERE / "measured.csv").read_text().splitlines()
    pairs = csv.DictReader(line for line in lines if not line.startswith("#"))
    beside = HERE.resolve().parents[2] / "shared" / "data"
    sessions = pathlib.Path(os.environ.get("STRETCH_DATA", beside)) / "knit_sleeve"
    if not sessions.is_dir():
        sys.exit(f"SKIPPED: there is no folder {sessions}; STRETCH_DATA names the one that holds knit_sleeve")
    for pair in pairs:
        if pair["signal"] == "-":
            continue
        load = lambda name: read(sessions / f"{name}.csv", pair["signal"], "angle_deg")
        case = f"{pair['calibrated on']} -> {pair['tested on']}"
        judge(rows, case, [load(pair["calibrated on"])], {"session": [load(pair["tested on"])]})
    with open(HERE / "offline.csv", "w", newline="") as out:
        out.write(f"# scikit-learn {sklearn.__version__}, numpy {np.__version__}, python {sys.version.split()[0]}; RMSE in mm (simulated) and degrees (measured)\n")
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(["case", "tested on", "regressor", "rmse"])
        writer.writerows(rows)


if __name__ == "__main__":
    main()
