//! What stands in each region: what is known or predicted, and a race where that stays open.

use super::context::Context;
use super::hypotheses::Candidate;
use super::predicted::Shortlist;
use super::race::{self, Outcome, TrialLength, race};
use super::region::Region;
use super::trials::{RaceInput, TrainedTrials};
use crate::backend::Backend;
use crate::cancel::Cancelled;
use crate::events::{Event, Observer};
use crate::verdict::{Hypothesis, RegionVerdict, Verdict};
use std::time::Instant;

/// Somebody knows what stands in all regions.
fn is_known(known: &Context, regions: &[Region]) -> bool {
    regions.iter().all(Region::is_known) || known.index.is_some()
}

/// The index is searched.
pub(super) fn is_searched(known: &Context, regions: &[Region]) -> bool {
    known.options.search.enabled.is_on() && !is_known(known, regions)
}

/// What stands in each region, `None` for nothing.
pub(super) struct Decided {
    pub candidates: Vec<Option<Candidate>>,
    pub verdict: Option<Verdict>,
    /// The backend holds what has learned this in the race. Otherwise it holds the start.
    pub goes_on: bool,
}

/// Takes what is known, and lets what is shortlisted race where there is a judge and enough time.
pub(super) fn decide(
    backend: &mut dyn Backend,
    field: &RaceInput,
    shortlist: &Shortlist,
    observer: &mut Observer,
    clock: Instant,
) -> Result<Decided, Cancelled> {
    let RaceInput { known, regions, .. } = *field;
    let judge = &known.options.judge;
    let views = known.sampler.aside();
    let verdict = |regions: Vec<RegionVerdict>| {
        let (seconds, progress) = (clock.elapsed().as_secs_f64(), known.progress.0);
        Some(Verdict { views, seconds, progress, regions, proof: None }).filter(|v| !v.regions.is_empty())
    };
    let sure: Vec<RegionVerdict> = shortlist.verdicts.iter().flatten().cloned().collect();
    let Some(first) = shortlist.rivals.first() else {
        return Ok(Decided { candidates: shortlist.sure.clone(), verdict: verdict(sure), goes_on: false });
    };
    let alone = !judge.straight.is_on() && shortlist.rivals.len() == 1;
    let races = judge.enabled.is_on() && !is_known(known, regions) && !alone && views > 0;
    let entries = shortlist.rivals.len() + 1;
    let mut trials = TrainedTrials::new(backend, field, observer, shortlist);
    let length = if races { length(&mut trials, field, entries, clock)? } else { TrialLength::default() };
    if length.first == 0 {
        field.start.clone().load(backend);
        let searched = is_searched(known, regions);
        // Nobody bends from a mere guess where straight rays may win.
        let must_be_found = searched && judge.enabled.is_on() && judge.straight.is_on();
        let candidates = if must_be_found { &shortlist.sure } else { first };
        let guessed = |(k, c): (usize, &Option<Candidate>)| {
            Some((k, *c.as_ref().filter(|c| !c.searched)?.values.first()?))
        };
        for (region, index) in candidates.iter().enumerate().filter_map(guessed).filter(|_| searched) {
            observer.tell(Event::IndexGuessed { region, index });
        }
        return Ok(Decided { candidates: candidates.clone(), verdict: verdict(sure), goes_on: false });
    }
    trials.set_course(length);
    let Outcome { finalist, mut verdicts } = race(&mut trials, length)?;
    let mut candidates = trials.candidates(finalist).to_vec();
    for (k, (verdict, candidate)) in verdicts.iter_mut().zip(&mut candidates).enumerate() {
        if let Some(known) = &shortlist.verdicts[k] {
            (*verdict, *candidate) = (known.clone(), shortlist.sure[k].clone());
            continue;
        }
        if judge.straight.is_on() && verdict.hypothesis == Hypothesis::Straight {
            *candidate = None;
        }
        verdict.hypothesis = candidate.as_ref().map_or(Hypothesis::Straight, |c| c.proposal.kind);
        verdict.found = candidate.as_ref().map_or(Vec::new(), |c| c.found(&regions[k]));
        verdict.evidence = shortlist.evidence[k];
    }
    // What has learned exactly this goes on; a mixture begins again.
    let winner = [race::STRAIGHT, finalist].into_iter().find(|e| {
        let assumed = trials.candidates(*e);
        assumed.iter().zip(&candidates).all(|(a, b)| a.is_some() == b.is_some())
    });
    let state = winner.and_then(|entry| trials.into_state(entry));
    let goes_on = state.is_some();
    state.unwrap_or_else(|| field.start.clone()).load(backend);
    Ok(Decided { candidates, verdict: verdict(verdicts), goes_on })
}

/// Most of a run that prediction and race may take.
const COST: f64 = 0.15;
/// Most steps that a hypothesis learns in its race.
const RACE_STEPS: u64 = 300;
/// Fewer steps say nothing: a short run races for so many, whatever they cost.
const LEAST_STEPS: u64 = 60;
/// A run whose shortest race would take more than this part of it has none.
const MOST_RACING: f64 = 0.3;
/// Where all that lies within is learned anew, the least race is longer by this factor, if the run has that much time.
const RELEARNING: u64 = 3;

/// A race whose end is open takes at most so many times its length.
const LONGER: u64 = 3;

/// How long a race of so many entries may be: what prediction leaves of the share of the run. Where the run has a clock, a
/// few steps of the best candidates are timed; else steps count alike.
fn length(
    trials: &mut TrainedTrials,
    field: &RaceInput,
    entries: usize,
    clock: Instant,
) -> Result<TrialLength, Cancelled> {
    let run = &field.known.options.run;
    // All learn one third, straight rays and the best other go on: entries/3 + 2 · 2/3 of the whole length.
    let shares = (entries as f64 + 4.0) / 3.0;
    let (budget, most) = if run.minutes > 0.0 {
        let per_step = trials.seconds_per_step()?;
        let steps = |seconds: f64| (seconds.max(0.0) / (per_step * shares)) as u64;
        let left = COST * 60.0 * run.minutes - clock.elapsed().as_secs_f64();
        (steps(left), steps(MOST_RACING * 60.0 * run.minutes))
    } else {
        ((COST * run.steps as f64 / shares) as u64, run.steps / 3)
    };
    let relearns = (0..entries).flat_map(|e| trials.candidates(e)).flatten().any(Candidate::relearns);
    let wanted = LEAST_STEPS * if relearns { RELEARNING } else { 1 };
    let all = if most < LEAST_STEPS { 0 } else { budget.max(wanted.min(most)).min(RACE_STEPS) };
    let most = (LONGER * all).min(most).max(all);
    Ok(TrialLength { regions: field.regions.len(), entries, first: all / 3, all, most })
}
