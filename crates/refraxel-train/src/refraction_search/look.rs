//! A look at a region: the numbers of hypotheses and a first surface, by what the field of straight rays shows through them.

use super::context::Context;
use super::hypotheses::refraction;
use super::hypotheses::{Body, Candidate, OFFSET, Proposal};
use super::region::Region;
use super::surface::Surface;
use crate::backend::{Backend, Marching};
use crate::cancel::Cancelled;
use crate::events::{Observer, Task};
use crate::evidence::{
    Best, Detail, Photographs, Predicted, Refiner, Scores, Unknown, Way, first, mean, predict, refined,
};
use crate::model::Refraction;
use crate::options::Options;
use crate::rays::RaySampler;
use crate::verdict::Hypothesis;
use refraxel_core::{IndexGrid, Ray};
use std::collections::HashMap;
use std::time::{Duration, Instant};

/// Views that are looked at while numbers are scanned, at most: few of them for first numbers of hypotheses whose scan takes long.
const FEW_VIEWS: usize = 6;
const SCANNED_VIEWS: usize = 12;
/// The detail of pictures by which hypotheses compare and verdicts are taken. A hull from rough masks shows little in finer ones.
pub(super) const JUDGED: Detail = Detail::Middle;
/// A hypothesis whose best first numbers score less than the best of those beside it by `FAR`, or less than what stands, whose surface
/// may be refined, by `NEAR`, is not followed.
const FAR: f64 = 0.15;
const NEAR: f64 = 0.2;
/// What stands and scores this much is not weighed against hypotheses whose scan takes long.
pub(super) const CONVINCING: f64 = 0.85;
/// A hypothesis must score more than a simpler one by this much, and by so many standard errors.
const BETTER: f64 = 0.01;
pub(super) const SURELY: f64 = 2.0;
/// Largest share of a run with a clock in which a surface may be refined.
const MOST_REFINING: f64 = 0.08;
/// A run of fewer steps refines it by a part of the usual steps.
const REFINED_STEPS: f64 = 2000.0;

/// Scores that are larger by more than they vary.
pub(super) fn is_better(scores: &Scores, than: &Scores) -> bool {
    let above = scores.above(than);
    above.mean > BETTER && above.significance() > SURELY
}

/// What stands in the other regions by now.
pub(super) fn others(looks: &[Look], region: usize) -> Vec<Body> {
    let others = looks.iter().enumerate().filter(|(k, _)| *k != region);
    others.flat_map(|(_, look)| look.bodies()).collect()
}

/// What a scan does not know of a hypothesis. How far a surface lies off the hull is left to its refinement.
pub(super) fn unknowns(proposal: &Proposal, region: &Region) -> Vec<Unknown> {
    let of_scan =
        |u: Unknown| if u.name == OFFSET { Unknown { first: vec![0.0], fine: Vec::new(), ..u } } else { u };
    (proposal.unknowns)(region).into_iter().map(of_scan).collect()
}

/// Shapes of candidates that differ in the index alone.
#[derive(Default)]
struct Shapes {
    made: HashMap<(Hypothesis, Vec<u32>), Vec<Body>>,
    tried: u64,
}

impl Shapes {
    fn bodies(&mut self, candidate: &Candidate, place: &Region, options: &Options) -> Vec<Body> {
        self.tried += 1;
        if !candidate.proposal.is_sharp || candidate.refined.is_some() {
            return candidate.bodies(place, options);
        }
        let numbers = candidate.values[1..].iter().map(|v| v.to_bits()).collect();
        let key = (candidate.proposal.kind, numbers);
        let shape = self.made.entry(key).or_insert_with(|| candidate.bodies(place, options));
        candidate.bodies_of_shape(shape)
    }
}

/// In which surroundings a region is looked at.
pub(super) struct Standing<'a> {
    pub(super) backend: &'a dyn Backend,
    pub(super) others: &'a [Body],
    pub(super) known: &'a Context<'a>,
    pub(super) marching: Marching,
    pub(super) tangents: &'a [Ray<f32>],
}

impl Standing<'_> {
    /// Bodies among the others.
    pub(super) fn medium(&self, bodies: Vec<Body>) -> Refraction {
        // The last one rules: what is looked at rules over others.
        refraction(self.others.iter().cloned().chain(bodies).collect(), self.known.options)
    }

    pub(super) fn predicted(
        &self,
        photographs: &Photographs,
        detail: Detail,
        bodies: Vec<Body>,
    ) -> Predicted {
        predict(self.backend, &self.marching, photographs, detail, &self.medium(bodies), Way::Bent)
    }
}

/// Photographs of one region.
pub(super) struct Seen {
    /// Views by which first numbers and finer ones are scanned, all that straight rays learn from, and those kept aside.
    few: Photographs,
    pub(super) scanned: Photographs,
    pub(super) learned: Photographs,
    pub(super) aside: Photographs,
}

impl Seen {
    pub(super) fn new(region: &Region, sampler: &RaySampler, is_alone: bool) -> Self {
        let (aside, learned): (Vec<usize>, Vec<usize>) =
            (0..sampler.views()).partition(|v| sampler.is_aside(*v));
        let shows = |ray: &Ray<f32>| is_alone || region.meets(ray);
        let some = |count: usize| -> Vec<usize> {
            learned.iter().copied().step_by(learned.len().div_ceil(count).max(1)).collect()
        };
        let [few, scanned] = [some(FEW_VIEWS), some(SCANNED_VIEWS)];
        let [few, scanned, learned, aside] =
            [few, scanned, learned, aside].map(|views| Photographs::new(sampler, &views, shows));
        let aside = if aside.views() > 1 { aside } else { scanned.clone() };
        Self { few, scanned, learned, aside }
    }

    /// Few views for first numbers of scans that take long, more for all else.
    pub(super) fn at(&self, are_few: bool) -> &Photographs {
        if are_few { &self.few } else { &self.scanned }
    }
}

/// A look at one region.
pub(super) struct Look<'a> {
    pub(super) region: &'a Region,
    pub(super) sketch: Option<Region>,
    pub(super) options: &'a Options,
    pub(super) seen: &'a Seen,
    pub(super) standing: Option<Candidate>,
    /// The same before its surface was refined by what views show that straight rays learned from.
    pub(super) unrefined: Option<Candidate>,
}

impl<'a> Look<'a> {
    pub(super) fn new(region: &'a Region, seen: &'a Seen, options: &'a Options) -> Self {
        Self { region, sketch: region.sketch(), options, seen, standing: None, unrefined: None }
    }

    fn place(&self) -> &Region {
        self.sketch.as_ref().unwrap_or(self.region)
    }

    /// The bodies that stand there by now.
    pub(super) fn bodies(&self) -> Vec<Body> {
        self.standing.as_ref().map_or(Vec::new(), |c| c.bodies(self.place(), self.options))
    }

    fn candidate(proposal: &'static Proposal, values: &[f32]) -> Candidate {
        Candidate { proposal, values: values.to_vec(), searched: true, refined: None }
    }

    /// How alike what some values of a hypothesis show is to photographs.
    fn scores(
        &self,
        at: &Standing,
        shapes: &mut Shapes,
        candidate: &Candidate,
        (detail, views): (Detail, &Photographs),
        observer: &mut Observer,
    ) -> Result<Scores, Cancelled> {
        observer.progress(Task::SearchingIndex, shapes.tried, shapes.tried)?;
        let bodies = shapes.bodies(candidate, self.place(), self.options);
        Ok(at.predicted(views, detail, bodies).scores(views))
    }

    /// What stands, by the views that numbers are scanned with.
    fn now(&self, at: &Standing, observer: &mut Observer) -> Result<Option<Scores>, Cancelled> {
        let scores = |c| self.scores(at, &mut Shapes::default(), c, (JUDGED, &self.seen.scanned), observer);
        self.standing.as_ref().map(scores).transpose()
    }

    /// Lets that hypothesis stand which scores most, the simplest first, and refines its surface. Where no refinement could make the best
    /// usual one [`CONVINCING`], dear ones are looked at before it, and it is left out if one of them is better by more than it would gain.
    pub(super) fn choose(
        &mut self,
        at: &Standing,
        (usual, dear): (&[&'static Proposal], &[&'static Proposal]),
        regions: usize,
        observer: &mut Observer,
    ) -> Result<(), Cancelled> {
        self.stand(at, usual, observer)?;
        let Some(now) = self.now(at, observer)? else { return Ok(()) };
        if mean(&now) >= CONVINCING - NEAR {
            self.refine(at, regions, observer)?;
            return self.stand(at, dear, observer);
        }
        let Some((proposal, found)) = self.best(at, dear, Some(&now), observer)? else {
            return self.refine(at, regions, observer);
        };
        if mean(&found.scores) < mean(&now) + NEAR {
            self.refine(at, regions, observer)?;
            if self.now(at, observer)?.is_some_and(|refined| !is_better(&found.scores, &refined)) {
                return Ok(());
            }
        }
        self.adopt(at, proposal, &found, observer)
    }

    /// Lets that of these hypotheses stand which scores most.
    pub(super) fn stand(
        &mut self,
        at: &Standing,
        kinds: &[&'static Proposal],
        observer: &mut Observer,
    ) -> Result<(), Cancelled> {
        let now = self.now(at, observer)?;
        match self.best(at, kinds, now.as_ref(), observer)? {
            Some((proposal, found)) => self.adopt(at, proposal, &found, observer),
            None => Ok(()),
        }
    }

    /// That of these hypotheses which scores most, the simplest first, if it scores clearly more than what stands by `now`.
    fn best(
        &self,
        at: &Standing,
        kinds: &[&'static Proposal],
        now: Option<&Scores>,
        observer: &mut Observer,
    ) -> Result<Option<(&'static Proposal, Best)>, Cancelled> {
        if now.is_some_and(|scores| mean(scores) > CONVINCING) {
            return Ok(None);
        }
        let unknowns = |p: &Proposal| unknowns(p, self.region);
        let mut shapes = Shapes::default();
        let scanned = &self.seen.scanned;
        let mut least = f64::NEG_INFINITY;
        if let Some(standing) = &self.standing {
            least =
                mean(&self.scores(at, &mut shapes, standing, (Detail::Coarse, scanned), observer)?) - NEAR;
        }
        let mut firsts: Vec<(&'static Proposal, Best)> = Vec::new();
        for p in kinds {
            // Most first numbers score far below what stands, so few views suffice to discard them.
            let from = first(&unknowns(p), now.is_some(), |v: &[f32], d, are_few| {
                self.scores(at, &mut shapes, &Self::candidate(p, v), (d, self.seen.at(are_few)), observer)
            })?;
            firsts.push((p, from));
        }
        let most = firsts.iter().map(|(_, b)| mean(&b.scores)).fold(f64::NEG_INFINITY, f64::max);
        let mut best: Option<(&'static Proposal, Best)> = None;
        for (p, from) in firsts.iter().filter(|(_, b)| mean(&b.scores) >= least.max(most - FAR)) {
            let found = refined(from, &unknowns(p), JUDGED, |v: &[f32], d| {
                self.scores(at, &mut shapes, &Self::candidate(p, v), (d, scanned), observer)
            })?;
            let simpler = best.as_ref().map(|(_, b)| &b.scores).or(now);
            if simpler.is_none_or(|simpler| is_better(&found.scores, simpler)) {
                best = Some((p, found));
            }
        }
        Ok(best)
    }

    /// Lets a hypothesis stand with the numbers found.
    fn adopt(
        &mut self,
        at: &Standing,
        proposal: &'static Proposal,
        found: &Best,
        observer: &mut Observer,
    ) -> Result<(), Cancelled> {
        (self.standing, self.unrefined) = (Some(Self::candidate(proposal, &found.values)), None);
        let last: Vec<Unknown> = unknowns(proposal, self.region).iter().map(Unknown::last).collect();
        self.adjust(at, &last, observer)
    }

    /// The numbers of what stands once more, in the finest pictures.
    pub(super) fn adjust(
        &mut self,
        at: &Standing,
        unknowns: &[Unknown],
        observer: &mut Observer,
    ) -> Result<(), Cancelled> {
        let Some(standing) = self.standing.clone() else { return Ok(()) };
        let mut shapes = Shapes::default();
        let from = Best { values: standing.values.clone(), scores: Scores::default() };
        let found = refined(&from, unknowns, Detail::Fine, |v: &[f32], d| {
            let candidate = Candidate { values: v.to_vec(), ..standing.clone() };
            self.scores(at, &mut shapes, &candidate, (d, &self.seen.scanned), observer)
        })?;
        self.standing = Some(Candidate { values: found.values, ..standing });
        Ok(())
    }

    /// The surface of a solid body by the gradient of the score, if that makes it better.
    fn refine(&mut self, at: &Standing, regions: usize, observer: &mut Observer) -> Result<(), Cancelled> {
        let Some(candidate) = &self.standing else { return Ok(()) };
        let surface = self.region.surface();
        let is_free =
            candidate.proposal.kind == Hypothesis::Solid && surface.is_some_and(|s| s.planes().is_none());
        let axis = surface.and_then(Surface::axis);
        let bodies = candidate.bodies(self.region, self.options);
        let Some(surface) = bodies.first().and_then(|b| b.grid.level_set()).filter(|_| is_free) else {
            return Ok(());
        };
        let others: Vec<IndexGrid<f32>> = at.others.iter().map(|b| b.grid.clone()).collect();
        let (run, share) = (&self.options.run, 1.0 / regions as f64);
        let time = Duration::try_from_secs_f64(share * MOST_REFINING * 60.0 * run.minutes).ok();
        let until = time.filter(|t| !t.is_zero()).and_then(|t| Instant::now().checked_add(t));
        let refiner = Refiner {
            backend: at.backend,
            marching: at.marching,
            photographs: &self.seen.learned,
            outlines: at.tangents,
            axis,
            others: &others,
            optics: self.options.optics(),
            effort: if run.minutes > 0.0 { 1.0 } else { (run.steps as f64 / REFINED_STEPS).min(1.0) },
            until,
        };
        let found = refiner.refine(surface, candidate.values[0], observer)?;
        if let Some((surface, index)) = found {
            let mut better = candidate.clone();
            better.values[0] = index;
            better.refined = Some(Box::new(surface));
            self.unrefined = self.standing.replace(better);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CpuBackend;
    use crate::cancel::Cancel;
    use crate::evidence::tests::{MARCHING, RADIUS, taken};
    use crate::refraction_search::hypotheses::proposals;
    use crate::schedule::Progress;
    use crate::silhouettes::Site;
    use refraxel_core::{Aabb, LevelSet, Vec3, vec3};
    use refraxel_data::LocalOrigin;

    fn ball(middle: Vec3<f32>, radius: f32, index: f32) -> IndexGrid<f32> {
        let surface =
            LevelSet::from_samples(Aabb::cube_at(middle, 0.65), [41; 3], |x| (x - middle).length() - radius);
        IndexGrid::sharp(surface, index)
    }

    /// A lens by its index at a distance from the middle [radius].
    fn lens(index: impl Fn(f32) -> f32) -> IndexGrid<f32> {
        let of = |x: Vec3<f32>| index(x.length() / RADIUS);
        IndexGrid::from_samples(Aabb::cube(0.65), [41; 3], Options::default().index.interpolation.into(), of)
    }

    /// Photographs of a truth in balls of `mask` times their radius, whose silhouettes are what is known of it.
    struct Setting {
        backend: CpuBackend,
        sampler: RaySampler,
        options: Options,
        regions: Vec<Region>,
    }

    impl Setting {
        fn new(truth: Vec<IndexGrid<f32>>, middles: &[Vec3<f32>], mask: f32) -> Self {
            let options = Options::default();
            let truth = Refraction { optics: options.optics(), ..Refraction::of(truth) };
            let radius = mask * RADIUS;
            let (backend, sampler) = taken(truth, |r| {
                middles.iter().any(|m| (r.origin - *m).cross(r.direction).length() < radius)
            });
            let region = |middle: &Vec3<f32>| {
                let interpolation = options.index.interpolation.into();
                let site = Site { bounds: Aabb::cube_at(*middle, 0.65), resolution: [41; 3], interpolation };
                let body = Region::body(site, |x| (x - *middle).length() - radius);
                Region { is_shared: middles.len() > 1, ..body }
            };
            let regions = middles.iter().map(region).collect();
            Self { backend, sampler, options, regions }
        }

        fn alone(truth: Vec<IndexGrid<f32>>) -> Self {
            Self::new(truth, &[Vec3::zero()], 1.0)
        }

        /// What stands in each region after a look at all of them, and how alike its prediction is to the photographs.
        fn seen(&self) -> Vec<(Hypothesis, Vec<f32>, f64)> {
            let Self { backend, sampler, options, regions } = self;
            let (origin, progress) = (LocalOrigin::default(), Progress(0.0));
            let known = Context { sampler, options, near: 0.0, origin, index: None, found: None, progress };
            let (cancel, mut ignore) = (Cancel::new(), |_| {});
            let mut observer = Observer::new(&cancel, &mut ignore);
            let seen: Vec<Seen> = regions.iter().map(|r| Seen::new(r, sampler, regions.len() == 1)).collect();
            let mut looks: Vec<Look> =
                regions.iter().zip(&seen).map(|(r, seen)| Look::new(r, seen, options)).collect();
            for k in 0..looks.len() {
                let others = others(&looks, k);
                let at =
                    Standing { backend, others: &others, known: &known, marching: MARCHING, tangents: &[] };
                let (dear, usual): (Vec<_>, Vec<_>) =
                    proposals(&regions[k], options).into_iter().partition(|p| p.is_dear);
                looks[k].stand(&at, &usual, &mut observer).unwrap();
                looks[k].stand(&at, &dear, &mut observer).unwrap();
            }
            let of = |k: usize| {
                let others = others(&looks, k);
                let at =
                    Standing { backend, others: &others, known: &known, marching: MARCHING, tangents: &[] };
                let found = looks[k].standing.clone().unwrap();
                let scores =
                    at.predicted(&seen[k].learned, JUDGED, looks[k].bodies()).scores(&seen[k].learned);
                (found.proposal.kind, found.values, mean(&scores))
            };
            (0..looks.len()).map(of).collect()
        }

        fn best(&self) -> (Hypothesis, Vec<f32>, f64) {
            self.seen().remove(0)
        }
    }

    #[test]
    fn the_index_of_a_solid_body_is_found() {
        for index in [1.33, 1.5, 1.8] {
            let (kind, values, score) = Setting::alone(vec![ball(Vec3::zero(), RADIUS, index)]).best();
            assert_eq!(kind, Hypothesis::Solid, "{index}: {values:?}");
            assert!((values[0] - index).abs() < 0.011 && score > 0.85, "{index}: {values:?} {score}");
        }
    }

    #[test]
    fn wall_and_index_of_a_shell_are_found() {
        let truth = vec![ball(Vec3::zero(), RADIUS, 1.5), ball(Vec3::zero(), 0.7 * RADIUS, 1.0)];
        let (kind, values, score) = Setting::alone(truth).best();
        assert_eq!(kind, Hypothesis::Shell, "{values:?} {score}");
        assert!((values[0] - 1.5).abs() < 0.03 && (values[1] - 0.3).abs() < 0.03, "{values:?} {score}");
    }

    #[test]
    fn lenses_are_told_from_bodies_of_one_index() {
        let luneburg = |r: f32| (1.0 + 0.96 * (1.0 - r * r).max(0.0)).sqrt();
        let (kind, values, score) = Setting::alone(vec![lens(luneburg)]).best();
        assert_eq!(kind, Hypothesis::Graded, "{values:?} {score}");
        assert!((values[0] - 1.4).abs() < 0.02 && (values[1] - 1.0).abs() < 0.15, "{values:?}");
        // A bell that has faded to 0.02 at the border.
        let bell = |r: f32| 1.0 + 0.5 * (-3.22 * r * r).exp() * f32::from(u8::from(r < 1.2));
        let (kind, values, score) = Setting::alone(vec![lens(bell)]).best();
        assert_eq!(kind, Hypothesis::Graded, "{values:?} {score}");
        assert!((values[0] - 1.5).abs() < 0.06 && values[1] > 1.4, "{values:?} {score}");
    }

    #[test]
    fn what_absorbs_has_its_index_too() {
        let mut tinted = ball(Vec3::zero(), RADIUS, 1.5);
        tinted.set_absorption([0.3, 1.5, 3.0]);
        let (kind, values, score) = Setting::alone(vec![tinted]).best();
        assert!(kind == Hypothesis::Solid && (values[0] - 1.5).abs() < 0.02, "{values:?} {score}");
    }

    #[test]
    fn where_nothing_bends_the_index_is_one() {
        let mut setting = Setting::alone(vec![ball(Vec3::zero(), RADIUS, 1.0)]);
        setting.options.search.profile = crate::options::SurfaceProfile::Sharp;
        let (_, values, _) = setting.best();
        assert!((values[0] - 1.0).abs() < 0.01, "{values:?}");
    }

    #[test]
    fn two_bodies_of_different_index_have_their_own() {
        let middles = [vec3(-0.6, 0.0, 0.0), vec3(0.6, 0.1, 0.0)];
        let truth = vec![ball(middles[0], RADIUS, 1.45), ball(middles[1], RADIUS, 1.65)];
        let found = Setting::new(truth, &middles, 1.0).seen();
        for ((kind, values, score), index) in found.iter().zip([1.45, 1.65]) {
            assert_eq!(*kind, Hypothesis::Solid);
            assert!((values[0] - index).abs() < 0.02, "{index}: {values:?} {score}");
        }
    }
}
