//! How a model comes to bend its rays: find what is refractive, search its index, and clear what straight rays left
//! inside.
//!
//! At this point straight rays have learned everything that is seen beside the refractive things. Then:
//! 1. Views say where refractive things can be (`find`): the visual hull of the masks, a box, or a known index.
//! 2. Each hypothesis on what stands there (`hypotheses`) has some unknown numbers, first of all the index. They are searched
//!    by the error of the rays inside the masks (`search`): the scene around is known by now, so the right index shows it in
//!    the right places. The error has one minimum, which a gradient from n = 1 never finds.
//! 3. The hypotheses that fit best race against straight rays (`race`, `contest`), and views that were kept aside judge. A
//!    region in which straight rays are as good stays straight.
//! 4. Haze that straight rays left inside is cleared.
//!
//! From there shape and index learn by their gradients, first alone and then together with everything else.

mod border;
mod completing;
mod contest;
mod facets;
mod find;
mod ground;
mod heats;
mod hull;
mod hypotheses;
mod known;
mod look;
mod opinion;
mod outline;
mod parts;
mod predicted;
mod race;
mod region;
mod revolve;
mod search;
mod shapes;
mod silhouettes;

pub(crate) use border::border;
pub use completing::LEAST as LEAST_MASKS;
pub(crate) use completing::hulls;
pub(crate) use ground::Ground;
pub use known::{known_field, known_refraction};
pub(crate) use outline::{Outline, outline};
pub(crate) use parts::{NONE, connected, neighbours};
pub(crate) use silhouettes::OCCLUDER_RAYS;

use crate::backend::{Backend, Caches};
use crate::cancel::Cancelled;
use crate::events::{Event, Task, Watch};
use crate::model::{MirrorSource, ProbeLayout, Reflection, Refraction};
use crate::options::{Options, StartShape, Switch};
use crate::rays::{RaySampler, Selection};
use crate::schedule::{Progress, training_marching};
use crate::verdict::{Hypothesis, StayReason, Verdict};
use contest::Trained;
use heats::{Heats, heats};
use hypotheses::{Body, Candidate};
use predicted::Prediction;
use race::{Course, Outcome, race};
use refraxel_core::{Medium, ShDegree};
use refraxel_data::{Dataset, IndexSource, MaskMeaning};
use region::Region;
use std::time::Instant;

/// Why nothing can bend.
#[derive(Debug, thiserror::Error)]
pub enum RecipeError {
    /// Neither masks nor a box.
    #[error(
        "nothing says what is refractive: the dataset has no masks of refractive things; give masks (`refraxel mask` makes some), or \
         a box with --refraction-box x0,y0,z0,x1,y1,z1, or leave --refraction out, so that it is sought"
    )]
    Nowhere,
    /// The shape is to come from a file, and there is none.
    #[error("option `shape.start` is `file`, but no index is given; name its file with --index-from")]
    NoFile,
    /// What there is leads nowhere: rays stay straight.
    #[error(transparent)]
    Stay(#[from] StayReason),
    /// Somebody wished to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Finds out before training whether something says what is refractive; `masked`: the dataset has masks of it.
pub fn check(options: &Options, masked: bool, index: Option<&IndexSource>) -> Result<(), RecipeError> {
    if options.refraction.bend == Switch::Off {
        return Ok(());
    }
    if options.shape.start == StartShape::File && index.is_none() {
        return Err(RecipeError::NoFile);
    }
    let named = index.is_some() || options.refraction.aabb().is_some();
    let seeks = options.seek.enabled.is_on() && options.shape.start == StartShape::Hull;
    if named || masked || seeks { Ok(()) } else { Err(RecipeError::Nowhere) }
}

/// Whether some training view has a mask of what is refractive.
pub fn has_masks(data: &Dataset) -> bool {
    let mut views = data.split.train.iter().map(|&i| &data.views[i]);
    views.any(|v| v.has_mask() && v.mask_meaning == MaskMeaning::Refractive)
}

/// What is known when rays begin to bend.
#[derive(Clone, Copy)]
pub struct Known<'a> {
    /// The photographs.
    pub sampler: &'a RaySampler,
    /// The options.
    pub options: &'a Options,
    /// Nothing nearer to a camera is seen [scene unit].
    pub near: f32,
    /// The index, where somebody knows it.
    pub index: Option<&'a IndexSource>,
    /// Where the run stands.
    pub progress: Progress,
}

/// What is decided when rays were to bend.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// Why all rays stay straight, if they do.
    pub stays: Option<StayReason>,
    /// How it was decided, where hypotheses raced.
    pub verdict: Option<Verdict>,
}

/// Let rays bend from now on, or find out that they had better stay straight: the backend then holds the model to go on
/// with. After an error its model is half changed: load it again.
pub fn begin<B: Backend>(backend: &mut B, known: &Known, watch: &mut Watch) -> Result<Decision, RecipeError> {
    let clock = Instant::now();
    let found = match find::find(backend, known, watch) {
        Err(RecipeError::Stay(why)) => return Ok(Decision { stays: Some(why), verdict: None }),
        found => found?,
    };
    let find::Found { mut regions, tangents } = found;
    regions.iter().enumerate().for_each(|(k, r)| watch.tell(r.found(k)));
    let start = contest::State::of(backend);
    contest::clear(backend, known, |x| regions.iter().any(|r| r.is_inside(x)));
    let judges = is_searched(known, &regions) && known.options.judge.enabled.is_on();
    let mut glimpsed = None;
    if judges {
        let prediction = predicted::decide(backend, &mut regions, &tangents, &start, known, watch)?;
        if let Prediction::Decided(predicted::Decided { candidates, verdicts, pictures }) = prediction {
            let verdict = Verdict {
                views: known.sampler.aside(),
                seconds: clock.elapsed().as_secs_f64(),
                progress: known.progress.0,
                regions: verdicts,
            };
            watch.tell(Event::Judged { verdict: verdict.clone(), pictures });
            if candidates.iter().all(Option::is_none) {
                return Ok(Decision { stays: Some(StayReason::Judged), verdict: Some(verdict) });
            }
            start.load(backend);
            contest::bend(backend, known, &regions, &candidates, watch)?;
            let hypotheses = candidates.iter().flatten().map(|c| c.proposal.kind).collect();
            watch.tell(Event::RaysBend { hypotheses });
            return Ok(Decision { stays: None, verdict: Some(verdict) });
        }
        if let Prediction::Races(heats) = prediction {
            glimpsed = Some(heats);
        }
        start.clone().load(backend);
        contest::clear(backend, known, |x| regions.iter().any(|r| r.is_inside(x)));
    }
    let heats = match glimpsed {
        Some(heats) => heats,
        None => heats(&search::fits(backend, &regions, known, watch)?, &regions, known, watch),
    };
    start.clone().load(backend);
    let field = Field { known, regions: &regions, start };
    let Decided { candidates, verdict, goes_on } = decide(backend, &field, heats, watch, clock)?;
    if let Some(verdict) = &verdict {
        watch.tell(Event::Judged { verdict: verdict.clone(), pictures: Vec::new() });
    }
    if candidates.iter().all(Option::is_none) {
        let why = if verdict.is_some() { StayReason::Judged } else { StayReason::TooShort };
        return Ok(Decision { stays: Some(why), verdict });
    }
    if !goes_on {
        contest::bend(backend, known, &regions, &candidates, watch)?;
    }
    let hypotheses = candidates.iter().flatten().map(|c| c.proposal.kind).collect();
    watch.tell(Event::RaysBend { hypotheses });
    Ok(Decision { stays: None, verdict })
}

/// Somebody knows what stands in all regions.
fn is_known(known: &Known, regions: &[Region]) -> bool {
    regions.iter().all(Region::is_known) || known.index.is_some()
}

/// The index is searched.
fn is_searched(known: &Known, regions: &[Region]) -> bool {
    known.options.search.enabled.is_on() && !is_known(known, regions)
}

/// On what hypotheses race.
struct Field<'a> {
    known: &'a Known<'a>,
    regions: &'a [Region],
    start: contest::State,
}

/// What stands in each region, `None` for nothing.
struct Decided {
    candidates: Vec<Option<Candidate>>,
    verdict: Option<Verdict>,
    /// The backend holds what has learned this in the race. Otherwise it holds the start.
    goes_on: bool,
}

/// Lets the heats race, where there is a judge and enough time.
fn decide<B: Backend>(
    backend: &mut B,
    field: &Field,
    Heats { rivals: heats, assumed, straight }: Heats,
    watch: &mut Watch,
    clock: Instant,
) -> Result<Decided, Cancelled> {
    let Field { known, regions, .. } = *field;
    let judge = &known.options.judge;
    let is_known = is_known(known, regions);
    let alone = !judge.straight.is_on() && heats.len() == 1;
    let views = known.sampler.aside();
    let is_searched = is_searched(known, regions);
    let races = judge.enabled.is_on() && !is_known && !alone && views > 0;
    let entries = heats.len() + 1;
    let mut contest = Trained::new(backend, field, watch, heats);
    let course = if races { course(&mut contest, field, entries, clock)? } else { Course::default() };
    if course.first == 0 {
        field.start.clone().load(backend);
        // Nobody bends from a mere guess where straight rays may win.
        let must_be_found = is_searched && judge.enabled.is_on() && judge.straight.is_on();
        let candidates: Vec<Option<Candidate>> =
            assumed.into_iter().map(|c| Some(c).filter(|c| c.searched || !must_be_found)).collect();
        for (k, candidate) in candidates.iter().enumerate() {
            if is_searched && candidate.as_ref().is_some_and(|c| !c.searched) {
                watch.tell(heats::guessed(k, straight[k], known.options));
            }
        }
        return Ok(Decided { candidates, verdict: None, goes_on: false });
    }
    contest.set_course(course);
    let Outcome { finalist, mut verdicts } = race(&mut contest, course, judge)?;
    let mut candidates = contest.candidates(finalist).to_vec();
    for (verdict, candidate) in verdicts.iter_mut().zip(&mut candidates) {
        if judge.straight.is_on() && verdict.hypothesis == Hypothesis::Straight {
            *candidate = None;
        }
        verdict.hypothesis = candidate.as_ref().map_or(Hypothesis::Straight, |c| c.proposal.kind);
    }
    // What has learned exactly this goes on; a mixture begins again.
    let winner = [race::STRAIGHT, finalist].into_iter().find(|e| {
        let assumed = contest.candidates(*e);
        assumed.iter().zip(&candidates).all(|(a, b)| a.is_some() == b.is_some())
    });
    let state = winner.and_then(|entry| contest.into_state(entry));
    let goes_on = state.is_some();
    state.unwrap_or_else(|| field.start.clone()).load(backend);
    let (seconds, progress) = (clock.elapsed().as_secs_f64(), known.progress.0);
    let verdict = Some(Verdict { views, seconds, progress, regions: verdicts });
    Ok(Decided { candidates, verdict, goes_on })
}

/// A run whose shortest race would take more than this part of it has none.
const MOST_RACING: f64 = 0.3;
/// Where all that lies within is learned anew, the least race is longer by this factor, if the run has that much time.
const RELEARNING: u64 = 3;

/// A race whose end is open takes at most so many times its length.
const LONGER: u64 = 3;

/// How long a race of so many entries may be: what the search leaves of the share of the run. Where the run has a clock, a
/// few steps of the best candidates are timed; else steps count alike.
fn course<B: Backend>(
    contest: &mut Trained<B>,
    field: &Field,
    entries: usize,
    clock: Instant,
) -> Result<Course, Cancelled> {
    let (run, judge) = (&field.known.options.run, &field.known.options.judge);
    // All learn one third, straight rays and the best other go on: entries/3 + 2 · 2/3 of the whole length.
    let shares = (entries as f64 + 4.0) / 3.0;
    let (budget, most) = if run.minutes > 0.0 {
        let per_step = contest.seconds_per_step()?;
        let steps = |seconds: f64| (seconds.max(0.0) / (per_step * shares)) as u64;
        let left = judge.cost * 60.0 * run.minutes - clock.elapsed().as_secs_f64();
        (steps(left), steps(MOST_RACING * 60.0 * run.minutes))
    } else {
        ((judge.cost * run.steps as f64 / shares) as u64, run.steps / 3)
    };
    let relearns = (0..entries).flat_map(|e| contest.candidates(e)).flatten().any(Candidate::relearns);
    let wanted = judge.least_steps * if relearns { RELEARNING } else { 1 };
    let all = if most < judge.least_steps { 0 } else { budget.max(wanted.min(most)).min(judge.race_steps) };
    let most = (LONGER * all).min(most).max(all);
    Ok(Course { regions: field.regions.len(), entries, first: all / 3, all, most })
}

/// What bends rays where these bodies are.
fn refraction(bodies: Vec<Body>, options: &Options) -> Refraction {
    let (grids, states) = bodies.into_iter().map(|b| (b.grid, b.state)).unzip();
    let medium = Medium::new(grids).unwrap_or_else(|e| unreachable!("regions were made apart: {e}"));
    Refraction { medium, optics: options.optics(), states }
}

/// Let surfaces mirror what the field shows by now, where there are some: a lens has none.
fn begin_mirroring<B: Backend>(backend: &mut B, known: &Known, watch: &mut Watch) -> Result<(), Cancelled> {
    let c = &known.options.reflection;
    if !c.enabled.is_on() || !has_surfaces(backend, known.sampler) {
        return Ok(());
    }
    let degree = ShDegree::new(c.degree).unwrap_or_default();
    let (source, layout) = (c.cache, ProbeLayout { longest: c.probes, degree });
    backend.set_reflection(Reflection::of(backend.medium(), source, &layout));
    if source != MirrorSource::Exact {
        watch.progress(Task::Baking, 0, 1)?;
        let marching = training_marching(known.options, known.near);
        backend.bake(Caches::Reflection, &marching, watch.cancel())?;
        watch.tell(Event::Progress { task: Task::Baking, done: 1, total: 1 });
    }
    Ok(())
}

/// Rays that say whether what is refractive has a surface.
const RAYS_FOR_SURFACES: usize = 256;

/// Something refractive has a sharp surface, or transitions that most rays through it meet.
fn has_surfaces(backend: &impl Backend, sampler: &RaySampler) -> bool {
    let (refraction, domain) = (backend.medium(), backend.domain());
    let is_sharp = refraction.medium.regions().iter().any(|r| r.level_set().is_some());
    let rays = || sampler.batch(0, RAYS_FOR_SURFACES, Selection::Inside(1.0)).rays;
    is_sharp || refraction.mirrors(&rays(), domain)
}
