"""Runs a plant of the challenge as a worker of stretch: `python3 worker.py servo`. book/src/reference/worker.md describes the protocol."""
import importlib
import json
import struct
import sys

import numpy as np

PLANT = importlib.import_module(sys.argv[1])
SOURCE, SINK = sys.stdin.buffer, sys.stdout.buffer
sys.stdout = sys.stderr  # printed text must not mix with the frames


def receive():
    prefix = SOURCE.read(16)
    if len(prefix) < 16:
        sys.exit(0)  # the other side has closed the stream
    header, body = struct.unpack("<4xIQ", prefix)
    return json.loads(SOURCE.read(header)), np.frombuffer(SOURCE.read(body), "<f8")


def send(header, body=b""):
    text = json.dumps(header).encode()
    SINK.write(struct.pack("<4sIQ", b"STR1", len(text), len(body)) + text + body)
    SINK.flush()


def simulated(stage, parameters, effects, drive, trials):
    """Output of a stage over these trials. Each trial starts at rest."""
    p = np.array([parameters.get(name, value) for name, value in PLANT.PARAMETERS.items()])
    e = np.array([effects.get(name, 0.0) for name in PLANT.EFFECTS])
    out, first = [], 0
    for trial in trials:
        part = np.ascontiguousarray(drive[first : first + trial["samples"]], dtype=np.float64)
        out.append(PLANT.SIMULATE[stage](part, p, e))
        first += trial["samples"]
    return np.concatenate(out)


def main():
    header = {"kind": ""}
    while header["kind"] != "bye":
        header, body = receive()
        if header["kind"] == "hello":
            send({"kind": "hello", "version": 1, "batch": 16, "inputs": True,
                  "parameters": list(PLANT.PARAMETERS), "effects": list(PLANT.EFFECTS)})
        elif header["kind"] == "session":
            session, names = header, [column["name"] for column in header["columns"]]
            columns = body.reshape(len(names), -1)
            drives = [columns[names.index(stage["inputs"][0])] for stage in header["stages"]]
            send({"kind": "ready"})
        elif header["kind"] == "simulate":
            outputs, at = [], 0
            for model in header["models"]:
                trials = session["trials"][: model["trials"]]
                samples = sum(trial["samples"] for trial in trials)
                middle = at + len(session["parameters"])
                end = middle + len(session["effects"])
                parameters = dict(zip(session["parameters"], body[at:middle], strict=True))
                effects = dict(zip(session["effects"], body[middle:end], strict=True))
                drive, at = drives[model["stage"]][:samples], end
                if model["inputs"]:
                    drive, at = body[end : end + samples], end + samples
                outputs.append(simulated(model["stage"], parameters, effects, drive, trials))
            send({"kind": "outputs", "models": [{"samples": len(y)} for y in outputs]},
                 np.concatenate(outputs).astype("<f8").tobytes())


if __name__ == "__main__":
    main()
