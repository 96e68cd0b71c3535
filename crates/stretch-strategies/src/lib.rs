#![doc = include_str!("../README.md")]

mod calibrations;
mod files;
mod observations;
mod pairs;
mod signals;
mod voltages;

pub use calibrations::{
    calibration, degree, diagnosed_calibration, diagnosed_map, history_calibration, history_map,
    live_rate_estimator, normalisation, observer_calibration, observer_map, paper_calibration,
    range, surface, surface_of,
};
pub use files::{any_trial, data_set, faulty_csv, number, parameter, rig_file, rig_trial};
pub use observations::{Observations, observations};
pub use pairs::{faulty_pairs, lagged, pairs};
pub use signals::{Signal, Sine, faulty_stream, polynomial, sines, uneven_times};
pub use voltages::{Fault, clean_voltages, fault, faulty_voltages};
