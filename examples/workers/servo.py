"""A first-order servo as a worker of stretch, which needs only NumPy. The protocol is in book/src/reference/worker.md."""
import json
import struct
import sys

import numpy as np

SOURCE, SINK = sys.stdin.buffer, sys.stdout.buffer
sys.stdout = sys.stderr  # printed text must not mix with the frames


def receive():
    prefix = SOURCE.read(16)
    if len(prefix) < 16:
        sys.exit(0)  # the program has closed the pipe
    header, body = struct.unpack("<4xIQ", prefix)
    return json.loads(SOURCE.read(header)), np.frombuffer(SOURCE.read(body), "<f8")


def send(header, body=b""):
    text = json.dumps(header).encode()
    SINK.write(struct.pack("<4sIQ", b"STR1", len(text), len(body)) + text + body)
    SINK.flush()


def servo(gain, tau, brake, u, trials):
    """angle' = (gain u - brake - angle)/tau by Euler steps; each trial starts at rest."""
    step, out, first = DT_S / tau, np.empty_like(u), 0
    for trial in trials:
        angle = 0.0
        for i in range(first, first + trial["samples"]):
            out[i] = angle
            push = gain * float(u[i]) - angle
            angle += step * (push - min(max(push, -brake), brake))
        first += trial["samples"]
    return out


header = {"kind": ""}
while header["kind"] != "bye":
    header, body = receive()
    if header["kind"] == "hello":
        send({"kind": "hello", "version": 1, "batch": 8, "inputs": True,
              "parameters": ["gain", "tau"], "effects": ["brake"]})
    elif header["kind"] == "session":
        DT_S, TRIALS = header["dt_s"], header["trials"]
        names = [c["name"] for c in header["columns"]]
        COMMAND = body.reshape(len(names), -1)[names.index(header["stages"][0]["inputs"][0])]
        send({"kind": "ready"})
    elif header["kind"] == "simulate":
        outputs, at = [], 0
        for model in header["models"]:
            trials = TRIALS[: model["trials"]]
            samples = sum(t["samples"] for t in trials)
            numbers, at = body[at : at + 3].tolist(), at + 3  # parameters, then effects
            u = body[at : at + samples] if model["inputs"] else COMMAND[:samples]
            at += samples if model["inputs"] else 0
            outputs.append(servo(*numbers, u, trials))
        send({"kind": "outputs", "models": [{"samples": len(y)} for y in outputs]},
             np.concatenate(outputs).astype("<f8").tobytes())
