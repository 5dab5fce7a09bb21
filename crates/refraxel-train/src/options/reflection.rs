//! Reflection at refractive surfaces.

use super::section::section;
use super::{Allowed, OptionValue, Switch, Word};
use crate::model::MirrorSource;

impl OptionValue for MirrorSource {
    const KIND: &'static str = "word";
    /// Without "black": no run trains with mirrors that show nothing.
    const ALL: Allowed = Allowed::Words(&[
        Word { word: "learned", meaning: "Probes that learn from the training images." },
        Word { word: "exact", meaning: "A second ray through the field. Slow; for reference." },
    ]);

    fn parse(text: &str) -> Option<Self> {
        match text {
            "learned" => Some(Self::Learned),
            "exact" => Some(Self::Exact),
            _ => None,
        }
    }

    fn text(&self) -> String {
        let word = match self {
            Self::Learned => "learned",
            Self::Exact => "exact",
            Self::Black => "black",
        };
        word.to_owned()
    }
}

section! {
    /// Reflection at refractive surfaces.
    pub struct ReflectionOptions "reflection" {
        /// Whether surfaces mirror the share of the light that they do not transmit.
        enabled: Switch = Switch::On;
        /// Where the mirrored light comes from.
        cache: MirrorSource = MirrorSource::Learned;
        /// Radiance probes along the longest edge of a refractive region.
        probes: u32 = 8, in 2..=64;
    }
}
