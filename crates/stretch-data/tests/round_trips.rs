//! Written files read back to the same bits, and reading arbitrary input never panics.

use proptest::prelude::*;
use stretch_data::{DataSet, RigFile};

use crate::cases;

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn rigs(rig in stretch_strategies::rig_file()) {
        prop_assert_eq!(RigFile::parse("rig.toml", &rig.to_toml())?, rig);
    }

    #[test]
    fn data_sets(set in stretch_strategies::data_set()) {
        prop_assert_eq!(DataSet::parse("dataset.toml", &set.to_toml())?, set);
    }

    #[test]
    fn soup_never_panics(soup in stretch_strategies::faulty_csv()) {
        let text = String::from_utf8_lossy(&soup);
        let _ = DataSet::parse("soup", &text);
        let _ = RigFile::parse("soup", &text);
    }
}
