//! What stands in each region, by prediction without training: the numbers of each hypothesis, a first surface, and the verdict.

use super::contest::State;
use super::heats::Heats;
use super::hypotheses::{Body, Candidate, OFFSET, Proposal, SOLID, proposals};
use super::region::Region;
use super::{Known, refraction};
use crate::backend::{Backend, Marching};
use crate::cancel::Cancelled;
use crate::events::{Event, Task, Watch};
use crate::evidence::{
    Best, Detail, Difference, Photographs, Predicted, Refiner, Scores, Shown, Unknown, first, interval, mean,
    predict, refined, rendered, without_bending,
};
use crate::model::Refraction;
use crate::options::Options;
use crate::rays::{Draw, Selection};
use crate::schedule::{Moment, objective, training_marching};
use crate::verdict::{Evidence, Hypothesis, RegionVerdict};
use refraxel_core::{IndexGrid, Ray};
use std::collections::HashMap;
use std::time::{Duration, Instant};

/// Views that are looked at while numbers are scanned, at most: few of them for first numbers of hypotheses whose scan takes long.
const FEW_VIEWS: usize = 6;
const SCANNED_VIEWS: usize = 12;
/// The detail of pictures by which hypotheses compare and verdicts are taken. A hull from rough masks shows little in finer ones.
const JUDGED: Detail = Detail::Middle;
/// A hypothesis whose best first numbers score less than the best of those beside it by `FAR`, or less than what stands, whose surface
/// may be refined, by `NEAR`, is not followed.
const FAR: f64 = 0.15;
const NEAR: f64 = 0.2;
/// What stands and scores this much is not weighed against hypotheses whose scan takes long.
const CONVINCING: f64 = 0.8;
/// A hypothesis must score more than a simpler one by this much, and by so many standard errors.
const BETTER: f64 = 0.01;
const SURELY: f64 = 2.0;
/// A verdict needs a prediction that scores more than looking straight through by this much, and by so many standard errors.
const LEAST_SCORE: f64 = 0.05;
const SIGNIFICANT: f64 = 3.0;
/// From so many standard errors on it may be right: further views decide, or a race.
const GLIMPSED: f64 = 1.0;
/// Straight rays that have learned what is inside the masks explain it if they make up for this part of what the prediction lacks.
const EXPLAINED: f64 = 0.5;
/// Straight rays that score this much see what is there.
const OPAQUE: f64 = 0.9;
/// Steps that straight rays learn for this, and the fraction of their rays inside masks.
const STRAIGHT_STEPS: u64 = 100;
const STRAIGHT_INSIDE: f64 = 0.5;
/// Largest share of a run with a clock in which a surface may be refined.
const MOST_REFINING: f64 = 0.08;
/// A run of fewer steps refines it by a part of the usual steps.
const REFINED_STEPS: f64 = 2000.0;

/// What stands in the regions.
pub(super) struct Decided {
    /// `None` where rays stay straight.
    pub candidates: Vec<Option<Candidate>>,
    pub verdicts: Vec<RegionVerdict>,
    /// What they rest on.
    pub pictures: Vec<Shown>,
}

/// What prediction leads to.
pub(super) enum Prediction {
    /// It knows.
    Decided(Decided),
    /// It does not, but sees something of what is to race against straight rays.
    Races(Heats),
    /// It sees nothing.
    Open,
}

/// Decides about all regions, or about none where one stays open. The backend holds the field of straight rays, `start`, with the inside
/// of the regions cleared; afterwards it holds any.
pub(super) fn decide<B: Backend>(
    backend: &mut B,
    regions: &mut [Region],
    tangents: &[Ray<f32>],
    start: &State,
    known: &Known,
    watch: &mut Watch,
) -> Result<Prediction, Cancelled> {
    backend.set_medium(Refraction::none());
    let is_alone = regions.len() == 1;
    for k in 0..regions.len() {
        revolve(backend, &mut regions[k], is_alone, known, tangents, watch)?;
    }
    let regions = &*regions;
    let mut looks: Vec<Look> = regions.iter().map(|r| Look::new(r, known, is_alone)).collect();
    let marching = training_marching(known.options, known.near);
    for k in 0..looks.len() {
        let others = others(&looks, k);
        let at = Standing { backend, others: &others, known, marching, tangents };
        let (dear, usual): (Vec<_>, Vec<_>) =
            proposals(&regions[k], known.options).into_iter().partition(|p| is_dear(p));
        looks[k].choose(&at, &usual, watch)?;
        looks[k].refine(&at, regions.len(), watch)?;
        looks[k].choose(&at, &dear, watch)?;
    }
    let mut judged = Vec::new();
    for k in 0..looks.len() {
        let others = others(&looks, k);
        let at = Standing { backend, others: &others, known, marching, tangents };
        if let Some(standing) = looks[k].standing.as_ref().filter(|_| regions.len() > 1) {
            let unknowns = unknowns(standing.proposal, &regions[k]);
            looks[k].adjust(&at, &unknowns, watch)?;
        }
        judged.push(looks[k].judged(&at, k, watch));
    }
    learn_straight(backend, start, known, watch)?;
    let opinion = |(look, judged): (&Look, &Option<Judged>)| {
        let trained = rendered(backend, &marching, &look.aside, JUDGED);
        judged.as_ref().map_or_else(Opinion::default, |judged| look.opinion(judged, &trained))
    };
    let opinions: Vec<Opinion> = looks.iter().zip(&judged).map(opinion).collect();
    // Where nobody said that something is there, what prediction does not see beside something that it sees is nothing.
    let is_found = known.sampler.traces_found();
    let is_enough = is_found && opinions.iter().any(|o| o.bends == Some(true));
    if !is_enough && opinions.iter().any(|o| o.bends.is_none()) {
        let glimpsed = opinions.iter().filter(|o| o.is_glimpsed).count();
        if glimpsed == 0 || (glimpsed < regions.len() && !is_found) {
            return Ok(Prediction::Open);
        }
        let guess = |r: &Region| Candidate::guess(proposals(r, known.options)[0], r, known.options);
        let rival = |(look, opinion): (&Look, &Opinion)| {
            let standing = look.standing.clone().filter(|_| opinion.is_glimpsed);
            standing.unwrap_or_else(|| guess(look.region))
        };
        let rivals = vec![looks.iter().zip(&opinions).map(rival).collect()];
        let straight = opinions.iter().map(|o| 1.0 - o.evidence.map_or(0.0, |e| e.straight_through.mean));
        let (assumed, straight) = (regions.iter().map(guess).collect(), straight.collect());
        return Ok(Prediction::Races(Heats { rivals, assumed, straight }));
    }
    let pictures = judged.into_iter().flatten().filter_map(|j| j.shown).collect();
    let mut out = Decided { candidates: Vec::new(), verdicts: Vec::new(), pictures };
    for (k, (look, opinion)) in looks.iter().zip(opinions).enumerate() {
        let candidate = look.standing.clone().filter(|_| opinion.bends == Some(true));
        let hypothesis = candidate.as_ref().map_or(Hypothesis::Straight, |c| c.proposal.kind);
        let found = candidate.as_ref().map_or(Vec::new(), |c| c.found(look.region));
        out.candidates.push(candidate);
        out.verdicts.push(RegionVerdict::predicted(k, hypothesis, found, opinion.evidence));
    }
    Ok(Prediction::Decided(out))
}

/// A body that may be one of revolution is one if more is seen through that, whatever it is made of.
fn revolve<B: Backend>(
    backend: &B,
    region: &mut Region,
    is_alone: bool,
    known: &Known,
    tangents: &[Ray<f32>],
    watch: &mut Watch,
) -> Result<(), Cancelled> {
    let Some(revolved) = region.revolved.take() else { return Ok(()) };
    let marching = training_marching(known.options, known.near);
    let at = Standing { backend, others: &[], known, marching, tangents };
    let mut scores = [Scores::default(), Scores::default()];
    for (scores, region) in scores.iter_mut().zip([&*region, &revolved]) {
        let mut look = Look::new(region, known, is_alone);
        look.choose(&at, &[&SOLID], watch)?;
        *scores = at.predicted(&look.scanned, JUDGED, look.bodies()).scores(&look.scanned);
    }
    let [hull, turned] = scores;
    if is_better(&turned, &hull) {
        *region = *revolved;
    }
    Ok(())
}

/// Scores that are larger by more than they vary.
fn is_better(scores: &Scores, than: &Scores) -> bool {
    let above = scores.above(than);
    above.mean > BETTER && above.significance() > SURELY
}

/// What stands in the other regions by now.
fn others(looks: &[Look], region: usize) -> Vec<Body> {
    let others = looks.iter().enumerate().filter(|(k, _)| *k != region);
    others.flat_map(|(_, look)| look.bodies()).collect()
}

/// Straight rays learn what is inside the masks, too.
fn learn_straight<B: Backend>(
    backend: &mut B,
    start: &State,
    known: &Known,
    watch: &mut Watch,
) -> Result<(), Cancelled> {
    start.clone().load(backend);
    let extent = backend.domain().extent;
    let moment = Moment { progress: known.progress, bends_since: None, bends: false, extent };
    let objective = objective(known.options, known.near, moment);
    for step in 0..STRAIGHT_STEPS {
        watch.progress(Task::Judging, step, STRAIGHT_STEPS)?;
        // No step of the run has these numbers.
        let (sampler, number) = (known.sampler, u64::MAX / 4 + step);
        let size = known.options.run.batch as usize;
        let draw = Draw { sampler, number, size, selection: Selection::Inside(STRAIGHT_INSIDE) };
        backend.submit_drawn(&draw, &objective, step);
        backend.outcomes(true);
    }
    backend.refresh_occupancy(&training_marching(known.options, known.near));
    Ok(())
}

/// What a scan does not know of a hypothesis. How far a surface lies off the hull is left to its refinement.
fn unknowns(proposal: &Proposal, region: &Region) -> Vec<Unknown> {
    let of_scan =
        |u: Unknown| if u.name == OFFSET { Unknown { first: vec![0.0], fine: Vec::new(), ..u } } else { u };
    (proposal.unknowns)(region).into_iter().map(of_scan).collect()
}

/// Hypotheses of many unknowns, or whose rays are slow, are looked at last, and go on only where their first numbers come near to what stands.
fn is_dear(proposal: &Proposal) -> bool {
    proposal.is_dear || proposal.kind == Hypothesis::Graded
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
struct Standing<'a, B> {
    backend: &'a B,
    others: &'a [Body],
    known: &'a Known<'a>,
    marching: Marching,
    tangents: &'a [Ray<f32>],
}

impl<B: Backend> Standing<'_, B> {
    /// Bodies among the others.
    fn medium(&self, bodies: Vec<Body>) -> Refraction {
        // The last one rules: what is looked at rules over others.
        refraction(self.others.iter().cloned().chain(bodies).collect(), self.known.options)
    }

    fn predicted(&self, photographs: &Photographs, detail: Detail, bodies: Vec<Body>) -> Predicted {
        predict(self.backend, &self.marching, photographs, detail, &self.medium(bodies))
    }
}

/// A look at one region.
struct Look<'a> {
    region: &'a Region,
    sketch: Option<Region>,
    options: &'a Options,
    /// Views by which first numbers and finer ones are scanned, all that straight rays learn from, and those kept aside.
    few: Photographs,
    scanned: Photographs,
    learned: Photographs,
    aside: Photographs,
    standing: Option<Candidate>,
    /// The same before its surface was refined by what views show that straight rays learned from.
    unrefined: Option<Candidate>,
}

/// What prediction says of a region.
#[derive(Default)]
struct Opinion {
    /// Whether rays bend there, if it knows.
    bends: Option<bool>,
    /// It shows more than looking straight through, but not surely.
    is_glimpsed: bool,
    evidence: Option<Evidence>,
}

/// What is known of a region but for straight rays that have learned its inside.
struct Judged {
    predicted: Predicted,
    scores: Scores,
    through: Scores,
    others: Difference,
    /// By how much its numbers alone score more than looking straight through, in all views that straight rays learned from.
    in_learned: Difference,
    index: Option<[f32; 2]>,
    shown: Option<Shown>,
}

impl<'a> Look<'a> {
    fn new(region: &'a Region, known: &Known<'a>, is_alone: bool) -> Self {
        let sampler = known.sampler;
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
        let options = known.options;
        Self {
            region,
            sketch: region.sketch(options),
            options,
            few,
            scanned,
            learned,
            aside,
            standing: None,
            unrefined: None,
        }
    }

    fn place(&self) -> &Region {
        self.sketch.as_ref().unwrap_or(self.region)
    }

    /// The bodies that stand there by now.
    fn bodies(&self) -> Vec<Body> {
        self.standing.as_ref().map_or(Vec::new(), |c| c.bodies(self.place(), self.options))
    }

    fn candidate(proposal: &'static Proposal, values: &[f32]) -> Candidate {
        Candidate { proposal, values: values.to_vec(), searched: true, tint: [0.0; 3], refined: None }
    }

    /// How alike what some values of a hypothesis show is to photographs.
    fn scores<B: Backend>(
        &self,
        at: &Standing<B>,
        shapes: &mut Shapes,
        candidate: &Candidate,
        (detail, views): (Detail, &Photographs),
        watch: &mut Watch,
    ) -> Result<Scores, Cancelled> {
        watch.progress(Task::SearchingIndex, shapes.tried, shapes.tried)?;
        let bodies = shapes.bodies(candidate, self.place(), self.options);
        Ok(at.predicted(views, detail, bodies).scores(views))
    }

    /// Lets that of these hypotheses stand which scores most, the simplest first, if it scores clearly more than what stands by now.
    fn choose<B: Backend>(
        &mut self,
        at: &Standing<B>,
        kinds: &[&'static Proposal],
        watch: &mut Watch,
    ) -> Result<(), Cancelled> {
        let unknowns = |p: &Proposal| unknowns(p, self.region);
        // First numbers that must come near to what stands, and often do not, are looked at in few views.
        let views = if self.standing.is_some() { &self.few } else { &self.scanned };
        let mut shapes = Shapes::default();
        let mut least = f64::NEG_INFINITY;
        let mut best: Option<Best> = None;
        if let Some(standing) = &self.standing {
            let mut now = |at_detail| self.scores(at, &mut shapes, standing, at_detail, watch);
            least = mean(&now((Detail::Coarse, views))?) - NEAR;
            let scores = now((JUDGED, &self.scanned))?;
            if mean(&scores) > CONVINCING {
                return Ok(());
            }
            best = Some(Best { values: Vec::new(), scores });
        }
        let mut firsts: Vec<(&'static Proposal, Best)> = Vec::new();
        for p in kinds {
            let from = first(&unknowns(p), |v: &[f32], d| {
                self.scores(at, &mut shapes, &Self::candidate(p, v), (d, views), watch)
            })?;
            firsts.push((p, from));
        }
        let most = firsts.iter().map(|(_, b)| mean(&b.scores)).fold(f64::NEG_INFINITY, f64::max);
        let mut chosen = None;
        for (p, from) in firsts.iter().filter(|(_, b)| mean(&b.scores) >= least.max(most - FAR)) {
            let found = refined(from, &unknowns(p), JUDGED, |v: &[f32], d| {
                self.scores(at, &mut shapes, &Self::candidate(p, v), (d, &self.scanned), watch)
            })?;
            if best.as_ref().is_none_or(|simpler| is_better(&found.scores, &simpler.scores)) {
                (chosen, best) = (Some(*p), Some(found));
            }
        }
        if let (Some(p), Some(best)) = (chosen, best) {
            self.standing = Some(Self::candidate(p, &best.values));
            let last: Vec<Unknown> = unknowns(p).iter().map(Unknown::last).collect();
            self.adjust(at, &last, watch)?;
        }
        Ok(())
    }

    /// The numbers of what stands once more, in the finest pictures.
    fn adjust<B: Backend>(
        &mut self,
        at: &Standing<B>,
        unknowns: &[Unknown],
        watch: &mut Watch,
    ) -> Result<(), Cancelled> {
        let Some(standing) = self.standing.clone() else { return Ok(()) };
        let mut shapes = Shapes::default();
        let from = Best { values: standing.values.clone(), scores: Scores::default() };
        let found = refined(&from, unknowns, Detail::Fine, |v: &[f32], d| {
            let candidate = Candidate { values: v.to_vec(), ..standing.clone() };
            self.scores(at, &mut shapes, &candidate, (d, &self.scanned), watch)
        })?;
        self.standing = Some(Candidate { values: found.values, ..standing });
        Ok(())
    }

    /// The surface of a solid body by the gradient of the score, if that makes it better.
    fn refine<B: Backend>(
        &mut self,
        at: &Standing<B>,
        regions: usize,
        watch: &mut Watch,
    ) -> Result<(), Cancelled> {
        let Some(candidate) = &self.standing else { return Ok(()) };
        let is_free = candidate.proposal.kind == Hypothesis::Solid && self.region.solid.is_none();
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
            photographs: &self.learned,
            outlines: at.tangents,
            axis: self.region.axis,
            others: &others,
            optics: self.options.optics(),
            effort: if run.minutes > 0.0 { 1.0 } else { (run.steps as f64 / REFINED_STEPS).min(1.0) },
            until,
        };
        let found = refiner.refine(surface, candidate.values[0], watch)?;
        if let Some((surface, index)) = found {
            let mut better = candidate.clone();
            better.values[0] = index;
            better.refined = Some(Box::new(surface));
            self.unrefined = self.standing.replace(better);
        }
        Ok(())
    }

    /// The evidence on views kept aside.
    fn judged<B: Backend>(&mut self, at: &Standing<B>, region: usize, watch: &mut Watch) -> Option<Judged> {
        let candidate = self.standing.as_mut()?;
        let place = self.sketch.as_ref().unwrap_or(self.region);
        let unknowns = (candidate.proposal.unknowns)(self.region);
        let telling = candidate.telling(self.region);
        let found = interval(candidate.values[telling], unknowns[telling].range, |n| {
            let mut other = candidate.clone();
            other.values[telling] = n;
            let bodies = other.bodies(place, self.options);
            at.predicted(&self.scanned, Detail::Fine, bodies).scores(&self.scanned)
        });
        let index = found.map(|f| f.range);
        if let Some(found) = found {
            candidate.values[telling] = found.best;
        }
        let unbent = |bodies: &[Body]| -> Vec<Body> {
            bodies.iter().map(|b| Body { grid: without_bending(&b.grid), ..b.clone() }).collect()
        };
        let plain = self.unrefined.as_ref().unwrap_or(candidate).bodies(place, self.options);
        let in_learned = [unbent(&plain), plain].map(|bodies| {
            let medium = at.medium(bodies);
            predict(at.backend, &at.marching, &self.learned, JUDGED, &medium).scores(&self.learned)
        });
        let in_learned = in_learned[1].above(&in_learned[0]);
        let bodies = candidate.bodies(place, self.options);
        let straight = unbent(&bodies);
        let [bent, straight] = [bodies, straight].map(|bodies| at.medium(bodies));
        let of = |medium: &Refraction| predict(at.backend, &at.marching, &self.aside, JUDGED, medium);
        let predicted = of(&bent);
        let (scores, through) = (predicted.scores(&self.aside), of(&straight).scores(&self.aside));
        let shown = scores.middle().and_then(|(view, score)| {
            let media = [(&straight, through.of_view(view)), (&bent, score)];
            Shown::new(at.backend, &at.marching, (&self.aside, view), media, region)
        });
        let others = predicted.scores_of_others(&self.aside).mean();
        watch.tell(Event::IndexSearched {
            region,
            hypothesis: candidate.proposal.kind,
            found: candidate.found(self.region),
            misfit: 1.0 - scores.mean().mean,
        });
        Some(Judged { predicted, scores, through, others, in_learned, index, shown })
    }

    /// Whether rays bend here.
    fn opinion(&self, judged: &Judged, trained: &Predicted) -> Opinion {
        let Judged { predicted, scores, through, others, in_learned, index, .. } = judged;
        let straight = predicted.scores_of(trained, &self.aside);
        let (above, lacks) = (scores.above(through), straight.above(scores));
        let evidence = Evidence {
            predicted: scores.mean(),
            straight_through: through.mean(),
            other_photographs: *others,
            trained_straight: straight.mean(),
            above,
            index: *index,
        };
        // Straight rays that show nearly everything leave nothing to explain. Otherwise what stands in a body, which is seen through it
        // alone, may be what they have learned, and what prediction lacks.
        let is_more = |d: Difference, errors: f64| d.mean > LEAST_SCORE && d.significance() > errors;
        // Few views kept aside leave faint evidence open. All others decide then, by numbers alone: a surface that was refined fits them
        // by chance, and looking straight through gains by what straight rays fitted to them.
        let is_seen = (is_more(above, SIGNIFICANT)
            || is_more(above, GLIMPSED) && is_more(*in_learned, SIGNIFICANT))
            && evidence.predicted.mean > others.mean + SURELY * others.error;
        let is_explained = lacks.mean > EXPLAINED * (1.0 - evidence.predicted.mean)
            && (is_seen || evidence.trained_straight.mean > OPAQUE);
        // What is seen in a cavity, which nobody knows before it is learned, straight rays may explain, and a prediction cannot.
        let is_unknown = is_seen == is_explained || (is_explained && !self.options.judge.straight.is_on());
        let is_glimpsed = is_more(above, GLIMPSED) && !is_seen && !is_explained;
        Opinion { bends: (!is_unknown).then_some(is_seen), is_glimpsed, evidence: Some(evidence) }
    }
}
