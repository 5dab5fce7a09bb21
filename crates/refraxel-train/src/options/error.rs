//! Why options are refused.

/// Why options were refused. Each message names the option.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum OptionError {
    /// A name that no option has.
    #[error("unknown option `{key}`{}; `refraxel train --options` lists all", suggested(.suggestion))]
    Unknown {
        /// As it was written.
        key: String,
        /// The most similar name, if one is similar.
        suggestion: Option<&'static str>,
    },
    /// A name without its section that several sections have.
    #[error("several options are called `{key}`; say which one: `{}`", .candidates.join("`, `"))]
    Ambiguous {
        /// As it was written.
        key: String,
        /// The full names of all of them.
        candidates: Vec<&'static str>,
    },
    /// An option that earlier versions had.
    #[error("option `{key}` is gone: {now}")]
    Gone {
        /// Its name.
        key: &'static str,
        /// What there is in its place.
        now: &'static str,
    },
    /// A value that the option cannot have.
    #[error("option `{name}` is `{found}`, expected {expected}")]
    Value {
        /// Its full name.
        name: &'static str,
        /// The value.
        found: String,
        /// The type and the range.
        expected: String,
    },
    /// Options that are not given as a table of names and values.
    #[error("options are a table of names and values, found `{found}`")]
    NoTable {
        /// What was found.
        found: String,
    },
}

fn suggested(name: &Option<&str>) -> String {
    name.map_or(String::new(), |name| format!(" (did you mean `{name}`?)"))
}
