//! Readers of the published recordings in their original folders.

use std::{fs, path::Path};

use stretch_data::{Channel, Trial};

/// One session of one wearer.
pub(crate) struct Worn {
    pub(crate) wearer: String,
    pub(crate) activity: String,
    pub(crate) name: String,
    pub(crate) trials: Vec<Trial>,
}

/// Sessions of a published set, and the names of its columns.
pub(crate) struct Set {
    pub(crate) signals: Vec<String>,
    pub(crate) reference: String,
    pub(crate) worn: Vec<Worn>,
}

/// Reads the authors' regression data: files such as `S1_2_HC45.csv`, sampled at 100 Hz, without a header. Each file
/// contains two concatenated sessions of one wearer. A session begins where all five signals are zero, because they are
/// relative to its first sample. If no row is zero, the second session begins at the largest jump of all columns
/// together.
///
/// The gains show that both sessions of a file are from one wearer: their gains differ by a fifth of the difference
/// between files of the same movement.
pub(crate) fn sleeves(folder: &Path) -> anyhow::Result<Set> {
    let mut worn = Vec::new();
    for path in files(folder)? {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
        let parts: Vec<&str> = stem.trim_start_matches('s').splitn(3, '_').collect();
        let [first, second, activity] = parts[..] else { continue };
        let rows = rows(&path)?;
        let cut = boundary(&rows);
        for (session, rows) in [(first, &rows[..cut]), (second, &rows[cut..])] {
            // The shortest useful session has one minute whose reference may be used, and half a minute that is judged.
            if rows.len() < 9000 {
                continue;
            }
            let name = format!("s{session}_{activity}");
            let names = ["angle_deg", "s1", "s2", "s3", "s4", "s5"];
            let channel = |(c, name): (usize, &&str)| Channel {
                name: (*name).to_owned(),
                values: rows.iter().map(|row| row[c]).collect(),
            };
            let trial = Trial {
                name: name.clone(),
                time_s: (0..rows.len()).map(|i| i as f64 * 0.01).collect(),
                channels: names.iter().enumerate().map(channel).collect(),
            };
            let (wearer, activity) = (format!("{first}-{second}"), activity.to_owned());
            worn.push(Worn { wearer, activity, name, trials: vec![trial] });
        }
    }
    let signals = (1..=5).map(|k| format!("s{k}")).collect();
    Ok(Set { signals, reference: "angle_deg".into(), worn })
}

/// Reads one ankle of ten people, at 125 Hz: files such as `P001_WALK1_BF.csv`, whose first columns are named in their
/// header. The six barefoot walks of a person are one session, those in shoes another.
///
/// The foot is `L` or `R`. The angle is `FLX` (flexion) or `IEV` (inversion). The signals are those of the given feet:
/// five of one ankle, or ten of both.
pub(crate) fn ankles(folder: &Path, foot: &str, angle: &str, feet: &[&str]) -> anyhow::Result<Set> {
    let places = ["PFX", "INV", "DFX", "EVR", "HEEL"];
    let signals = feet.iter().flat_map(|foot| places.map(|place| format!("{foot}_{place}")));
    let signals: Vec<String> = signals.collect();
    let mut names = vec![format!("{foot}_{angle}")];
    names.extend(signals.iter().cloned());
    let mut worn: Vec<Worn> = Vec::new();
    for path in files(folder)? {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let parts: Vec<&str> = stem.split('_').collect();
        let [wearer, walk, shoe] = parts[..] else { continue };
        if !walk.starts_with("WALK") {
            continue;
        }
        let text = fs::read_to_string(&path)?;
        let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let header = lines.next().unwrap_or_default();
        let places: Option<Vec<usize>> =
            names.iter().map(|name| header.iter().position(|own| own == name)).collect();
        let Some(places) = places else { continue };
        let row = |cells: Vec<&str>| -> Option<Vec<f64>> {
            places
                .iter()
                .map(|&c| cells.get(c)?.parse().ok().filter(|x: &f64| x.is_finite()))
                .collect()
        };
        let values: Vec<Vec<f64>> = lines.filter_map(row).collect();
        let channel = |(c, name): (usize, &String)| Channel {
            name: if c == 0 { "ankle_deg".into() } else { name.clone() },
            values: values.iter().map(|row| row[c]).collect(),
        };
        let trial = Trial {
            name: stem.clone(),
            time_s: (0..values.len()).map(|i| i as f64 * 0.008).collect(),
            channels: names.iter().enumerate().map(channel).collect(),
        };
        let name = format!("{wearer}_{shoe}");
        match worn.iter_mut().find(|own| own.name == name) {
            Some(own) => own.trials.push(trial),
            None => worn.push(Worn {
                wearer: wearer.to_owned(),
                activity: shoe.to_owned(),
                name,
                trials: vec![trial],
            }),
        }
    }
    Ok(Set { signals, reference: "ankle_deg".into(), worn })
}

/// Reads the knee sensor of sixteen people, at 250 Hz: files such as `P001_WALK1.csv` with time stamps, angle and
/// capacitance. The files of a person are one session, in the order of their names.
pub(crate) fn knees(folder: &Path) -> anyhow::Result<Set> {
    let mut worn: Vec<Worn> = Vec::new();
    for path in files(folder)? {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let Some((person, _)) = stem.split_once("_WALK") else { continue };
        let text = fs::read_to_string(&path)?;
        let values: Vec<[f64; 2]> = text
            .lines()
            .skip(1)
            .filter_map(|line| {
                let mut cells = line.split(',').skip(1).map(str::parse::<f64>);
                Some([cells.next()?.ok()?, cells.next()?.ok()?])
            })
            .filter(|row| row.iter().all(|x| x.is_finite()))
            .collect();
        if values.len() < 500 {
            continue;
        }
        let channel = |c: usize, name: &str| Channel {
            name: name.to_owned(),
            values: values.iter().map(|row| row[c]).collect(),
        };
        let trial = Trial {
            name: stem.clone(),
            time_s: (0..values.len()).map(|i| i as f64 * 0.004).collect(),
            channels: vec![channel(0, "knee_deg"), channel(1, "cap_pf")],
        };
        match worn.iter_mut().find(|own| own.wearer == person) {
            Some(own) => own.trials.push(trial),
            None => worn.push(Worn {
                wearer: person.to_owned(),
                activity: "walk".into(),
                name: person.to_owned(),
                trials: vec![trial],
            }),
        }
    }
    Ok(Set { signals: vec!["cap_pf".into()], reference: "knee_deg".into(), worn })
}

fn files(folder: &Path) -> anyhow::Result<Vec<std::path::PathBuf>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            found.extend(files(&path)?);
        } else if path.extension().is_some_and(|e| e == "csv") {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

fn rows(path: &Path) -> anyhow::Result<Vec<[f64; 6]>> {
    let text = fs::read_to_string(path)?;
    let mut rows = Vec::new();
    for line in text.trim_start_matches('\u{feff}').lines() {
        let mut row = [f64::NAN; 6];
        row.iter_mut().zip(line.split(',')).for_each(|(place, cell)| {
            *place = cell.trim().parse().unwrap_or(f64::NAN);
        });
        if row.iter().all(|x| x.is_finite()) {
            rows.push(row);
        }
    }
    Ok(rows)
}

/// Returns the first row of the second session.
fn boundary(rows: &[[f64; 6]]) -> usize {
    let (count, middle) = (rows.len(), rows.len() / 2);
    let is_zero = |i: &usize| rows[*i][1..].iter().all(|x| x.abs() < 1e-12);
    let zero = (count / 4..3 * count / 4).filter(is_zero).min_by_key(|i| i.abs_diff(middle));
    if let Some(zero) = zero {
        return zero;
    }
    let usual = |c: usize| {
        let mut steps: Vec<f64> = rows.windows(2).map(|w| (w[1][c] - w[0][c]).abs()).collect();
        steps.sort_by(f64::total_cmp);
        steps[steps.len() / 2] + 1e-6
    };
    let usual: Vec<f64> = (0..6).map(usual).collect();
    let jump = |i: usize| -> f64 {
        (0..6).map(|c| ((rows[i][c] - rows[i - 1][c]).abs() / usual[c]).min(60.0)).sum()
    };
    (3 * count / 10..7 * count / 10).max_by(|&a, &b| jump(a).total_cmp(&jump(b))).unwrap_or(middle)
}
