//! The types that options have, and the values that are allowed of them.

use std::fmt::{self, Display, Formatter};
use std::ops::{RangeFrom, RangeInclusive};

/// A type that an option can have: a number, a text, or a choice of words.
pub trait OptionValue: Sized {
    /// "number", "whole number" or "word", for messages.
    const KIND: &'static str;
    /// Every value of the type.
    const ALL: Allowed = Allowed::Any;
    /// The value that a text says; `None` where it says none.
    fn parse(text: &str) -> Option<Self>;
    /// The text that says this value: [`OptionValue::parse`] returns the same value for it.
    fn text(&self) -> String;
}

macro_rules! whole_number {
    ($($Type:ty)+) => { $(
        impl OptionValue for $Type {
            const KIND: &'static str = "whole number";

            fn parse(text: &str) -> Option<Self> {
                text.parse().ok()
            }

            fn text(&self) -> String {
                self.to_string()
            }
        }
    )+ };
}

macro_rules! real_number {
    ($($Type:ty)+) => { $(
        impl OptionValue for $Type {
            const KIND: &'static str = "number";

            fn parse(text: &str) -> Option<Self> {
                text.parse().ok().filter(|v: &Self| v.is_finite())
            }

            fn text(&self) -> String {
                let is_tiny = *self != 0.0 && self.abs() < 1e-3;
                if is_tiny { format!("{self:e}") } else { self.to_string() }
            }
        }
    )+ };
}

whole_number!(u8 u32 u64);
real_number!(f32 f64);

impl OptionValue for String {
    const KIND: &'static str = "text";

    fn parse(text: &str) -> Option<Self> {
        Some(text.to_owned())
    }

    fn text(&self) -> String {
        self.clone()
    }
}

/// The values that an option may have.
#[derive(Clone, Copy, Debug)]
pub enum Allowed {
    /// All that its type has.
    Any,
    /// Numbers between two, both included.
    Within(f64, f64),
    /// Numbers between two, both excluded.
    Between(f64, f64),
    /// 0 for "chosen by the program", or a number between two, both included.
    AutoOrWithin(f64, f64),
    /// This number and all above.
    AtLeast(f64),
    /// All above this number.
    Above(f64),
    /// One of some words.
    Words(&'static [Word]),
    /// A text of the form that the first describes, which the second recognises.
    Form(&'static str, fn(&str) -> bool),
}

/// A word that can be chosen.
#[derive(Clone, Copy, Debug)]
pub struct Word {
    /// As it is written.
    pub word: &'static str,
    /// What it chooses.
    pub meaning: &'static str,
}

impl Allowed {
    /// Whether the value with this text, [`OptionValue::text`], is allowed. Of a number, its decimal digits count: 0.99 is
    /// allowed up to 0.99, although the nearest f32 is a little more.
    pub fn admits(&self, text: &str) -> bool {
        let is_number = |valid: &dyn Fn(f64) -> bool| text.parse().is_ok_and(valid);
        match *self {
            Self::Any => true,
            Self::Within(low, high) => is_number(&|v| low <= v && v <= high),
            Self::Between(low, high) => is_number(&|v| low < v && v < high),
            Self::AutoOrWithin(low, high) => is_number(&|v| v == 0.0 || low <= v && v <= high),
            Self::AtLeast(low) => is_number(&|v| low <= v && v.is_finite()),
            Self::Above(low) => is_number(&|v| low < v && v.is_finite()),
            Self::Words(words) => words.iter().any(|w| w.word == text),
            Self::Form(_, fits) => fits(text),
        }
    }
}

impl Display for Allowed {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        match *self {
            Self::Any => write!(f, "any"),
            Self::Within(low, high) => write!(f, "{} to {}", low.text(), high.text()),
            Self::Between(low, high) => write!(f, "between {low} and {high}"),
            Self::AutoOrWithin(low, high) => write!(f, "0 (automatic) or {low} to {high}"),
            Self::AtLeast(low) => write!(f, "{low} or more"),
            Self::Above(low) => write!(f, "more than {low}"),
            Self::Words(words) => {
                let words: Vec<String> = words.iter().map(|w| format!("`{}`", w.word)).collect();
                write!(f, "{}", words.join(", "))
            }
            Self::Form(form, _) => write!(f, "{form}"),
        }
    }
}

impl From<RangeInclusive<f64>> for Allowed {
    fn from(range: RangeInclusive<f64>) -> Self {
        Self::Within(*range.start(), *range.end())
    }
}

impl From<RangeInclusive<u32>> for Allowed {
    fn from(range: RangeInclusive<u32>) -> Self {
        Self::Within((*range.start()).into(), (*range.end()).into())
    }
}

impl From<RangeFrom<f64>> for Allowed {
    fn from(range: RangeFrom<f64>) -> Self {
        Self::AtLeast(range.start)
    }
}

impl From<RangeFrom<u32>> for Allowed {
    fn from(range: RangeFrom<u32>) -> Self {
        Self::AtLeast(range.start.into())
    }
}

/// Defines an enum that is an option: each variant with its meaning and the word that chooses it.
macro_rules! choice {
    (
        $(#[doc = $about:literal])+
        pub enum $Choice:ident {
            $( $(#[doc = $meaning:literal])+ $Variant:ident = $word:literal, )+
        }
    ) => {
        $(#[doc = $about])+
        #[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
        pub enum $Choice {
            $( $(#[doc = $meaning])+ #[serde(rename = $word)] $Variant, )+
        }

        impl $crate::options::OptionValue for $Choice {
            const KIND: &'static str = "word";
            const ALL: $crate::options::Allowed = $crate::options::Allowed::Words(&[
                $( $crate::options::Word { word: $word, meaning: concat!($($meaning),+) }, )+
            ]);

            fn parse(text: &str) -> Option<Self> {
                match text {
                    $( $word => Some(Self::$Variant), )+
                    _ => None,
                }
            }

            fn text(&self) -> String {
                match self {
                    $( Self::$Variant => $word.to_owned(), )+
                }
            }
        }
    };
}
pub(super) use choice;

choice! {
    /// A choice between doing and leaving.
    pub enum Switch {
        /// It is not done.
        Off = "off",
        /// It is done.
        On = "on",
    }
}

impl Switch {
    /// True when on.
    pub fn is_on(self) -> bool {
        self == Self::On
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_decimal_digits_of_a_number_are_what_is_checked() {
        let up_to = Allowed::from(0.0..=0.99);
        assert!(up_to.admits(&0.99_f32.text()) && !up_to.admits("0.991"));
    }

    #[test]
    fn small_numbers_have_short_texts_that_say_the_same() {
        for (value, text) in [(1e-5_f32, "1e-5"), (0.001, "0.001"), (0.0, "0"), (-5.0, "-5")] {
            assert_eq!(value.text(), text);
            assert_eq!(f32::parse(text), Some(value));
        }
        assert_eq!(f32::parse("1e99"), None);
    }

    #[test]
    fn ends_are_included_or_not() {
        assert!(Allowed::Within(1.0, 2.0).admits("2") && !Allowed::Between(1.0, 2.0).admits("2"));
        assert!(Allowed::AtLeast(1.0).admits("1") && !Allowed::Above(1.0).admits("1"));
        let auto = Allowed::AutoOrWithin(8.0, 9.0);
        assert!(auto.admits("0") && auto.admits("8") && !auto.admits("7"));
    }
}
