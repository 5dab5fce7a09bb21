//! What stands in each region, by prediction without training: the numbers of each hypothesis, a first surface, and the verdict.

use super::Known;
use super::contest::State;
use super::heats::Heats;
use super::hypotheses::{Candidate, proposals};
use super::look::{JUDGED, Look, Seen, Standing, is_dear, others, unknowns};
use super::opinion::{Judged, Opinion};
use super::region::Region;
use super::revolve::revolve;
use crate::backend::Backend;
use crate::cancel::Cancelled;
use crate::events::{Task, Watch};
use crate::evidence::{Shown, rendered};
use crate::model::Refraction;
use crate::rays::{Draw, Selection};
use crate::schedule::{Moment, objective, training_marching};
use crate::verdict::{Hypothesis, RegionVerdict};
use refraxel_core::Ray;

/// Steps that straight rays learn for this, and the fraction of their rays inside masks.
const STRAIGHT_STEPS: u64 = 100;
const STRAIGHT_INSIDE: f64 = 0.5;

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
    let (is_alone, marching) = (regions.len() == 1, training_marching(known.options, known.near));
    let seen: Vec<Seen> = regions.iter().map(|r| Seen::new(r, known.sampler, is_alone)).collect();
    for (region, seen) in regions.iter_mut().zip(&seen) {
        let at = Standing { backend, others: &[], known, marching, tangents };
        revolve(&at, region, seen, watch)?;
    }
    let regions = &*regions;
    let look = |(r, seen)| Look::new(r, seen, known.options);
    let mut looks: Vec<Look> = regions.iter().zip(&seen).map(look).collect();
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
        let trained = rendered(backend, &marching, &look.seen.aside, JUDGED);
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
