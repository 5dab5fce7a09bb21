//! The race on a backend: entries learn from the same model, on the grid of the moment, and are scored on the views that
//! were kept aside.

use super::hypotheses::{Body, Candidate};
use super::race::{Contest, Course, Entry, STRAIGHT, ViewScore};
use super::region::Region;
use super::{Field, Known, begin_mirroring, refraction};
use crate::backend::{Backend, BrickMask, Layers};
use crate::cancel::Cancelled;
use crate::events::{Task, Watch};
use crate::model::{Model, Optimiser};
use crate::rays::{AsideView, Draw, Selection, squared_errors};
use crate::schedule::{Moment, objective, training_marching};
use crate::verdict::{Found, Hypothesis};
use refraxel_core::{IndexGrid, Vec3};
use std::iter::repeat;
use std::time::Instant;

/// Part of the steps of an entry in which its index and surfaces learn alone.
const ALONE: f64 = 0.15;
/// Least fraction of the rays of a race inside masks: it is decided there.
const INSIDE: f64 = 0.7;
/// Pixels of a region that a view must show to have a say.
const LEAST_PIXELS: usize = 20;
/// Rays of a batch at most.
const RAYS: usize = 2048;

/// A model under way.
#[derive(Clone)]
pub(super) struct State {
    model: Model,
    optimiser: Optimiser,
}

impl State {
    /// What a backend holds.
    pub(super) fn of(backend: &impl Backend) -> Self {
        let snapshot = backend.snapshot();
        Self { model: snapshot.model.into_owned(), optimiser: snapshot.optimiser.into_owned() }
    }

    /// Puts it into a backend.
    pub(super) fn load(self, backend: &mut impl Backend) {
        backend.load(self.model, Some(self.optimiser));
    }
}

/// What an entry assumes, and how far it has come.
struct Runner {
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
pub(super) struct Trained<'a, 'w, B> {
    backend: &'a mut B,
    known: &'a Known<'a>,
    regions: &'a [Region],
    watch: &'a mut Watch<'w>,
    aside: Vec<AsideView>,
    /// Where all entries start.
    start: &'a State,
    /// Steps that an entry learns if it stays in the race.
    length: u64,
    runners: Vec<Runner>,
    /// Steps done by all.
    done: u64,
    total: u64,
}

impl<'a, 'w, B: Backend> Trained<'a, 'w, B> {
    /// A contest between straight rays and, per heat, one candidate per region.
    pub(super) fn new(
        backend: &'a mut B,
        field: &'a Field<'a>,
        watch: &'a mut Watch<'w>,
        heats: Vec<Vec<Candidate>>,
    ) -> Self {
        let Field { known, regions, start } = field;
        let straight = vec![None; regions.len()];
        let bent = heats.into_iter().map(|heat| heat.into_iter().map(Some).collect());
        let runners = std::iter::once(straight).chain(bent).map(Runner::new).collect();
        let aside = known.sampler.kept_aside();
        Self { backend, known, regions, start, watch, aside, length: u64::MAX, runners, done: 0, total: 0 }
    }

    /// States how long the race will be.
    pub(super) fn set_course(&mut self, course: Course) {
        self.length = course.all;
        self.total = course.entries as u64 * course.first + 2 * (course.all - course.first);
    }

    /// How long a step with bent rays takes [s]: that of the best candidates, which have these steps behind them then.
    pub(super) fn seconds_per_step(&mut self) -> Result<f64, Cancelled> {
        const BEST: Entry = STRAIGHT + 1;
        self.load(BEST)?;
        self.steps(BEST, 1)?;
        let clock = Instant::now();
        self.steps(BEST, TIMED)?;
        let seconds = clock.elapsed().as_secs_f64();
        self.runners[BEST].ahead = 1 + TIMED;
        self.keep(BEST);
        Ok(seconds / TIMED as f64)
    }

    /// Keeps what the backend holds as what an entry has learned, unless it failed.
    fn keep(&mut self, entry: Entry) {
        let runner = &mut self.runners[entry];
        runner.state = (!runner.failed).then(|| State::of(self.backend));
    }

    /// So many steps of the entry that the backend holds.
    fn steps(&mut self, entry: Entry, steps: u64) -> Result<(), Cancelled> {
        let options = self.known.options;
        let share = options.refraction.mask_ray_fraction.max(INSIDE);
        let size = (options.run.batch as usize).min(RAYS);
        for _ in 0..steps {
            self.watch.progress(Task::Judging, self.done, self.total.max(self.done))?;
            let runner = &self.runners[entry];
            let (step, failed) = (runner.steps, runner.failed);
            self.runners[entry].steps += 1;
            self.done += 1;
            if failed {
                continue;
            }
            // The same rays for all entries, and none that training will draw.
            let (sampler, number) = (self.known.sampler, u64::MAX / 4 + step);
            let draw = Draw { sampler, number, size, selection: Selection::Inside(share) };
            let objective = objective(options, self.known.near, self.moment(entry, step));
            self.backend.submit_drawn(&draw, &objective, step);
            let finite = self.backend.outcomes(true).iter().all(|o| o.finite);
            self.runners[entry].failed = !finite;
        }
        Ok(())
    }

    /// What an entry assumes of each region.
    pub(super) fn candidates(&self, entry: Entry) -> &[Option<Candidate>] {
        &self.runners[entry].candidates
    }

    /// What an entry has learned; `None` if it overflowed.
    pub(super) fn into_state(mut self, entry: Entry) -> Option<State> {
        self.runners[entry].state.take()
    }

    /// Puts an entry into the backend, as far as it has come.
    fn load(&mut self, entry: Entry) -> Result<(), Cancelled> {
        if let Some(state) = self.runners[entry].state.take() {
            state.load(self.backend);
            return Ok(());
        }
        self.start.clone().load(self.backend);
        if entry != STRAIGHT {
            bend(self.backend, self.known, self.regions, &self.runners[entry].candidates, self.watch)?;
        }
        Ok(())
    }

    /// The moment of a step: at first the index learns alone.
    fn moment(&self, entry: Entry, step: u64) -> Moment {
        let progress = self.known.progress;
        let is_alone = (step as f64) < ALONE * self.length as f64;
        let before = self.known.options.refraction.index_alone_share + f64::EPSILON;
        let since = if is_alone { progress.0 } else { progress.0 - before };
        let bends = entry != STRAIGHT;
        let extent = self.backend.domain().extent;
        Moment { progress, bends_since: bends.then_some(since), bends, extent }
    }
}

impl Runner {
    fn new(candidates: Vec<Option<Candidate>>) -> Self {
        Self { candidates, steps: 0, ahead: 0, state: None, failed: false }
    }
}

/// Lets rays bend at what is assumed of each region, with its inside cleared, and surfaces mirror.
pub(super) fn bend<B: Backend>(
    backend: &mut B,
    known: &Known,
    regions: &[Region],
    candidates: &[Option<Candidate>],
    watch: &mut Watch,
) -> Result<(), Cancelled> {
    let options = known.options;
    let standing = || regions.iter().zip(candidates).filter_map(|(r, c)| Some((r, c.as_ref()?)));
    let learning = standing().flat_map(|(r, c)| c.learning(r, options).into_iter().zip(repeat(c.relearns())));
    let (bodies, relearned): (Vec<Body>, Vec<bool>) = learning.unzip();
    let mut found = refraction(bodies, options);
    let near = |x: Vec3<f32>| found.medium.regions().iter().any(|r| near_surface(r, x));
    clear(backend, known, |x| standing().any(|(r, _)| r.is_inside(x)) || near(x));
    for (body, _) in found.medium.regions().iter().zip(relearned).filter(|(_, relearned)| *relearned) {
        let surface = body.level_set();
        fill(backend, known, options.refraction.submerged_density, |x| {
            surface.is_some_and(|s| s.domain().bounds.contains(x) && s.is_inside(x))
        });
    }
    found.find_flat_cells();
    backend.set_medium(found);
    begin_mirroring(backend, known, watch)
}

/// Inside a body, or within a voxel of it.
fn near_surface(body: &IndexGrid<f32>, x: Vec3<f32>) -> bool {
    body.level_set().is_some_and(|l| l.domain().bounds.contains(x) && l.value(x) < l.voxel())
}

/// Clears the haze that straight rays left inside.
pub(super) fn clear<B: Backend>(backend: &mut B, known: &Known, inside: impl Fn(Vec3<f32>) -> bool) {
    fill(backend, known, known.options.refraction.contents_density, inside);
}

/// Sets the raw density inside.
fn fill<B: Backend>(backend: &mut B, known: &Known, density: f32, inside: impl Fn(Vec3<f32>) -> bool) {
    let inside = BrickMask::new(backend.domain(), backend.map(), inside);
    backend.set_density(density, &inside);
    backend.refresh_occupancy(&training_marching(known.options, known.near));
}

/// Steps that are timed.
const TIMED: u64 = 4;

impl<B: Backend> Contest for Trained<'_, '_, B> {
    fn learn(&mut self, entry: Entry, steps: u64) -> Result<(), Cancelled> {
        self.load(entry)?;
        let ahead = self.runners[entry].ahead.min(steps);
        self.runners[entry].ahead -= ahead;
        self.steps(entry, steps - ahead)
    }

    fn scores(&mut self, entry: Entry) -> Result<Vec<ViewScore>, Cancelled> {
        let marching = training_marching(self.known.options, self.known.near);
        self.backend.refresh_occupancy(&marching);
        let failed = self.runners[entry].failed;
        let (backend, regions) = (&*self.backend, self.regions);
        let cancel = self.watch.cancel();
        let score = |view: &AsideView| {
            cancel.check()?;
            let pixels = backend.render(&view.batch.rays, &marching, Layers::All);
            let errors = squared_errors(&pixels, &view.batch);
            let mean = |chosen: &dyn Fn(usize) -> bool| {
                let of: Vec<f64> =
                    (0..errors.len()).filter(|k| chosen(*k)).map(|k| errors[k] / 3.0).collect();
                (of.len() >= LEAST_PIXELS).then(|| of.iter().sum::<f64>() / of.len() as f64)
            };
            let shows =
                |r: &Region, k: usize| view.inside[k] && (regions.len() == 1 || r.meets(&view.batch.rays[k]));
            let inside = regions.iter().map(|r| mean(&|k| shows(r, k))).collect();
            let outside = mean(&|k| !view.inside[k]);
            let nan = |v: Option<f64>| if failed { v.map(|_| f64::NAN) } else { v };
            let inside: Vec<Option<f64>> = inside;
            Ok(ViewScore { inside: inside.into_iter().map(nan).collect(), outside: nan(outside) })
        };
        let scores = self.aside.iter().map(score).collect::<Result<_, Cancelled>>()?;
        self.keep(entry);
        Ok(scores)
    }

    fn combined(&mut self, chosen: &[Entry]) -> Entry {
        if let Some(first) = chosen.first().filter(|first| chosen.iter().all(|e| e == *first)) {
            return *first;
        }
        let candidates = chosen.iter().enumerate().map(|(r, e)| self.runners[*e].candidates[r].clone());
        self.runners.push(Runner::new(candidates.collect()));
        self.runners.len() - 1
    }

    fn assumes(&self, entry: Entry, region: usize) -> (Hypothesis, Vec<Found>) {
        match &self.runners[entry].candidates[region] {
            None => (Hypothesis::Straight, Vec::new()),
            Some(c) => (c.proposal.kind, c.found(&self.regions[region])),
        }
    }
}
