//! The one index of each region, by the error of rays inside the masks.

use super::region::Region;
use super::{Known, RecipeError, Start, refraction};
use crate::backend::{Backend, Batch, Layers, Marching};
use crate::cancel::Cancelled;
use crate::events::{Event, FoundIndex, Task, Watch};
use crate::initial::Profile;
use crate::model::Refraction;
use crate::options::{Options, SurfaceProfile};
use crate::rays::{RaySampler, Selection, squared_errors};
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
    fn error(&self, backend: &impl Backend) -> f64 {
        let pixels = backend.render(&self.batch.rays, &self.marching, Layers::All);
        let errors = squared_errors(&pixels, &self.batch);
        let robust = errors.iter().map(|e| e / (e + ROBUST));
        robust.sum::<f64>() / errors.len().max(1) as f64
    }
}

/// Starts that were tried, and their error.
#[derive(Clone, Debug, Default)]
struct Fit {
    error: f64,
    starts: Vec<Start>,
}

/// A search under way.
struct Search<'a, 'w, B> {
    backend: &'a mut B,
    regions: &'a [Region],
    options: &'a Options,
    judge: Judge,
    watch: &'a mut Watch<'w>,
    /// Candidates judged, and how many there will be as far as is known.
    done: u64,
    total: u64,
}

/// What each region starts from.
pub(super) fn starts<B: Backend>(
    backend: &mut B,
    regions: &[Region],
    known: &Known,
    watch: &mut Watch,
) -> Result<Vec<Start>, RecipeError> {
    let options = known.options;
    let profiles = profiles(regions, options);
    let judge = Judge::new(known.sampler, options, known.near);
    backend.set_medium(Refraction::none());
    let straight_misfit = judge.error(backend);
    let mut search = Search { backend, regions, options, judge, watch, done: 0, total: 0 };
    search.total = profiles.iter().map(|p| search.candidates(*p)).sum();
    let mut best: Option<Fit> = None;
    for profile in profiles {
        let fit = search.best(profile)?;
        let found = fit.starts.iter().map(|s| FoundIndex { index: s.index, wall: s.wall });
        let (regions, misfit) = (found.collect(), fit.error);
        search.watch.tell(Event::IndexSearched { profile, regions, misfit });
        if best.as_ref().is_none_or(|b| fit.error < BETTER * b.error) {
            best = Some(fit);
        }
    }
    let mut best = best.unwrap_or_default();
    if search.searches() && best.error > DECISIVE * straight_misfit {
        let (index, profile) = (options.search.guess, profile_of(options.search.profile));
        watch.tell(Event::IndexGuessed { straight_misfit, index });
        best.starts.fill(Start { profile, index, wall: 1.0, searched: false });
    }
    if let Some(first) = best.starts.first() {
        watch.tell(Event::RaysBend { profile: first.profile });
    }
    Ok(best.starts)
}

/// The profiles that are tried.
fn profiles(regions: &[Region], options: &Options) -> Vec<Profile> {
    let mut profiles = match options.search.profile {
        SurfaceProfile::Auto => vec![Profile::Sharp, Profile::Graded],
        other => vec![profile_of(other)],
    };
    if regions.iter().any(Region::is_known) {
        profiles.retain(|p| *p != Profile::Graded);
        profiles.push(Profile::Smooth);
        profiles.dedup();
    }
    profiles
}

fn profile_of(surface: SurfaceProfile) -> Profile {
    match surface {
        SurfaceProfile::Auto | SurfaceProfile::Sharp => Profile::Sharp,
        SurfaceProfile::Smooth => Profile::Smooth,
        SurfaceProfile::Graded => Profile::Graded,
    }
}

impl<B: Backend> Search<'_, '_, B> {
    /// Whether an index is searched at all: it is not known, and a search is wanted.
    fn searches(&self) -> bool {
        self.options.search.enabled.is_on() && !self.regions.iter().all(Region::is_known)
    }

    /// Candidates of a profile whose regions are solid.
    fn candidates(&self, profile: Profile) -> u64 {
        if !self.searches() {
            return 1;
        }
        let walls = if profile == Profile::Sharp { WALLS.len() * HOLLOW.len() } else { 0 };
        let of_region = walls + FINE.len() * (AROUND.len() + 1);
        u64::from(COARSE) + (of_region * self.regions.len()) as u64
    }

    /// Error of rays bent from these starts.
    fn error(&mut self, starts: &[Start]) -> Result<f64, Cancelled> {
        self.watch.progress(Task::SearchingIndex, self.done, self.total.max(self.done))?;
        self.done += 1;
        self.backend.set_medium(refraction(self.regions, starts, self.options));
        Ok(self.judge.error(self.backend) * index_prior(starts))
    }

    /// The candidate with the least error.
    fn least(&mut self, candidates: impl IntoIterator<Item = Vec<Start>>) -> Result<Fit, Cancelled> {
        let mut best: Option<Fit> = None;
        for starts in candidates {
            let error = self.error(&starts)?;
            if best.as_ref().is_none_or(|b| error.total_cmp(&b.error).is_lt()) {
                best = Some(Fit { error, starts });
            }
        }
        Ok(best.unwrap_or_default())
    }

    /// All regions together over the whole range, then each by itself, finer and finer.
    fn best(&mut self, profile: Profile) -> Result<Fit, Cancelled> {
        let count = self.regions.len();
        let all = |index: f32, searched: bool| vec![Start { profile, index, wall: 1.0, searched }; count];
        if !self.searches() {
            return self.least([all(self.options.search.guess, false)]);
        }
        let mut fit = self.least((0..COARSE).map(|k| all(1.0 + 0.075 * k as f32, true)))?;
        for region in 0..if profile == Profile::Sharp { count } else { 0 } {
            let solid = fit.starts.clone();
            let hollow =
                |wall: f32, index: f32| changed(&solid, region, |s| (s.wall, s.index) = (wall, index));
            let walls = WALLS.iter().flat_map(|&wall| HOLLOW.map(|index| hollow(wall, index)));
            let found = self.least(walls)?;
            if found.error < BETTER * fit.error {
                fit = found;
            }
        }
        for step in FINE {
            for region in 0..count {
                fit = self.refined(&fit.starts, region, step)?;
            }
        }
        Ok(fit)
    }

    /// A region's index, then its wall, some steps around what they are.
    fn refined(&mut self, starts: &[Start], region: usize, step: f32) -> Result<Fit, Cancelled> {
        let Start { index, wall, .. } = starts[region];
        let around = AROUND.map(|k| (index + k * step).max(1.0));
        let best = self.least(around.map(|n| changed(starts, region, |s| s.index = n)))?;
        let thicker = if wall < 1.0 { &AROUND[..] } else { &[0.0] };
        let walls = thicker.iter().map(|k| (wall + k * step).clamp(0.02, 1.0));
        self.least(walls.map(|w| changed(&best.starts, region, |s| s.wall = w)))
    }
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
