"""An object of a Python module as a worker: `python3 shim.py module:object`.

A function is called with two dicts, parameters and effects by name, for one model at a time. An object has
`simulate(parameters[n, p], effects[n, e])`, whose columns go by name as well (`effects["delay_s"]`), and answers n rows. Both may
take by keyword `inputs` (every column by name, `[samples]` or `[n, samples]`, those that drive the stage as a wrapper alters
them), `trials` (name, slice of samples and start_s of each that is asked for) and `stage`, and may have `begin(session)`.
"""
import importlib
import inspect
import itertools
import json
import os
import struct
import sys
import traceback
from types import SimpleNamespace

import numpy as np

SOURCE, SINK = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
os.dup2(2, 1)  # whatever is printed, by C code as well, goes to standard error
sys.path.insert(0, os.getcwd())


def receive():
    prefix = SOURCE.read(16)
    if len(prefix) < 16:
        sys.exit(0)
    header, body = struct.unpack("<4xIQ", prefix)
    return json.loads(SOURCE.read(header)), np.frombuffer(SOURCE.read(body), "<f8")


def send(header, body=b""):
    text = json.dumps(header).encode()
    SINK.write(struct.pack("<4sIQ", b"STR1", len(text), len(body)) + text + body)
    SINK.flush()


def find(path):
    module, name = path.split(":")
    found = getattr(importlib.import_module(module), name)
    return found() if inspect.isclass(found) else found


class Named(np.ndarray):
    """An array `[n, names]` whose columns go by name, too."""

    def __new__(cls, rows, names):
        table = np.array(rows, "<f8").reshape(len(rows), len(names)).view(cls)
        table.names = list(names)
        return table

    def __array_finalize__(self, other):
        self.names = getattr(other, "names", [])

    def __getitem__(self, at):
        return np.asarray(self)[:, self.names.index(at)] if isinstance(at, str) else np.asarray(self)[at]


class Worker:
    def __init__(self, path):
        self.object = find(path)
        self.is_many = hasattr(self.object, "simulate")
        self.call = self.object.simulate if self.is_many else self.object
        taken = inspect.signature(self.call).parameters
        kinds = {p.kind for p in taken.values()}
        self.more = {k for k in ("inputs", "stage", "trials") if k in taken or inspect.Parameter.VAR_KEYWORD in kinds}

    def hello(self):
        known = {k: getattr(self.object, k) for k in ("units", "parameters", "effects") if hasattr(self.object, k)}
        return {"kind": "hello", "version": 1, "batch": 16 if self.is_many else 1, "inputs": "inputs" in self.more, **known}

    def begin(self, session, body):
        self.session, names = session, [c["name"] for c in session["columns"]]
        self.columns = dict(zip(names, body.reshape(len(names), -1)))
        ends = itertools.accumulate(t["samples"] for t in session["trials"])
        spans = [(t, slice(end - t["samples"], end)) for t, end in zip(session["trials"], ends)]
        self.spans = [SimpleNamespace(name=t["name"], samples=span, start_s=t["start_s"]) for t, span in spans]
        if hasattr(self.object, "begin"):
            self.object.begin({**session, "columns": self.columns})

    def take(self, models, body):
        """One model after the other: parameters, effects, inputs."""
        p, e = len(self.session["parameters"]), len(self.session["effects"])
        at = 0
        for model in models:
            numbers = body[at : at + p + e]
            at += p + e
            inputs = None
            if model["inputs"]:
                samples = sum(t["samples"] for t in self.session["trials"][: model["trials"]])
                names = self.session["stages"][model["stage"]]["inputs"]
                inputs = dict(zip(names, body[at : at + samples * len(names)].reshape(len(names), samples)))
                at += samples * len(names)
            yield model, numbers[:p], numbers[p:], inputs

    def simulate(self, models, body):
        """Neighbours that differ in their numbers alone are one call."""
        alone = itertools.count()
        kind = lambda t: next(alone) if t[3] is not None or not self.is_many else (t[0]["stage"], t[0]["trials"])
        groups = itertools.groupby(self.take(models, body), kind)
        return [row for _, group in groups for row in self.answer(list(group))]

    def answer(self, group):
        model, _, _, altered = group[0]
        trials = self.spans[: model["trials"]]
        inputs = {k: v[: trials[-1].samples.stop] for k, v in self.columns.items()} | (altered or {})
        if self.is_many:
            inputs = {k: np.broadcast_to(v, (len(group), len(v))) for k, v in inputs.items()}
        more = {"inputs": inputs, "stage": model["stage"], "trials": trials}
        more = {k: v for k, v in more.items() if k in self.more}
        try:
            if self.is_many:
                p = Named([g[1] for g in group], self.session["parameters"])
                e = Named([g[2] for g in group], self.session["effects"])
                return list(np.atleast_2d(np.asarray(self.call(p, e, **more), dtype="<f8")))
            p = dict(zip(self.session["parameters"], group[0][1].tolist()))
            e = dict(zip(self.session["effects"], group[0][2].tolist()))
            return [np.asarray(self.call(p, e, **more), dtype="<f8").ravel()]
        except Exception as error:
            traceback.print_exc()
            return [f"{type(error).__name__}: {error}"] * len(group)


def main():
    worker, header = Worker(sys.argv[1]), {"kind": ""}
    while header["kind"] != "bye":
        header, body = receive()
        if header["kind"] == "hello":
            send(worker.hello())
        elif header["kind"] == "session":
            worker.begin(header, body)
            send({"kind": "ready"})
        elif header["kind"] == "simulate":
            rows = worker.simulate(header["models"], body)
            told = [{"error": row} if isinstance(row, str) else {"samples": len(row)} for row in rows]
            numbers = [row for row in rows if not isinstance(row, str)]
            send({"kind": "outputs", "models": told}, b"".join(np.ascontiguousarray(n, "<f8").tobytes() for n in numbers))


main()
