//! What tells the options of two runs apart.

use super::sections::Options;

/// An option that differs between two runs, and the text of its value in both.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Its full name.
    pub name: &'static str,
    /// Its value here.
    pub here: String,
    /// Its value there.
    pub there: String,
}

impl Options {
    /// The options whose values differ from those of others.
    pub fn differences(&self, others: &Self) -> Vec<Difference> {
        let values = self.values().into_iter().zip(others.values());
        let named = Self::definitions().into_iter().zip(values);
        let different = named.filter(|(_, (here, there))| here != there);
        different.map(|(option, (here, there))| Difference { name: option.name, here, there }).collect()
    }
}
