//! All masks in a sentence.

use crate::naming::first_few;
use crate::{MaskMeaning, Problem, View};
use std::collections::BTreeMap;

/// A note about the masks of all views: how many there are, what their white means, and which views have none.
pub(crate) fn summary(views: &[View]) -> Option<Problem> {
    let mut counts = BTreeMap::new();
    for view in views.iter().filter(|v| v.has_mask()) {
        let meaning = match view.mask_meaning {
            MaskMeaning::Refractive => "white = refractive object",
            MaskMeaning::Keep => "white = use, black = ignore",
            MaskMeaning::Ignore => "white = ignore",
        };
        *counts.entry(meaning).or_insert(0) += 1;
    }
    let text: Vec<String> = counts.iter().map(|(meaning, n)| format!("{n} masks, {meaning}")).collect();
    let without: Vec<&str> = views.iter().filter(|v| !v.has_mask()).map(|v| v.name.as_str()).collect();
    let gap = match without.len() {
        0 => String::new(),
        n => format!("; {n} views have none: {}", first_few(without.into_iter())),
    };
    (!text.is_empty()).then(|| Problem::note(format!("{}{gap}", text.join("; "))))
}
