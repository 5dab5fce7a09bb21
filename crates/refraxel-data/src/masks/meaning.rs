//! What the white of masks means where nothing says it: what stands on its two sides in the photographs.

use super::sides::{self, Seen};
use crate::looks::{SAME, common_colour, is_within, rgb};
use crate::region::quantile;
use crate::rigid::Score;
use crate::{DataError, MaskMeaning, Problem, photo};
use rayon::prelude::*;
use std::path::Path;

/// White that covers less than this part of the picture marks a thing; masks that say what to use are mostly white.
const SMALL: f64 = 0.5;
/// Masks that are looked at to find out what their white means, at most.
const LOOKED_AT: usize = 12;
/// One colour has at least this share of a plain side; the rest are blurred borders.
const PLAIN: f64 = 0.9;
/// Least pixels of a side that is called plain.
const FEWEST: usize = 50;
/// A side shows no rigid scene where its [`Score`] is below this part of that of the other one, which does: what refracts is found again here and there, what changes from
/// view to view is not.
const REFRACTS: f64 = 0.5;
const CHANGES: f64 = 0.2;
/// Correlation of black patches with the same pixels of the next photograph from which they show what stands still before the camera.
const STILL: f64 = 0.7;
/// How much less white patches correlate then.
const MOVES: f64 = 0.25;

/// What is thought of masks before they are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Prior {
    /// They mark something refractive, as masks of renderings do.
    Refractive,
    /// They say what to use.
    Keep,
    /// That of [`meaning_of`].
    Coverage,
}

/// The meaning of masks, and what is to be said of it.
pub(super) fn conclude(prior: Prior, seen: &[Seen]) -> (MaskMeaning, Option<Problem>) {
    let white = median_white(seen.iter().map(|s| s.mask.white));
    let guess = match prior {
        Prior::Refractive => MaskMeaning::Refractive,
        Prior::Keep => MaskMeaning::Keep,
        Prior::Coverage => meaning_of(white),
    };
    let Some(white) = white else { return (guess, None) };
    let covered = format!("white covers {:.0} % of a picture", 100.0 * white);
    let plain = [true, false].map(|side| is_plain(seen, side));
    if plain == [Some(true), Some(false)] {
        let message = format!(
            "the meaning of white in the masks is not stated; {covered} and only a plain backdrop, and what the photographs show is \
             black: they are taken for inverted, white = ignore (--mask-meaning keep or refractive overrides this)"
        );
        return (MaskMeaning::Ignore, Some(Problem::warning(message)));
    }
    if let Some([inside, outside]) = sides::stillness(seen)
        && outside > STILL
        && inside < outside - MOVES
    {
        return (MaskMeaning::Keep, Some(still(&covered, outside)));
    }
    let [inside, outside] = sides::sides(seen);
    if let (Some(inside), Some(outside)) = (inside, outside)
        && let Some(meaning) = by_rigidity(inside, outside)
    {
        return (meaning, Some(sides_differ(meaning, &covered, inside, outside)));
    }
    (guess, (prior != Prior::Refractive).then(|| by_prior(prior, &covered, guess, plain[1] == Some(true))))
}

/// Where one side shows a rigid scene and the other does not, that says what the masks are for.
fn by_rigidity(inside: Score, outside: Score) -> Option<MaskMeaning> {
    let is_below = |s: Score, part: f64, of: Score| s.mean + 2.0 * s.error < part * of.mean;
    if inside.is_rigid() && is_below(outside, CHANGES, inside) {
        return Some(MaskMeaning::Keep);
    }
    (outside.is_rigid() && is_below(inside, REFRACTS, outside)).then_some(MaskMeaning::Refractive)
}

fn still(covered: &str, outside: f64) -> Problem {
    Problem::note(format!(
        "the meaning of white in the masks is not stated; {covered}, and what is black stays where it is in the photographs although the \
         cameras move, as behind a turntable (correlation {outside:.2}): they say which pixels to use (--mask-meaning refractive says \
         otherwise)"
    ))
}

fn sides_differ(meaning: MaskMeaning, covered: &str, inside: Score, outside: Score) -> Problem {
    let scores = format!("gain of correlation {:.2} inside, {:.2} outside", inside.mean, outside.mean);
    Problem::note(match meaning {
        MaskMeaning::Refractive => format!(
            "the meaning of white in the masks is not stated; neighbouring photographs agree on black pixels, and less on white \
             ones ({scores}): white marks something refractive (--mask-meaning keep or ignore overrides this)"
        ),
        _ => format!(
            "the meaning of white in the masks is not stated; {covered}, and neighbouring photographs agree there, but not on black \
             pixels ({scores}): the masks say which pixels to use (--mask-meaning refractive overrides this)"
        ),
    })
}

/// What was taken for granted, for want of evidence.
fn by_prior(prior: Prior, covered: &str, meaning: MaskMeaning, is_black_plain: bool) -> Problem {
    let (taken, other) = match meaning {
        MaskMeaning::Refractive => ("mark something refractive", "keep"),
        _ => ("say which pixels to use", "refractive"),
    };
    let text = format!(
        "the meaning of white in the masks is not stated; {covered}, so they are taken to {taken} (--mask-meaning {other} overrides this)"
    );
    // Pixels of a plain backdrop teach the same either way, and the search finds out whether rays bend.
    let is_doubtful = prior == Prior::Coverage && meaning == MaskMeaning::Refractive && !is_black_plain;
    if is_doubtful {
        let doubt =
            "if they mark something opaque, or pixels to use, as in nerfstudio's format, set --mask-meaning";
        return Problem::warning(format!("{text}; {doubt}"));
    }
    Problem::note(text)
}

/// Whether nearly all pixels of one side have one colour, where there are enough of them.
fn is_plain(seen: &[Seen], white: bool) -> Option<bool> {
    let of = |s: &Seen| -> Vec<[f32; 3]> {
        let samples = s.look.samples.iter().zip(&s.mask.samples);
        samples.filter(|(_, is_white)| **is_white == white).map(|([here, _], _)| rgb(*here)).collect()
    };
    let pixels: Vec<[f32; 3]> = seen.iter().flat_map(of).collect();
    let common = common_colour(pixels.iter().copied()).filter(|_| pixels.len() >= FEWEST)?;
    let same = pixels.iter().filter(|p| is_within(**p, common, SAME)).count();
    Some(same as f64 >= PLAIN * pixels.len() as f64)
}

/// [`crate::photographs::meaning_shown`].
pub(crate) fn meaning_shown(masks: &[&Path]) -> Result<MaskMeaning, DataError> {
    let some: Vec<&Path> = masks.iter().copied().step_by(masks.len().div_ceil(LOOKED_AT).max(1)).collect();
    let shares = some.into_par_iter().map(photo::white_share).collect::<Result<Vec<f64>, DataError>>()?;
    Ok(meaning_of(median_white(shares)))
}

fn meaning_of(white: Option<f64>) -> MaskMeaning {
    if white.is_some_and(|w| w < SMALL) { MaskMeaning::Refractive } else { MaskMeaning::Keep }
}

/// The median share of white in masks that are not black; `None` without any.
fn median_white(shares: impl IntoIterator<Item = f64>) -> Option<f64> {
    quantile(shares.into_iter().filter(|s| *s > 0.0), 0.5)
}
