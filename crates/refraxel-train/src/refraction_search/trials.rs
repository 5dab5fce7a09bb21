//! The race on a backend: entries learn from the same model, on the grid of the moment, and are scored on the views that
//! were kept aside.

use super::context::Context;
use super::hypotheses::refraction;
use super::hypotheses::{Body, Candidate};
use super::mirrors::begin_mirroring;
use super::predicted::Shortlist;
use super::race::{STRAIGHT, TrialIndex, TrialLength, Trials, ViewScore};
use super::region::Region;
use super::state::State;
use super::tint::begin_tinted;
use crate::backend::{Backend, BrickMask, Layers, Marching};
use crate::cancel::Cancelled;
use crate::events::{Observer, Task};
use crate::rays::{AsideView, Draw, Selection, squared_errors};
use crate::schedule::{INDEX_ALONE, Moment, objective, training_marching};
use crate::verdict::{Found, Hypothesis};
use refraxel_core::{IndexGrid, Vec3};
use std::iter::repeat_n;
use std::time::Instant;

/// Part of the steps of an entry in which its index and surfaces learn alone.
const ALONE: f64 = 0.15;
/// Least fraction of the rays of a race inside masks: it is decided there.
const INSIDE: f64 = 0.7;
/// Pixels of a region that a view must show to have a say.
const LEAST_PIXELS: usize = 20;
/// Raw density inside a body when rays begin to bend.
const CONTENTS: f32 = -5.0;
/// The same below water that is seen from above only: something must stand there, and is learned sooner from haze.
const SUBMERGED: f32 = -2.0;
/// Rays of a batch at most.
const RAYS: usize = 2048;

/// On what hypotheses race.
pub(super) struct RaceInput<'a> {
    pub known: &'a Context<'a>,
    pub regions: &'a [Region],
    pub start: State,
}

/// What an entry assumes, and how far it has come.
struct Trial {
    /// One per region; `None` for straight rays.
    candidates: Vec<Option<Candidate>>,
    steps: u64,
    /// Steps that it did before the race, and that count.
    ahead: u64,
    state: Option<State>,
    /// A step overflowed.
    failed: bool,
}

/// Entries that learn on a backend.
pub(super) struct TrainedTrials<'a, 'w> {
    backend: &'a mut dyn Backend,
    known: &'a Context<'a>,
    regions: &'a [Region],
    observer: &'a mut Observer<'w>,
    aside: Vec<AsideView>,
    /// Where all entries start.
    start: &'a State,
    /// Steps that an entry learns if it stays in the race.
    length: u64,
    trials: Vec<Trial>,
    /// Steps done by all.
    done: u64,
    total: u64,
}

impl<'a, 'w> TrainedTrials<'a, 'w> {
    /// Trials of what is assumed without any rival and of rivals, each with one candidate per region.
    pub(super) fn new(
        backend: &'a mut dyn Backend,
        field: &'a RaceInput<'a>,
        observer: &'a mut Observer<'w>,
        shortlist: &Shortlist,
    ) -> Self {
        let RaceInput { known, regions, start } = field;
        let trials =
            std::iter::once(&shortlist.sure).chain(&shortlist.rivals).cloned().map(Trial::new).collect();
        let aside = known.sampler.kept_aside();
        Self { backend, known, regions, start, observer, aside, length: u64::MAX, trials, done: 0, total: 0 }
    }

    /// States how long the race will be.
    pub(super) fn set_course(&mut self, length: TrialLength) {
        self.length = length.all;
        self.total = length.entries as u64 * length.first + 2 * (length.all - length.first);
    }

    /// How long a step with bent rays takes [s]: that of the best candidates, which have these steps behind them then.
    pub(super) fn seconds_per_step(&mut self) -> Result<f64, Cancelled> {
        const BEST: TrialIndex = STRAIGHT + 1;
        self.load(BEST)?;
        self.steps(BEST, 1)?;
        let clock = Instant::now();
        self.steps(BEST, TIMED)?;
        let seconds = clock.elapsed().as_secs_f64();
        self.trials[BEST].ahead = 1 + TIMED;
        self.keep(BEST);
        Ok(seconds / TIMED as f64)
    }

    /// Keeps what the backend holds as what an entry has learned, unless it failed.
    fn keep(&mut self, entry: TrialIndex) {
        let trial = &mut self.trials[entry];
        trial.state = (!trial.failed).then(|| State::of(self.backend));
    }

    /// So many steps of the entry that the backend holds.
    fn steps(&mut self, entry: TrialIndex, steps: u64) -> Result<(), Cancelled> {
        let options = self.known.options;
        let share = options.refraction.mask_ray_fraction.max(INSIDE);
        let size = (options.run.batch as usize).min(RAYS);
        for _ in 0..steps {
            self.observer.progress(Task::Judging, self.done, self.total.max(self.done))?;
            let trial = &self.trials[entry];
            let (step, failed) = (trial.steps, trial.failed);
            self.trials[entry].steps += 1;
            self.done += 1;
            if failed {
                continue;
            }
            // The same rays for all entries, and none that training will draw.
            let (sampler, number) = (self.known.sampler, u64::MAX / 4 + step);
            let draw = Draw { sampler, number, size, selection: Selection::Inside(share), reach: 0 };
            let objective = objective(options, self.known.near, self.moment(entry, step));
            self.backend.submit_drawn(&draw, &objective, step);
            let finite = self.backend.outcomes(true).iter().all(|o| o.finite);
            self.trials[entry].failed = !finite;
        }
        Ok(())
    }

    /// What an entry assumes of each region.
    pub(super) fn candidates(&self, entry: TrialIndex) -> &[Option<Candidate>] {
        &self.trials[entry].candidates
    }

    /// What an entry has learned; `None` if it overflowed.
    pub(super) fn into_state(mut self, entry: TrialIndex) -> Option<State> {
        self.trials[entry].state.take()
    }

    /// Puts an entry into the backend, as far as it has come.
    fn load(&mut self, entry: TrialIndex) -> Result<(), Cancelled> {
        if let Some(state) = self.trials[entry].state.take() {
            state.load(self.backend);
            return Ok(());
        }
        self.start.clone().load(self.backend);
        if self.trials[entry].bends() {
            bend(self.backend, self.known, self.regions, &self.trials[entry].candidates, self.observer)?;
        }
        Ok(())
    }

    /// The moment of a step: at first the index learns alone.
    fn moment(&self, entry: TrialIndex, step: u64) -> Moment {
        let progress = self.known.progress;
        let is_alone = (step as f64) < ALONE * self.length as f64;
        let before = INDEX_ALONE + f64::EPSILON;
        let since = if is_alone { progress.0 } else { progress.0 - before };
        let bends = self.trials[entry].bends();
        let extent = self.backend.domain().extent;
        Moment { progress, bends_since: bends.then_some(since), bends, is_detected: false, extent }
    }
}

impl Trial {
    fn new(candidates: Vec<Option<Candidate>>) -> Self {
        Self { candidates, steps: 0, ahead: 0, state: None, failed: false }
    }

    fn bends(&self) -> bool {
        self.candidates.iter().any(Option::is_some)
    }
}

/// Lets rays bend at what is assumed of each region, with its inside cleared, and surfaces mirror.
pub(super) fn bend(
    backend: &mut dyn Backend,
    known: &Context,
    regions: &[Region],
    candidates: &[Option<Candidate>],
    observer: &mut Observer,
) -> Result<(), Cancelled> {
    let options = known.options;
    let standing = || regions.iter().zip(candidates).filter_map(|(r, c)| Some((r, c.as_ref()?)));
    let (mut bodies, mut relearned, mut glass): (Vec<Body>, Vec<bool>, Vec<(&Region, Vec<usize>)>) =
        Default::default();
    for (region, candidate) in standing() {
        let (from, learning) = (bodies.len(), candidate.learning(region, options));
        let is_glass =
            |b: &Body| !candidate.relearns() && b.is_searched && b.grid.interior_index() != Some(1.0);
        glass.push((
            region,
            (0..learning.len()).filter(|k| is_glass(&learning[*k])).map(|k| from + k).collect(),
        ));
        relearned.extend(repeat_n(candidate.relearns(), learning.len()));
        bodies.extend(learning);
    }
    let mut found = refraction(bodies, options);
    let near = |x: Vec3<f32>| found.medium.regions().iter().any(|r| near_surface(r, x));
    clear(backend, known, |x| standing().any(|(r, _)| r.is_inside(x)) || near(x));
    for (body, _) in found.medium.regions().iter().zip(relearned).filter(|(_, relearned)| *relearned) {
        let surface = body.level_set();
        fill(backend, known, SUBMERGED, |x| {
            surface.is_some_and(|s| s.domain().bounds.contains(x) && s.is_inside(x))
        });
    }
    found.find_flat_cells();
    backend.set_medium(found);
    for (region, bodies) in glass {
        begin_tinted(backend, known, region, &bodies);
    }
    begin_mirroring(backend, known, observer)
}

/// Inside a body, or within a voxel of it.
fn near_surface(body: &IndexGrid<f32>, x: Vec3<f32>) -> bool {
    body.level_set().is_some_and(|l| l.domain().bounds.contains(x) && l.value(x) < l.voxel())
}

/// Clears the haze that straight rays left inside.
pub(super) fn clear(backend: &mut dyn Backend, known: &Context, inside: impl Fn(Vec3<f32>) -> bool) {
    fill(backend, known, CONTENTS, inside);
}

/// Sets the raw density inside.
fn fill(backend: &mut dyn Backend, known: &Context, density: f32, inside: impl Fn(Vec3<f32>) -> bool) {
    let inside = BrickMask::new(backend.domain(), backend.map(), inside);
    backend.set_density(density, &inside);
    backend.refresh_occupancy(&training_marching(known.options, known.near));
}

/// How far the pixels of a view lie from the photograph.
pub(super) struct Errors(Vec<f64>);

impl Errors {
    /// Those of what a backend renders.
    pub(super) fn of(backend: &dyn Backend, view: &AsideView, marching: &Marching) -> Self {
        Self(squared_errors(&backend.render(&view.batch.rays, marching, Layers::All), &view.batch))
    }

    /// Mean squared error of the chosen pixels, over the three channels; none where there are too few.
    pub(super) fn mean(&self, chosen: impl Fn(usize) -> bool) -> Option<f64> {
        let of: Vec<f64> = (0..self.0.len()).filter(|k| chosen(*k)).map(|k| self.0[k] / 3.0).collect();
        (of.len() >= LEAST_PIXELS).then(|| of.iter().sum::<f64>() / of.len() as f64)
    }
}

/// Steps that are timed.
const TIMED: u64 = 4;

impl Trials for TrainedTrials<'_, '_> {
    fn learn(&mut self, entry: TrialIndex, steps: u64) -> Result<(), Cancelled> {
        self.load(entry)?;
        let ahead = self.trials[entry].ahead.min(steps);
        self.trials[entry].ahead -= ahead;
        self.steps(entry, steps - ahead)
    }

    fn scores(&mut self, entry: TrialIndex) -> Result<Vec<ViewScore>, Cancelled> {
        let marching = training_marching(self.known.options, self.known.near);
        self.backend.refresh_occupancy(&marching);
        let failed = self.trials[entry].failed;
        let (backend, regions) = (&*self.backend, self.regions);
        let cancel = self.observer.cancel();
        let score = |view: &AsideView| {
            cancel.check()?;
            let errors = Errors::of(backend, view, &marching);
            let shows =
                |r: &Region, k: usize| view.inside[k] && (regions.len() == 1 || r.meets(&view.batch.rays[k]));
            let inside = regions.iter().map(|r| errors.mean(|k| shows(r, k))).collect();
            let outside = errors.mean(|k| !view.inside[k]);
            let nan = |v: Option<f64>| if failed { v.map(|_| f64::NAN) } else { v };
            let inside: Vec<Option<f64>> = inside;
            Ok(ViewScore { inside: inside.into_iter().map(nan).collect(), outside: nan(outside) })
        };
        let scores = self.aside.iter().map(score).collect::<Result<_, Cancelled>>()?;
        self.keep(entry);
        Ok(scores)
    }

    fn combined(&mut self, chosen: &[TrialIndex]) -> TrialIndex {
        if let Some(first) = chosen.first().filter(|first| chosen.iter().all(|e| e == *first)) {
            return *first;
        }
        let candidates = chosen.iter().enumerate().map(|(r, e)| self.trials[*e].candidates[r].clone());
        self.trials.push(Trial::new(candidates.collect()));
        self.trials.len() - 1
    }

    fn assumes(&self, entry: TrialIndex, region: usize) -> (Hypothesis, Vec<Found>) {
        match &self.trials[entry].candidates[region] {
            None => (Hypothesis::Straight, Vec::new()),
            Some(c) => (c.proposal.kind, c.found(&self.regions[region])),
        }
    }
}
