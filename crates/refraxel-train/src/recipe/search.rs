//! The one index of each region, by the error of rays inside the masks.

use super::regions::Region;
use super::{Profile, Start, refraction};
use crate::backend::{Backend, Batch, Marching};
use crate::config::{Config, Surface};
use crate::cpu::CpuBackend;
use crate::rays::{Selection, Shots};
use crate::schedule::training_marching;

/// Rays that judge an index.
const RAYS: usize = 4096;
/// Candidates of the first pass: 1, 1.075, … 2.5.
const COARSE: u32 = 21;
/// Distance of the candidates of the later passes, five each.
const FINE: [f32; 3] = [0.03, 0.01, 0.005];
/// Squared error that counts half, over the three channels.
const ROBUST: f64 = 0.01;
/// The best index must lower the error of straight rays to this part. Where it does not, what is seen through the body is
/// not known yet, and the search says nothing.
const DECISIVE: f64 = 0.985;
/// Another profile must be better than a sharp surface by this factor of the error.
const BETTER: f64 = 0.985;

/// Loss of rays inside the masks.
pub(super) struct Judge {
    batch: Batch,
    marching: Marching,
}

impl Judge {
    pub(super) fn new(shots: &Shots, config: &Config, near: f32) -> Self {
        // No step of a run has this number: the judge has rays of its own.
        let batch = shots.batch(u64::MAX / 2, RAYS, Selection::Inside(1.0));
        Self { batch, marching: training_marching(config, near) }
    }

    /// Mean over the rays of e/(e + 0.01), e being the squared error (Geman & McClure 1985): rays that end at something
    /// unknown must not decide.
    fn error(&self, backend: &CpuBackend) -> f64 {
        let errors = backend.squared_errors(&self.batch, &self.marching);
        let robust = errors.iter().map(|e| e / (e + ROBUST));
        robust.sum::<f64>() / errors.len().max(1) as f64
    }
}

/// What each region starts from, and what there is to say about it.
pub(super) fn starts(
    backend: &mut CpuBackend,
    regions: &[Region],
    judge: &Judge,
    config: &Config,
) -> (Vec<Start>, Vec<String>) {
    let mut profiles = match config.index_surface {
        Surface::Auto => vec![Profile::Sharp, Profile::Graded],
        other => vec![profile_of(other)],
    };
    if regions.iter().any(Region::is_known) {
        profiles.retain(|p| *p != Profile::Graded);
        profiles.push(Profile::Smooth);
        profiles.dedup();
    }
    let mut best: Option<(f64, Vec<Start>)> = None;
    let mut news = Vec::new();
    let straight = {
        backend.set_refraction(crate::refraction::Refraction::none());
        judge.error(backend)
    };
    for profile in profiles {
        let (error, found) = search(backend, regions, judge, config, profile);
        let indices: Vec<String> = found.iter().map(|s| format!("{:.3}", s.index)).collect();
        news.push(format!("{}: index {} fits best, misfit {error:.3}", profile.name(), indices.join(", ")));
        if best.as_ref().is_none_or(|(b, _)| error < BETTER * b) {
            best = Some((error, found));
        }
    }
    let (error, mut best) = best.unwrap_or_default();
    if error > DECISIVE * straight && !regions.iter().all(Region::is_known) && config.index_scan.is_on() {
        let n = config.index_guess;
        news.push(format!("straight rays fit as well (misfit {straight:.3}): starting from index {n}"));
        best.iter_mut().for_each(|s| *s = Start { profile: Profile::Sharp, index: n, searched: false });
        if config.index_surface != Surface::Auto {
            best.iter_mut().for_each(|s| s.profile = profile_of(config.index_surface));
        }
    }
    news.push(format!("rays bend: {}", best.first().map_or("nowhere", |s| s.profile.name())));
    (best, news)
}

fn profile_of(surface: Surface) -> Profile {
    match surface {
        Surface::Auto | Surface::Sharp => Profile::Sharp,
        Surface::Smooth => Profile::Smooth,
        Surface::Graded => Profile::Graded,
    }
}

/// All regions together over the whole range, then each by itself, finer and finer.
fn search(
    backend: &mut CpuBackend,
    regions: &[Region],
    judge: &Judge,
    config: &Config,
    profile: Profile,
) -> (f64, Vec<Start>) {
    let mut error = |starts: &[Start]| {
        backend.set_refraction(refraction(regions, starts, config));
        judge.error(backend)
    };
    let all = |index: f32| vec![Start { profile, index, searched: true }; regions.len()];
    let mut starts = all(config.index_guess);
    if !config.index_scan.is_on() || regions.iter().all(Region::is_known) {
        starts.iter_mut().for_each(|s| s.searched = false);
        return (error(&starts), starts);
    }
    let coarse = (0..COARSE).map(|k| 1.0 + 0.075 * k as f32);
    let (_, best) = least(coarse, |n| error(&all(n)));
    starts = all(best);
    let mut lowest = f64::INFINITY;
    for step in FINE {
        for region in 0..starts.len() {
            let center = starts[region].index;
            let candidates = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k| (center + k * step).max(1.0));
            (lowest, starts[region].index) = least(candidates, |n| {
                let mut tried = starts.clone();
                tried[region].index = n;
                error(&tried)
            });
        }
    }
    (lowest, starts)
}

/// The candidate with the least error, and that error.
fn least(candidates: impl IntoIterator<Item = f32>, mut error: impl FnMut(f32) -> f64) -> (f64, f32) {
    let judged = candidates.into_iter().map(|n| (error(n), n));
    judged.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::INFINITY, 1.0))
}

impl Profile {
    fn name(self) -> &'static str {
        match self {
            Self::Sharp => "at a sharp surface",
            Self::Smooth => "through a smooth transition",
            Self::Graded => "in an index gradient",
        }
    }
}
