//! Enumerations whose members have a name in files, reports and options.

/// An enumeration with one word per member, used to serialise, to print and to parse it.
macro_rules! worded {
    ($(#[$own:meta])* $name:ident { $($(#[$doc:meta])* $member:ident $word:literal),* $(,)? }) => {
        $(#[$own])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[derive(serde::Serialize, serde::Deserialize)]
        pub enum $name { $($(#[$doc])* #[serde(rename = $word)] $member),* }

        impl $name {
            /// All of them, in the order of reports.
            pub const ALL: [Self; [$($word),*].len()] = [$(Self::$member),*];

            /// Name as labels, reports and options write it.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self { $(Self::$member => $word),* }
            }
        }

        impl std::str::FromStr for $name {
            type Err = String;

            fn from_str(name: &str) -> Result<Self, String> {
                let found = Self::ALL.into_iter().find(|one| one.name() == name);
                found.ok_or_else(|| format!("there are {}", Self::ALL.map(Self::name).join(", ")))
            }
        }
    };
}
pub(crate) use worded;
