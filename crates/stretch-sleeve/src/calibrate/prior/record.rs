//! Priors as files in JSON, under a digest.

use std::path::Path;

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use stretch_calibrate::digest;
use stretch_core::{Interval, Range, Target};
use stretch_data::files::read_whole;

use crate::{
    SleeveError,
    calibrate::{array::Still, bank::Bank},
};

use super::{
    expected::Expected,
    landmarks::LANDMARKS,
    learnt::Prior,
    session::{SCHEMA, Session, packed, unpacked},
    tree::Normal,
};

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Record {
    schema: u32,
    signals: Vec<String>,
    reference: String,
    sample_rate_hz: f64,
    sessions: usize,
    expected: Vec<Expected>,
    target: Target,
    target_range: Range,
    estimate: Interval,
    domains: Vec<Vec<Interval>>,
    known: Vec<Known>,
    levels: Vec<Vec<f64>>,
    noise: f64,
    gram: Vec<f64>,
    still_samples: Vec<u32>,
    still_seen: u64,
    landmarks: Vec<Landmarks>,
}

/// A session's path and its landmarks.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Landmarks {
    path: Vec<String>,
    at: [f64; LANDMARKS],
}

/// A path that was seen, with mean and covariance (upper triangle, row by row) of its coefficients.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Known {
    path: Vec<String>,
    mean: Vec<f64>,
    covariance: Vec<f64>,
}

fn problem(file: &str, problem: impl std::fmt::Display) -> SleeveError {
    let problem = format!(
        "this is no prior that can be used: {problem}; learn it again with stretch sleeve learn"
    );
    SleeveError::Prior { file: file.to_owned(), problem }
}

impl Prior {
    /// Reads a prior.
    ///
    /// # Errors
    /// [`SleeveError::Prior`] with the file and what is wrong with it.
    pub fn read(path: &Path) -> Result<Self, SleeveError> {
        let (record, file): (Record, _) = opened(path)?;
        if record.schema != SCHEMA {
            return Err(problem(&file, "it was written by another release"));
        }
        let wrong = || problem(&file, "its numbers are not as many as its channels need");
        let has_domain = |d: &Vec<Interval>| !d.is_empty() && d.iter().all(|d| d.min < d.max);
        if record.domains.len() != record.signals.len()
            || record.still_samples.len() != record.signals.len()
            || !record.domains.iter().all(has_domain)
        {
            return Err(wrong());
        }
        let terms = Bank::new(record.domains.clone()).terms();
        let matrix = |numbers: &Vec<f64>| {
            let upper = unpacked(numbers, terms).ok_or_else(wrong)?;
            Ok::<_, SleeveError>(mirrored(upper))
        };
        let known: Result<Vec<_>, SleeveError> = record
            .known
            .iter()
            .map(|known| {
                if known.mean.len() != terms {
                    return Err(wrong());
                }
                let mean = DVector::from_column_slice(&known.mean);
                Ok((known.path.clone(), Normal { mean, covariance: matrix(&known.covariance)? }))
            })
            .collect();
        let known = known?;
        if known.first().is_none_or(|(path, _)| !path.is_empty())
            || record.noise.is_nan()
            || record.noise <= 0.0
        {
            return Err(wrong());
        }
        Ok(Self {
            levels: record.levels.iter().map(matrix).collect::<Result<_, _>>()?,
            gram: matrix(&record.gram)?,
            known,
            signals: record.signals,
            reference: record.reference,
            sample_rate_hz: record.sample_rate_hz,
            sessions: record.sessions,
            expected: record.expected,
            target: record.target,
            target_range: record.target_range,
            estimate: record.estimate,
            domains: record.domains,
            noise: record.noise,
            still: Still { longest: record.still_samples, samples: record.still_seen },
            landmarks: record.landmarks.into_iter().map(|l| (l.path, l.at)).collect(),
        })
    }

    /// The prior in JSON.
    ///
    /// # Errors
    /// Never, because all of its numbers are finite.
    pub fn to_json(&self) -> Result<String, SleeveError> {
        let known = self.known.iter().map(|(path, normal)| Known {
            path: path.clone(),
            mean: normal.mean.iter().copied().collect(),
            covariance: packed(&normal.covariance),
        });
        let record = Record {
            schema: SCHEMA,
            signals: self.signals.clone(),
            reference: self.reference.clone(),
            sample_rate_hz: self.sample_rate_hz,
            sessions: self.sessions,
            expected: self.expected.clone(),
            target: self.target,
            target_range: self.target_range,
            estimate: self.estimate,
            domains: self.domains.clone(),
            known: known.collect(),
            levels: self.levels.iter().map(packed).collect(),
            noise: self.noise,
            gram: packed(&self.gram),
            still_samples: self.still.longest.clone(),
            still_seen: self.still.samples,
            landmarks: self
                .landmarks
                .iter()
                .map(|(path, at)| Landmarks { path: path.clone(), at: *at })
                .collect(),
        };
        sealed(&record, "prior")
    }
}

/// An object in JSON with its digest as the last field.
fn sealed(record: &impl Serialize, name: &str) -> Result<String, SleeveError> {
    let object = serde_json::to_string(record).map_err(|error| problem(name, error))?;
    digest::join(&object).ok_or_else(|| problem(name, "it is no object"))
}

/// The object of a file whose digest is that of its text.
fn opened<T: for<'d> Deserialize<'d>>(path: &Path) -> Result<(T, String), SleeveError> {
    let file = path.display().to_string();
    let bytes = read_whole(path).map_err(|error| problem(&file, error))?;
    let text = String::from_utf8(bytes).map_err(|error| problem(&file, error))?;
    let (object, found) = digest::split(&text);
    if found != Some(digest::digest(&object).as_str()) {
        return Err(problem(
            &file,
            "its digest is not that of its text, so it was edited or damaged",
        ));
    }
    let mut json = serde_json::Deserializer::from_str(&object);
    let value = serde_path_to_error::deserialize(&mut json).map_err(|e| problem(&file, e))?;
    Ok((value, file))
}

impl Session {
    /// Reads a session that [`Session::to_json`] wrote.
    ///
    /// # Errors
    /// [`SleeveError::Prior`] with the file and what is wrong with it.
    pub fn read(path: &Path) -> Result<Self, SleeveError> {
        let (session, file): (Self, _) = opened(path)?;
        session.check(&file)?;
        Ok(session)
    }

    /// The session in JSON.
    ///
    /// # Errors
    /// Never, because all of its numbers are finite.
    pub fn to_json(&self) -> Result<String, SleeveError> {
        sealed(self, &self.name)
    }
}

/// The symmetric matrix of an upper triangle.
fn mirrored(mut upper: DMatrix<f64>) -> DMatrix<f64> {
    upper.fill_lower_triangle_with_upper_triangle();
    upper
}
