//! Reflection at refractive surfaces.

use super::section::section;
use super::value::choice;
use super::{Allowed, OptionValue, Switch, Word};
use crate::model::MirrorSource;
use refraxel_core::optics::Weight;

impl OptionValue for MirrorSource {
    const KIND: &'static str = "word";
    /// Without "black": no run trains with mirrors that show nothing.
    const ALL: Allowed = Allowed::Words(&[
        Word { word: "learned", meaning: "Probes that learn from the training images." },
        Word { word: "baked", meaning: "Probes that sample the field once in a while." },
        Word { word: "exact", meaning: "A second ray through the field. Slow; for reference." },
    ]);

    fn parse(text: &str) -> Option<Self> {
        match text {
            "learned" => Some(Self::Learned),
            "baked" => Some(Self::Baked),
            "exact" => Some(Self::Exact),
            _ => None,
        }
    }

    fn text(&self) -> String {
        let word = match self {
            Self::Learned => "learned",
            Self::Baked => "baked",
            Self::Exact => "exact",
            Self::Black => "black",
        };
        word.to_owned()
    }
}

choice! {
    /// How much of the light surfaces mirror.
    pub enum ReflectionWeight {
        /// Fresnel's reflectance.
        Whole = "whole",
        /// The plain product of Fresnel's reflectance and the gradient of the index along the path, for comparison.
        Gradient = "gradient",
    }
}

impl From<ReflectionWeight> for Weight {
    fn from(choice: ReflectionWeight) -> Self {
        match choice {
            ReflectionWeight::Whole => Self::Whole,
            ReflectionWeight::Gradient => Self::Gradient,
        }
    }
}

section! {
    /// Reflection at refractive surfaces.
    pub struct ReflectionOptions "reflection" {
        /// Whether surfaces mirror the share of the light that they do not transmit.
        enabled: Switch = Switch::On;
        /// How much of the light they mirror.
        weight: ReflectionWeight = ReflectionWeight::Whole;
        /// Where the mirrored light comes from.
        cache: MirrorSource = MirrorSource::Learned;
        /// Radiance probes along the longest edge of a refractive region.
        probes: u32 = 8, in 2..=64;
        /// Degree of the spherical harmonics of the probes.
        degree: u8 = 3, in 0..=3;
        /// Steps after which baked probes sample the field again.
        bake_period: u64 = 250, in 1.., "steps";
        /// Learning rate of the coefficients of learned probes.
        rate: f32 = 0.01, in 0.0..=1.0;
        /// Learning rate of the strength with which a surface mirrors.
        rate_strength: f32 = 0.003, in 0.0..=1.0;
    }
}
