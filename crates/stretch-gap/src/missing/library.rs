//! The library: all terms that a stage may lack. It was chosen from physics, before the cases
//! existed on which it is evaluated.
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

/// Levels by which friction and commands are multiplied.
fn levels(signal: usize) -> [Factor; 3] {
    [power(signal, 1.0), power(signal, 2.0), Below { signal, at: 1.0, power: 1.0 }]
}

fn plays(signal: usize) -> [Factor; 5] {
    WIDTHS.map(|width| Play { signal, width })
}

impl Shelf<'_> {
    fn direct(&mut self, factors: &[Factor]) {
        self.terms.push(Term::new(factors, Passage::Direct));
    }

    /// Adds the product of `with` and each of the factors.
    fn each(&mut self, with: &[Factor], factors: impl IntoIterator<Item = Factor>) {
        factors.into_iter().for_each(|factor| self.direct(&[with, &[factor]].concat()));
    }

    /// Adds each of the factors, and each times x of the signal `s`.
    fn also_times(&mut self, s: usize, factors: impl IntoIterator<Item = Factor>) {
        for factor in factors {
            self.direct(&[factor]);
            self.direct(&[power(s, 1.0), factor]);
        }
    }

    fn lagged(&mut self, factors: &[Factor]) {
        let lagged = |&tau_s: &f64| Term::new(factors, Passage::Lag { tau_s });
        self.terms.extend(self.times_s.iter().map(lagged));
    }

    fn lags(&self, signal: usize) -> Vec<Factor> {
        self.times_s.iter().map(|&tau_s| Lag { signal, tau_s }).collect()
    }

    fn lates(&self, signal: usize) -> [Factor; 4] {
        DELAYS.map(|n| Late { signal, delay_s: n * self.inputs.grid.dt_s() })
    }

    fn fades(&self) -> Vec<Factor> {
        self.times_s[2..].iter().map(|&tau_s| TimeFade { tau_s }).collect()
    }

    fn clocks(&mut self) {
        self.direct(&[]);
        self.each(&[], [0.5, 1.0, 2.0].map(|power| Time { power }));
        self.each(&[], [0.5, 1.0].map(|power| Session { power }));
        self.each(&[], self.fades());
    }

    fn curves(&mut self, s: usize) {
        let signal = s;
        self.each(&[], [0.5, 1.0, 1.5, 2.0, 3.0, 4.0].map(|p| power(s, p)));
        let at = self.inputs.signals[s].centre();
        self.each(&[], [3, 4, 5].map(|power| Centred { signal, at, power }));
        for share in QUANTILES {
            let at = self.inputs.quantile(s, share, self.roles);
            for power in [1.0, 2.0] {
                self.each(&[], [Above { signal, at, power }, Below { signal, at, power }]);
            }
        }
        for width in WIDTHS {
            self.each(&[], [Low { signal, width }, High { signal, width }]);
        }
        for turns in TURNS {
            self.each(&[], [Sine { signal, turns }, Cosine { signal, turns }]);
        }
    }

    fn friction(&mut self, s: usize) {
        let forms = [Linear, Magnitude, Square, SignedSquare, SignedRoot, Sign, Striction, Rising];
        let rates = forms.map(|form| rate(s, form));
        self.each(&[], rates);
        levels(s).into_iter().for_each(|level| self.each(&[level], rates));
        self.also_times(s, [Bend { signal: s }]);
    }

    fn memory(&mut self, s: usize) {
        self.also_times(s, plays(s));
        self.also_times(s, WIDTHS.map(|width| Turned { signal: s, width }));
        self.also_times(s, self.lates(s));
        self.also_times(s, self.lags(s));
        self.also_times(s, [Peak { signal: s }]);
        for lag in self.lags(s) {
            self.direct(&[lag, lag]);
            for form in [Linear, Magnitude, Sign] {
                self.direct(&[rate(s, form), lag]);
            }
        }
        for play in plays(s) {
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
        let at = self.inputs.quantile(s, 0.5, self.roles);
        self.lagged(&[Above { signal: s, at, power: 1.0 }]);
        for power in [0.5, 1.0] {
            self.also_times(s, [Travel { signal: s, power }]);
            self.each(&[x], [Time { power }, Session { power }]);
        }
        self.also_times(s, WEAR.map(|width| TravelFade { signal: s, width }));
        for form in [Linear, Sign] {
            self.each(&[rate(s, form)], [Time { power: 1.0 }, Session { power: 1.0 }]);
        }
        self.each(&[x], self.fades());
    }

    /// Adds x of the signal `s` times the terms of the signal `other`.
    fn crossing(&mut self, s: usize, other: usize) {
        let x = power(s, 1.0);
        if s < other {
            self.direct(&[x, power(other, 1.0)]);
            self.direct(&[rate(s, Linear), rate(other, Linear)]);
        }
        self.direct(&[power(s, 2.0), power(other, 1.0)]);
        let forms = [Linear, Magnitude, Sign, SignedRoot, SignedSquare];
        self.each(&[x], forms.map(|form| rate(other, form)));
        self.each(&[x], self.lags(other));
        self.each(&[x], plays(other));
        self.direct(&[x, Travel { signal: other, power: 1.0 }]);
    }

    fn command(&mut self, c: usize) {
        self.direct(&[power(c, 1.0)]);
        self.lagged(&[power(c, 1.0)]);
        self.each(&[], self.lates(c));
    }

    fn commanded(&mut self, c: usize, s: usize) {
        let open = power(c, 1.0);
        for level in levels(s) {
            self.direct(&[open, level]);
            self.lagged(&[open, level]);
        }
        self.each(&[open], [Linear, Sign].map(|form| rate(s, form)));
    }

    /// Adds terms that act on the rate of the output. The output is their integral, which leaks in
    /// proportion to the openings.
    fn rates(&mut self, states: &[usize], commands: &[usize]) {
        let clocks = [Session { power: 1.0 }, Time { power: 1.0 }];
        let mut sources = vec![Vec::new(), vec![clocks[0]], vec![clocks[1]]];
        let open = |source: &[Factor]| {
            commands.iter().map(|&c| [&[power(c, 1.0)][..], source].concat()).collect::<Vec<_>>()
        };
        for &s in states {
            let lags = self.lags(s);
            let gated =
                [power(s, 0.5)].into_iter().chain(levels(s)).chain([lags[1], lags[3], lags[5]]);
            for factor in gated {
                sources.push(vec![factor]);
                sources.extend(open(&[factor]));
            }
            sources.extend([Linear, Magnitude, Sign].map(|form| vec![rate(s, form)]));
            clocks.iter().for_each(|clock| sources.extend(open(&[power(s, 1.0), *clock])));
        }
        for &c in commands {
            let own = [power(c, 1.0), power(c, 2.0)].into_iter().chain(self.lags(c));
            sources.extend(own.chain(self.lates(c)).map(|factor| vec![factor]));
        }
        for tau_s in [0.1, 0.3, 1.0, 3.0] {
            let leaking = |source: &Vec<Factor>| Term::new(source, Passage::Leak { tau_s });
            self.terms.extend(sources.iter().map(leaking));
        }
    }
}
