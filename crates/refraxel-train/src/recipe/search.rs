//! The one index of each region, by the error of rays inside the masks.

use super::regions::Region;
use super::{Profile, Start, refraction};
use crate::backend::{Backend, Batch, Marching};
use crate::cpu::CpuBackend;
use crate::options::{Options, SurfaceProfile};
use crate::rays::{RaySampler, Selection};
use crate::schedule::training_marching;

/// Rays that judge an index.
const RAYS: usize = 4096;
/// Candidates of the first pass: 1, 1.075, … 2.5.
const COARSE: u32 = 21;
/// Distance of the candidates of the later passes, five each.
const FINE: [f32; 3] = [0.03, 0.01, 0.005];
/// Candidates of a later pass, in its distances.
const AROUND: [f32; 5] = [-2.0, -1.0, 0.0, 1.0, 2.0];
/// Thickness of the walls of hollow bodies that are tried [depth of the body], each with all of these indices.
const WALLS: [f32; 5] = [0.08, 0.15, 0.25, 0.4, 0.6];
const HOLLOW: [f32; 5] = [1.3, 1.4, 1.5, 1.6, 1.75];
/// Squared error that counts half, over the three channels.
const ROBUST: f64 = 0.01;
/// The best index must lower the error of straight rays to this part. Where it does not, what is seen through the body is
/// not known yet, and the search says nothing.
const DECISIVE: f64 = 0.97;
/// Another profile must be better than a sharp surface by this factor of the error.
const BETTER: f64 = 0.985;

/// Most things are of water, glass or plastic. An index this far from the usual one must fit better by a part of
/// [`UNUSUAL`]; twice as far, by four. It decides where the error hardly depends on the index, and nowhere else.
const USUAL: [f64; 2] = [1.42, 0.25];
const UNUSUAL: f64 = 0.002;

/// Loss of rays inside the masks.
pub(super) struct Judge {
    batch: Batch,
    marching: Marching,
}

impl Judge {
    pub(super) fn new(sampler: &RaySampler, options: &Options, near: f32) -> Self {
        // No step of a run has this number: the judge has rays of its own.
        let batch = sampler.batch(u64::MAX / 2, RAYS, Selection::Inside(1.0));
        Self { batch, marching: training_marching(options, near) }
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
    options: &Options,
) -> (Vec<Start>, Vec<String>) {
    let mut profiles = match options.search.profile {
        SurfaceProfile::Auto => vec![Profile::Sharp, Profile::Graded],
        other => vec![profile_of(other)],
    };
    if regions.iter().any(Region::is_known) {
        profiles.retain(|p| *p != Profile::Graded);
        profiles.push(Profile::Smooth);
        profiles.dedup();
    }
    let mut best: Option<(f64, Vec<Start>)> = None;
    let mut events = Vec::new();
    let straight = {
        backend.set_refraction(crate::refraction::Refraction::none());
        judge.error(backend)
    };
    for profile in profiles {
        let (error, found) = search(backend, regions, judge, options, profile);
        let said = found.iter().map(|s| match s.wall {
            1.0 => format!("{:.3}", s.index),
            wall => format!("{:.3} (hollow: the wall is {:.0} % of the depth)", s.index, 100.0 * wall),
        });
        let indices: Vec<String> = said.collect();
        events.push(format!("{}: index {} fits best, misfit {error:.3}", profile.name(), indices.join(", ")));
        if best.as_ref().is_none_or(|(b, _)| error < BETTER * b) {
            best = Some((error, found));
        }
    }
    let (error, mut best) = best.unwrap_or_default();
    if error > DECISIVE * straight && !regions.iter().all(Region::is_known) && options.search.enabled.is_on()
    {
        let n = options.search.guess;
        events.push(format!("straight rays fit as well (misfit {straight:.3}): starting from index {n}"));
        best.iter_mut()
            .for_each(|s| *s = Start { profile: Profile::Sharp, index: n, wall: 1.0, searched: false });
        if options.search.profile != SurfaceProfile::Auto {
            best.iter_mut().for_each(|s| s.profile = profile_of(options.search.profile));
        }
    }
    events.push(format!("rays bend: {}", best.first().map_or("nowhere", |s| s.profile.name())));
    (best, events)
}

fn profile_of(surface: SurfaceProfile) -> Profile {
    match surface {
        SurfaceProfile::Auto | SurfaceProfile::Sharp => Profile::Sharp,
        SurfaceProfile::Smooth => Profile::Smooth,
        SurfaceProfile::Graded => Profile::Graded,
    }
}

/// All regions together over the whole range, then each by itself, finer and finer.
fn search(
    backend: &mut CpuBackend,
    regions: &[Region],
    judge: &Judge,
    options: &Options,
    profile: Profile,
) -> (f64, Vec<Start>) {
    let mut error = |starts: &[Start]| {
        backend.set_refraction(refraction(regions, starts, options));
        judge.error(backend) * index_prior(starts)
    };
    let all = |index: f32| vec![Start { profile, index, wall: 1.0, searched: true }; regions.len()];
    let mut starts = all(options.search.guess);
    if !options.search.enabled.is_on() || regions.iter().all(Region::is_known) {
        starts.iter_mut().for_each(|s| s.searched = false);
        return (error(&starts), starts);
    }
    let coarse = (0..COARSE).map(|k| 1.0 + 0.075 * k as f32);
    let (mut lowest, best) = least(coarse, |n| error(&all(n)));
    starts = all(best);
    for region in 0..if profile == Profile::Sharp { starts.len() } else { 0 } {
        let with =
            |(wall, index): (f32, f32)| changed(&starts, region, |s| (s.wall, s.index) = (wall, index));
        let walls = WALLS.iter().flat_map(|&w| HOLLOW.map(|n| (w, n)));
        let (found, hollow) = least(walls, |c| error(&with(c)));
        if found < BETTER * lowest {
            (lowest, starts) = (found, with(hollow));
        }
    }
    for step in FINE {
        for region in 0..starts.len() {
            let Start { index, wall, .. } = starts[region];
            let with = |n: f32| changed(&starts, region, |s| s.index = n);
            let (_, index) = least(AROUND.map(|k| (index + k * step).max(1.0)), |n| error(&with(n)));
            starts = with(index);
            let thicker = if wall < 1.0 { &AROUND[..] } else { &[0.0] };
            let with = |w: f32| changed(&starts, region, |s| s.wall = w);
            let walls = thicker.iter().map(|k| (wall + k * step).clamp(0.02, 1.0));
            let wall;
            (lowest, wall) = least(walls, |w| error(&with(w)));
            starts = with(wall);
        }
    }
    (lowest, starts)
}

/// Factor on the error of unusual indices.
fn index_prior(starts: &[Start]) -> f64 {
    let away = |s: &Start| ((f64::from(s.index) - USUAL[0]) / USUAL[1]).powi(2);
    1.0 + UNUSUAL * starts.iter().map(away).sum::<f64>() / starts.len().max(1) as f64
}

/// The same starts but for one region.
fn changed(starts: &[Start], region: usize, change: impl FnOnce(&mut Start)) -> Vec<Start> {
    let mut starts = starts.to_vec();
    change(&mut starts[region]);
    starts
}

/// The candidate with the least error, and that error.
fn least<C: Copy>(candidates: impl IntoIterator<Item = C>, mut error: impl FnMut(C) -> f64) -> (f64, C) {
    let judged = candidates.into_iter().map(|c| (error(c), c));
    let best = judged.min_by(|a, b| a.0.total_cmp(&b.0));
    best.unwrap_or_else(|| unreachable!("there are candidates"))
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
