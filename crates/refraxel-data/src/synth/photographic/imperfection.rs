//! The imperfections and sets of them.

use std::str::FromStr;

/// What makes a photograph differ from an exact rendering.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Imperfection {
    /// Brightness and colour temperature change from view to view.
    Exposure,
    /// Shot noise and read noise of the sensor.
    Noise,
    /// Pictures are JPEG files.
    Jpeg,
    /// The poses that are told are not quite those of the pictures.
    Poses,
    /// Only what is as far away as the thing is sharp.
    Focus,
    /// Masks are as a segmenter draws them.
    Masks,
}

/// No imperfection has that name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{found}` is no imperfection; expected exposure, noise, jpeg, poses, focus or masks")]
pub struct UnknownImperfection {
    /// What stood there.
    pub found: String,
}

impl Imperfection {
    /// All of them.
    pub const ALL: [Imperfection; 6] = [
        Imperfection::Exposure,
        Imperfection::Noise,
        Imperfection::Jpeg,
        Imperfection::Poses,
        Imperfection::Focus,
        Imperfection::Masks,
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Imperfection::Exposure => "exposure",
            Imperfection::Noise => "noise",
            Imperfection::Jpeg => "jpeg",
            Imperfection::Poses => "poses",
            Imperfection::Focus => "focus",
            Imperfection::Masks => "masks",
        }
    }
}

impl FromStr for Imperfection {
    type Err = UnknownImperfection;

    fn from_str(text: &str) -> Result<Self, UnknownImperfection> {
        let named = Self::ALL.into_iter().find(|i| i.name() == text);
        named.ok_or_else(|| UnknownImperfection { found: text.to_owned() })
    }
}

/// A set of imperfections.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Imperfections(u8);

impl Imperfections {
    /// All of them: what a phone does.
    pub const ALL: Imperfections = Imperfections((1 << Imperfection::ALL.len()) - 1);

    /// This set but for one.
    #[must_use]
    pub fn without(self, one: Imperfection) -> Imperfections {
        Imperfections(self.0 & !(1 << one as u8))
    }

    /// Whether one of them is in the set.
    pub fn has(self, one: Imperfection) -> bool {
        self.0 >> one as u8 & 1 == 1
    }

    /// The names of those in the set.
    pub fn names(self) -> Vec<&'static str> {
        Imperfection::ALL.into_iter().filter(|&i| self.has(i)).map(Imperfection::name).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_read_back_and_leaves_out_itself_alone() {
        for one in Imperfection::ALL {
            assert_eq!(one.name().parse(), Ok(one));
            let rest = Imperfections::ALL.without(one);
            assert!(Imperfection::ALL.into_iter().all(|other| rest.has(other) == (other != one)));
        }
        let message = "blur".parse::<Imperfection>().unwrap_err().to_string();
        assert!(Imperfection::ALL.iter().all(|i| message.contains(i.name())), "{message}");
    }
}
