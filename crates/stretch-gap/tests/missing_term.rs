//! A gauge that lacks something that no catalogue holds: is it found again, and is what is random called so?

mod support;

use stretch_gap::{Diagnosis, Options, Proposed, VerdictKind, diagnose};
use support::{Gauge, Lack};

fn diagnosed(gauge: &Gauge) -> Diagnosis {
    let (diagnosis, _) = diagnose(gauge, &Options::default(), &|_| (), &|| false).expect("runs");
    diagnosis
}

fn proposed(gauge: &Gauge) -> Proposed {
    let diagnosis = diagnosed(gauge);
    assert_eq!(diagnosis.verdict, VerdictKind::Unknown, "{}", diagnosis.sentence);
    diagnosis.proposed.expect("an unknown gap has a proposal")
}

#[test]
fn look() {
    for lack in support::ALL {
        for seed in 0..3 {
            let t = std::time::Instant::now();
            let d = diagnosed(&Gauge::lacking(lack, seed));
            println!("{lack:?} {seed} {:?} {:?}", d.verdict, t.elapsed());
            if let Some(p) = d.proposed {
                println!("   {} odds {:.0} held {:.2}", p.sentence, p.log_odds, p.closes_held);
            }
        }
    }
}
