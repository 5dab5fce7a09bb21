//! What rays show: forward passes of rays that are straight and of those that may bend and be mirrored.

use crate::GpuError;
use crate::backend::GpuBackend;
use crate::bending::{Bending, Paths, follow};
use crate::coats::{self, Coat};
use crate::constants::{COATED, MIRRORS, STATUS_CUT};
use crate::memory::Buffers;
use crate::pools::workgroups;
use crate::reflections::{self, Found};
use crate::step::RayBuffers;
use crate::task::{Lesson, Seen, Task};
use refraxel_core::Ray;
use refraxel_train::Refraction;
use refraxel_train::backend::{Layers, Marching};
use refraxel_train::bake::Through;
use refraxel_train::model::{MAX_SEGMENTS, MirrorSource};
use refraxel_train::second_rays;

/// Which light rays show, and how they go.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Showing {
    pub layers: Layers,
    pub through: Through,
    /// Segments that a path may have.
    pub most_segments: usize,
}

impl Showing {
    /// What a camera sees of these layers.
    pub(crate) fn layers(layers: Layers) -> Self {
        Self { layers, through: Through::Bent, most_segments: MAX_SEGMENTS }
    }

    /// What probes see: nothing that surfaces mirror.
    pub(crate) fn of_probes(through: Through) -> Self {
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

impl GpuBackend {
    /// What a portion of rays shows.
    pub(crate) fn show(
        &self,
        rays: &[Ray<f32>],
        marching: &Marching,
        showing: Showing,
    ) -> Result<Vec<Seen>, GpuError> {
        self.check_steps(marching, self.forward_loops())?;
        let (gpu, mut buffers, straight) = (&self.gpu, RayBuffers::default(), Refraction::none());
        let bends = showing.through == Through::Bent && !self.held.refraction.is_none();
        let refraction = if bends { &self.held.refraction } else { &straight };
        buffers.fill(gpu, &Lesson::of_rays(rays, refraction), false)?;
        let mut task = Task::marching(marching, &self.held, rays.len());
        let source = reflections::source(&self.held, showing.layers);
        task.wants |= reflections::wants(&self.held, source);
        if !bends || task.wants & COATED != 0 {
            coats::fit(gpu, &mut buffers.buffers, &task)?;
            let straight = StraightForward { task, source, marching: *marching };
            self.forward_straight(&straight, &[&self.buffers, &buffers.buffers])?;
        }
        if bends {
            let paths = Paths::standing(gpu, rays.len())?;
            let portion = Bending::shown(gpu, &self.held, marching, rays.len()).up_to(showing.most_segments);
            let of = [&self.buffers, &buffers.buffers, &paths.buffers];
            let forward = Forward { portion, task, source, marching: *marching, of: &of };
            self.forward(&forward, &mut Found::default())?;
        }
        if task.wants & MIRRORS != 0 {
            // The one kernel that may be left after paths were followed.
            self.check_end()?;
        }
        buffers.buffers.read(gpu, "seen", rays.len())
    }

    /// Whether the device has left loops before their end.
    fn check_end(&self) -> Result<(), GpuError> {
        if self.buffers.read_word(&self.gpu, "status", STATUS_CUT)? == 0 {
            Ok(())
        } else {
            Err(GpuError::cut_short(&self.gpu))
        }
    }

    /// Render straight rays, with what a clearcoat mirrors into them.
    pub(crate) fn forward_straight(
        &self,
        forward: &StraightForward,
        of: &[&Buffers],
    ) -> Result<(), GpuError> {
        let (gpu, task) = (&self.gpu, forward.task);
        let groups = workgroups(task.rays as usize);
        self.buffers.write(gpu, "task", &[task]);
        let mut encoder = self.encoder();
        self.kernels.render.run(gpu, &mut encoder, of, groups);
        if task.wants & COATED != 0 {
            let (coat, bending) =
                (self.kernels.coat(gpu)?, Bending::shown(gpu, &self.held, &forward.marching, 0));
            self.buffers.write(gpu, "bending", &[bending]);
            coat.face.run(gpu, &mut encoder, of, groups);
            if forward.source == Some(MirrorSource::Exact) {
                gpu.queue.submit([encoder.finish()]);
                self.look_exactly_from_coats(of, task.rays as usize, &forward.marching)?;
                self.buffers.write(gpu, "task", &[task]);
                self.buffers.write(gpu, "bending", &[bending]);
                encoder = self.encoder();
            }
            coat.coat.run(gpu, &mut encoder, of, groups);
        }
        gpu.queue.submit([encoder.finish()]);
        Ok(())
    }

    /// Render a portion of rays that may bend, with what surfaces mirror into them; the dispatches that the longest path needed.
    pub(crate) fn forward(&self, forward: &Forward, found: &mut Found) -> Result<usize, GpuError> {
        let Forward { portion, task, of, .. } = forward;
        let (gpu, rays, before) = (&self.gpu, portion.rays as usize, found.dispatches);
        let with = |found: &Buffers, kernel| {
            let all: Vec<&Buffers> = of.iter().copied().chain([found]).collect();
            follow(gpu, kernel, &all, portion, before)
        };
        self.buffers.write(gpu, "task", &[*task]);
        let render = &self.kernels.bent(gpu)?.render;
        if task.wants & MIRRORS == 0 {
            found.bind_nothing(gpu)?;
            found.dispatches = with(&found.buffers, render)?.dispatches;
            return Ok(found.dispatches);
        }
        let mirrors = self.kernels.mirrors(gpu)?;
        let count = found.fill(gpu, &self.buffers, rays, |found| with(found, &mirrors.find))?;
        found.dispatches = with(&found.buffers, render)?.dispatches;
        if forward.source == Some(MirrorSource::Exact) {
            self.look_exactly(found, rays..count, &forward.marching)?;
            self.buffers.write(gpu, "task", &[*task]);
            self.buffers.write(gpu, "bending", &[*portion]);
        }
        let mut encoder = self.encoder();
        let all: Vec<&Buffers> = of.iter().copied().chain([&found.buffers]).collect();
        mirrors.mirror.run(gpu, &mut encoder, &all, workgroups(rays));
        gpu.queue.submit([encoder.finish()]);
        Ok(found.dispatches)
    }

    /// Give the reflections that were found what a second ray through the field shows, without further reflections.
    fn look_exactly(
        &self,
        found: &Found,
        range: std::ops::Range<usize>,
        marching: &Marching,
    ) -> Result<(), GpuError> {
        let (medium, voxel) = (&self.held.refraction.medium, self.held.field.domain.voxel());
        let mut all = found.read(&self.gpu, range.start, range.end)?;
        let ray = |r: &reflections::Reflection| {
            let mirrored = Ray { origin: r.position.into(), direction: r.direction.into() };
            let away = second_rays::distance(medium, voxel, Some(r.region as usize));
            second_rays::lifted(mirrored, r.normal.into(), away)
        };
        let rays: Vec<Ray<f32>> = all.iter().map(ray).collect();
        for (r, light) in all.iter_mut().zip(self.second_rays(&rays, marching)?) {
            r.light = light;
        }
        found.write(&self.gpu, range.start, &all);
        Ok(())
    }

    /// The same for the surfaces at which straight rays end.
    fn look_exactly_from_coats(
        &self,
        of: &[&Buffers],
        rays: usize,
        marching: &Marching,
    ) -> Result<(), GpuError> {
        let (medium, voxel) = (&self.held.refraction.medium, self.held.field.domain.voxel());
        let Some(buffers) = of.iter().find(|b| b.get("coats").is_some()) else { return Ok(()) };
        let mut all: Vec<Coat> = buffers.read(&self.gpu, "coats", rays)?;
        let away = second_rays::distance(medium, voxel, None);
        let ray = |c: &Coat| {
            let mirrored = Ray { origin: c.position.into(), direction: c.direction.into() };
            second_rays::lifted(mirrored, c.normal.into(), away)
        };
        let rays: Vec<Ray<f32>> = all.iter().filter(|c| c.is_there != 0).map(ray).collect();
        let seen = self.second_rays(&rays, marching)?;
        for (c, light) in all.iter_mut().filter(|c| c.is_there != 0).zip(seen) {
            c.light = light;
        }
        buffers.write(&self.gpu, "coats", &all);
        Ok(())
    }

    /// What rays from surfaces show.
    fn second_rays(&self, rays: &[Ray<f32>], marching: &Marching) -> Result<Vec<[f32; 3]>, GpuError> {
        let most_segments = self.held.refraction.secondary_segments();
        let showing = Showing { most_segments, ..Showing::layers(Layers::Transmitted) };
        let (marching, mut out) = (Marching { near: 0.0, ..*marching }, Vec::with_capacity(rays.len()));
        for rays in rays.chunks(self.portion()) {
            out.extend(self.show(rays, &marching, showing)?.into_iter().map(|seen| seen.colour));
        }
        Ok(out)
    }
}
