//! What changes during training: resolution, learning rates, priors.

use crate::backend::{AbsorptionObjective, IndexObjective, Marching, Objective, ReflectionObjective};
use crate::options::{FieldOptions, Options};
use refraxel_core::{Domain, Extent};
use serde::{Deserialize, Serialize};

/// Share of a run before the finest grid. Each stage before the last takes the same share of the part of a run that is then left.
const COARSE_SHARE: f64 = 0.2775;
/// Share of a run during which the learning rates rise from a tenth of their value: the first batches must not throw the field about.
const WARM_UP: f32 = 0.01;
/// Factor on all learning rates that is reached at the end of a run.
const RATE_DECAY: f32 = 0.05;
/// The same of field and background: a run ends before every pixel has been seen several times, and the last ones still teach something.
const FIELD_RATE_DECAY: f32 = 0.1;
/// The same on the weights of total variation: at first it fills gaps, at the end it would blur.
const VARIATION_DECAY: f32 = 0.1;
/// In one step total variation visits one in this many voxels.
pub(crate) const VARIATION_PERIOD: u32 = 16;
/// Colour feels it in one of so many of their rounds: it is 27 of a voxel's 28 parameters, and waits for memory.
const COLOUR_ROUNDS: u64 = 4;
/// Factor on the total variation of density where rays bend: views through a refractive medium show the scene from few sides.
const VARIATION_BENT: f32 = 2.0;
/// Learning rate of the background at the start of a run.
const RATE_BACKGROUND: f32 = 0.01;
/// Pull of each sample's colour towards what its ray should show, theory (4.5). Where colours of a haze have come near to what each view
/// shows, those that no view agrees on explain nothing and dissolve.
const SAMPLE_COLOUR: f32 = 0.1;
/// Samples whose optical depth per voxel is below this are transparent.
const MIN_OPTICAL_DEPTH: f32 = 1e-3;
/// Samples of smaller optical depth [1], over the length of their step, are left out by chance, theory (4.6), in a box and in surroundings:
/// haze, which between photographs has most of the samples, and little to teach. Where little is haze, more than 0.02 costs more than it saves.
const THIN: f32 = 0.02;
const THIN_AROUND: f32 = 0.05;
/// Samples nearer to the camera than so many times the distance at which rays begin move surroundings by less, theory (4.29): each photograph
/// would fill the space before its own camera with what explains it alone. By default this is how near the scene's centre a camera comes.
/// No camera stands in a box, and those of forward-facing captures see what is near all together.
const FULL_DISTANCE: f32 = 5.0;
/// Weight of rays that bend in the loss: they err more, by what is not yet right about the glass, and things that straight rays see as
/// well must not learn those errors.
const BENT_WEIGHT: f32 = 0.3;
/// Share of a run after the straight phase in which only the index learns.
pub(crate) const INDEX_ALONE: f64 = 0.02;
/// Bound on the gradient that one index sample of a path contributes.
const INDEX_CLIP: f32 = 3.0;
/// Standard deviation of the blur of the gradient of the index [voxel of its grid].
const INDEX_BLUR: f32 = 1.5;
/// Largest index that can be learned: above diamond.
const LARGEST_INDEX: f32 = 2.6;
/// The one index of a body with a sharp surface stays this near to what it began with: where the shape is wrong, the gradient would carry
/// it away.
const INDEX_TRUST: f32 = 0.15;
/// The index learns only from rays that meet surfaces at most this often, and surfaces from those that meet them at most so often.
const INDEX_EVENTS: u32 = 4;
const SURFACE_EVENTS: u32 = 2;
/// Weight of the depth at which rays beside a mask pass through a sharp surface [1 / voxel of its grid]: what is seen in the refraction
/// may overrule masks.
const SILHOUETTE: f32 = 0.1;
/// Learning rates of the coefficients of learned probes, and of the strengths with which surfaces and clearcoats mirror.
const RATE_PROBES: f32 = 0.01;
const RATE_STRENGTH: f32 = 0.003;
const RATE_CLEARCOAT: f32 = 0.02;
/// Learning rate of the optical thickness over the longest edge of a body's box.
const RATE_ABSORPTION: f32 = 0.03;

/// What a run is busy with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Phase {
    /// Rays are straight. If they shall bend later: what lies outside the masks is learned.
    #[default]
    Straight,
    /// Rays bend, and the index learns alone.
    Index,
    /// Rays bend, and everything learns.
    Joint,
}

/// Where a run stands: 0 at the start, 1 at the end.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Progress(pub f64);

impl Progress {
    /// Share of the time where there is a budget [minute], of the steps otherwise.
    pub fn of(options: &Options, step: u64, seconds: f64) -> Self {
        let run = &options.run;
        if run.minutes > 0.0 {
            Self((seconds / (60.0 * run.minutes)).min(1.0))
        } else {
            Self(step as f64 / run.steps as f64)
        }
    }

    /// Where the schedule of a run stands that was held: from then on it goes to its end in what is left.
    pub fn scheduled(self, held: Option<PausedSchedule>) -> Self {
        let Some(PausedSchedule { at, until }) = held else { return self };
        let done = (self.0 - until).max(0.0) / (1.0 - until).max(f64::EPSILON);
        Self(at + (1.0 - at) * done.min(1.0))
    }

    /// The stage (from 0) that this point belongs to.
    pub fn stage(self, options: &Options) -> u32 {
        let stages = options.grid.stages;
        (0..stages).rev().find(|&s| self.0 >= stage_start(s, stages)).unwrap_or(0)
    }
}

/// The schedule was held while something else than steps was done: a coarse grid must not end before it has learned. Or it began
/// again, because rays stay straight that were to bend.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PausedSchedule {
    /// Where it stood; 0 where it began again.
    pub at: f64,
    /// The share of the run that was over when it went on.
    pub until: f64,
}

/// A point of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Where the run stands.
    pub progress: Progress,
    /// Where it stood when rays began to bend.
    pub bends_since: Option<f64>,
    /// Rays bend now, or will.
    pub bends: bool,
    /// What may bend them was detected: no mask shows it.
    pub is_detected: bool,
    /// How far the field reaches.
    pub extent: Extent,
}

impl Moment {
    /// The phase that this point belongs to.
    pub fn phase(self) -> Phase {
        match self.bends_since {
            None => Phase::Straight,
            Some(since) if self.progress.0 < since + INDEX_ALONE => Phase::Index,
            Some(_) => Phase::Joint,
        }
    }

    /// Share of the time with bent rays that is over.
    fn bent_share(self) -> f32 {
        let since = self.bends_since.unwrap_or(0.0);
        ((self.progress.0 - since) / (1.0 - since).max(f64::EPSILON)).clamp(0.0, 1.0) as f32
    }
}

/// Straight rays have at most this share of a run.
const MOST_STRAIGHT: f64 = 0.25;

/// Whether straight rays have learned enough for rays to bend. A number of steps, not a share of the run: what is learned
/// beyond it gets in the way of bent rays.
pub fn is_time_to_bend(options: &Options, step: u64, progress: Progress) -> bool {
    step >= options.refraction.straight_steps || progress.0 >= MOST_STRAIGHT
}

/// Where one of so many stages starts, theory (4.9).
fn stage_start(stage: u32, stages: u32) -> f64 {
    1.0 - (1.0 - COARSE_SHARE).powf(f64::from(stage) / f64::from((stages - 1).max(1)))
}

/// The domain of a stage: the final one coarsened by 2 per stage that is still to come.
pub fn stage_domain(options: &Options, finest: &Domain<f32>, stage: u32) -> Domain<f32> {
    let divisor = 1 << (options.grid.stages - 1 - stage.min(options.grid.stages - 1));
    let resolution = finest.resolution.map(|n| ((n - 1).div_ceil(divisor) + 1).max(4));
    Domain { resolution, ..*finest }
}

/// How rays are marched while training; `near` [scene unit].
pub fn training_marching(options: &Options, near: f32) -> Marching {
    Marching {
        step: options.march.step,
        near,
        min_optical_depth: MIN_OPTICAL_DEPTH,
        min_transmittance: options.march.min_transmittance,
    }
}

/// How final pictures are marched.
pub fn rendering_marching(options: &Options, near: f32) -> Marching {
    Marching { step: options.march.render_step, ..training_marching(options, near) }
}

/// The objective at a point of the run, theory (4.8): how straight rays learn, with what bends switched on, and what is held
/// fixed at rate 0.
pub fn objective(options: &Options, near: f32, moment: Moment) -> Objective {
    let straight = straight_objective(options, near, moment);
    let learns = |o: &IndexObjective| o.rate > 0.0 || o.surface_rate > 0.0;
    let index = Some(index_objective(options, moment.bent_share())).filter(learns);
    let mirrors = reflection_objective(moment);
    let absorption = Some(absorption_objective(moment));
    match moment.phase() {
        Phase::Straight => {
            Objective { reflection: options.clearcoat.enabled.is_on().then_some(mirrors), ..straight }
        }
        Phase::Index => Objective {
            index,
            absorption,
            rate_density: 0.0,
            rate_colour: 0.0,
            rate_background: 0.0,
            ..straight
        },
        Phase::Joint => {
            let mirroring = options.reflection.enabled.is_on() || options.clearcoat.enabled.is_on();
            let tv_density = straight.tv_density * VARIATION_BENT;
            let reflection = mirroring.then_some(mirrors);
            Objective { index, reflection, absorption, tv_density, ..straight }
        }
    }
}

/// An objective in a step of the run: total variation of colour takes one in [`COLOUR_ROUNDS`] rounds of the buckets, with as many
/// times the weight. Rays that bend take most of the time themselves, and keep all rounds.
pub(crate) fn in_step(objective: Objective, moment: Moment, step: u64) -> Objective {
    if moment.bends {
        return objective;
    }
    let round = step / u64::from(VARIATION_PERIOD);
    let weight = if round.is_multiple_of(COLOUR_ROUNDS) { COLOUR_ROUNDS as f32 } else { 0.0 };
    Objective { tv_colour: weight * objective.tv_colour, ..objective }
}

/// How the field learns now. Slow and smooth, surroundings stand in fog for long. Masks show what stands in front of it; where none does, too
/// little can be predicted in fog, and until it is decided whether rays bend, surroundings learn as fast and as sharply as what lies in a box.
fn field_options(options: &Options, moment: Moment) -> FieldOptions {
    let (field, usual) = (options.field.clone(), FieldOptions::default());
    let is_undecided = moment.is_detected && moment.bends_since.is_none();
    if is_undecided && moment.extent.is_unbounded() {
        FieldOptions {
            rate_density: field.rate_density.max(usual.rate_density),
            tv_density: field.tv_density.min(usual.tv_density),
            ..field
        }
    } else {
        field
    }
}

/// The objective of a field before which nothing refracts or mirrors.
fn straight_objective(options: &Options, near: f32, moment: Moment) -> Objective {
    let (field, p) = (field_options(options, moment), moment.progress.0.clamp(0.0, 1.0) as f32);
    let warm = (0.1 + 0.9 * p / WARM_UP).min(1.0);
    let decay = warm * FIELD_RATE_DECAY.powf(p);
    let tv = VARIATION_DECAY.powf(p);
    Objective {
        marching: training_marching(options, near),
        thin: if moment.extent == Extent::Bounded { THIN } else { THIN_AROUND },
        full_distance: if moment.extent == Extent::Contracted { FULL_DISTANCE * near } else { 0.0 },
        bent_weight: BENT_WEIGHT,
        sample_colour: SAMPLE_COLOUR,
        depth: field.depth,
        tv_density: field.tv_density * tv,
        tv_colour: field.tv_colour * tv,
        tv_period: VARIATION_PERIOD,
        rate_density: field.rate_density * decay,
        rate_colour: field.rate_colour * decay,
        rate_view: view_share(moment),
        rate_background: RATE_BACKGROUND * decay,
        index: None,
        reflection: None,
        absorption: None,
    }
}

/// Share of its rate at which the view-dependent part of colour learns: it rises over the run where rays bend, theory (4.8), but for
/// surroundings without bounds. Few views see each place of them, and colour that does not depend on the view explains those by fog and blur.
fn view_share(moment: Moment) -> f32 {
    let is_delayed = moment.bends && moment.extent == Extent::Bounded;
    if is_delayed { moment.progress.0.clamp(0.0, 1.0) as f32 } else { 1.0 }
}

/// Least fraction of rays inside masks in a batch. It falls to none while rays bend: at first shape and index must be found.
pub fn mask_ray_fraction(options: &Options, moment: Moment) -> f64 {
    options.refraction.mask_ray_fraction * (1.0 - f64::from(moment.bent_share()))
}

/// How mirrors and clearcoats learn. Mirrors have been there since rays bend, clearcoats for most of the run.
fn reflection_objective(moment: Moment) -> ReflectionObjective {
    let over = if moment.bends_since.is_some() { moment.bent_share() } else { 0.0 };
    let decay = RATE_DECAY.powf(over);
    ReflectionObjective {
        rate: RATE_PROBES * decay,
        rate_strength: RATE_STRENGTH * decay,
        rate_clearcoat: RATE_CLEARCOAT * RATE_DECAY.powf(moment.progress.0 as f32),
    }
}

/// How bodies learn what they absorb, from the first bent ray on.
fn absorption_objective(moment: Moment) -> AbsorptionObjective {
    AbsorptionObjective { rate: RATE_ABSORPTION * RATE_DECAY.powf(moment.bent_share()) }
}

/// How the index learns when this share of the time with bent rays is over.
pub(crate) fn index_objective(options: &Options, over: f32) -> IndexObjective {
    let decay = RATE_DECAY.powf(over);
    IndexObjective {
        rate: options.index.rate * decay,
        surface_rate: options.surface.rate * decay,
        surface_blur: options.surface.blur,
        surface_smooth: options.surface.smooth * decay,
        silhouette: SILHOUETTE,
        surface_events: SURFACE_EVENTS,
        index_events: INDEX_EVENTS,
        blur: INDEX_BLUR,
        clip: INDEX_CLIP,
        variation: (options.index.variation, options.index.penalty.into()),
        deviation: (options.index.deviation, options.index.penalty.into()),
        largest: LARGEST_INDEX,
        trust: INDEX_TRUST,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Aabb, vec3};

    #[test]
    fn stages_follow_each_other_and_the_last_has_the_final_resolution() {
        let c = Options::default();
        let stages: Vec<u32> = (0..=100).map(|k| Progress(f64::from(k) / 100.0).stage(&c)).collect();
        assert!(stages.is_sorted() && stages[0] == 0 && stages[100] == c.grid.stages - 1);
        let bounds = Aabb::new(vec3(0.0, 0.0, 0.0), vec3(1.0, 1.0, 1.0));
        let finest = Domain::with_longest(bounds, Extent::Bounded, 129);
        assert_eq!(stage_domain(&c, &finest, c.grid.stages - 1), finest);
        assert_eq!(stage_domain(&c, &finest, 0).resolution, [33; 3]);
    }

    #[test]
    fn time_that_a_decision_takes_leaves_the_schedule_where_it_was() {
        let is_near =
            |found: &[f64], expected: &[f64]| found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12);
        let at = |p: f64, at: f64, until: f64| Progress(p).scheduled(Some(PausedSchedule { at, until })).0;
        let once = [0.1, 0.4, 0.7, 1.0].map(|p| at(p, 0.1, 0.4));
        assert!(is_near(&once, &[0.1, 0.1, 0.55, 1.0]), "{once:?}");
        // PausedSchedule once more: it goes on from there.
        let twice = [0.85, 0.925, 1.0].map(|p| at(p, once[2], 0.85));
        assert!(is_near(&twice, &[0.55, 0.775, 1.0]), "{twice:?}");
        assert_eq!(Progress(0.25).scheduled(None), Progress(0.25));
        assert_eq!(at(1.0, 0.2, 2.0), 0.2, "a budget that became smaller");
    }

    fn at(progress: f64, bends_since: Option<f64>) -> Moment {
        let (bends, is_detected, extent) = (true, false, Extent::Bounded);
        Moment { progress: Progress(progress), bends_since, bends, is_detected, extent }
    }

    #[test]
    fn rays_bend_after_some_steps_or_a_share_of_short_runs_then_the_index_learns_first() {
        let mut c = Options::default();
        c.refraction.straight_steps = 50;
        let bends = |step, p| is_time_to_bend(&c, step, Progress(p));
        assert!(!bends(49, 0.2) && bends(50, 0.01) && bends(3, 0.25));
        let phase = |p| at(p, Some(0.2)).phase();
        assert_eq!([phase(0.2), phase(0.219), phase(0.221)], [Phase::Index, Phase::Index, Phase::Joint]);
        assert_eq!(at(0.9, None).phase(), Phase::Straight);
    }

    #[test]
    fn rates_rise_then_fall_to_the_decay() {
        let c = Options::default();
        let straight = |p| Moment { bends: false, ..at(p, None) };
        let rate = |p| objective(&c, 0.0, straight(p)).rate_density;
        assert!(rate(0.0) < 0.2 * c.field.rate_density && rate(0.02) > 0.8 * c.field.rate_density);
        assert!((rate(1.0) / c.field.rate_density - FIELD_RATE_DECAY).abs() < 1e-6);
        assert_eq!([0.0, 0.25, 1.0].map(|p| view_share(at(p, None))), [0.0, 0.25, 1.0]);
        assert_eq!(view_share(straight(0.0)), 1.0, "straight");
        let unbounded = |p, since| view_share(Moment { extent: Extent::Contracted, ..at(p, since) });
        assert_eq!([unbounded(0.1, None), unbounded(0.2, Some(0.2))], [1.0; 2]);
    }

    #[test]
    fn all_buckets_feel_total_variation_of_colour_as_much_as_that_of_density() {
        let straight = Moment { bends: false, ..at(0.0, None) };
        let usual = objective(&Options::default(), 0.0, straight);
        let period = u64::from(usual.tv_period);
        assert!((0..period * COLOUR_ROUNDS).all(|s| in_step(usual, at(0.0, None), s) == usual));
        for bucket in [0, 5, period - 1] {
            let turns = (0..2 * COLOUR_ROUNDS * period).filter(|s| (s + bucket).is_multiple_of(period));
            let felt: Vec<f32> =
                turns.map(|s| in_step(usual, straight, s).tv_colour / usual.tv_colour).collect();
            assert_eq!(felt.iter().sum::<f32>(), felt.len() as f32);
            assert_eq!(felt.iter().filter(|f| **f > 0.0).count() as u64, 2);
        }
    }

    #[test]
    fn surroundings_learn_faster_until_it_is_decided_whether_what_was_detected_bends() {
        let c = Options::suited_to(Extent::Contracted, false);
        let rates = |p, since, is_detected| {
            let o = objective(&c, 0.0, Moment { is_detected, extent: Extent::Contracted, ..at(p, since) });
            (o.rate_density, o.tv_density)
        };
        let [(masked, smooth), (detected, sharp)] = [false, true].map(|d| rates(0.1, None, d));
        assert!(detected > 2.0 * masked && sharp < 0.5 * smooth);
        assert_eq!(rates(0.3, Some(0.2), true), rates(0.3, Some(0.2), false), "once it is decided");
    }

    #[test]
    fn rays_inside_masks_are_favoured_less_and_less() {
        let mut c = Options::default();
        c.refraction.mask_ray_fraction = 0.4;
        let share = |p| (100.0 * mask_ray_fraction(&c, at(p, Some(0.2)))).round();
        assert_eq!([0.2, 0.6, 1.0, 1.1].map(share), [40.0, 20.0, 0.0, 0.0]);
    }
}
