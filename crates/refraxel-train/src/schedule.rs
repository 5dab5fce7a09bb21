//! What changes during training: resolution, learning rates, priors.

use crate::backend::{AbsorptionObjective, IndexObjective, Marching, Objective, ReflectionObjective};
use crate::model::MirrorSource;
use crate::options::Options;
use refraxel_core::{Domain, Extent};
use serde::{Deserialize, Serialize};

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
    pub fn scheduled(self, held: Option<Held>) -> Self {
        let Some(Held { at, until }) = held else { return self };
        let done = (self.0 - until).max(0.0) / (1.0 - until).max(f64::EPSILON);
        Self(at + (1.0 - at) * done.min(1.0))
    }

    /// The stage (from 0) that this point belongs to.
    pub fn stage(self, options: &Options) -> u32 {
        (0..options.grid.stages).rev().find(|&s| self.0 >= stage_start(options, s)).unwrap_or(0)
    }
}

/// The schedule was held while something else than steps was done: a coarse grid must not end before it has learned. Or it began
/// again, because rays stay straight that were to bend.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Held {
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
    /// How far the field reaches.
    pub extent: Extent,
}

impl Moment {
    /// The phase that this point belongs to.
    pub fn phase(self, options: &Options) -> Phase {
        match self.bends_since {
            None => Phase::Straight,
            Some(since) if self.progress.0 < since + options.refraction.index_alone_share => Phase::Index,
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

/// Where a stage starts, theory (4.9): each before the last takes `stage_share` of what is left.
fn stage_start(options: &Options, stage: u32) -> f64 {
    1.0 - (1.0 - options.grid.stage_share).powi(stage as i32)
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
        min_optical_depth: options.march.min_optical_depth,
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
    let mirrors = reflection_objective(options, moment);
    let absorption = absorption_objective(options, moment);
    match moment.phase(options) {
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
            let tv_density = straight.tv_density * options.field.tv_density_refractive;
            let reflection = mirroring.then_some(mirrors);
            Objective { index, reflection, absorption, tv_density, ..straight }
        }
    }
}

/// The error of pictures alone, of which nothing learns but poses.
pub fn picture_objective(marching: Marching) -> Objective {
    Objective {
        marching,
        bent_weight: 1.0,
        sparsity: 0.0,
        opacity: 0.0,
        tv_density: 0.0,
        tv_colour: 0.0,
        tv_period: 1,
        rate_density: 0.0,
        rate_colour: 0.0,
        rate_view: 0.0,
        rate_background: 0.0,
        index: None,
        reflection: None,
        absorption: None,
    }
}

/// The objective of a field before which nothing refracts or mirrors.
fn straight_objective(options: &Options, near: f32, moment: Moment) -> Objective {
    let (field, p) = (&options.field, moment.progress.0.clamp(0.0, 1.0) as f32);
    let warm = if field.warm_up > 0.0 { (0.1 + 0.9 * p / field.warm_up).min(1.0) } else { 1.0 };
    let decay = warm * field.rate_decay.powf(p);
    let tv = field.tv_decay.powf(p);
    Objective {
        marching: training_marching(options, near),
        bent_weight: options.refraction.bent_weight,
        sparsity: field.sparsity,
        opacity: field.opacity,
        tv_density: field.tv_density * tv,
        tv_colour: field.tv_colour * tv,
        tv_period: field.tv_period,
        rate_density: field.rate_density * decay,
        rate_colour: field.rate_colour * decay,
        rate_view: view_share(options, moment),
        rate_background: field.rate_background * decay,
        index: None,
        reflection: None,
        absorption: None,
    }
}

/// Share of its rate at which the view-dependent part of colour learns: delayed where rays bend, theory (4.8), but for surroundings
/// without bounds. Few views see each place of them, and colour that does not depend on the view explains those by fog and blur.
fn view_share(options: &Options, moment: Moment) -> f32 {
    let warm_up = options.field.view_warm_up;
    let is_delayed = moment.bends && moment.extent == Extent::Bounded && warm_up > 0.0;
    if is_delayed { (moment.progress.0.clamp(0.0, 1.0) as f32 / warm_up).min(1.0) } else { 1.0 }
}

/// Least fraction of rays inside masks in a batch. It falls while rays bend: at first shape and index must be found.
pub fn mask_ray_fraction(options: &Options, moment: Moment) -> f64 {
    let over = f64::from(moment.bent_share());
    options.refraction.mask_ray_fraction * (1.0 + (options.refraction.mask_ray_decay - 1.0) * over)
}

/// How mirrors and clearcoats learn. Mirrors have been there since rays bend, clearcoats for most of the run.
fn reflection_objective(options: &Options, moment: Moment) -> ReflectionObjective {
    let over = if moment.bends_since.is_some() { moment.bent_share() } else { 0.0 };
    let decay = options.field.rate_decay.powf(over);
    let learned = options.reflection.cache == MirrorSource::Learned;
    ReflectionObjective {
        rate: if learned { options.reflection.rate * decay } else { 0.0 },
        rate_strength: options.reflection.rate_strength * decay,
        rate_clearcoat: options.clearcoat.rate * options.field.rate_decay.powf(moment.progress.0 as f32),
    }
}

/// How bodies learn what they absorb, from the first bent ray on.
fn absorption_objective(options: &Options, moment: Moment) -> Option<AbsorptionObjective> {
    let rate = options.absorption.rate * options.field.rate_decay.powf(moment.bent_share());
    (options.absorption.enabled.is_on() && rate > 0.0).then_some(AbsorptionObjective { rate })
}

/// How the index learns when this share of the time with bent rays is over.
pub(crate) fn index_objective(options: &Options, over: f32) -> IndexObjective {
    let decay = options.field.rate_decay.powf(over);
    IndexObjective {
        rate: options.index.rate * decay,
        surface_rate: options.surface.rate * decay,
        surface_blur: options.surface.blur,
        surface_smooth: options.surface.smooth * decay,
        silhouette: options.surface.silhouette,
        surface_events: options.surface.events,
        index_events: options.index.events,
        blur: options.index.blur,
        clip: options.index.clip,
        variation: (options.index.variation, options.index.variation_penalty.into()),
        deviation: (options.index.deviation, options.index.deviation_penalty.into()),
        largest: options.index.largest,
        trust: options.index.trust,
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
        let at = |p: f64, at: f64, until: f64| Progress(p).scheduled(Some(Held { at, until })).0;
        let once = [0.1, 0.4, 0.7, 1.0].map(|p| at(p, 0.1, 0.4));
        assert!(is_near(&once, &[0.1, 0.1, 0.55, 1.0]), "{once:?}");
        // Held once more: it goes on from there.
        let twice = [0.85, 0.925, 1.0].map(|p| at(p, once[2], 0.85));
        assert!(is_near(&twice, &[0.55, 0.775, 1.0]), "{twice:?}");
        assert_eq!(Progress(0.25).scheduled(None), Progress(0.25));
        assert_eq!(at(1.0, 0.2, 2.0), 0.2, "a budget that became smaller");
    }

    fn at(progress: f64, bends_since: Option<f64>) -> Moment {
        Moment { progress: Progress(progress), bends_since, bends: true, extent: Extent::Bounded }
    }

    #[test]
    fn rays_bend_after_some_steps_or_a_share_of_short_runs_then_the_index_learns_first() {
        let mut c = Options::default();
        (c.refraction.straight_steps, c.refraction.index_alone_share) = (50, 0.1);
        let bends = |step, p| is_time_to_bend(&c, step, Progress(p));
        assert!(!bends(49, 0.2) && bends(50, 0.01) && bends(3, 0.25));
        let phase = |p| at(p, Some(0.2)).phase(&c);
        assert_eq!([phase(0.2), phase(0.29), phase(0.31)], [Phase::Index, Phase::Index, Phase::Joint]);
        assert_eq!(at(0.9, None).phase(&c), Phase::Straight);
    }

    #[test]
    fn rates_rise_then_fall_to_the_decay() {
        let c = Options::default();
        let straight = |p| Moment { bends: false, ..at(p, None) };
        let rate = |p| objective(&c, 0.0, straight(p)).rate_density;
        assert!(rate(0.0) < 0.2 * c.field.rate_density && rate(0.02) > 0.8 * c.field.rate_density);
        assert!((rate(1.0) / c.field.rate_density - c.field.rate_decay).abs() < 1e-6);
        let view = |view_warm_up, p| {
            let mut options = c.clone();
            options.field.view_warm_up = view_warm_up;
            view_share(&options, at(p, None))
        };
        assert_eq!([view(0.5, 0.0), view(0.5, 0.25), view(0.5, 0.8), view(0.0, 0.0)], [0.0, 0.5, 1.0, 1.0]);
        assert_eq!(view_share(&c, straight(0.0)), 1.0, "straight");
        let unbounded = |p, since| view_share(&c, Moment { extent: Extent::Contracted, ..at(p, since) });
        assert_eq!([unbounded(0.1, None), unbounded(0.2, Some(0.2))], [1.0; 2]);
    }

    #[test]
    fn rays_inside_masks_are_favoured_less_and_less() {
        let mut c = Options::default();
        (c.refraction.mask_ray_fraction, c.refraction.mask_ray_decay) = (0.4, 0.5);
        let share = |p| (100.0 * mask_ray_fraction(&c, at(p, Some(0.2)))).round();
        assert_eq!([0.2, 0.6, 1.0, 1.1].map(share), [40.0, 30.0, 20.0, 20.0]);
    }
}
