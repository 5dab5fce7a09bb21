//! Masks that look odd: black, white, grey, swapped, or with numbers in place of black and white.

use super::coverage::Reading;
use crate::looks::MaskLook;
use crate::naming::first_few;
use crate::region::quantile;
use crate::{DataError, MaskMeaning, Problem, View, photo};
use std::path::Path;

/// Share of grey above which a mask is none of black and white.
const GREY: f64 = 0.1;
/// Masks whose white differs from the median by more than this part of the picture, or of its border, stand out.
const STANDS_OUT: f64 = 0.5;
/// Masks of glass that are white on a larger share of their border are doubted: even water rarely fills it like that.
const MOST: f64 = 0.9;

/// A mask that was looked at.
pub(super) struct Odd<'a> {
    pub view: &'a View,
    /// Its file, where it is no alpha channel.
    pub path: Option<&'a Path>,
    pub mask: &'a MaskLook,
    pub meaning: MaskMeaning,
}

impl Odd<'_> {
    /// Nothing of the photograph counts.
    fn leaves_nothing(&self) -> bool {
        match self.meaning {
            MaskMeaning::Keep => self.mask.white <= 0.0,
            MaskMeaning::Ignore => self.mask.white >= 1.0,
            MaskMeaning::Refractive => false,
        }
    }

    /// All of the photograph counts.
    fn leaves_all(&self) -> bool {
        self.meaning == MaskMeaning::Keep && self.mask.white >= 1.0
    }

    /// At least half of it is said to be refractive, but not all.
    fn marks_around(&self) -> bool {
        self.meaning == MaskMeaning::Refractive && (0.5..1.0).contains(&self.mask.white)
    }

    fn marks_all(&self) -> bool {
        self.meaning == MaskMeaning::Refractive && self.mask.white >= 1.0
    }
}

/// What is to be said of masks that were looked at.
pub(super) fn oddities(masks: &[Odd]) -> Result<Vec<Problem>, DataError> {
    let on_border =
        |m: &Odd| m.mask.border.iter().filter(|w| **w).count() as f64 / m.mask.border.len().max(1) as f64;
    if masks.is_empty() {
        return Ok(Vec::new());
    }
    let median = quantile(masks.iter().map(|m| m.mask.white), 0.5).unwrap_or(0.0);
    let median_on_border = quantile(masks.iter().map(on_border), 0.5).unwrap_or(0.0);
    let swapped = format!(
        "differ much from the others, whose white covers {:.0} %; they may be inverted",
        100.0 * median
    );
    let stands_out = |m: &Odd| {
        let away = [m.mask.white - median, on_border(m) - median_on_border].map(f64::abs);
        away.iter().any(|d| *d > STANDS_OUT) && !m.leaves_nothing() && !m.marks_all()
    };
    // White masks are right where nothing moved through these photographs; masks whose colours all count as white are not.
    let coloured = masks.iter().find_map(|m| m.path).filter(|_| masks.iter().all(Odd::leaves_all));
    let leave_all = coloured.map(photo::mask_has_colours).transpose()?.unwrap_or(false);
    let inverted = format!(
        "have white on most of their border, as where black marks the glass (white covers {:.0} %); if it does, invert them",
        100.0 * median
    );
    let found = [
        named(
            masks,
            |_| leave_all,
            "leave out nothing, because all of their colours count as white: write them in black and white",
        ),
        named(masks, |m| median_on_border > MOST && m.marks_around() && on_border(m) > MOST, &inverted),
        named(masks, |m| m.leaves_nothing(), "leave no pixel of their photographs"),
        named(masks, |m| m.marks_all(), "are white all over, as if the photograph showed nothing but glass"),
        named(masks, |m| m.mask.grey > GREY, "have much grey, which counts as white from the middle on"),
        named(masks, stands_out, &swapped),
    ];
    let mut problems: Vec<Problem> = found.into_iter().flatten().collect();
    let bright = masks.iter().find(|m| m.mask.white > 0.0).and_then(|m| m.path);
    if let Some(path) = bright {
        problems.extend(unusual(path, photo::mask_reading(path)?));
    }
    Ok(problems)
}

/// A warning that names views.
fn named(masks: &[Odd], is_odd: impl Fn(&Odd) -> bool, what: &str) -> Option<Problem> {
    let names: Vec<&str> = masks.iter().filter(|m| is_odd(m)).map(|m| m.view.name.as_str()).collect();
    let (of, first) = (masks.len(), first_few(names.iter().copied()));
    let message = format!("of {of} inspected masks, {} {what}: {first}", names.len());
    (!names.is_empty()).then(|| Problem::warning(message))
}

/// A sentence about a file that says what is covered in another way than by white.
fn unusual(path: &Path, reading: Reading) -> Option<Problem> {
    let path = path.display();
    match reading {
        Reading::White => None,
        Reading::Alpha => {
            Some(Problem::note(format!("{path}: the alpha channel of the mask says what is white")))
        }
        Reading::Labels(1) => Some(Problem::note(format!("{path}: the mask has 0 and 1; 1 counts as white"))),
        Reading::Labels(most) => Some(Problem::warning(format!(
            "{path}: the mask has numbers from 0 to {most}, as labels have; all but 0 count as white. Where only some labels are meant, \
             write masks of black and white"
        ))),
    }
}
