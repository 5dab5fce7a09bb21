//! Scores of several views, with their errors.

use serde::{Deserialize, Deserializer, Serialize};

/// One score per view; `None` where too little is to be compared.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Scores(pub Vec<Option<f64>>);

/// A mean over views and its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Difference {
    /// The mean.
    pub mean: f64,
    /// Its standard error, from the spread over views; ∞, in JSON `null`, of a single view.
    #[serde(deserialize_with = "or_infinite")]
    pub error: f64,
    /// Views that it is of.
    pub views: usize,
}

fn or_infinite<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::INFINITY))
}

impl Difference {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let values: Vec<f64> = values.collect();
        let n = values.len() as f64;
        if values.is_empty() {
            return Self::default();
        }
        let mean = values.iter().sum::<f64>() / n;
        let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
        // One view alone says nothing of the spread.
        let error = if values.len() > 1 { (square / (n - 1.0) / n).sqrt() } else { f64::INFINITY };
        Self { mean, error, views: values.len() }
    }

    /// How many standard errors it lies above 0.
    pub fn significance(&self) -> f64 {
        if self.mean == 0.0 { 0.0 } else { self.mean / self.error.max(1e-6) }
    }
}

impl Scores {
    /// Their mean.
    pub(crate) fn mean(&self) -> Difference {
        Difference::of(self.0.iter().flatten().copied())
    }

    /// The score of one view, 0 where it has none.
    pub(crate) fn of_view(&self, view: usize) -> f64 {
        self.0.get(view).copied().flatten().unwrap_or(0.0)
    }

    /// The view with the middle score, and that score.
    pub(crate) fn middle(&self) -> Option<(usize, f64)> {
        let mut known: Vec<(usize, f64)> =
            self.0.iter().enumerate().filter_map(|(k, s)| Some((k, (*s)?))).collect();
        known.sort_by(|a, b| a.1.total_cmp(&b.1));
        known.get(known.len() / 2).copied()
    }

    /// By how much they are larger than others of the same views, over the views that have both.
    pub(crate) fn above(&self, other: &Self) -> Difference {
        let pairs = self.0.iter().zip(&other.0).filter_map(|(a, b)| Some((*a)? - (*b)?));
        Difference::of(pairs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_taken_view_by_view() {
        let a = Scores(vec![Some(0.5), None, Some(0.9), Some(0.1)]);
        let b = Scores(vec![Some(0.4), Some(0.3), Some(0.8), None]);
        let found = a.above(&b);
        assert!((found.mean - 0.1).abs() < 1e-12 && found.error < 1e-12 && found.views == 2);
        let mean = a.mean();
        assert!((mean.mean - 0.5).abs() < 1e-12 && (mean.error - 0.4 / 3.0_f64.sqrt()).abs() < 1e-12);
        let one = Scores(vec![Some(1.0)]).mean();
        assert_eq!(one.significance(), 0.0);
        let text = serde_json::to_string(&one).unwrap();
        assert_eq!(serde_json::from_str::<Difference>(&text).unwrap(), one, "{text}");
    }
}
