//! What stands in each region, by prediction without training: the numbers of each hypothesis, a first surface, and the verdict.

use super::context::Context;
use super::hypotheses::{Candidate, proposals};
use super::look::{JUDGED, Look, Seen, Standing, others, unknowns};
use super::opinion::{Judged, Opinion};
use super::region::Region;
use super::revolve::revolve;
use super::state::State;
use crate::backend::Backend;
use crate::cancel::Cancelled;
use crate::events::{Observer, Task};
use crate::evidence::{Shown, rendered};
use crate::model::Refraction;
use crate::rays::{Draw, Selection};
use crate::schedule::{Moment, objective, training_marching};
use crate::verdict::{Evidence, Hypothesis, RegionVerdict};
use refraxel_core::Ray;

/// Steps that straight rays learn for this, and the fraction of their rays inside masks.
const STRAIGHT_STEPS: u64 = 100;
const STRAIGHT_INSIDE: f64 = 0.5;

/// Indices of what is usual.
const WATER: f32 = 1.33;
const GLASS: f32 = 1.5;
/// Other indices are so far away from them.
const OTHER: f32 = 0.05;
/// Rivals at most.
const MOST_RIVALS: usize = 3;

/// What may stand in the regions.
pub(super) struct Shortlist {
    /// What is known to stand in each; `None` where rays stay straight, or where rivals race.
    pub sure: Vec<Option<Candidate>>,
    /// Per region: how that is known; `None` where rivals race.
    pub verdicts: Vec<Option<RegionVerdict>>,
    /// Per region: what prediction says, whether or not it decides.
    pub evidence: Vec<Option<Evidence>>,
    /// Per trial one candidate per region; none where all is known.
    pub rivals: Vec<Vec<Option<Candidate>>>,
    /// What the verdicts rest on.
    pub pictures: Vec<Shown>,
}

impl Shortlist {
    /// Without any prediction: what is guessed of each region, or known.
    pub(super) fn guessed(candidates: Vec<Candidate>) -> Self {
        let n = candidates.len();
        let rivals = vec![candidates.into_iter().map(Some).collect()];
        Self {
            sure: vec![None; n],
            verdicts: vec![None; n],
            evidence: vec![None; n],
            rivals,
            pictures: Vec::new(),
        }
    }

    /// Whether it is known that nothing bends.
    pub(super) fn stays_straight(&self) -> bool {
        self.rivals.is_empty() && self.sure.iter().all(Option::is_none)
    }
}

/// The rivals of all regions, side by side.
fn side_by_side(rivals: &[Vec<Candidate>], sure: &[Option<Candidate>]) -> Vec<Vec<Option<Candidate>>> {
    let count = rivals.iter().map(Vec::len).max().unwrap_or(0);
    let of = |h: usize, k: usize| rivals[k].get(h).or(rivals[k].last()).cloned().or_else(|| sure[k].clone());
    (0..count).map(|h| (0..sure.len()).map(|k| of(h, k)).collect()).collect()
}

/// What races where a prediction does not know, because what is seen through a body is seen nowhere else: water seen from above, what the
/// prediction sees best, and a body of water, which has flat faces in a tank, or of glass.
fn rivals(look: &Look, opinion: &Opinion) -> Vec<Candidate> {
    let (region, all) = (look.region, proposals(look.region, look.options));
    let of = |kind: Hypothesis| all.iter().find(|p| p.kind == kind).copied();
    let open = of(Hypothesis::WaterSurface).map(|p| Candidate::guess(p, region, WATER));
    let seen = look.standing.clone().filter(|_| opinion.is_glimpsed);
    let water = Candidate::guess(of(Hypothesis::Polyhedron).unwrap_or(all[0]), region, WATER);
    let glass = Candidate::guess(all[0], region, GLASS);
    let mut rivals: Vec<Candidate> = open.into_iter().chain(seen).collect();
    for usual in [water, glass] {
        let is_like =
            |c: &Candidate| c.proposal == usual.proposal && (c.values[0] - usual.values[0]).abs() < OTHER;
        if !rivals.iter().any(is_like) {
            rivals.push(usual);
        }
    }
    rivals.truncate(MOST_RIVALS);
    rivals
}

/// Says of each region what stands there, or what is to race. The backend holds the field of straight rays, `start`, with the inside
/// of the regions cleared; afterwards it holds any.
pub(super) fn decide(
    backend: &mut dyn Backend,
    regions: &mut [Region],
    tangents: &[Ray<f32>],
    start: &State,
    known: &Context,
    observer: &mut Observer,
) -> Result<Shortlist, Cancelled> {
    backend.set_medium(Refraction::none());
    let (is_alone, marching) = (regions.len() == 1, training_marching(known.options, known.near));
    let seen: Vec<Seen> = regions.iter().map(|r| Seen::new(r, known.sampler, is_alone)).collect();
    for (region, seen) in regions.iter_mut().zip(&seen) {
        let at = Standing { backend, others: &[], known, marching, tangents };
        revolve(&at, region, seen, observer)?;
    }
    let regions = &*regions;
    let look = |(r, seen)| Look::new(r, seen, known.options);
    let mut looks: Vec<Look> = regions.iter().zip(&seen).map(look).collect();
    for k in 0..looks.len() {
        let others = others(&looks, k);
        let at = Standing { backend, others: &others, known, marching, tangents };
        let (dear, usual): (Vec<_>, Vec<_>) =
            proposals(&regions[k], known.options).into_iter().partition(|p| p.is_dear);
        looks[k].choose(&at, (&usual, &dear), regions.len(), observer)?;
    }
    let mut judged = Vec::new();
    for k in 0..looks.len() {
        let others = others(&looks, k);
        let at = Standing { backend, others: &others, known, marching, tangents };
        if let Some(standing) = looks[k].standing.as_ref().filter(|_| regions.len() > 1) {
            let unknowns = unknowns(standing.proposal, &regions[k]);
            looks[k].adjust(&at, &unknowns, observer)?;
        }
        judged.push(looks[k].judged(&at, k, observer));
    }
    learn_straight(backend, start, known, observer)?;
    let opinion = |(look, judged): (&Look, &Option<Judged>)| {
        let trained = rendered(backend, &marching, &look.seen.aside, JUDGED);
        judged.as_ref().map_or_else(Opinion::default, |judged| look.opinion(judged, &trained))
    };
    let opinions: Vec<Opinion> = looks.iter().zip(&judged).map(opinion).collect();
    // Where nobody said that something is there, what prediction does not see beside something that it sees is nothing.
    let is_found = known.sampler.traces_found();
    let is_enough = is_found && opinions.iter().any(|o| o.bends == Some(true));
    let is_judged = known.options.judge.enabled.is_on();
    let (mut sure, mut verdicts, mut open) = (Vec::new(), Vec::new(), Vec::new());
    for (k, (look, opinion)) in looks.iter().zip(&opinions).enumerate() {
        let races = is_judged && opinion.bends.is_none() && (opinion.is_seen || !is_enough);
        let bends = opinion.bends == Some(true) || !is_judged;
        let candidate = look.standing.clone().filter(|_| bends && !races);
        let hypothesis = candidate.as_ref().map_or(Hypothesis::Straight, |c| c.proposal.kind);
        let found = candidate.as_ref().map_or(Vec::new(), |c| c.found(look.region));
        let verdict = RegionVerdict::predicted(k, hypothesis, found, opinion.evidence);
        sure.push(candidate);
        verdicts.push(Some(verdict).filter(|_| !races));
        open.push(if races { rivals(look, opinion) } else { Vec::new() });
    }
    let pictures = judged.into_iter().flatten().filter_map(|j| j.shown).collect();
    let (rivals, evidence) = (side_by_side(&open, &sure), opinions.iter().map(|o| o.evidence).collect());
    Ok(Shortlist { sure, verdicts, evidence, rivals, pictures })
}

/// Straight rays learn what is inside the masks, too.
fn learn_straight(
    backend: &mut dyn Backend,
    start: &State,
    known: &Context,
    observer: &mut Observer,
) -> Result<(), Cancelled> {
    start.clone().load(backend);
    let extent = backend.domain().extent;
    let moment =
        Moment { progress: known.progress, bends_since: None, bends: false, is_detected: false, extent };
    let objective = objective(known.options, known.near, moment);
    for step in 0..STRAIGHT_STEPS {
        observer.progress(Task::Judging, step, STRAIGHT_STEPS)?;
        // No step of the run has these numbers.
        let (sampler, number) = (known.sampler, u64::MAX / 4 + step);
        let size = known.options.run.batch as usize;
        let draw = Draw { sampler, number, size, selection: Selection::Inside(STRAIGHT_INSIDE), reach: 0 };
        backend.submit_drawn(&draw, &objective, step);
        backend.outcomes(true);
    }
    backend.refresh_occupancy(&training_marching(known.options, known.near));
    Ok(())
}
