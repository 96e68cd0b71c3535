import importlib
import itertools
import json
import os
import struct
import sys
import traceback

SOURCE, SINK = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
os.dup2(2, 1)  # everything that is printed, also by C code, goes to standard error
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


def hello(asked):
    known = {k: getattr(asked.simulator, k) for k in ("units", "parameters", "effects") if hasattr(asked.simulator, k)}
    able = {"inputs": asked.takes_inputs, "all": asked.answers_all, "several": asked.takes_inputs}
    return {"kind": "hello", "version": 1, "batch": asked.batch, **able, **known}


def bind(asked, session, body):
    names = [c["name"] for c in session["columns"]]
    asked.bind({**session, "columns": dict(zip(names, body.reshape(len(names), -1)))})


def take(asked, models, body):
    """Yield stage, trials, parameters, effects, altered inputs, and places and columns of other altered inputs of each model."""
    at = 0

    def numbers(count):
        nonlocal at
        at += count
        return body[at - count : at]

    for model in models:
        stage, trials = model["stage"], model["trials"]
        parameters, effects = numbers(len(asked.parameters)), numbers(len(asked.effects))
        altered = [numbers(asked.samples(trials)) for _ in asked.inputs[stage]] if model["inputs"] else None
        places = [tuple(place) for place in model.get("others", ())]
        yield stage, trials, parameters, effects, altered, places, [numbers(asked.samples(trials)) for _ in places]


def simulate(asked, models, body):
    """Simulate the models of a request. Neighbouring models that fit into one call are simulated together."""
    kind = lambda model: (model[0], model[1], model[4] is None, model[5])
    groups = itertools.groupby(take(asked, models, body), kind)
    return [row for _, group in groups for row in answer(asked, list(group))]


def answer(asked, group):
    """Return a row, or an error, for each model. If a call for several models fails, each model is simulated separately."""
    stage, trials, _, _, altered, places, _ = group[0]
    inputs = None if altered is None else list(zip(*(model[4] for model in group)))
    others = [(*place, rows) for place, rows in zip(places, zip(*(model[6] for model in group)))]
    table = lambda at: np.array([model[at] for model in group], "<f8").reshape(len(group), -1)
    try:
        return list(asked(stage, trials, table(2), table(3), inputs, others))
    except Exception as error:
        if len(group) > 1:
            return [row for model in group for row in answer(asked, [model])]
        traceback.print_exc()
        return [f"{type(error).__name__}: {error}"]


def main():
    asked, header = Asked(find(sys.argv[1])), {"kind": ""}
    while header["kind"] != "bye":
        header, body = receive()
        if header["kind"] == "hello":
            send(hello(asked))
        elif header["kind"] == "session":
            bind(asked, header, body)
            send({"kind": "ready"})
        elif header["kind"] == "simulate":
            rows = simulate(asked, header["models"], body)
            models = [{"error": row} if isinstance(row, str) else {"samples": len(row)} for row in rows]
            numbers = [row for row in rows if not isinstance(row, str)]
            send({"kind": "outputs", "models": models}, b"".join(np.ascontiguousarray(n, "<f8").tobytes() for n in numbers))


main()
