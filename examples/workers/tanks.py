"""Two cascaded tanks as a worker of stretch whose levels may overflow. The protocol is in book/src/reference/worker.md."""
import json
import math
import struct
import sys

SOURCE, SINK = sys.stdin.buffer, sys.stdout.buffer
sys.stdout = sys.stderr  # printed text must not mix with the frames
LEVELS = ["upper", "lower"]


def receive():
    prefix = SOURCE.read(16)
    if len(prefix) < 16:
        sys.exit(0)  # the program has closed the pipe
    header, body = struct.unpack("<4xIQ", prefix)
    header, body = json.loads(SOURCE.read(header)), SOURCE.read(body)
    return header, struct.unpack(f"<{len(body) // 8}d", body)


def send(header, numbers=()):
    text, body = json.dumps(header).encode(), struct.pack(f"<{len(numbers)}d", *numbers)
    SINK.write(struct.pack("<4sIQ", b"STR1", len(text), len(body)) + text + body)
    SINK.flush()


def tanks(parameters, effects, pump, trials):
    """upper' = inflow pump - drain sqrt(upper), lower' = drain (sqrt(upper) - sqrt(lower)), by Euler steps."""
    inflow, drain = (parameters[name] for name in ("inflow", "drain"))

    def held(name, level):
        level *= math.exp(-effects.get(f"state.{name}.leak", 0.0) * DT_S)
        level = min(level, effects.get(f"state.{name}.spill", math.inf))
        return max(level, effects.get(f"state.{name}.floor", 0.0))

    out, first = [], 0
    for trial in trials:
        upper = lower = 2.0
        for u in pump[first : first + trial["samples"]]:
            out.append(lower)
            into, through = inflow * u - drain * math.sqrt(upper), math.sqrt(upper) - math.sqrt(lower)
            upper = held("upper", max(upper + DT_S * into, 0.0))
            lower = held("lower", max(lower + DT_S * drain * through, 0.0))
        first += trial["samples"]
    return out


header = {"kind": ""}
while header["kind"] != "bye":
    header, body = receive()
    if header["kind"] == "hello":
        states = [{"name": name, "unit": "cm", "least": 0, "greatest": 12} for name in LEVELS]
        send({"kind": "hello", "version": 1, "batch": 8, "inputs": True, "states": states})
    elif header["kind"] == "session":
        DT_S, TRIALS = header["dt_s"], header["trials"]
        PARAMETERS, EFFECTS = header["parameters"], header["effects"]
        names, rows = [c["name"] for c in header["columns"]], sum(t["samples"] for t in TRIALS)
        at = names.index(header["stages"][0]["inputs"][0])
        PUMP = body[at * rows : (at + 1) * rows]
        send({"kind": "ready"})
    elif header["kind"] == "simulate":
        outputs, at = [], 0
        for model in header["models"]:
            trials = TRIALS[: model["trials"]]
            samples = sum(t["samples"] for t in trials)
            parameters = dict(zip(PARAMETERS, body[at:]))
            at += len(PARAMETERS)
            effects = dict(zip(EFFECTS, body[at : at + len(EFFECTS)]))
            at += len(EFFECTS)
            pump = body[at : at + samples] if model["inputs"] else PUMP[:samples]
            at += samples if model["inputs"] else 0
            outputs.append(tanks(parameters, effects, pump, trials))
        send({"kind": "outputs", "models": [{"samples": len(y)} for y in outputs]},
             [level for output in outputs for level in output])
