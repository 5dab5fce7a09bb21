//! The unknown numbers of a candidate, by coordinate ascent of its score, from coarse pictures to fine ones.

use super::Scores;
use super::detail::Detail;
use crate::cancel::Cancelled;
use std::collections::HashMap;

/// A number that is scanned.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Unknown {
    /// `index`, `wall`, …
    pub name: &'static str,
    /// Values that are tried first, all with all of the other unknowns.
    pub first: Vec<f32>,
    /// Then steps away from the best one as long as that helps, finer and finer.
    pub fine: Vec<f32>,
    /// Smallest and largest value.
    pub range: [f32; 2],
}

impl Unknown {
    pub(crate) fn new(name: &'static str, first: &[f32], fine: &[f32], range: [f32; 2]) -> Self {
        Self { name, first: first.to_vec(), fine: fine.to_vec(), range }
    }

    /// The same with its largest steps alone.
    pub(crate) fn begun(&self) -> Self {
        Self { fine: self.fine.first().copied().into_iter().collect(), ..self.clone() }
    }

    /// The same, of which the first values are known, and only the finest steps are left.
    pub(crate) fn last(&self) -> Self {
        Self { fine: self.fine.last().copied().into_iter().collect(), ..self.clone() }
    }
}

/// The numbers with the largest score.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Best {
    pub values: Vec<f32>,
    /// Their scores at the last detail, one per view.
    pub scores: Scores,
}

/// Steps in one direction at most, and rounds over all unknowns.
const MOST_STEPS: usize = 6;
const ROUNDS: usize = 2;

/// What scores numbers at a detail.
pub(crate) trait Scored: FnMut(&[f32], Detail) -> Result<Scores, Cancelled> {}
impl<F: FnMut(&[f32], Detail) -> Result<Scores, Cancelled>> Scored for F {}

struct Scan<'a, F> {
    unknowns: &'a [Unknown],
    score: F,
    known: HashMap<(Vec<u32>, usize), Scores>,
}

/// One in so many first values is scored again in all views.
const LIKELY: usize = 4;

/// All first values at the coarsest detail: the likely ones with their scores, the best first. With `begins_in_few`, `score` is told to look
/// at few views first. These often take wrong values for the best, so they only choose the likely ones, and all views choose among those.
pub(crate) fn firsts(
    unknowns: &[Unknown],
    begins_in_few: bool,
    mut score: impl FnMut(&[f32], Detail, bool) -> Result<Scores, Cancelled>,
) -> Result<Vec<Best>, Cancelled> {
    let mut scored = |all: Vec<Vec<f32>>, are_few: bool| {
        let of =
            |values: Vec<f32>| score(&values, Detail::Coarse, are_few).map(|scores| Best { values, scores });
        let mut all = all.into_iter().map(of).collect::<Result<Vec<_>, _>>()?;
        all.sort_by(|a, b| mean(&b.scores).total_cmp(&mean(&a.scores)));
        Ok(all)
    };
    let mut likely = products(unknowns);
    if begins_in_few {
        let ranked: Vec<Best> = scored(likely, true)?;
        let shows_something = ranked.first().is_some_and(|b| mean(&b.scores).is_finite());
        let count = if shows_something { ranked.len().div_ceil(LIKELY) } else { ranked.len() };
        likely = ranked.into_iter().take(count).map(|b| b.values).collect();
    }
    scored(likely, false)
}

/// The best of them.
pub(crate) fn first(
    unknowns: &[Unknown],
    begins_in_few: bool,
    score: impl FnMut(&[f32], Detail, bool) -> Result<Scores, Cancelled>,
) -> Result<Best, Cancelled> {
    let best = firsts(unknowns, begins_in_few, score)?.into_iter().next();
    Ok(best.unwrap_or_else(|| unreachable!("every unknown has values")))
}

/// From there on, the finer steps at finer and finer details.
pub(crate) fn refined(
    from: &Best,
    unknowns: &[Unknown],
    finest: Detail,
    score: impl Scored,
) -> Result<Best, Cancelled> {
    let passes = unknowns.iter().map(|u| u.fine.len()).max().unwrap_or(0);
    let mut scan = Scan { unknowns, score, known: HashMap::new() };
    let mut best = from.clone();
    for pass in 0..passes {
        let detail = Detail::ALL[(finest as usize + pass + 1).saturating_sub(passes)];
        best.scores = scan.at(&best.values, detail)?;
        for _ in 0..ROUNDS {
            let before = mean(&best.scores);
            for which in 0..unknowns.len() {
                scan.climb(&mut best, which, pass, detail)?;
            }
            if mean(&best.scores) <= before || unknowns.len() == 1 {
                break;
            }
        }
    }
    best.scores = scan.at(&best.values, finest)?;
    Ok(best)
}

impl<F: Scored> Scan<'_, F> {
    fn at(&mut self, values: &[f32], detail: Detail) -> Result<Scores, Cancelled> {
        let key = (values.iter().map(|v| v.to_bits()).collect(), detail as usize);
        if let Some(known) = self.known.get(&key) {
            return Ok(known.clone());
        }
        let scores = (self.score)(values, detail)?;
        self.known.insert(key, scores.clone());
        Ok(scores)
    }

    /// Steps of one unknown as long as the score rises.
    fn climb(&mut self, best: &mut Best, which: usize, pass: usize, detail: Detail) -> Result<(), Cancelled> {
        let Unknown { fine, range: [low, high], .. } = &self.unknowns[which];
        let Some(step) = fine.get(pass) else { return Ok(()) };
        for direction in [1.0, -1.0] {
            let mut moved = 0;
            while moved < MOST_STEPS {
                let mut values = best.values.clone();
                values[which] = (values[which] + direction * step).clamp(*low, *high);
                let scores = self.at(&values, detail)?;
                if mean(&scores) <= mean(&best.scores) {
                    break;
                }
                (*best, moved) = (Best { values, scores }, moved + 1);
            }
            if moved > 0 {
                break;
            }
        }
        Ok(())
    }
}

/// An index with the range in which it may lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interval {
    pub best: f32,
    pub range: [f32; 2],
}

/// Distances from the best index at which its interval is sought [1].
const AWAY: [f32; 6] = [0.005, 0.01, 0.02, 0.04, 0.08, 0.16];
/// An index lies outside the interval where it scores less by so many standard errors, taken view by view.
const WORSE: f64 = 2.0;

/// The best index near `start` within bounds, and its interval: up to the nearest on either side that scores clearly less. `None` where
/// nothing is to be compared.
pub(crate) fn interval(start: f32, [low, high]: [f32; 2], score: impl Fn(f32) -> Scores) -> Option<Interval> {
    let (mut best, mut scores) = (start, score(start));
    if scores.mean().views == 0 {
        return None;
    }
    for step in [0.02, 0.01, 0.005] {
        for direction in [1.0, -1.0] {
            for _ in 0..MOST_STEPS {
                let n = (best + direction * step).clamp(low, high);
                let other = score(n);
                if mean(&other) <= mean(&scores) {
                    break;
                }
                (best, scores) = (n, other);
            }
        }
    }
    let edge = |direction: f32| {
        let is_worse = |n: f32| {
            let below = scores.above(&score(n));
            below.mean > 0.0 && below.significance() > WORSE
        };
        let mut tried = AWAY.iter().map(|a| (best + direction * a).clamp(low, high));
        tried.find(|n| is_worse(*n)).unwrap_or(if direction < 0.0 { low } else { high })
    };
    Some(Interval { best, range: [edge(-1.0), edge(1.0)] })
}

/// The mean score; −∞ where nothing is to be compared.
pub(crate) fn mean(scores: &Scores) -> f64 {
    let mean = scores.mean();
    if mean.views == 0 { f64::NEG_INFINITY } else { mean.mean }
}

/// All first values with all others.
fn products(unknowns: &[Unknown]) -> Vec<Vec<f32>> {
    unknowns.iter().fold(vec![Vec::new()], |known, unknown| {
        let with = |k: &Vec<f32>| unknown.first.iter().map(|&v| [&k[..], &[v]].concat()).collect::<Vec<_>>();
        known.iter().flat_map(with).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scan_finds_the_top_of_a_hill_that_is_narrow_in_fine_pictures() {
        let unknowns = [
            Unknown::new("index", &[1.0, 1.2, 1.4, 1.6], &[0.05, 0.02, 0.01], [1.0, 3.0]),
            Unknown::new("wall", &[0.1, 0.5], &[0.1, 0.05, 0.02], [0.0, 1.0]),
        ];
        let mut calls = 0;
        let mut score = |v: &[f32], detail: Detail| {
            calls += 1;
            let width = [0.2, 0.1, 0.05][detail as usize];
            let away = ((v[0] - 1.333) / width).powi(2) + ((v[1] - 0.36) / (4.0 * width)).powi(2);
            Ok(Scores(vec![Some(f64::from((-away).exp())); 3]))
        };
        let from = first(&unknowns, false, |v, d, _| score(v, d)).unwrap();
        assert_eq!(from.values, [1.4, 0.5]);
        let best = refined(&from, &unknowns, Detail::Fine, &mut score).unwrap();
        assert!((best.values[0] - 1.333).abs() < 0.01 && (best.values[1] - 0.36).abs() < 0.03, "{best:?}");
        assert!(calls < 60, "{calls}");
    }

    #[test]
    fn what_few_views_take_for_the_best_is_chosen_by_all() {
        let values: Vec<f32> = (0..24).map(|k| 1.0 + 0.05 * k as f32).collect();
        let unknown = Unknown::new("index", &values, &[], [1.0, 3.0]);
        let [mut few, mut all] = [0, 0];
        let found = first(&[unknown], true, |v, _, are_few| {
            *if are_few { &mut few } else { &mut all } += 1;
            let likes = |n: f32| f64::from((-((v[0] - n) / 0.1).powi(2)).exp());
            let score = likes(1.5) + if are_few { 1.1 * likes(2.0) } else { 0.0 };
            Ok(Scores(vec![Some(score); 2]))
        });
        assert_eq!((few, all), (24, 6));
        assert_eq!(found.unwrap().values, values[10..11]);
    }
}
