//! Values of flags that need more than a number.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use refraxel_train::options::Switch;
use std::str::FromStr;

/// One `KEY=VALUE`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// Name of the option, may be dotted.
    pub key: String,
    /// As written; spaces around it are not part of it.
    pub value: String,
}

impl FromStr for Setting {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (key, value) = text.split_once('=').ok_or("expected KEY=VALUE, such as steps=2000")?;
        let (key, value) = (key.trim(), value.trim());
        if key.is_empty() || value.is_empty() {
            return Err("expected a key and a value, such as steps=2000".to_owned());
        }
        Ok(Self { key: key.to_owned(), value: value.to_owned() })
    }
}

/// A value that is one of a few words: each word, what it means, and what it stands for.
pub fn words<T: Copy + Send + Sync + 'static>(
    all: &'static [(&'static str, &'static str, T)],
) -> impl TypedValueParser<Value = T> {
    let known = all.iter().map(|(word, meaning, _)| PossibleValue::new(*word).help(*meaning));
    PossibleValuesParser::new(known).map(move |word: String| {
        let found = all.iter().find(|(known, ..)| *known == word);
        found.expect("the parser admits no other word").2
    })
}

/// Whether something is done.
pub const ON_OFF: [(&str, &str, Switch); 2] = [("on", "Yes", Switch::On), ("off", "No", Switch::Off)];

/// A positive time.
pub fn minutes(text: &str) -> Result<f64, String> {
    number(text, |m| m > 0.0 && m.is_finite())
        .ok_or_else(|| "expected a time above 0, such as 10 or 0.5".to_owned())
}

/// A plausible index of refraction; a value below 1 belongs to a body in a denser medium, such as a bubble in water.
pub fn index(text: &str) -> Result<f64, String> {
    number(text, |n| (0.25..=4.0).contains(&n))
        .ok_or_else(|| "expected 0.25 to 4, such as 1.5 for glass".to_owned())
}

/// A factor on the contrast of the index.
pub fn factor(text: &str) -> Result<f64, String> {
    number(text, |s| (0.0..=100.0).contains(&s))
        .ok_or_else(|| "expected a factor from 0 to 100, such as 0.5".to_owned())
}

/// A direction, of any length.
pub fn direction(text: &str) -> Result<[f64; 3], String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    let numbers: Option<[f64; 3]> = numbers.and_then(|n| n.try_into().ok());
    let length = |n: &[f64; 3]| n.iter().map(|n| n * n).sum::<f64>();
    numbers
        .filter(|n| (1e-12..1e12).contains(&length(n)))
        .ok_or_else(|| "expected three numbers that are not all 0, such as 0,0,1".to_owned())
}

/// A rate that players show.
pub fn frame_rate(text: &str) -> Result<f64, String> {
    number(text, |f| (1.0..=120.0).contains(&f))
        .ok_or_else(|| "expected 1 to 120 frames per second".to_owned())
}

/// Width and height of a picture.
pub fn size(text: &str) -> Result<[u32; 2], String> {
    let edges = text.split_once(['x', 'X', '×']).map(|(w, h)| [w, h].map(|n| n.trim().parse().unwrap_or(0)));
    edges
        .filter(|edges| edges.iter().all(|n| (8..=16_384).contains(n)))
        .ok_or_else(|| "expected WIDTHxHEIGHT from 8 to 16384 pixels, such as 800x600".to_owned())
}

fn number(text: &str, valid: impl Fn(f64) -> bool) -> Option<f64> {
    text.parse().ok().filter(|&v| valid(v))
}
