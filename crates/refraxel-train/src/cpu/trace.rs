//! The fused pass over a chunk of rays: trace, march, shade, compare, and march back while everything is in the cache.

use super::Scene;
use super::clearcoat::{self, CLEARCOAT};
use super::colour::{Lanes, prefetch_corners, shade, voxels};
use super::march::Sample;
use super::path_adjoint::{PathAdjoint, SegmentSums};
use super::reflection::{self, MirroredSample, Section};
use super::secondary::SecondScratch;
use super::tape::{Record, Tape};
use crate::backend::{Batch, Marching, Objective, StepOutcome};
use crate::reflection::MirrorSource;
use fearless_simd::Simd;
use fearless_simd_macros::simd;
use refraxel_core::optics::{PartialReflection, PartialReflectionAdjoint, Tracer};
use refraxel_core::priors::{cauchy_slope, opacity_beta_slope};
use refraxel_core::radiance::{Pixel, Segment};
use refraxel_core::{Background, Path, Ray, Vec3};
use std::ops::Range;

/// Rays marched before their samples are shaded: enough samples to prefetch across rays, few enough for the L2 cache.
const PACKET: usize = 8;
/// Samples between prefetch and use.
const AHEAD: usize = 4;

/// A segment that has samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct MarchedSegment {
    pub segment: Segment<f32>,
    /// Which segment of its path.
    pub place: u32,
    pub unit: Vec3<f32>,
    /// |p|.
    pub speed: f32,
    /// Arc length of the path up to t = 0 [scene unit].
    arc: f32,
    /// SH basis of the direction.
    pub basis: Lanes,
}

/// What marching found of one ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// End of its samples in the packet's.
    samples: usize,
    /// End of its partial reflections in the packet's.
    mirrored_samples: usize,
    /// Transmittance at its end.
    pub left: f32,
    /// The path bends.
    bent: bool,
    /// The ray that reaches the background.
    pub exit: Ray<f32>,
}

/// Per-thread memory of the pass.
#[derive(Default)]
pub(super) struct Scratch {
    samples: Vec<Sample>,
    pub marched: Vec<MarchedSegment>,
    found: Vec<Found>,
    /// The bent paths, one per ray of the packet.
    paths: [Path<f32>; PACKET],
    sums: SegmentSums,
    mirrored_samples: Vec<MirroredSample>,
    reflections: Vec<PartialReflection<f32>>,
    d_reflections: Vec<PartialReflectionAdjoint<f32>>,
    second: SecondScratch,
    density_gradients: Vec<Record>,
}

/// How a chunk traces its rays.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub scene: &'a Scene<'a>,
    pub marching: &'a Marching,
    /// Absent when all rays are straight.
    pub tracer: Option<Tracer<'a, f32>>,
}

impl<'a> View<'a> {
    fn new(scene: &'a Scene<'a>, marching: &'a Marching) -> Self {
        let tracer = (!scene.refraction.is_none())
            .then(|| scene.refraction.tracer(scene.marcher.domain(), marching.near));
        Self { scene, marching, tracer }
    }

    /// The tracer, where surfaces mirror.
    #[inline(always)]
    fn mirroring(&self) -> Option<&Tracer<'a, f32>> {
        self.tracer.as_ref().filter(|_| !self.scene.reflection.is_none())
    }

    /// What a straight ray sees in the clearcoat of what it ends at.
    #[inline(always)]
    fn reflection(
        &self,
        ray: &Ray<f32>,
        bent: bool,
        seen: (&[Sample], &[MarchedSegment], Range<usize>),
    ) -> Option<MirroredSample> {
        let clearcoat = self.scene.clearcoat.filter(|_| !bent)?;
        clearcoat::mirrored_sample(
            (self.scene, self.marching.min_optical_depth),
            clearcoat,
            ray.direction,
            seen,
        )
    }

    /// The samples of one ray, appended; where it bends, its path.
    #[inline(always)]
    pub fn march<S: Simd>(
        &self,
        simd: S,
        (ray, offset): (&Ray<f32>, f32),
        path: &mut Path<f32>,
        (samples, marched): (&mut Vec<Sample>, &mut Vec<MarchedSegment>),
    ) -> Found {
        let (scene, marcher) = (self.scene, self.scene.marcher);
        let mut front = marcher.start(offset, self.marching, samples);
        let bending = self.tracer.as_ref().filter(|_| scene.refraction.admits(ray));
        let mut exit = *ray;
        let straight;
        let segments = match bending {
            Some(tracer) => {
                tracer.trace_into(ray, path);
                exit = path.exit;
                &path.segments[..]
            }
            None => {
                straight = Segment::straight(ray, marcher.domain(), self.marching.near);
                straight.as_slice()
            }
        };
        let mut arc = 0.0;
        for (place, segment) in segments.iter().enumerate() {
            let speed = segment.momentum.length();
            if segment.range[0] < segment.range[1] {
                let marched_segment = marched.len() as u32;
                let out = (&mut front, &mut *samples);
                if marcher.march(simd, scene.field, (segment, marched_segment), self.marching, out) {
                    let unit = segment.momentum / speed;
                    let basis = scene.layout.basis(unit);
                    marched.push(MarchedSegment {
                        segment: *segment,
                        place: place as u32,
                        unit,
                        speed,
                        arc,
                        basis,
                    });
                }
                if front.opaque {
                    break;
                }
            }
            arc += speed * segment.range[1];
        }
        marcher.finish(simd, &scene.field.density, self.marching, (&mut front, samples));
        let (samples, left) = (samples.len(), front.transmittance);
        Found { samples, mirrored_samples: 0, left, bent: bending.is_some(), exit }
    }

    /// March and shade a packet of rays.
    #[inline(always)]
    fn march_packet<S: Simd, const BLOCKS: usize>(
        &self,
        simd: S,
        (rays, offsets): (&[Ray<f32>], &[f32]),
        scratch: &mut Scratch,
    ) {
        let Scratch { samples, marched, found, paths, mirrored_samples, reflections, .. } = scratch;
        samples.clear();
        marched.clear();
        found.clear();
        mirrored_samples.clear();
        for ((i, ray), path) in rays.iter().enumerate().zip(paths) {
            let (offset, first) = (offsets.get(i).copied().unwrap_or(0.5), samples.len());
            let mut of_ray = self.march(simd, (ray, offset), path, (samples, marched));
            if let Some(tracer) = self.mirroring().filter(|_| of_ray.bent) {
                let opaque = of_ray.left < self.marching.min_transmittance;
                let seen = (&samples[..], &marched[..], first..samples.len());
                reflection::find(
                    self.scene.reflection,
                    (tracer, path),
                    seen,
                    opaque,
                    (reflections, mirrored_samples),
                );
            }
            mirrored_samples.extend(self.reflection(
                ray,
                of_ray.bent,
                (samples, marched, first..samples.len()),
            ));
            of_ray.mirrored_samples = mirrored_samples.len();
            found.push(of_ray);
        }
        self.shade_all::<S, BLOCKS>(simd, samples, marched);
        if self.scene.reflection.source == MirrorSource::Exact {
            self.look_exactly::<S, BLOCKS>(simd, &mut scratch.second, &mut scratch.mirrored_samples);
        }
    }

    #[inline(always)]
    pub fn shade_all<S: Simd, const BLOCKS: usize>(
        &self,
        simd: S,
        samples: &mut [Sample],
        marched: &[MarchedSegment],
    ) {
        let colour = voxels::<BLOCKS>(&self.scene.field.colour);
        for s in samples.iter().take(AHEAD) {
            prefetch_corners(colour, &s.corners);
        }
        for k in 0..samples.len() {
            if let Some(next) = samples.get(k + AHEAD) {
                prefetch_corners(colour, &next.corners);
            }
            let s = &mut samples[k];
            let basis = &marched[s.segment as usize].basis;
            s.colour = shade::<S, BLOCKS>(simd, colour, &s.corners, &s.weights, (self.scene.layout, basis));
        }
    }
}

/// C = Σ T a c over the samples of one ray, theory (3.9).
#[inline(always)]
pub(super) fn composite(samples: &[Sample], marched: &[MarchedSegment], transmittance: f32) -> Pixel<f32> {
    let mut pixel = Pixel { colour: [0.0; 3], transmittance, depth: 0.0 };
    for s in samples {
        let weight = s.before * s.alpha;
        for c in 0..3 {
            pixel.colour[c] += weight * s.colour[c];
        }
        let marched_segment = &marched[s.segment as usize];
        pixel.depth += weight * (marched_segment.arc + marched_segment.speed * s.t);
    }
    pixel
}

/// Render rays over the background.
#[simd]
pub(super) fn render_chunk<S: Simd, const BLOCKS: usize>(
    simd: S,
    scene: &Scene,
    rays: &[Ray<f32>],
    marching: &Marching,
    out: &mut [Pixel<f32>],
) {
    let (view, mut scratch) = (View::new(scene, marching), Scratch::default());
    for (rays, out) in rays.chunks(PACKET).zip(out.chunks_mut(PACKET)) {
        view.march_packet::<S, BLOCKS>(simd, (rays, &[]), &mut scratch);
        let (mut first, mut mirrored_sample) = (0, 0);
        for (found, out) in scratch.found.iter().zip(out) {
            *out = composite(&scratch.samples[first..found.samples], &scratch.marched, found.left);
            let behind = scene.background.radiance(found.exit.origin, found.exit.direction);
            let mirrored_samples = &mut scratch.mirrored_samples[mirrored_sample..found.mirrored_samples];
            out.colour = shown(&scratch.samples, first..found.samples, mirrored_samples, (out, behind));
            (first, mirrored_sample) = (found.samples, found.mirrored_samples);
        }
    }
}

/// Record each sample's weight T a, for pruning, theory (4.11).
#[simd]
pub(super) fn weigh_chunk<S: Simd, const BLOCKS: usize>(
    simd: S,
    scene: &Scene,
    rays: &[Ray<f32>],
    marching: &Marching,
) -> Tape {
    let (view, mut scratch, mut tape) = (View::new(scene, marching), Scratch::default(), Tape::default());
    let Scratch { samples, marched, paths: [path, ..], .. } = &mut scratch;
    for ray in rays {
        samples.clear();
        marched.clear();
        view.march(simd, (ray, 0.5), path, (samples, marched));
        tape.records.extend(samples.iter().map(|s| Record {
            cell: s.cell,
            fraction: s.fraction,
            basis: 0,
            d_theta: s.before * s.alpha,
            d_colour: [0.0; 3],
        }));
    }
    tape.sort(&scene.field.map);
    tape
}

/// Forward and adjoint of a range of a batch: the records that the update needs, and each ray's own gradient if
/// `ray_gradients` has room for it.
#[simd]
pub(super) fn learn_chunk<S: Simd, const BLOCKS: usize>(
    simd: S,
    scene: &Scene,
    batch: &Batch,
    range: Range<usize>,
    objective: &Objective,
    (tape, ray_gradients): (&mut Tape, &mut [(Vec3<f32>, Vec3<f32>)]),
) -> StepOutcome {
    tape.clear();
    let mut outcome = StepOutcome { finite: true, ..Default::default() };
    let (view, mut scratch) = (View::new(scene, &objective.marching), Scratch::default());
    let most_events = objective.index.map_or(usize::MAX, |o| o.most_events as usize);
    for start in range.clone().step_by(PACKET) {
        let packet = start..(start + PACKET).min(range.end);
        let rays = (&batch.rays[packet.clone()], &batch.offset[packet.clone()]);
        view.march_packet::<S, BLOCKS>(simd, rays, &mut scratch);
        outcome.samples += scratch.samples.len() as u64;
        let Scratch {
            samples: all,
            marched,
            found,
            paths,
            sums,
            mirrored_samples,
            d_reflections,
            density_gradients,
            ..
        } = &mut scratch;
        let (mut first, mut mirrored_sample) = (0, 0);
        for ((ray, found), path) in packet.clone().zip(found).zip(paths) {
            let (own, mirrored_samples) =
                (first..found.samples, &mut mirrored_samples[mirrored_sample..found.mirrored_samples]);
            (first, mirrored_sample) = (found.samples, found.mirrored_samples);
            let pixel = composite(&all[own.clone()], marched, found.left);
            let seen = (&all[..], own.clone(), &mut *mirrored_samples);
            let d = compare(scene, (batch, ray), seen, (pixel, &found.exit), objective, tape);
            outcome.squared_error += d.squared_error;
            let records = tape.records.len();
            density_gradients.clear();
            if let (Some(clearcoat), Some(g)) =
                (scene.clearcoat, mirrored_samples.first().filter(|g| g.of.region == CLEARCOAT))
            {
                let d = clearcoat::adjoint((clearcoat, scene.reflection.source), &g.of, g.d());
                let clearcoat = (clearcoat, batch.rays[ray].direction);
                let least = objective.marching.min_optical_depth;
                clearcoat::look_back(
                    (scene, least),
                    clearcoat,
                    &d,
                    (&mut all[own.clone()], marched),
                    density_gradients,
                );
            }
            for section in
                reflection::sections(own.clone(), mirrored_samples, (d.at_exit, d.behind), d.colour)
            {
                let left = (d.last, d.transmittance);
                march_back(
                    (&all[section.samples.clone()], marched),
                    &section,
                    left,
                    objective.sparsity,
                    tape,
                );
            }
            tape.records[records..].reverse();
            tape.records.append(density_gradients);
            let wanted = ray_gradients.get_mut(ray - range.start);
            let bent = view.tracer.as_ref().filter(|_| found.bent).map(|t| (t, &*path));
            let counts = bent.is_some_and(|(_, path)| path.events().count() <= most_events);
            if wanted.is_none() && !(counts && objective.index.is_some()) {
                continue;
            }
            let d_exit = background_vjp(scene, batch, &found.exit, &d);
            let made = (&all[own], &tape.records[records..], &marched[..]);
            if bent.is_some() {
                reflection::reflection_adjoints(scene.reflection, mirrored_samples, d_reflections);
            }
            let (ray, all) = (&batch.rays[ray], wanted.is_some());
            let adjoint = PathAdjoint { ray, d_exit, all, counts, d_reflections };
            let d_ray = adjoint.run::<S, BLOCKS>(simd, scene, made, bent, (sums, &mut tape.index_samples));
            if let Some(wanted) = wanted {
                *wanted = d_ray;
            }
        }
    }
    tape.sort(&scene.field.map);
    outcome
}

/// Where the adjoint of a ray starts.
struct PixelAdjoint {
    squared_error: f64,
    colour: [f32; 3],
    /// dLoss/d(what the background shows) for a transmittance of 1.
    at_exit: [f32; 3],
    transmittance: f32,
    behind: [f32; 3],
    last: f32,
}

/// C + T B of a ray, with what surfaces mirror: theory (3.9), (7.5).
#[inline(always)]
pub(super) fn shown(
    samples: &[Sample],
    range: Range<usize>,
    mirrored_samples: &mut [MirroredSample],
    (pixel, behind): (&Pixel<f32>, [f32; 3]),
) -> [f32; 3] {
    if !mirrored_samples.is_empty() {
        return reflection::composite(samples, range, mirrored_samples, behind);
    }
    [0, 1, 2].map(|c| pixel.colour[c] + pixel.transmittance * behind[c])
}

/// Compare a ray with its target: loss, its adjoint, the gradient of the background.
#[inline(always)]
fn compare(
    scene: &Scene,
    (batch, ray): (&Batch, usize),
    (samples, range, mirrored_samples): (&[Sample], Range<usize>, &mut [MirroredSample]),
    (pixel, exit): (Pixel<f32>, &Ray<f32>),
    objective: &Objective,
    tape: &mut Tape,
) -> PixelAdjoint {
    let (target, left) = (batch.target[ray], pixel.transmittance);
    let given = batch.behind.get(ray);
    let behind = given.copied().unwrap_or_else(|| scene.background.radiance(exit.origin, exit.direction));
    let (mut colour, mut squared_error) = ([0.0; 3], 0.0);
    let first = range.start;
    let shown = shown(samples, range, mirrored_samples, (&pixel, behind));
    for c in 0..3 {
        let error = shown[c] - target[c];
        squared_error += f64::from(error * error);
        colour[c] = 2.0 * error;
    }
    let at_exit = reflection::look_back((samples, first), mirrored_samples, colour, tape);
    if let (None, Background::Environment(map)) = (given, scene.background) {
        let stencil = map.stencil(exit.direction);
        for k in 0..4 {
            let w = left * stencil.weight[k];
            tape.texels.push((stencil.index[k] as u32, at_exit.map(|g| w * g)));
        }
    }
    let transmittance =
        if objective.opacity > 0.0 { objective.opacity * opacity_beta_slope(left) } else { 0.0 };
    PixelAdjoint { squared_error, colour, at_exit, transmittance, behind, last: left }
}

/// The sweep from the back: one record per sample, from the last on, theory (3.10)–(3.13). The twin of [`composite`].
#[inline(always)]
fn march_back(
    (samples, marched): (&[Sample], &[MarchedSegment]),
    d: &Section,
    (last, d_transmittance): (f32, f32),
    sparsity: f32,
    tape: &mut Tape,
) {
    let mut marched_segment = u32::MAX;
    let (mut behind, d_colour_ray, mut d_weight_behind) = (d.behind, d.d_colour, 0.0);
    for s in samples.iter().rev() {
        if s.segment != marched_segment {
            marched_segment = s.segment;
            tape.bases.push(marched[marched_segment as usize].basis);
        }
        let mut contrast = s.d_weight - d_weight_behind;
        d_weight_behind += s.alpha * contrast;
        let mut d_colour = [0.0; 3];
        for c in 0..3 {
            contrast += d_colour_ray[c] * (s.colour[c] - behind[c]);
            // A colour clamped at 0 has no slope.
            d_colour[c] = if s.colour[c] > 0.0 { s.before * s.alpha * d_colour_ray[c] } else { 0.0 };
            behind[c] += s.alpha * (s.colour[c] - behind[c]);
        }
        let mut d_tau = s.before * (1.0 - s.alpha) * contrast - last * d_transmittance;
        if sparsity > 0.0 {
            d_tau += sparsity * cauchy_slope(s.tau);
        }
        tape.records.push(Record {
            cell: s.cell,
            fraction: s.fraction,
            basis: tape.bases.len() as u32 - 1,
            d_theta: d_tau * s.slope,
            d_colour,
        });
    }
}

/// dLoss/d(direction) of the exit ray through the background.
fn background_vjp(scene: &Scene, batch: &Batch, exit: &Ray<f32>, d: &PixelAdjoint) -> Vec3<f32> {
    let Background::Environment(map) = scene.background else { return Vec3::zero() };
    if !batch.behind.is_empty() {
        return Vec3::zero();
    }
    let unit = exit.direction;
    let free = map.radiance_vjp(unit, d.at_exit.map(|g| g * d.last));
    free - unit * unit.dot(free)
}
