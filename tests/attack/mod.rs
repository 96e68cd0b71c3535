//! Attacks on the program from outside: wrong input, outputs over inputs, kills, full disks,
//! endless files.
//!
//! Most files contain one kind of attack as a table of cases, so that a new case is one line. The
//! table in `book/src/results/trust.md` states how often each attack is made.

mod bad_input;
mod doubts;
mod growth;
mod kills;
mod limits;
mod nonsense;
mod orphans;
mod overwrites;
mod silence;
mod soak;
mod streams;
mod whole_or_nothing;
mod wrong_advice;
