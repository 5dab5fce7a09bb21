//! How a model comes to bend its rays: find what is refractive, say what stands there, and clear what straight rays left inside.

use super::baseline::baseline;
use super::context::{Context, Decision, SearchError};
use super::decide::{Decided, decide, is_searched};
use super::find::{Found, find};
use super::hypotheses::simplest;
use super::predicted::{self, Shortlist};
use super::state::State;
use super::trials::{RaceInput, bend, clear};
use crate::backend::Backend;
use crate::events::{Event, Observer};
use crate::schedule::training_marching;
use crate::verdict::StayReason;
use std::time::Instant;

/// Let rays bend from now on, or find out that they had better stay straight: the backend then holds the model to go on
/// with. After an error its model is half changed: load it again.
pub fn begin(
    backend: &mut dyn Backend,
    known: &Context,
    observer: &mut Observer,
) -> Result<Decision, SearchError> {
    let clock = Instant::now();
    let found = match find(backend, known, observer) {
        Err(SearchError::Stay(why)) => return Ok(Decision::straight(why, None)),
        found => found?,
    };
    let Found { mut regions, tangents } = found;
    regions.iter().enumerate().for_each(|(k, r)| observer.tell(r.found(k, known.origin)));
    let start = State::of(backend);
    clear(backend, known, |x| regions.iter().any(|r| r.is_inside(x)));
    let shortlist = if is_searched(known, &regions) {
        predicted::decide(backend, &mut regions, &tangents, &start, known, observer)?
    } else {
        let guesses = regions.iter().map(|r| simplest(r, known.options));
        Shortlist::guessed(guesses.collect())
    };
    let (mut before, views) = (None, known.sampler.witnesses());
    // Where all is straight, what straight rays have learned meanwhile inside of masks goes on.
    if !shortlist.stays_straight() {
        if known.options.judge.straight.is_on() && !views.is_empty() {
            let marching = training_marching(known.options, known.near);
            before = Some(baseline(backend, &views, &marching, observer.cancel())?);
        }
        start.clone().load(backend);
    }
    let field = RaceInput { known, regions: &regions, start };
    let Decided { candidates, verdict, goes_on } = decide(backend, &field, &shortlist, observer, clock)?;
    if let Some(verdict) = &verdict {
        observer.tell(Event::Judged { verdict: verdict.clone(), pictures: shortlist.pictures });
    }
    if candidates.iter().all(Option::is_none) {
        let why = if verdict.is_some() { StayReason::Judged } else { StayReason::TooShort };
        return Ok(Decision::straight(why, verdict));
    }
    if !goes_on {
        bend(backend, known, &regions, &candidates, observer)?;
    }
    let hypotheses = candidates.iter().flatten().map(|c| c.proposal.kind).collect();
    observer.tell(Event::RaysBend { hypotheses });
    Ok(Decision { stays: None, verdict, baseline: before })
}
