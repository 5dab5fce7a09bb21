//! The clearcoat of opaque things.

use super::Switch;
use super::section::section;

section! {
    /// The clearcoat of opaque things.
    pub struct ClearcoatOptions "clearcoat" {
        /// Whether opaque things have a clearcoat that mirrors.
        enabled: Switch = Switch::Off;
    }
}
