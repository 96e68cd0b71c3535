//! The table of detection limits.

use stretch_gap::DetectionLimit;

use super::{
    markup::{number, shown_unit, with_unit},
    page::Table,
};

/// A table of how strong each effect would have to be to be named, with the parameter that says so.
///
/// ```
/// use stretch_gap::DetectionLimit;
/// use stretch_report::limit_table;
/// let strength = Some(0.0123);
/// let limit = DetectionLimit { effect: "creep".into(), parameter: "c".into(), strength, unit: "1".into(), others: Default::default() };
/// assert_eq!(limit_table(&[limit]).rows[0], ["creep", "c", "0.0123"]);
/// ```
pub fn limit_table(limits: &[DetectionLimit]) -> Table {
    let row = |limit: &DetectionLimit| {
        let strength =
            limit.strength.map(|strength| with_unit(&number(strength, 3), shown_unit(&limit.unit)));
        let none = || "none within its range".to_owned();
        vec![limit.effect.clone(), limit.parameter.clone(), strength.unwrap_or_else(none)]
    };
    Table::new(
        "Detection limits: the strength at which each effect would be named on these data with probability 0.9, \
         the simulator being right otherwise",
        &["Effect", "Parameter", "Limit"],
        limits.iter().map(row),
    )
}
