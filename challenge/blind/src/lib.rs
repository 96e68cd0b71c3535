//! Makes data sets with a known, sealed cause, and scores diagnoses of them. The README of
//! `challenge/` describes the cases.
//!
//! ```
//! use stretch_blind::{Plan, Score, Truth, Verdict, make};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let dir = tempfile::tempdir()?;
//! let plan = Plan { single: 1, ..Plan::of(0) };
//! let sha256 = make(dir.path(), 7, &plan, &|done| eprintln!("{done} made"))?;
//! println!("{sha256}"); // before anything is diagnosed
//!
//! // A diagnosis that never sees `sealed/` reads case-000 and answers:
//! let answer = serde_json::json!({
//!     "schema": 2, "verdict": "no_gap", "named": [], "ambiguous": [], "candidates": [], "runtime_s": 0.1
//! });
//! let verdict = Verdict::from_diagnosis("case-000", &answer)?;
//!
//! let (truth, _) = Truth::open(dir.path())?; // an error if a label was altered
//! let score = Score::of(&truth, &[verdict])?;
//! assert_eq!(score.misses.len(), usize::from(truth.cases["case-000"].excess >= 0.1));
//! # Ok(())
//! # }
//! ```

mod case;
mod curve;
mod disturbances;
mod effect;
mod electric;
mod error;
mod excess;
mod friction;
mod gauge;
mod lags;
mod laws;
mod make;
mod plan;
mod plant;
mod plants;
mod pneumatics;
mod protocol;
mod random;
mod rate;
mod rig;
mod score;
mod seal;
mod session;
mod submission;
mod timing;
mod truth;
mod verdict;
pub use effect::{Family, Stage};
pub use error::BlindError;
pub use make::make;
pub use plan::Plan;
pub use plants::{
    Form, FormFamily, Level, OpenLabel, OpenTruth, PlantName, make_set, sealed_beside,
};
pub use rate::{Bin, Calibration, Rate};
pub use score::{COUNTED_EXCESS, Compounds, Miss, Score, Singles};
pub use submission::{Answer, Believed, Figures, Interval, OpenScore, Outcome, Said, Submission};
pub use truth::{Acting, CaseKind, Label, TWINS, Truth, are_twins};
pub use verdict::Verdict;
