//! Sections of options: how one is written down, and what all have in common.

use super::{Allowed, OptionError, OptionValue};

/// What there is to know of an option, apart from its value.
#[derive(Clone, Copy, Debug)]
pub struct Definition {
    /// Section and key, such as `surface.blur`.
    pub name: &'static str,
    /// "number", "whole number", "word" or "text".
    pub kind: &'static str,
    /// The values that it may have.
    pub allowed: Allowed,
    /// Unit in which `allowed` counts; empty where there is none.
    pub unit: &'static str,
    /// What it does, and in which unit.
    pub meaning: &'static str,
}

impl Definition {
    /// The values that it may have, with their unit: "0 to 8 voxels".
    pub fn range(&self) -> String {
        match self.allowed {
            Allowed::Any => format!("any {}", self.kind),
            _ => format!("{} {}", self.allowed, self.unit).trim_end().to_owned(),
        }
    }

    /// The value that a text says, if the option may have it.
    pub(super) fn read<T: OptionValue>(&self, text: &str) -> Result<T, OptionError> {
        let value = T::parse(text).filter(|v| self.allowed.admits(&v.text()));
        value.ok_or_else(|| self.refusal(text))
    }

    /// Why a value is not allowed.
    pub(super) fn refusal(&self, found: &str) -> OptionError {
        let range = self.range();
        let expected = match self.allowed {
            Allowed::Any => range,
            Allowed::Words(_) => format!("one of {range}"),
            Allowed::Form(..) => range,
            _ => format!("a {}, {range}", self.kind),
        };
        OptionError::Value { name: self.name, found: found.to_owned(), expected }
    }
}

/// Options that belong together.
pub trait Section {
    /// The part of the names before the dot.
    fn name(&self) -> &'static str;
    /// What the section is about.
    fn about(&self) -> &'static str;
    /// Its options, in the order of the fields.
    fn definitions(&self) -> Vec<Definition>;
    /// The texts of their values, in the same order.
    fn values(&self) -> Vec<String>;
    /// Sets one of its options to the value that a text says.
    fn set(&mut self, option: &Definition, text: &str) -> Result<(), OptionError>;

    /// Refuses values that are not allowed: fields can be set without [`Section::set`].
    fn check(&self) -> Result<(), OptionError> {
        let options = self.definitions().into_iter().zip(self.values());
        let refused = options.into_iter().find(|(option, value)| !option.allowed.admits(value));
        refused.map_or(Ok(()), |(option, value)| Err(option.refusal(&value)))
    }
}

/// Defines a section. Each field has its meaning as a doc comment, then
/// `key: type = default, in range, "unit of the range";` where range and unit may be left out. A choice of words needs no
/// range.
macro_rules! section {
    (
        $(#[doc = $about:literal])+
        pub struct $Section:ident $section:literal {
            $(
                $(#[doc = $meaning:literal])+
                $key:ident: $Type:ty = $default:expr $(, in $allowed:expr $(, $unit:literal)?)?;
            )+
        }
    ) => {
        $(#[doc = $about])+
        #[derive(Clone, Debug, PartialEq, serde::Serialize)]
        pub struct $Section {
            $( $(#[doc = $meaning])+ pub $key: $Type, )+
        }

        impl Default for $Section {
            fn default() -> Self {
                Self { $( $key: $default, )+ }
            }
        }

        impl $crate::options::Section for $Section {
            fn name(&self) -> &'static str {
                $section
            }

            fn about(&self) -> &'static str {
                concat!($($about),+)
            }

            fn definitions(&self) -> Vec<$crate::options::Definition> {
                vec![ $( $crate::options::Definition {
                    name: concat!($section, ".", stringify!($key)),
                    kind: <$Type as $crate::options::OptionValue>::KIND,
                    allowed: $crate::options::section::allowed!($Type $(, $allowed)?),
                    unit: concat!("" $($(, $unit)?)?),
                    meaning: concat!($($meaning),+),
                } ),+ ]
            }

            fn values(&self) -> Vec<String> {
                vec![ $( $crate::options::OptionValue::text(&self.$key) ),+ ]
            }

            fn set(
                &mut self,
                option: &$crate::options::Definition,
                text: &str,
            ) -> Result<(), $crate::options::OptionError> {
                match option.name {
                    $( concat!($section, ".", stringify!($key)) => self.$key = option.read(text)?, )+
                    other => unreachable!("{other} is an option of another section"),
                }
                Ok(())
            }
        }
    };
}

/// The range of an option: the one that is given, else all values of its type.
macro_rules! allowed {
    ($Type:ty) => {
        <$Type as $crate::options::OptionValue>::ALL
    };
    ($Type:ty, $allowed:expr) => {
        $crate::options::Allowed::from($allowed)
    };
}

pub(super) use {allowed, section};
