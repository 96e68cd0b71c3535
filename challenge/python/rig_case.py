"""A case of the rig for a method: 17 trials at 100 Hz, two stages that are fitted, 23 candidates.

Differences from the other plants:

- The noise is correlated, and is estimated. Residuals are computed from every seventh row: each minus `rho` times the previous one (an AR(1)
  model), divided by its scale. `rho` and the scale are estimated from the residual of the re-tuned nominal rig.
- Every second ramp is left out, which costs half the time.
- After the nominal rig is re-tuned, parameters follow the effects to first order, with their tolerances as prior; only arguments are searched.
- A recording without pressure has one stage, from the openings to length and voltage.
"""
from pathlib import Path

import numpy as np
import tomllib
from scipy.optimize import least_squares

import rig
from case import Case
from rig_trial import MAD, Trial, roughness

LINES_HZ = (50.0, 60.0)
PNEUMATIC = ("supply_sag", "valve_delay", "valve_deadband", "leak", "chamber_volume")


class RigCase(Case):
    """As `Case`. Stage 0 is the pneumatics; stage 1 is muscle, gauge and reference."""

    def __init__(self, folder, plant, candidates):
        self.folder, self.plant, self.places, self.runs = Path(folder), plant, candidates, 0
        index = tomllib.loads((self.folder / "dataset.toml").read_text())["trial"]
        self.trials = [(t["split"], Trial(self.folder / t["file"], t["start_s"])) for t in index]
        ramps = [i for i, (split, _) in enumerate(self.trials) if split == "fit" and index[i]["kind"] in ("inflation", "deflation")]
        self.fit = [i for i, (split, _) in enumerate(self.trials) if split == "fit" and i not in ramps[1::2]]
        self.test = [i for i, (split, _) in enumerate(self.trials) if split == "test"]
        self.has_pressure = all(t.has_pressure for _, t in self.trials)
        self.stages = range(2 if self.has_pressure else 1)
        self.count_travel()
        self.find_hum()
        self.last_pressure = self.last_length = (None, None)
        self.tuned = {}
        fitted = [self.trials[i][1] for i in self.fit]
        known = range(0 if self.has_pressure else 1, 3)
        self.raw = {c: float(np.median([roughness(t.outputs[c]) for t in fitted])) for c in known}
        self.rho, self.scale = dict.fromkeys(known, 0.0), dict(self.raw)
        for stage in self.stages:
            self.learn_noise(stage, self.at_nominal(stage, self.fit)[0])
        self.tuned = {}

    def count_travel(self):
        gone, strains = 0.0, [(1.0 + rig.PARAMETERS[1]["e0"]) * t.length / rig.L_0 for _, t in self.trials]
        for i, (_, trial) in enumerate(self.trials):
            if i:
                gone += abs(strains[i][0] - strains[i - 1][-1])
            trial.travel = gone
            gone += rig.travelled(strains[i], 5e-4)[-1]

    def find_hum(self):
        power = [sum(np.sum(self.trials[i][1].line(f)[0] ** 2) for i in self.fit) for f in LINES_HZ]
        hertz = LINES_HZ[int(np.argmax(power))]
        for _, trial in self.trials:
            parts, wave = trial.line(hertz)
            trial.hum = wave / max(np.hypot(*parts), 1e-12)

    def channels(self, stage):
        return (0,) if stage == 0 and self.has_pressure else (1, 2)

    def learn_noise(self, stage, p):
        gap = self.measured(stage, self.fit) - self.simulate(stage, p, {}, self.fit)
        pieces = self.pieces(stage, gap, self.fit)
        for k, channel in enumerate(self.channels(stage)):
            mine = pieces[k :: len(self.channels(stage))]
            shared = sum(np.dot(g[1:], g[:-1]) for g in mine) / sum(np.dot(g, g) for g in mine)
            self.rho[channel] = float(np.clip(shared, 0.0, 0.98))
            white = np.concatenate([g[1:] - self.rho[channel] * g[:-1] for g in mine])
            self.scale[channel] = float(max(MAD * np.median(np.abs(white)), 1e-9))

    def pieces(self, stage, values, trials):
        """Values of a stage by trial and channel."""
        counts = [len(self.trials[i][1].rows) for i in trials for _ in self.channels(stage)]
        return np.split(values, np.cumsum(counts)[:-1])

    def in_noise(self, stage, gap, trials):
        channels, out = self.channels(stage), []
        for k, g in enumerate(self.pieces(stage, gap, trials)):
            c = channels[k % len(channels)]
            out.append((g[1:] - self.rho[c] * g[:-1]) / self.scale[c])
        return np.concatenate(out)

    def noisy(self, stage, values, random):
        channels, out = self.channels(stage), []
        for k, y in enumerate(self.pieces(stage, values, self.fit)):
            c = channels[k % len(channels)]
            noise = self.scale[c] * random.normal(size=len(y))
            noise[0] /= np.sqrt(1.0 - self.rho[c] ** 2)
            for i in range(1, len(y)):
                noise[i] += self.rho[c] * noise[i - 1]
            out.append(y + noise)
        return np.concatenate(out)

    def trial_lengths(self, stage):
        return [len(self.channels(stage)) * (len(self.trials[i][1].rows) - 1) for i in self.fit]

    def stage_of(self, name):
        return rig.STAGE_OF_PLACE[self.places[name]] if self.has_pressure else 0

    def nominal(self, stage):
        tables = [stage] if self.has_pressure else [0, 1]
        return tuple(np.array([x for k in tables for x in table[k].values()]) for table in (rig.PARAMETERS, rig.TOLERANCES))

    def centre(self, stage):
        """The tolerances of the rig are wide. After a fit, about a tenth of them remains as uncertainty."""
        return self.at_nominal(stage, self.fit)[0], 0.1 * self.nominal(stage)[1]

    def arguments(self, name):
        return rig.ARGUMENTS[name]

    def is_signed(self, name):
        return name in rig.SIGNED

    def free(self, name):
        """Number of fitted numbers of a candidate. The phase of a hum is fitted in each trial."""
        return len(rig.ARGUMENTS[name]) + (len(self.fit) if name == "mains_hum" else 0)

    def measured(self, stage, trials):
        return np.concatenate([self.trials[i][1].outputs[c][self.trials[i][1].rows]
                               for i in trials for c in self.channels(stage)])

    def simulate(self, stage, p, effects, trials):
        self.runs += 1
        p = np.asarray(p, dtype=float)
        if not self.has_pressure:
            return self.body(p[5:], effects, trials, self.pressures(p[:5], effects, trials))
        if stage == 0:
            pressures = self.pressures(p, effects, trials)
            return np.concatenate([x[self.trials[i][1].rows] for i, x in zip(trials, pressures, strict=True)])
        return self.body(p, effects, trials, [self.trials[i][1].pressure for i in trials])

    def pressures(self, p, effects, trials):
        """Pressure of each trial, kPa. The last result is cached, because most steps of a fit change other values."""
        inside = np.array([effects[n][0] if n in effects else 0.0 for n in PNEUMATIC])
        key = (tuple(p), tuple(inside), tuple(trials))
        if key != self.last_pressure[0]:
            out = []
            for t in (self.trials[i][1] for i in trials):
                full_kpa = 1e-3 * p[0] if t.wound > 0.0 else 0.0
                start_kpa = t.start_kpa if self.has_pressure else full_kpa
                out.append(rig.pneumatics(t.inlet, t.outlet, t.y, start_kpa, p, inside))
            self.last_pressure = (key, out)
        return self.last_pressure[1]

    def body(self, p, effects, trials, pressures):
        """Length and voltage of each trial, from its pressure. The last lengths are cached."""
        named = dict(zip(rig.PARAMETERS[1], p, strict=True))
        own = [(n, tuple(v)) for n, v in effects.items() if self.places[n] != "sensing"]
        key = (tuple(p[:5]), tuple(own), tuple(trials), self.last_pressure[0])
        pairs = [(self.trials[i][1], x) for i, x in zip(trials, pressures, strict=True)]
        if key != self.last_length[0]:
            lengths = [rig.reference(rig.muscle(x, t.wound, named, effects), t.wound, named, effects)[t.rows] for t, x in pairs]
            self.last_length = (key, lengths)
        out = []
        for shown, (t, x) in zip(self.last_length[1], pairs, strict=True):
            length = rig.unreferenced(t.length, t.moving, named, effects)
            volts = rig.sensing(length, x, t.wound, t.t_s, t.travel, t.hum, named, effects)
            out += [shown, volts[t.rows]]
        return np.concatenate(out)

    def at_nominal(self, stage, trials):
        """The re-tuned nominal rig: parameters, the same in tolerances, sensitivities, and the matrices of the least-squares solution."""
        key = (stage, tuple(trials))
        if key not in self.tuned:
            p0, tolerance = self.nominal(stage)
            n = len(p0)
            cost = lambda z: np.concatenate([self.residual(stage, p0 + tolerance * z, {}, trials), z])
            z = least_squares(cost, np.zeros(n), bounds=(-3.0, 3.0), diff_step=1e-3, x_scale=1.0, max_nfev=8).x
            p = p0 + tolerance * z
            plain = self.residual(stage, p, {}, trials)
            slopes = []
            for i in range(n):
                moved = p.copy()
                moved[i] += 0.05 * tolerance[i]
                slopes.append((self.residual(stage, moved, {}, trials) - plain) / 0.05)
            s = np.array(slopes).T
            self.tuned[key] = (p, z, s, np.linalg.solve(s.T @ s + np.eye(n), s.T), np.linalg.inv(s.T @ s + np.eye(n)))
        return self.tuned[key]

    def left(self, stage, effects, trials):
        """(parameters, residual with the prior) after parameters are re-tuned to first order."""
        p, z, slopes, solve, prior = self.at_nominal(stage, trials)
        gap = self.residual(stage, p, effects, trials)
        step = -(solve @ gap) - prior @ z
        moved = np.clip(z + step, -3.0, 3.0)
        return p + self.nominal(stage)[1] * (moved - z), np.concatenate([gap + slopes @ (moved - z), moved])

    def retune(self, stage, names=(), trials=None, start=None):
        trials, names = self.fit if trials is None else trials, list(names)
        triples = [triple for name in names for triple in self.arguments(name)]
        if not triples:
            p, left = self.left(stage, {}, trials)
            return p, {}, float(left @ left)
        off, begin, most = (np.array([t[k] for t in triples]) for k in range(3))

        def effects_at(x):
            return self.shared_out(names, off + (most - off) * x)

        lowest = self.least(names)
        first = np.clip((begin - off) / (most - off), lowest + 1e-6, 1.0 - 1e-6)
        found = least_squares(lambda x: self.left(stage, effects_at(x), trials)[1], first, bounds=(lowest, np.ones(len(off))),
                              diff_step=1e-2, x_scale=0.1, max_nfev=8)
        self.last = found
        p, left = self.left(stage, effects_at(found.x), trials)
        return p, effects_at(found.x), float(left @ left)

    def search(self, stage, names):
        off, most = (np.array([t[k] for n in names for t in self.arguments(n)]) for k in (0, 2))
        count = len(off)

        def cost(x):
            left = self.left(stage, self.shared_out(names, off + (most - off) * np.asarray(x)[:count]), self.fit)[1]
            return float(left @ left)

        spare = 1 if count == 1 else 0  # some optimisers need at least two variables
        lowest = np.r_[self.least(names), np.zeros(spare)]
        return cost, 0.2 * np.ones(count + spare), lowest, np.ones(count + spare)

    def closed(self, names):
        """Share of the gap on the test trials that these effects close. The gap is the mean square beyond the noise from second differences."""
        before = after = 0.0
        for stage in self.stages:
            mine = [n for n in names if self.stage_of(n) == stage]
            fits = [self.retune(stage), self.retune(stage, mine)]
            left = []
            for p, effects, _ in fits:
                gap = self.measured(stage, self.test) - self.simulate(stage, p, effects, self.test)
                pieces = self.pieces(stage, gap, self.test)
                channels = self.channels(stage)
                squares = [[np.mean(g**2) for g in pieces[k :: len(channels)]] for k in range(len(channels))]
                left.append(sum(max(0.0, np.mean(s) / self.raw[c] ** 2 - 1.0) for s, c in zip(squares, channels, strict=True)))
            before, after = before + left[0], after + left[1]
        return float(1.0 - after / before) if before > 0 else 0.0
