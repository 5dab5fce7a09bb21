//! The unknown numbers of each hypothesis on each region, by the error of rays inside the masks: all first values, then
//! coordinate descent. The radiance field is held; it shows what straight rays have learned around the regions.

mod bodies;
mod starts;
#[cfg(test)]
mod tests;
mod tint;

use super::hypotheses::{Body, Candidate, Proposal, Unknown, proposals};
use super::region::Region;
use super::{Known, refraction};
use crate::backend::{Backend, Batch, Layers, Marching};
use crate::cancel::Cancelled;
use crate::events::{Event, Task, Watch};
use crate::model::Refraction;
use crate::options::{Options, SearchOptions};
use crate::rays::{Selection, squared_errors};
use crate::schedule::training_marching;
use crate::verdict::{Found, Hypothesis};
use bodies::Shapes;
use refraxel_core::radiance::Pixel;
use std::collections::HashMap;

/// Candidates of a finer pass, in its distances.
const AROUND: [f32; 5] = [-2.0, -1.0, 0.0, 1.0, 2.0];

/// And of the index together with the second unknown: the error has a valley across both, for more glass and a lower index
/// look alike.
const DIAGONALS: [[f32; 2]; 8] =
    [[1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [2.0, 1.0], [-2.0, -1.0], [2.0, -1.0], [-2.0, 1.0]];
/// Rounds of a pass at most: another one follows where one lowers the error to this part.
const ROUNDS: usize = 3;
const BETTER: f64 = 0.97;

/// A hypothesis with the numbers that fit best.
#[derive(Clone)]
pub(super) struct Fit {
    /// Mean of e/(e + saturation), times the prior on the index.
    pub misfit: f64,
    /// The same by which hypotheses compare: larger where one has more unknowns.
    pub error: f64,
    pub candidate: Candidate,
}

/// What a search found on one region.
pub(super) struct Fits {
    /// Error of straight rays.
    pub straight: f64,
    /// One per hypothesis, and of dear ones one per valley of the error; the best first.
    pub fits: Vec<Fit>,
}

/// Rays of the search lie up to so many times `refraction.mask_margin` beside masks.
const BESIDE: u32 = 2;

/// Rays that judge what stands in one region.
struct Judge {
    /// For the last passes.
    batch: Batch,
    /// A part of them for first values: these are many, and differ more.
    few: Batch,
    /// Those of that part that meet the region: what colours them is the body.
    through: Batch,
    marching: Marching,
    saturation: f64,
}

impl Judge {
    /// Rays inside masks, and half as many around their borders, of those that would meet the region on a straight line or pass near
    /// it. Those beside masks tell where the body ends: inside alone, a larger body of a higher index looks alike.
    fn new(known: &Known, region: &Region, is_alone: bool) -> Self {
        let Known { sampler, options, near, .. } = *known;
        let reach = BESIDE * options.refraction.mask_margin;
        let gate = || region.widened(reach as f32 * sampler.pixel_size(region.site.bounds.center()));
        let gate = (!is_alone).then(gate);
        let drawn = |rays: usize, selection: Selection| {
            // No step of a run has this number: the judge has rays of its own.
            let drawn = sampler.batch(u64::MAX / 2, rays * if is_alone { 1 } else { 4 }, selection);
            drawn.filtered(rays, |ray| gate.as_ref().is_none_or(|gate| gate.admits(ray)))
        };
        let rays = options.search.rays as usize;
        let (inside, around) =
            (drawn(rays, Selection::Inside(1.0)), drawn(rays / 2, Selection::Around(reach)));
        let part = |of: &Batch| of.filtered(of.rays.len() / 4, |_| true);
        let few = part(&inside).and(part(&around));
        let through = few.filtered(usize::MAX, |ray| region.meets(ray));
        let (marching, saturation) = (training_marching(options, near), options.search.saturation);
        Self { batch: inside.and(around), few, through, marching, saturation }
    }

    fn batch(&self, care: Care) -> &Batch {
        match care {
            Care::First => &self.few,
            Care::Through => &self.through,
            Care::Last => &self.batch,
        }
    }

    /// What its rays show.
    fn shown(&self, backend: &impl Backend, care: Care) -> Vec<Pixel<f32>> {
        backend.render(&self.batch(care).rays, &self.marching, Layers::All)
    }

    /// Mean over the rays of e/(e + saturation), e being the squared error (Geman & McClure 1985).
    fn error(&self, shown: &[Pixel<f32>], care: Care) -> f64 {
        let errors = squared_errors(shown, self.batch(care));
        let robust = errors.iter().map(|e| e / (e + self.saturation));
        robust.sum::<f64>() / errors.len().max(1) as f64
    }
}

/// Error of straight rays.
#[derive(Clone, Copy)]
struct Straight {
    /// By the rays of first values.
    few: f64,
    /// By all of them.
    all: f64,
}

impl Straight {
    /// While nothing bends.
    fn new(judge: &Judge, backend: &impl Backend) -> Self {
        let [few, all] = [Care::First, Care::Last].map(|care| judge.error(&judge.shown(backend, care), care));
        Self { few, all }
    }
}

/// How many rays judge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Care {
    /// A part.
    First,
    /// Those of that part that meet the region.
    Through,
    /// All.
    Last,
}

/// What the error of a candidate depends on while the rest stands: hypothesis, bits of its values, rays.
type Key = (Hypothesis, Vec<u32>, Care);

/// A search under way.
struct Search<'a, 'w, B> {
    backend: &'a mut B,
    regions: &'a [Region],
    /// Coarser ones, where there are some.
    sketches: Vec<Option<Region>>,
    /// Shapes that candidates share.
    shapes: Shapes,
    options: &'a Options,
    watch: &'a mut Watch<'w>,
    /// What stands in the other regions meanwhile.
    standing: Vec<Option<Candidate>>,
    /// What each region absorbs [1 / scene unit].
    tints: Vec<[f32; 3]>,
    /// Errors of candidates since something else changed: the middle of a round, and what ends at the end of a range, come again.
    errors: HashMap<Key, f64>,
    /// Candidates judged, and how many there will be as far as is known.
    done: u64,
    total: u64,
}

/// Searches region by region; where one is seen through another, once more with the others as they were found.
pub(super) fn fits<B: Backend>(
    backend: &mut B,
    regions: &[Region],
    known: &Known,
    watch: &mut Watch,
) -> Result<Vec<Fits>, Cancelled> {
    let options = known.options;
    let judges: Vec<Judge> = regions.iter().map(|r| Judge::new(known, r, regions.len() == 1)).collect();
    let sketches = regions.iter().map(|r| r.sketch(options)).collect();
    backend.set_medium(Refraction::none());
    let straight: Vec<Straight> = judges.iter().map(|j| Straight::new(j, backend)).collect();
    let (standing, tints) = (vec![None; regions.len()], vec![[0.0; 3]; regions.len()]);
    let mut search = Search {
        backend,
        regions,
        sketches,
        shapes: Shapes::default(),
        options,
        watch,
        standing,
        tints,
        errors: HashMap::new(),
        done: 0,
        total: 0,
    };
    search.total = regions.iter().map(|r| search.candidates(r)).sum();
    let mut found = Vec::with_capacity(regions.len());
    for (k, judge) in judges.iter().enumerate() {
        search.tints[k] = search.tint(k, judge)?;
        let fits = search.all(k, judge, straight[k])?;
        search.standing[k] = fits.first().map(|best| best.candidate.clone());
        found.push(Fits { straight: straight[k].all, fits });
    }
    if regions.len() > 1 && search.searches() {
        for (k, judge) in judges.iter().enumerate() {
            search.refine_among_others(k, judge, &mut found[k])?;
        }
    }
    Ok(found)
}

impl<B: Backend> Search<'_, '_, B> {
    /// Whether anything is searched at all.
    fn searches(&self) -> bool {
        self.options.search.enabled.is_on() && !self.regions.iter().all(|r| r.is_known())
    }

    /// The region on which a hypothesis is tried: a sketch, unless the body has edges by this hypothesis, which that would
    /// round: then first values only.
    fn place(&self, region: usize, proposal: &Proposal, care: Care) -> &Region {
        let whole = &self.regions[region];
        let has_edges = match proposal.kind {
            Hypothesis::Solid => whole.may_have_edges(),
            kind => kind == Hypothesis::Polyhedron,
        };
        let is_exact = has_edges && care == Care::Last;
        self.sketches[region].as_ref().filter(|_| !is_exact).unwrap_or(whole)
    }

    /// About how many candidates a region has.
    fn candidates(&self, region: &Region) -> u64 {
        if !self.searches() {
            return 1;
        }
        let of = |proposal: &Proposal| {
            let unknowns = (proposal.unknowns)(region);
            let first: usize = unknowns.iter().map(|u| u.first.len()).product();
            let diagonals = if unknowns.len() > 1 { unknowns[0].fine.len() * DIAGONALS.len() } else { 0 };
            first
                + starts::most(proposal, &unknowns)
                    * (unknowns.iter().map(|u| u.fine.len() * AROUND.len()).sum::<usize>() + diagonals)
        };
        proposals(region, self.options).iter().map(|p| of(p) as u64).sum()
    }

    /// The best numbers of each hypothesis on a region; the better hypotheses first. The first proposal is the simplest: the
    /// others must be better by a margin.
    fn all(&mut self, region: usize, judge: &Judge, straight: Straight) -> Result<Vec<Fit>, Cancelled> {
        self.errors.clear();
        let proposals = proposals(&self.regions[region], self.options);
        let simplest = proposals[0];
        if !self.searches() {
            let candidate = Candidate::guess(simplest, &self.regions[region], self.options);
            let error = self.error(region, &candidate, judge, Care::Last)?;
            return Ok(vec![self.told(region, Fit { misfit: error, error, candidate }, true)]);
        }
        let (dear, usual): (Vec<_>, Vec<_>) = proposals.into_iter().partition(|p| p.is_dear);
        let (mut found, mut nearest) = (Vec::new(), f64::INFINITY);
        for group in [usual, dear] {
            let least = found.iter().map(|f: &Fit| f.error).fold(f64::INFINITY, f64::min);
            if least < self.options.search.explained * straight.all {
                break;
            }
            let first = group.into_iter().map(|p| self.first(region, p, judge, straight.few));
            let first = first.collect::<Result<Vec<_>, _>>()?;
            nearest = first.iter().flatten().map(|f| f.error).fold(nearest, f64::min);
            for starts in first {
                let Some(proposal) = starts.first().map(|f| f.candidate.proposal) else { continue };
                let (far, mut near): (Vec<_>, Vec<_>) =
                    starts.into_iter().partition(|f| f.error > self.options.search.far * nearest);
                for fit in &mut near {
                    *fit = self.refined(region, fit.clone(), judge, 1)?;
                }
                let unknowns = (proposal.unknowns)(&self.regions[region]);
                let fits = if near.is_empty() { far } else { starts::apart(near, &unknowns) };
                for fit in fits {
                    found.push(self.told(region, fit, proposal == simplest));
                }
            }
        }
        found.sort_by(|a, b| a.error.total_cmp(&b.error));
        Ok(found)
    }

    /// Says what was found. A hypothesis that is not the simplest needs a lower error.
    fn told(&mut self, region: usize, mut fit: Fit, is_simplest: bool) -> Fit {
        let (hypothesis, misfit) = (fit.candidate.proposal.kind, fit.misfit);
        let found = fit.candidate.found(&self.regions[region]);
        self.watch.tell(Event::IndexSearched { region, hypothesis, found, misfit });
        if !is_simplest {
            fit.error /= self.options.search.better;
        }
        fit
    }

    /// A hypothesis on a region after all first values and, from where it starts, the first pass, by some of the rays.
    fn first(
        &mut self,
        region: usize,
        proposal: &'static Proposal,
        judge: &Judge,
        straight: f64,
    ) -> Result<Vec<Fit>, Cancelled> {
        let (unknowns, tint) = ((proposal.unknowns)(&self.regions[region]), self.tints[region]);
        let first = products(&unknowns).into_iter();
        let candidates =
            first.map(|values| Candidate { proposal, values, searched: true, tint, refined: None });
        let mut fits = self.judged(region, candidates.collect(), judge, Care::First)?;
        if unknowns.iter().all(|u| u.fine.len() < 2) {
            fits.truncate(1);
            return Ok(fits); // its only pass takes all rays
        }
        let starts = starts::starts(fits, proposal, &unknowns, straight);
        starts.into_iter().map(|s| self.pass(region, s, judge, 0, Care::First)).collect()
    }

    /// Coordinate descent from a pass on.
    fn refined(&mut self, region: usize, mut fit: Fit, judge: &Judge, from: usize) -> Result<Fit, Cancelled> {
        let unknowns = (fit.candidate.proposal.unknowns)(&self.regions[region]);
        let passes = unknowns.iter().map(|u| u.fine.len()).max().unwrap_or(0);
        if passes == 0 {
            return self.least(region, vec![fit.candidate], judge, Care::Last);
        }
        for pass in from.min(passes.saturating_sub(1))..passes {
            let care = if pass + 1 < passes { Care::First } else { Care::Last };
            fit = self.pass(region, fit, judge, pass, care)?;
        }
        Ok(fit)
    }

    /// A pass: rounds as long as they help, for a narrow valley is followed in several.
    fn pass(
        &mut self,
        region: usize,
        mut fit: Fit,
        judge: &Judge,
        pass: usize,
        care: Care,
    ) -> Result<Fit, Cancelled> {
        fit.error = f64::INFINITY;
        for _ in 0..ROUNDS {
            let before = fit.error;
            fit = self.around(region, fit, judge, pass, care)?;
            if fit.error >= BETTER * before {
                break;
            }
        }
        Ok(fit)
    }

    /// One round of a pass: along each unknown, and across the first two.
    fn around(
        &mut self,
        region: usize,
        mut fit: Fit,
        judge: &Judge,
        pass: usize,
        care: Care,
    ) -> Result<Fit, Cancelled> {
        let unknowns = (fit.candidate.proposal.unknowns)(&self.regions[region]);
        let moved = |from: &Candidate, by: &[(usize, f32)]| {
            let mut moved = from.clone();
            for &(which, k) in by {
                let Unknown { fine, range: [low, high], .. } = &unknowns[which];
                let step = fine.get(pass).copied().unwrap_or(0.0);
                moved.values[which] = (moved.values[which] + k * step).clamp(*low, *high);
            }
            moved
        };
        for which in (0..unknowns.len()).filter(|&which| unknowns[which].fine.len() > pass) {
            let around = AROUND.map(|k| moved(&fit.candidate, &[(which, k)]));
            fit = self.least(region, around.to_vec(), judge, care)?;
        }
        if unknowns.len() > 1 {
            let across = DIAGONALS.map(|[a, b]| moved(&fit.candidate, &[(0, a), (1, b)]));
            let best = self.least(region, across.to_vec(), judge, care)?;
            fit = if best.error < fit.error { best } else { fit };
        }
        Ok(fit)
    }

    /// The best hypothesis again, now that something stands in the other regions.
    fn refine_among_others(
        &mut self,
        region: usize,
        judge: &Judge,
        found: &mut Fits,
    ) -> Result<(), Cancelled> {
        self.errors.clear();
        let Some(best) = found.fits.first_mut() else { return Ok(()) };
        let fit = self.refined(region, best.clone(), judge, 0)?;
        if fit.error.is_finite() {
            *best = fit;
            self.standing[region] = Some(best.candidate.clone());
        }
        Ok(())
    }

    /// The candidate with the least error.
    fn least(
        &mut self,
        region: usize,
        candidates: Vec<Candidate>,
        judge: &Judge,
        care: Care,
    ) -> Result<Fit, Cancelled> {
        let best = self.judged(region, candidates, judge, care)?.into_iter().next();
        Ok(best.unwrap_or_else(|| unreachable!("every unknown has values")))
    }

    /// All of the candidates, those with lower errors first.
    fn judged(
        &mut self,
        region: usize,
        candidates: Vec<Candidate>,
        judge: &Judge,
        care: Care,
    ) -> Result<Vec<Fit>, Cancelled> {
        if let Some(Candidate { proposal, .. }) = candidates.first() {
            let mut shapes = std::mem::take(&mut self.shapes);
            let place = self.place(region, proposal, care);
            let new: Vec<_> =
                candidates.iter().filter(|c| !self.errors.contains_key(&key(c, care))).collect();
            shapes.make(&new, region, place, (self.options, self.watch.cancel()))?;
            self.shapes = shapes;
        }
        let judged = candidates.into_iter().map(|candidate| {
            let error = self.error(region, &candidate, judge, care)?;
            Ok(Fit { misfit: error, error, candidate })
        });
        let mut fits = judged.collect::<Result<Vec<_>, _>>()?;
        fits.sort_by(|a, b| a.error.total_cmp(&b.error)); // the first of equals stays the first
        Ok(fits)
    }

    /// Error of rays bent by a candidate, and by what stands in the other regions.
    fn error(
        &mut self,
        region: usize,
        candidate: &Candidate,
        judge: &Judge,
        care: Care,
    ) -> Result<f64, Cancelled> {
        let key = key(candidate, care);
        if let Some(error) = self.errors.get(&key) {
            self.done += 1;
            return Ok(*error);
        }
        let shown = self.shown(region, candidate, judge, care)?;
        let error = judge.error(&shown, care) * prior(candidate, &self.regions[region], &self.options.search);
        self.errors.insert(key, error);
        Ok(error)
    }

    /// What these rays show.
    fn shown(
        &mut self,
        region: usize,
        candidate: &Candidate,
        judge: &Judge,
        care: Care,
    ) -> Result<Vec<Pixel<f32>>, Cancelled> {
        self.watch.progress(Task::SearchingIndex, self.done, self.total.max(self.done))?;
        self.done += 1;
        let standing = |k: usize| if k == region { Some(candidate) } else { self.standing[k].as_ref() };
        let of =
            |k: usize, c: &Candidate| self.shapes.bodies(c, k, self.place(k, c.proposal, care), self.options);
        let bodies: Vec<Body> =
            (0..self.regions.len()).filter_map(|k| standing(k).map(|c| of(k, c))).flatten().collect();
        self.backend.set_medium(refraction(bodies, self.options));
        Ok(judge.shown(self.backend, care))
    }
}

fn key(candidate: &Candidate, care: Care) -> Key {
    (candidate.proposal.kind, candidate.values.iter().map(|v| v.to_bits()).collect(), care)
}

/// Factor on the error of unusual indices, and of surfaces off the hull.
fn prior(candidate: &Candidate, region: &Region, options: &SearchOptions) -> f64 {
    let away = |found: &Found| {
        let value = f64::from(found.value);
        match found.name.as_str() {
            "index" => (value - options.usual_index) / options.usual_spread,
            "offset" => value / options.usual_offset,
            _ => 0.0,
        }
    };
    1.0 + options.unusual * candidate.found(region).iter().map(|f| away(f).powi(2)).sum::<f64>()
}

/// All first values with all others.
fn products(unknowns: &[Unknown]) -> Vec<Vec<f32>> {
    unknowns.iter().fold(vec![Vec::new()], |known, unknown| {
        let with = |k: &Vec<f32>| unknown.first.iter().map(|&v| [&k[..], &[v]].concat()).collect::<Vec<_>>();
        known.iter().flat_map(with).collect()
    })
}
