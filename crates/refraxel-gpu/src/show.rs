//! What rays show: forward passes of rays that are straight and of those that may bend and be mirrored.

use crate::bending::{Bending, Paths, follow};
use crate::coats::{self, Coat};
use crate::constants::{COATED, MIRRORS, STATUS_CUT};
use crate::error::GpuError;
use crate::loaded::LoadedModel;
use crate::memory::Buffers;
use crate::rays::RayBuffers;
use crate::reflections::{self, Found};
use crate::task::{Lesson, Seen, Task};
use refraxel_core::Ray;
use refraxel_train::Refraction;
use refraxel_train::backend::{Layers, Marching};
use refraxel_train::bake::RayKind;
use refraxel_train::model::{MAX_SEGMENTS, MirrorSource};
use refraxel_train::second_rays;

/// Which light rays show, and how they go.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Showing {
    pub layers: Layers,
    pub through: RayKind,
    /// Segments that a path may have.
    pub most_segments: usize,
}

impl Showing {
    /// What a camera sees of these layers.
    pub(crate) fn layers(layers: Layers) -> Self {
        Self { layers, through: RayKind::Bent, most_segments: MAX_SEGMENTS }
    }

    /// What probes see: nothing that surfaces mirror.
    pub(crate) fn of_probes(through: RayKind) -> Self {
        Self { through, ..Self::layers(Layers::Transmitted) }
    }
}

/// A portion of rays that may bend, on their way forward.
pub(crate) struct Forward<'a> {
    pub portion: Bending,
    pub task: Task,
    /// Where the mirrored light comes from.
    pub source: Option<MirrorSource>,
    pub marching: Marching,
    /// Buffers of the model, the rays and the paths.
    pub of: &'a [&'a Buffers],
}

/// Straight rays on their way forward.
pub(crate) struct StraightForward {
    pub task: Task,
    /// Where the mirrored light comes from.
    pub source: Option<MirrorSource>,
    pub marching: Marching,
}

/// What a portion of rays shows.
pub(crate) fn show(
    model: &LoadedModel,
    rays: &[Ray<f32>],
    marching: &Marching,
    showing: Showing,
) -> Result<Vec<Seen>, GpuError> {
    model.check_steps(marching, model.forward_loops())?;
    let (device, mut buffers, straight) = (model.device(), RayBuffers::default(), Refraction::none());
    let bends = showing.through == RayKind::Bent && !model.held.refraction.is_none();
    let refraction = if bends { &model.held.refraction } else { &straight };
    buffers.fill(device, &Lesson::of_rays(rays, refraction), false)?;
    let mut task = Task::marching(marching, &model.held, rays.len());
    let source = reflections::source(&model.held, showing.layers);
    task.wants |= reflections::wants(&model.held, source);
    if !bends || task.wants & COATED != 0 {
        coats::fit(device, &mut buffers.buffers, &task)?;
        let straight = StraightForward { task, source, marching: *marching };
        forward_straight(model, &straight, &[&model.buffers, &buffers.buffers])?;
    }
    if bends {
        let paths = Paths::standing(device, rays.len())?;
        let portion = Bending::shown(device, &model.held, marching, rays.len()).up_to(showing.most_segments);
        let of = [&model.buffers, &buffers.buffers, &paths.buffers];
        let bent = Forward { portion, task, source, marching: *marching, of: &of };
        forward(model, &bent, &mut Found::default())?;
    }
    if task.wants & MIRRORS != 0 {
        // The one kernel that may be left after paths were followed.
        check_end(model)?;
    }
    buffers.buffers.read(device, "seen", rays.len())
}

/// Whether the device has left loops before their end.
fn check_end(model: &LoadedModel) -> Result<(), GpuError> {
    if model.buffers.read_word(model.device(), "status", STATUS_CUT)? == 0 {
        Ok(())
    } else {
        Err(model.device().cut_short())
    }
}

/// Render straight rays, with what a clearcoat mirrors into them.
pub(crate) fn forward_straight(
    model: &LoadedModel,
    forward: &StraightForward,
    of: &[&Buffers],
) -> Result<(), GpuError> {
    let (device, task) = (model.device(), forward.task);
    let rays = task.rays as usize;
    model.buffers.write(device, "task", &[task]);
    let mut encoder = device.encoder();
    model.kernels.render.run(device, &mut encoder, of, rays);
    if task.wants & COATED != 0 {
        let coat = model.kernels.coat(device)?;
        let bending = Bending::shown(device, &model.held, &forward.marching, 0);
        model.buffers.write(device, "bending", &[bending]);
        coat.face.run(device, &mut encoder, of, rays);
        if forward.source == Some(MirrorSource::Exact) {
            device.submit(encoder);
            look_exactly_from_coats(model, of, rays, &forward.marching)?;
            model.buffers.write(device, "task", &[task]);
            model.buffers.write(device, "bending", &[bending]);
            encoder = device.encoder();
        }
        coat.coat.run(device, &mut encoder, of, rays);
    }
    device.submit(encoder);
    Ok(())
}

/// Render a portion of rays that may bend, with what surfaces mirror into them; the dispatches that the longest path needed.
pub(crate) fn forward(model: &LoadedModel, forward: &Forward, found: &mut Found) -> Result<usize, GpuError> {
    let Forward { portion, task, of, .. } = forward;
    let (device, rays, before) = (model.device(), portion.rays as usize, found.dispatches);
    let with = |found: &Buffers, kernel| {
        let all: Vec<&Buffers> = of.iter().copied().chain([found]).collect();
        follow(device, kernel, &all, portion, before)
    };
    model.buffers.write(device, "task", &[*task]);
    let render = &model.kernels.bent(device)?.render;
    if task.wants & MIRRORS == 0 {
        found.bind_nothing(device)?;
        found.dispatches = with(&found.buffers, render)?.dispatches;
        return Ok(found.dispatches);
    }
    let mirrors = model.kernels.mirrors(device)?;
    let count = found.fill(device, &model.buffers, rays, |found| with(found, &mirrors.find))?;
    found.dispatches = with(&found.buffers, render)?.dispatches;
    if forward.source == Some(MirrorSource::Exact) {
        look_exactly(model, found, rays..count, &forward.marching)?;
        model.buffers.write(device, "task", &[*task]);
        model.buffers.write(device, "bending", &[*portion]);
    }
    let mut encoder = device.encoder();
    let all: Vec<&Buffers> = of.iter().copied().chain([&found.buffers]).collect();
    mirrors.mirror.run(device, &mut encoder, &all, rays);
    device.submit(encoder);
    Ok(found.dispatches)
}

/// Give the reflections that were found what a second ray through the field shows, without further reflections.
fn look_exactly(
    model: &LoadedModel,
    found: &Found,
    range: std::ops::Range<usize>,
    marching: &Marching,
) -> Result<(), GpuError> {
    let (medium, voxel) = (&model.held.refraction.medium, model.held.field.domain.voxel());
    let mut all = found.read(model.device(), range.start, range.end)?;
    let ray = |r: &reflections::Reflection| {
        let mirrored = Ray { origin: r.position.into(), direction: r.direction.into() };
        let away = second_rays::distance(medium, voxel, Some(r.region as usize));
        second_rays::lifted(mirrored, r.normal.into(), away)
    };
    let rays: Vec<Ray<f32>> = all.iter().map(ray).collect();
    for (r, light) in all.iter_mut().zip(second_rays(model, &rays, marching)?) {
        r.light = light;
    }
    found.write(model.device(), range.start, &all);
    Ok(())
}

/// The same for the surfaces at which straight rays end.
fn look_exactly_from_coats(
    model: &LoadedModel,
    of: &[&Buffers],
    rays: usize,
    marching: &Marching,
) -> Result<(), GpuError> {
    let (medium, voxel) = (&model.held.refraction.medium, model.held.field.domain.voxel());
    let Some(buffers) = of.iter().find(|b| b.get("coats").is_some()) else { return Ok(()) };
    let mut all: Vec<Coat> = buffers.read(model.device(), "coats", rays)?;
    let away = second_rays::distance(medium, voxel, None);
    let ray = |c: &Coat| {
        let mirrored = Ray { origin: c.position.into(), direction: c.direction.into() };
        second_rays::lifted(mirrored, c.normal.into(), away)
    };
    let rays: Vec<Ray<f32>> = all.iter().filter(|c| c.is_there != 0).map(ray).collect();
    let seen = second_rays(model, &rays, marching)?;
    for (c, light) in all.iter_mut().filter(|c| c.is_there != 0).zip(seen) {
        c.light = light;
    }
    buffers.write(model.device(), "coats", &all);
    Ok(())
}

/// What rays from surfaces show.
fn second_rays(
    model: &LoadedModel,
    rays: &[Ray<f32>],
    marching: &Marching,
) -> Result<Vec<[f32; 3]>, GpuError> {
    let most_segments = model.held.refraction.secondary_segments();
    let showing = Showing { most_segments, ..Showing::layers(Layers::Transmitted) };
    let (marching, mut out) = (Marching { near: 0.0, ..*marching }, Vec::with_capacity(rays.len()));
    for rays in rays.chunks(model.portion()) {
        out.extend(show(model, rays, &marching, showing)?.into_iter().map(|seen| seen.colour));
    }
    Ok(out)
}
