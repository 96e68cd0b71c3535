//! Estimates of a trial as CSV.

use std::io::{self, Write};

use stretch_core::{Calibration, Model};
use stretch_data::{Trial, push_number, unit};
use stretch_receptor::{Reading, Withheld};

use super::Applied;

impl Applied {
    /// Writes the estimates of a trial as CSV: [`estimates_header`], and one row for each sample.
    ///
    /// # Errors
    /// Errors of the writer.
    ///
    /// ```
    /// use stretch_calibrate::apply;
    /// # use stretch_data::{Channel, Trial};
    /// # let calibration = stretch_receptor::example_calibration();
    /// # let time_s = (0..20).map(|n| f64::from(n) * 0.01).collect();
    /// # let channels = vec![Channel { name: "bridge_v".into(), values: vec![1.5; 20] }];
    /// # let trial = Trial { name: "still".into(), time_s, channels };
    /// let mut csv = Vec::new();
    /// apply(&calibration, &trial)?.write_csv(&calibration, &trial, &mut csv)?;
    /// assert!(csv.starts_with(b"time_s,estimate_mm,rate_mm_per_s,branch,domain\n0,,,,"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn write_csv(
        &self,
        calibration: &Calibration,
        trial: &Trial,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        out.write_all(estimates_header(calibration).as_bytes())?;
        let mut line = Vec::with_capacity(64);
        for (&time_s, reading) in trial.time_s.iter().zip(&self.readings) {
            line.clear();
            push_estimate(&mut line, time_s, reading, calibration);
            out.write_all(&line)?;
        }
        Ok(())
    }
}

/// Returns the header `time_s,estimate_mm,rate_mm_per_s,branch,domain`, with the unit of the
/// reference. The column `sd_mm` is added if the model computes a standard deviation.
///
/// ```
/// let calibration = stretch_receptor::example_calibration();
/// let header = stretch_calibrate::estimates_header(&calibration);
/// assert_eq!(header, "time_s,estimate_mm,rate_mm_per_s,branch,domain\n");
/// ```
pub fn estimates_header(calibration: &Calibration) -> String {
    let unit = unit(calibration.spec().reference.as_str())
        .map_or(String::new(), |unit| format!("_{unit}"));
    let sd = if knows_sd(calibration) { format!(",sd{unit}") } else { String::new() };
    format!("time_s,estimate{unit},rate{unit}_per_s,branch,domain{sd}\n")
}

fn knows_sd(calibration: &Calibration) -> bool {
    matches!(calibration.spec().model, Model::Diagnosed(_))
}

/// Appends the row of a sample, with its time in seconds, in the columns of [`estimates_header`]. Without a reading the
/// numbers are empty, and the column domain gives the reason.
///
/// ```
/// use stretch_receptor::Withheld;
/// let calibration = stretch_receptor::example_calibration();
/// let mut line = Vec::new();
/// stretch_calibrate::push_estimate(&mut line, 0.5, &Err(Withheld::Warming), &calibration);
/// assert_eq!(line, format!("0.5,,,,{}\n", Withheld::Warming).into_bytes());
/// ```
pub fn push_estimate(
    line: &mut Vec<u8>,
    time_s: f64,
    reading: &Result<Reading, Withheld>,
    calibration: &Calibration,
) {
    push_number(line, time_s);
    // Writing to memory cannot fail.
    let _ = match reading {
        Ok(Reading { estimate, rate, branch, domain, sd }) => {
            let branch = calibration.spec().target.branch_name(*branch);
            let written = match rate.is_nan() {
                true => write!(line, ",{estimate:.6},,{branch},{domain}"),
                false => write!(line, ",{estimate:.6},{rate:.6},{branch},{domain}"),
            };
            match sd.filter(|_| knows_sd(calibration)) {
                Some(sd) => written.and_then(|()| write!(line, ",{sd:.6}")),
                None => written,
            }
        }
        Err(withheld) => {
            write!(line, ",,,,{withheld}{}", if knows_sd(calibration) { "," } else { "" })
        }
    };
    line.push(b'\n');
}
