//! Priors and sessions as JSON files with a digest.

use std::path::Path;

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use stretch_calibrate::digest;
use stretch_core::Interval;
use stretch_data::files::read_whole;

use crate::{SleeveError, calibrate::bank::Bank};

use super::{
    learnt::Prior,
    session::{SCHEMA, Session, packed, unpacked},
    tree::Known,
};

/// The kind of a file, and how to make the file again.
const PRIOR: [&str; 2] = ["prior", "learn it again with stretch sleeve learn"];
const SESSION: [&str; 2] = ["session", "write it again with stretch calibrate --session"];

fn problem([what, again]: [&str; 2], file: &str, problem: impl std::fmt::Display) -> SleeveError {
    let problem = format!("this {what} cannot be used: {problem}; {again}");
    SleeveError::Prior { file: file.to_owned(), problem }
}

impl Prior {
    /// Reads a prior.
    ///
    /// # Errors
    /// [`SleeveError::Prior`] with the file and what is wrong with it.
    pub fn read(path: &Path) -> Result<Self, SleeveError> {
        let (prior, file): (Self, _) = opened(PRIOR, path)?;
        if prior.schema != SCHEMA {
            return Err(problem(PRIOR, &file, "it was written by another release"));
        }
        let terms = 1 + prior.domains.len() * Bank::terms_a_channel();
        let has_domain = |d: &Vec<Interval>| !d.is_empty() && d.iter().all(|d| d.min < d.max);
        let is_whole = |matrix: &DMatrix<f64>| matrix.ncols() == terms;
        let is_known = |own: &Known| own.mean.len() == terms && is_whole(&own.covariance);
        let is_good = prior.domains.len() == prior.signals.len()
            && prior.still_samples.len() == prior.signals.len()
            && prior.domains.iter().all(has_domain)
            && prior.known.iter().all(is_known)
            && prior.known.first().is_some_and(|root| root.path.is_empty())
            && prior.noise > 0.0
            && prior.zero_moves.iter().all(|x| x.is_finite() && *x > 0.0)
            && prior.levels.iter().chain([&prior.gram]).all(is_whole);
        match is_good {
            true => Ok(prior),
            false => {
                Err(problem(PRIOR, &file, "it has too many or too few numbers for its channels"))
            }
        }
    }

    /// Returns the prior in JSON.
    ///
    /// # Errors
    /// Never, because all of its numbers are finite.
    pub fn to_json(&self) -> Result<String, SleeveError> {
        sealed(PRIOR, self, "prior")
    }
}

/// Returns an object in JSON with its digest as the last field.
fn sealed(what: [&str; 2], record: &impl Serialize, name: &str) -> Result<String, SleeveError> {
    let object = serde_json::to_string(record).map_err(|error| problem(what, name, error))?;
    digest::join(&object).ok_or_else(|| problem(what, name, "it is not a JSON object"))
}

/// Checks the digest of a file and reads its object.
fn opened<T: for<'d> Deserialize<'d>>(
    what: [&str; 2],
    path: &Path,
) -> Result<(T, String), SleeveError> {
    let file = path.display().to_string();
    let unusable = |error: &dyn std::fmt::Display| problem(what, &file, error);
    let bytes = read_whole(path).map_err(|error| unusable(&error))?;
    let text = String::from_utf8(bytes).map_err(|error| unusable(&error))?;
    let object = digest::verified(&text, "an unchanged copy can still be used");
    let object = object.map_err(|error| unusable(&error))?;
    if ["\"signal\":", "\"channels\":"].iter().any(|key| object.contains(key)) {
        return Err(SleeveError::Prior {
            problem: format!("this is a calibration, not a {}; {}", what[0], what[1]),
            file,
        });
    }
    let value = digest::parse(&object);
    Ok((value.map_err(|error| unusable(&error))?, file))
}

impl Session {
    /// Reads a session that [`Session::to_json`] wrote.
    ///
    /// # Errors
    /// [`SleeveError::Prior`] with the file and what is wrong with it.
    pub fn read(path: &Path) -> Result<Self, SleeveError> {
        let (session, file): (Self, _) = opened(SESSION, path)?;
        session.check(&file)?;
        Ok(session)
    }

    /// Returns the session in JSON.
    ///
    /// # Errors
    /// Never, because all of its numbers are finite.
    pub fn to_json(&self) -> Result<String, SleeveError> {
        sealed(SESSION, self, &self.name)
    }
}

/// A symmetric matrix as its upper triangle, row by row.
pub(crate) mod triangle {
    use super::*;

    pub(crate) fn serialize<S: Serializer>(own: &DMatrix<f64>, to: S) -> Result<S::Ok, S::Error> {
        packed(own).serialize(to)
    }

    /// Returns an empty matrix if the count of numbers does not match a triangle.
    pub(crate) fn deserialize<'d, D: Deserializer<'d>>(from: D) -> Result<DMatrix<f64>, D::Error> {
        Vec::deserialize(from).map(|own| mirrored(&own))
    }
}

/// Symmetric matrices as [`triangle`]s.
pub(crate) mod triangles {
    use super::*;

    pub(crate) fn serialize<S: Serializer>(all: &[DMatrix<f64>], to: S) -> Result<S::Ok, S::Error> {
        to.collect_seq(all.iter().map(packed))
    }

    pub(crate) fn deserialize<'d, D: Deserializer<'d>>(
        from: D,
    ) -> Result<Vec<DMatrix<f64>>, D::Error> {
        let all: Vec<Vec<f64>> = Vec::deserialize(from)?;
        Ok(all.iter().map(|own| mirrored(own)).collect())
    }
}

/// A vector as a list.
pub(crate) mod list {
    use super::*;

    pub(crate) fn serialize<S: Serializer>(own: &DVector<f64>, to: S) -> Result<S::Ok, S::Error> {
        own.as_slice().serialize(to)
    }

    pub(crate) fn deserialize<'d, D: Deserializer<'d>>(from: D) -> Result<DVector<f64>, D::Error> {
        Vec::deserialize(from).map(DVector::from_vec)
    }
}

/// Returns the symmetric matrix with this upper triangle.
fn mirrored(numbers: &[f64]) -> DMatrix<f64> {
    let columns = (1..=numbers.len()).find(|n| n * (n + 1) / 2 >= numbers.len()).unwrap_or(0);
    let mut upper = unpacked(numbers, columns).unwrap_or_else(|| DMatrix::zeros(0, 0));
    upper.fill_lower_triangle_with_upper_triangle();
    upper
}
