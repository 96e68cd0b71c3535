//! The library: all terms that are considered as missing in a stage. It was written from physics,
//! before any of the cases with which it is evaluated.
//!
//! | kind | terms of a signal x with rate v | describes |
//! | --- | --- | --- |
//! | curve | x^p, (x - centre)^p, knees at quantiles, exp(-x/w) at either end, waves of x | scales, ends, contacts, threads |
//! | friction | v, abs v, v^2, sign v, friction that fades with speed; each also times x | viscous, dry and sticking friction |
//! | memory | play, lag, delay, travel since a reversal, or maximum of x; times x, or v | backlash, relaxation, delay, hysteresis, damage |
//! | slow | lags of x^2 and of friction terms, travel, time in the trial or session; also times x | warming, wear, drift |
//! | crossing | x of one signal times x, v or a memory of another | coupling |
//! | commands | opening of a valve, its lag, both also times x; a rate that leaks through the openings | valves, supply |
//!
//! The part of a term that parameters of the nominal simulator could explain is projected out.
//! Therefore terms need not have a mean of zero.

use crate::missing::{
    term::{Factor, Passage, RateForm, Term},
    term_inputs::TermInputs,
};
use crate::problem::sample_roles::SampleRoles;

use Factor::{
    Above, Below, Bend, Centred, Cosine, High, Lag, Late, Low, Peak, Play, Power, Rate, Session,
    Sine, Time, TimeFade, Travel, TravelFade, Turned,
};
use RateForm::{Linear, Magnitude, Rising, Sign, SignedRoot, SignedSquare, Square, Striction};

/// Half-widths of plays, and widths of the exponentials in x and in the travel since a reversal, as
/// shares of the range.
const WIDTHS: [f64; 5] = [0.015, 0.04, 0.1, 0.2, 0.4];
/// Quantiles of the signal at which knees lie.
const QUANTILES: [f64; 4] = [0.2, 0.4, 0.6, 0.8];
/// Numbers of periods of the waves over the range.
const TURNS: [f64; 7] = [1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0];
/// Delays, in samples.
const DELAYS: [f64; 4] = [2.0, 5.0, 12.0, 30.0];
/// Number of time constants. They are spaced in equal ratios from three samples to the longest
/// fitted trial.
const TIMES: usize = 8;
/// Distances of travel over which something wears in, in multiples of the range.
const WEAR: [f64; 2] = [2.0, 8.0];

/// Collects the terms of the library.
struct Shelf<'a> {
    inputs: &'a TermInputs,
    roles: &'a SampleRoles,
    times_s: Vec<f64>,
    terms: Vec<Term>,
}

/// All terms of a stage; `is_commanded` says whether it is driven by commands instead of a measured
/// input.
pub(crate) fn library(inputs: &TermInputs, roles: &SampleRoles, is_commanded: bool) -> Vec<Term> {
    let shortest = 3.0 * inputs.grid.dt_s();
    let ratio = (inputs.trial_s / shortest).max(1.0);
    let time = |k: usize| shortest * libm::pow(ratio, k as f64 / (TIMES - 1) as f64);
    let times_s = (0..TIMES).map(time).collect();
    let mut shelf = Shelf { inputs, roles, times_s, terms: Vec::new() };
    let (states, commands) = (inputs.of_kind(false), inputs.of_kind(true));
    shelf.clocks();
    for &s in &states {
        shelf.curves(s);
        shelf.friction(s);
        shelf.memory(s);
        shelf.slow(s);
        for &other in states.iter().filter(|other| **other != s) {
            shelf.crossing(s, other);
        }
    }
    for &c in &commands {
        shelf.command(c);
        for &s in &states {
            shelf.commanded(c, s);
        }
        for &other in commands.iter().filter(|other| **other > c) {
            shelf.direct(&[power(c, 1.0), power(other, 1.0)]);
        }
    }
    if is_commanded {
        shelf.rates(&states, &commands);
    }
    shelf.terms
}

fn power(signal: usize, power: f64) -> Factor {
    Power { signal, power }
}

fn rate(signal: usize, form: RateForm) -> Factor {
    Rate { signal, form }
}

impl Shelf<'_> {
    fn direct(&mut self, factors: &[Factor]) {
        self.terms.push(Term::new(factors, Passage::Direct));
    }

    fn lagged(&mut self, factors: &[Factor]) {
        for tau_s in self.times_s.clone() {
            self.terms.push(Term::new(factors, Passage::Lag { tau_s }));
        }
    }

    fn clocks(&mut self) {
        self.direct(&[]);
        for p in [0.5, 1.0, 2.0] {
            self.direct(&[Time { power: p }]);
        }
        for p in [0.5, 1.0] {
            self.direct(&[Session { power: p }]);
        }
        for &tau_s in &self.times_s.clone()[2..] {
            self.direct(&[TimeFade { tau_s }]);
        }
    }

    fn curves(&mut self, s: usize) {
        for p in [0.5, 1.0, 1.5, 2.0, 3.0, 4.0] {
            self.direct(&[power(s, p)]);
        }
        let at = self.inputs.signals[s].centre();
        for p in [3, 4, 5] {
            self.direct(&[Centred { signal: s, at, power: p }]);
        }
        for share in QUANTILES {
            let at = self.inputs.quantile(s, share, self.roles);
            for p in [1.0, 2.0] {
                self.direct(&[Above { signal: s, at, power: p }]);
                self.direct(&[Below { signal: s, at, power: p }]);
            }
        }
        for width in WIDTHS {
            self.direct(&[Low { signal: s, width }]);
            self.direct(&[High { signal: s, width }]);
        }
        for turns in TURNS {
            self.direct(&[Sine { signal: s, turns }]);
            self.direct(&[Cosine { signal: s, turns }]);
        }
    }

    fn friction(&mut self, s: usize) {
        let forms = [Linear, Magnitude, Square, SignedSquare, SignedRoot, Sign, Striction, Rising];
        let lower = Below { signal: s, at: 1.0, power: 1.0 };
        for form in forms {
            self.direct(&[rate(s, form)]);
            for level in [power(s, 1.0), power(s, 2.0), lower] {
                self.direct(&[level, rate(s, form)]);
            }
        }
        self.direct(&[Bend { signal: s }]);
        self.direct(&[power(s, 1.0), Bend { signal: s }]);
    }

    fn memory(&mut self, s: usize) {
        let x = power(s, 1.0);
        let plays = WIDTHS.map(|width| Play { signal: s, width });
        let turns = WIDTHS.map(|width| Turned { signal: s, width });
        let lates = DELAYS.map(|n| Late { signal: s, delay_s: n * self.inputs.grid.dt_s() });
        let lags: Vec<Factor> =
            self.times_s.iter().map(|&tau_s| Lag { signal: s, tau_s }).collect();
        let all = plays.into_iter().chain(turns).chain(lates).chain(lags);
        for memory in all.chain([Peak { signal: s }]) {
            self.direct(&[memory]);
            self.direct(&[x, memory]);
        }
        for tau_s in self.times_s.clone() {
            let lag = Lag { signal: s, tau_s };
            self.direct(&[lag, lag]);
            for form in [Linear, Magnitude, Sign] {
                self.direct(&[rate(s, form), lag]);
            }
        }
        for width in WIDTHS {
            let play = Play { signal: s, width };
            self.direct(&[rate(s, Magnitude), play]);
            self.direct(&[play, play]);
        }
    }

    fn slow(&mut self, s: usize) {
        let x = power(s, 1.0);
        for form in [Magnitude, Square, Sign, Rising] {
            self.lagged(&[rate(s, form)]);
        }
        self.lagged(&[power(s, 2.0)]);
        self.lagged(&[x, rate(s, Magnitude)]);
        self.lagged(&[Above {
            signal: s,
            at: self.inputs.quantile(s, 0.5, self.roles),
            power: 1.0,
        }]);
        for p in [0.5, 1.0] {
            self.direct(&[Travel { signal: s, power: p }]);
            self.direct(&[x, Travel { signal: s, power: p }]);
            self.direct(&[x, Time { power: p }]);
            self.direct(&[x, Session { power: p }]);
        }
        for width in WEAR {
            self.direct(&[TravelFade { signal: s, width }]);
            self.direct(&[x, TravelFade { signal: s, width }]);
        }
        for form in [Linear, Sign] {
            self.direct(&[rate(s, form), Time { power: 1.0 }]);
            self.direct(&[rate(s, form), Session { power: 1.0 }]);
        }
        for &tau_s in &self.times_s.clone()[2..] {
            self.direct(&[x, TimeFade { tau_s }]);
        }
    }

    /// Adds x of the signal `s` times the terms of the signal `other`.
    fn crossing(&mut self, s: usize, other: usize) {
        let x = power(s, 1.0);
        if s < other {
            self.direct(&[x, power(other, 1.0)]);
            self.direct(&[rate(s, Linear), rate(other, Linear)]);
        }
        self.direct(&[power(s, 2.0), power(other, 1.0)]);
        for form in [Linear, Magnitude, Sign, SignedRoot, SignedSquare] {
            self.direct(&[x, rate(other, form)]);
        }
        for &tau_s in &self.times_s.clone() {
            self.direct(&[x, Lag { signal: other, tau_s }]);
        }
        for width in WIDTHS {
            self.direct(&[x, Play { signal: other, width }]);
        }
        self.direct(&[x, Travel { signal: other, power: 1.0 }]);
    }

    fn command(&mut self, c: usize) {
        self.direct(&[power(c, 1.0)]);
        self.lagged(&[power(c, 1.0)]);
        for n in DELAYS {
            self.direct(&[Late { signal: c, delay_s: n * self.inputs.grid.dt_s() }]);
        }
    }

    fn commanded(&mut self, c: usize, s: usize) {
        let open = power(c, 1.0);
        for level in [power(s, 1.0), power(s, 2.0), Below { signal: s, at: 1.0, power: 1.0 }] {
            self.direct(&[open, level]);
            self.lagged(&[open, level]);
        }
        for form in [Linear, Sign] {
            self.direct(&[open, rate(s, form)]);
        }
    }

    /// Adds terms that act on the rate of the output. The output is their integral, which leaks in
    /// proportion to the openings.
    fn rates(&mut self, states: &[usize], commands: &[usize]) {
        let mut sources = vec![Vec::new(), vec![Session { power: 1.0 }], vec![Time { power: 1.0 }]];
        for &s in states {
            let x = power(s, 1.0);
            let lower = Below { signal: s, at: 1.0, power: 1.0 };
            for level in [x, power(s, 2.0), power(s, 0.5), lower] {
                sources.push(vec![level]);
                sources.extend(commands.iter().map(|&c| vec![power(c, 1.0), level]));
            }
            for form in [Linear, Magnitude, Sign] {
                sources.push(vec![rate(s, form)]);
            }
            for k in [1, 3, 5] {
                let lag = Lag { signal: s, tau_s: self.times_s[k] };
                sources.push(vec![lag]);
                sources.extend(commands.iter().map(|&c| vec![power(c, 1.0), lag]));
            }
            for c in commands {
                for clock in [Session { power: 1.0 }, Time { power: 1.0 }] {
                    sources.push(vec![power(*c, 1.0), x, clock]);
                }
            }
        }
        for &c in commands {
            sources.push(vec![power(c, 1.0)]);
            sources.push(vec![power(c, 2.0)]);
            for &tau_s in &self.times_s {
                sources.push(vec![Lag { signal: c, tau_s }]);
            }
            for n in DELAYS {
                sources.push(vec![Late { signal: c, delay_s: n * self.inputs.grid.dt_s() }]);
            }
        }
        for tau_s in [0.1, 0.3, 1.0, 3.0] {
            for source in &sources {
                self.terms.push(Term::new(source, Passage::Leak { tau_s }));
            }
        }
    }
}
