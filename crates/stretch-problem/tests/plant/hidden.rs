//! Plants with effects that the servo of the simulator lacks, each written from its equation,
//! without any operator of the project.

use super::{DT_S, plain};

/// A hidden effect: its name, and the plant that has it.
pub(crate) type Hidden = (&'static str, Box<dyn Fn(&[f64], f64) -> Vec<f64>>);

pub(crate) fn hidden() -> Vec<Hidden> {
    vec![
        (
            "input.delay",
            Box::new(|u, _| {
                let late: Vec<f64> = (0..u.len()).map(|i| u[i.saturating_sub(7)]).collect();
                plain(&late, 0.0)
            }),
        ),
        (
            "input.dead_zone",
            Box::new(|u, _| {
                let dead: Vec<f64> = u.iter().map(|u| u - u.clamp(-0.4, 0.4)).collect();
                plain(&dead, 0.0)
            }),
        ),
        (
            "input.saturation",
            Box::new(|u, _| {
                let held: Vec<f64> = u.iter().map(|u| u.clamp(-3.5, 3.5)).collect();
                plain(&held, 0.0)
            }),
        ),
        (
            "output.lag",
            Box::new(|u, _| {
                let mut z = None;
                let slow = |y: f64| {
                    let z = z.get_or_insert(y);
                    *z += (y - *z) * (1.0 - (-DT_S / 0.04_f64).exp());
                    *z
                };
                plain(u, 0.0).into_iter().map(slow).collect()
            }),
        ),
        (
            "output.backlash",
            Box::new(|u, _| {
                let mut z = 0.0_f64;
                plain(u, 0.0)
                    .into_iter()
                    .map(|y| {
                        z = z.clamp(y - 1.0, y + 1.0);
                        z
                    })
                    .collect()
            }),
        ),
        (
            "output.curve",
            Box::new(|u, _| plain(u, 0.0).into_iter().map(|y| y + 0.0006 * y * y).collect()),
        ),
        (
            "output.saturation",
            Box::new(|u, _| plain(u, 0.0).into_iter().map(|y| y.min(35.0)).collect()),
        ),
        (
            "output.drift",
            Box::new(|u, start_s| {
                let y = plain(u, 0.0).into_iter().enumerate();
                y.map(|(i, y)| y + 0.01 * (start_s + i as f64 * DT_S)).collect()
            }),
        ),
        (
            "input.slew_limit",
            Box::new(|u, _| {
                let mut z = u[0];
                let slow = |u: &f64| {
                    z += (u - z).clamp(-0.12, 0.12);
                    z
                };
                plain(&u.iter().map(slow).collect::<Vec<_>>(), 0.0)
            }),
        ),
        (
            "input.backlash",
            Box::new(|u, _| {
                let mut z = 0.0_f64;
                let play = |u: &f64| {
                    z = z.clamp(u - 0.4, u + 0.4);
                    z
                };
                plain(&u.iter().map(play).collect::<Vec<_>>(), 0.0)
            }),
        ),
        (
            "input.curve",
            Box::new(|u, _| plain(&u.iter().map(|u| u + 0.012 * u * u).collect::<Vec<_>>(), 0.0)),
        ),
        (
            "input.offset",
            Box::new(|u, _| {
                // The servo rests before the first command, so that an offset of the command
                // differs from an offset of the angle.
                plain(&u.iter().map(|u| u + 0.5).collect::<Vec<_>>(), 0.0)
            }),
        ),
        (
            "output.skew",
            Box::new(|u, _| {
                let y = plain(u, 0.0);
                (0..y.len()).map(|i| y[(i + 5).min(y.len() - 1)]).collect()
            }),
        ),
        (
            "output.second_order_lag",
            Box::new(|u, _| {
                let (mut x, mut v) = (0.2, 0.0);
                let y = plain(u, 0.0).into_iter();
                y.map(|y| {
                    for _ in 0..20 {
                        v += 5e-4 * (y - x - 2.0 * 0.2 * 0.05 * v) / 0.0025;
                        x += 5e-4 * v;
                    }
                    x
                })
                .collect()
            }),
        ),
        (
            "output.relaxation",
            Box::new(|u, _| {
                let mut z = 0.2;
                let y = plain(u, 0.0).into_iter();
                y.map(|y| {
                    z += (y - z) * DT_S / 0.8;
                    y + 0.12 * (y - z)
                })
                .collect()
            }),
        ),
        (
            "output.hysteresis",
            Box::new(|u, _| {
                let mut z = [0.0_f64; 4];
                let radii = [2.0, 5.0, 9.0, 14.0];
                let y = plain(u, 0.0).into_iter();
                y.map(|y| {
                    z.iter_mut().zip(radii).for_each(|(z, r)| *z = z.clamp(y - r, y + r));
                    y - 0.06 * z.iter().map(|z| y - z).sum::<f64>()
                })
                .collect()
            }),
        ),
        (
            "output.bouc_wen",
            Box::new(|u, _| {
                let (mut w, mut before) = (0.0_f64, 0.2);
                let y = plain(u, 0.0).into_iter();
                y.map(|y| {
                    let dx = (y - before) / 200.0;
                    before = y;
                    for _ in 0..200 {
                        w += (dx - 0.5 * dx.abs() * w - 0.5 * dx * w.abs()) / 6.0;
                    }
                    y - 2.0 * w
                })
                .collect()
            }),
        ),
        (
            "output.quantisation",
            Box::new(|u, _| plain(u, 0.0).into_iter().map(|y| (y / 1.5).round() * 1.5).collect()),
        ),
        (
            "output.softening",
            Box::new({
                // The travel accumulates from trial to trial.
                let worked = std::cell::Cell::new((0.0, 0.2));
                move |u, _| {
                    let soften = |y: f64| {
                        let (travel, before) = worked.get();
                        let travel = travel + (y - before).abs();
                        worked.set((travel, y));
                        -55.0 + (y + 55.0) * (1.0 - 0.08 * (1.0 - (-travel / 2500.0_f64).exp()))
                    };
                    plain(u, 0.0).into_iter().map(soften).collect()
                }
            }),
        ),
        (
            "output.crosstalk(command_V)",
            Box::new(|u, _| plain(u, 0.0).into_iter().zip(u).map(|(y, u)| y + 0.3 * u).collect()),
        ),
        (
            "output.hum",
            Box::new(|u, start_s| {
                let y = plain(u, 0.0).into_iter().enumerate();
                y.map(|(i, y)| y + 0.2 * (314.0 * (start_s + i as f64 * DT_S) + 0.4).sin())
                    .collect()
            }),
        ),
        ("input.profile", Box::new(|u, _| plain(&trapezoid(u, 60.0, 8.0), 0.0))),
        // The S profile is a `profile` with rounded corners.
        ("input.profile", Box::new(|u, _| plain(&jerk_limited(u, [1000.0, 60.0, 8.0]), 0.0))),
        (
            "input.firmware_dead_band",
            Box::new(|u, _| {
                let mut z = u[0];
                let held = |u: &f64| {
                    if (u - z).abs() > 0.35 {
                        z = *u;
                    }
                    z
                };
                plain(&u.iter().map(held).collect::<Vec<_>>(), 0.0)
            }),
        ),
        (
            "output.flexible_joint",
            Box::new(|u, _| {
                // m y'' = k (x - y) + d (x' - y') in steps of 1/20 of a sample, a natural frequency of 4 Hz.
                let (k, d) = (25.0_f64.powi(2), 2.0 * 0.08 * 25.0);
                let (mut y, mut v, mut before) = (0.2, 0.0, 0.2);
                let x = plain(u, 0.0).into_iter();
                x.map(|x| {
                    let slope = (x - before) / DT_S;
                    for i in 0..20 {
                        let at = before + (x - before) * (f64::from(i) + 0.5) / 20.0;
                        v += DT_S / 20.0 * (k * (at - y) + d * (slope - v));
                        y += DT_S / 20.0 * v;
                    }
                    before = x;
                    y
                })
                .collect()
            }),
        ),
        (
            "output.clock_drift",
            Box::new(|u, start_s| {
                let y = plain(u, 0.0);
                let at = |i: usize| {
                    let late = 0.02 + 6e-4 * (start_s + i as f64 * DT_S);
                    let t = (i as f64 - late / DT_S).max(0.0);
                    let (k, share) = (t.floor() as usize, t.fract());
                    y[k] + share * (y[(k + 1).min(y.len() - 1)] - y[k])
                };
                (0..y.len()).map(at).collect()
            }),
        ),
        ("brake", Box::new(|u, _| plain(u, 3.0))),
    ]
}

/// Follows a command with limits of acceleration and rate (bang-bang control), in steps of 1/50 of a
/// sample.
fn trapezoid(u: &[f64], acceleration: f64, rate: f64) -> Vec<f64> {
    let h = DT_S / 50.0;
    let (mut y, mut v) = (u[0], 0.0_f64);
    let follow = |u: &f64| {
        let shown = y;
        for _ in 0..50 {
            let apart = u - y;
            // Distance to the command that remains if braking begins now.
            let past = apart - v * v.abs() / (2.0 * acceleration);
            v = (v + past.signum() * acceleration * h).clamp(-rate, rate);
            if apart.abs() < acceleration * h * h && v.abs() < 2.0 * acceleration * h {
                (y, v) = (*u, 0.0);
            }
            y += v * h;
        }
        shown
    };
    u.iter().map(follow).collect()
}

/// Follows a command as quickly as the limits of jerk, acceleration and rate allow (Haschke,
/// Weitnauer and Ritter, doi 10.1109/IROS.2008.4650924). The jerk has its limit at all times:
/// towards the greatest rate, or, if braking from now on would end beyond the command, against it.
/// A step is 1/50 of a sample.
pub(crate) fn jerk_limited(u: &[f64], limits: [f64; 3]) -> Vec<f64> {
    let [jerk, acceleration, rate] = limits;
    let h = DT_S / 50.0;
    let (mut y, mut v, mut a) = (u[0], 0.0_f64, 0.0_f64);
    let follow = |u: &f64| {
        let shown = y;
        for _ in 0..50 {
            let side = (u - y - way_to_rest(v, a, limits)).signum();
            let wanted = if side * v < 0.0 { 0.0 } else { side * rate };
            // The speed that is reached if the acceleration is reduced to 0 now.
            let comes_to = v + 0.5 * a * a.abs() / jerk;
            let push = if side * (wanted - comes_to) > 0.0 { side } else { -side };
            a = (a + push * jerk * h).clamp(-acceleration, acceleration);
            v += a * h;
            y += v * h;
        }
        shown
    };
    u.iter().map(follow).collect()
}

/// Distance until rest, with the hardest braking that jerk and acceleration allow.
fn way_to_rest(v: f64, a: f64, [jerk, acceleration, _]: [f64; 3]) -> f64 {
    let side = (v + 0.5 * a * a.abs() / jerk).signum();
    let (mut v, mut a) = (side * v, side * a);
    let peak = (jerk * v + 0.5 * a * a).max(0.0).sqrt().min(acceleration);
    let holds = ((v + 0.5 * a * a / jerk - peak * peak / jerk) / peak.max(1e-12)).max(0.0);
    let mut way = 0.0;
    for (j, t) in [(-jerk, (a + peak) / jerk), (0.0, holds), (jerk, peak / jerk)] {
        way += t * (v + t * (a / 2.0 + t * j / 6.0));
        v += t * (a + t * j / 2.0);
        a += t * j;
    }
    side * way
}
