//! Probes look at the field, theory (7.9), and secondary rays.

use super::CpuBackend;
use super::trace::render_chunk;
use super::{CHUNK, Scene, colour, with_blocks};
use crate::backend::Marching;
use crate::index_edit::half_way_index;
use crate::reflection::{MirrorSource, Reflection};
use crate::refraction::Refraction;
use fearless_simd::dispatch;
use rayon::prelude::*;
use refraxel_core::optics::PathEnd;
use refraxel_core::radiance::{Pixel, probes::even_direction};
use refraxel_core::{Domain, IndexGrid, LevelSet, Path, Ray, Vec3};

/// Directions in which a probe looks: 16 per coefficient of degree 3.
const DIRECTIONS: usize = 256;
/// Distance from the surface inside a body from which probes outside look into it [voxel of the level set].
const MARGIN: f32 = 1.0;
/// Probes farther from a surface than this are asked by no ray [distance of neighbouring probes]: the diagonal of a cell.
const REACH: f32 = 1.8;

/// Probes of a clearcoat that look at the same time: bounds the memory of their rays.
const PORTION: usize = 256;

/// A probe of a region, and from where it looks.
struct Lookout {
    region: usize,
    probe: usize,
    position: Vec3<f32>,
}

impl Lookout {
    fn rays(&self) -> impl Iterator<Item = Ray<f32>> + use<> {
        let origin = self.position;
        (0..DIRECTIONS).map(move |i| Ray { origin, direction: even_direction(i, DIRECTIONS) })
    }
}

/// The mean of what is seen; mid-grey where nothing is.
fn mean(seen: &[Option<[f32; 3]>]) -> [f32; 3] {
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for colour in seen.iter().flatten() {
        (0..3).for_each(|c| sum[c] += colour[c]);
        count += 1.0;
    }
    if count > 0.0 { sum.map(|s| s / count) } else { [0.5; 3] }
}

impl CpuBackend {
    /// Let all probes near a surface look at the field as it is: those of the outer caches along straight rays, as if the
    /// bodies were not there, those of the inner caches along bent ones that begin inside.
    pub fn bake_reflection(&mut self, marching: &Marching) {
        let marching = Marching { near: 0.0, ..*marching };
        let regions = self.refraction.medium.regions();
        let of_mirrors = regions.iter().zip(&self.reflection.mirrors);
        let levels: Vec<Option<LevelSet<f32>>> = of_mirrors.map(|(region, _)| level_of(region)).collect();
        for inner in [false, true] {
            let lookouts = self.lookouts(&levels, inner);
            let rays: Vec<Ray<f32>> = lookouts.iter().flat_map(Lookout::rays).collect();
            let escapes = self.escapes(&rays, inner);
            let free: Vec<Ray<f32>> =
                rays.iter().zip(&escapes).filter(|(_, e)| **e).map(|(r, _)| *r).collect();
            let mut seen = self.seen_from_surfaces(&free, inner, &marching).into_iter().map(|p| p.colour);
            for (lookout, escapes) in lookouts.iter().zip(escapes.chunks_exact(DIRECTIONS)) {
                let own: Vec<Option<[f32; 3]>> =
                    escapes.iter().map(|e| e.then(|| seen.next()).flatten()).collect();
                let mirror = &mut self.reflection.mirrors[lookout.region];
                let cache = if inner { &mut mirror.inner } else { &mut mirror.outer };
                let mean = mean(&own);
                let views = own.iter().enumerate();
                let views = views.map(|(i, s)| (even_direction(i, DIRECTIONS), s.unwrap_or(mean)));
                cache.project(lookout.probe, views);
            }
        }
    }

    /// Let the probes of a clearcoat look at the field as it is, along straight rays.
    pub fn bake_clearcoat(&mut self, marching: &Marching) {
        let Some(mut clearcoat) = self.clearcoat.take() else { return };
        let marching = Marching { near: 0.0, ..*marching };
        let at = |probe| Lookout { region: 0, probe, position: clearcoat.radiance.position(probe) };
        let lookouts: Vec<Lookout> = (0..clearcoat.radiance.probes()).map(at).collect();
        for lookouts in lookouts.chunks(PORTION) {
            let rays: Vec<Ray<f32>> = lookouts.iter().flat_map(Lookout::rays).collect();
            let seen = self.seen_from_surfaces(&rays, false, &marching);
            let of_probes = rays.chunks_exact(DIRECTIONS).zip(seen.chunks_exact(DIRECTIONS));
            for (lookout, (rays, seen)) in lookouts.iter().zip(of_probes) {
                let views = rays.iter().zip(seen).map(|(ray, pixel)| (ray.direction, pixel.colour));
                clearcoat.radiance.project(lookout.probe, views);
            }
        }
        self.clearcoat = Some(clearcoat);
    }

    /// Which rays find out of all bodies. The others see nothing in particular.
    fn escapes(&self, rays: &[Ray<f32>], bent: bool) -> Vec<bool> {
        if !bent {
            return vec![true; rays.len()];
        }
        let tracer = self.refraction.secondary_tracer(&self.field.domain);
        let escapes = |path: &mut Path<f32>, ray: &Ray<f32>| {
            tracer.trace_into(ray, path);
            path.end == PathEnd::Escaped
        };
        rays.par_iter().map_init(Path::default, escapes).collect()
    }

    /// What rays show if surfaces mirror light of another source.
    pub fn render_mirroring(
        &self,
        rays: &[Ray<f32>],
        marching: &Marching,
        source: MirrorSource,
    ) -> Vec<Pixel<f32>> {
        let reflection = Reflection { source, ..self.reflection.clone() };
        self.render_scene(&Scene { reflection: &reflection, ..self.scene() }, rays, marching)
    }

    /// What rays show if no surface mirrors but totally.
    pub fn render_transmitted(&self, rays: &[Ray<f32>], marching: &Marching) -> Vec<Pixel<f32>> {
        let scene = Scene { reflection: &Reflection::none(), clearcoat: None, ..self.scene() };
        self.render_scene(&scene, rays, marching)
    }

    /// What rays from a surface see without further reflections; straight unless `bent`.
    fn seen_from_surfaces(&self, rays: &[Ray<f32>], bent: bool, marching: &Marching) -> Vec<Pixel<f32>> {
        let (straight, silent) = (Refraction::none(), Reflection::none());
        let refraction = if bent { &self.refraction } else { &straight };
        let scene = Scene { refraction, reflection: &silent, clearcoat: None, ..self.scene() };
        self.render_scene(&scene, rays, marching)
    }

    pub(super) fn render_scene(
        &self,
        scene: &Scene,
        rays: &[Ray<f32>],
        marching: &Marching,
    ) -> Vec<Pixel<f32>> {
        let mut out = vec![Pixel { colour: [0.0; 3], transmittance: 1.0, depth: 0.0 }; rays.len()];
        rays.par_chunks(CHUNK).zip(out.par_chunks_mut(CHUNK)).for_each(|(rays, out)| {
            with_blocks!(self, simd, render_chunk(scene, rays, marching, out));
        });
        out
    }

    /// The probes near the surface of each region that look, and from where.
    fn lookouts(&self, levels: &[Option<LevelSet<f32>>], inner: bool) -> Vec<Lookout> {
        let mut out = Vec::new();
        for (region, (level, mirror)) in levels.iter().zip(&self.reflection.mirrors).enumerate() {
            let Some(level) = level else { continue };
            let cache = mirror.cache(inner);
            let last = cache.resolution().map(|n| (n - 1) as f32);
            let extent = cache.bounds().extent();
            let spacing = (0..3).map(|a| extent[a] / last[a]).fold(0.0, f32::max);
            for probe in 0..cache.probes() {
                let at = cache.position(probe);
                let Some(near) = nearest(level, at).filter(|x| (*x - at).length() < REACH * spacing) else {
                    continue;
                };
                let position = if inner && !level.is_inside(at) { near } else { at };
                out.push(Lookout { region, probe, position });
            }
        }
        out
    }
}

/// The surface of a body, or where n is half-way between vacuum and the inside of what has a soft edge.
fn level_of(grid: &IndexGrid<f32>) -> Option<LevelSet<f32>> {
    if let Some(level) = grid.level_set() {
        return Some(level.clone());
    }
    let middle = half_way_index(grid)?;
    let Domain { bounds, resolution, .. } = *grid.domain();
    let mut level = LevelSet::from_samples(bounds, resolution, |x| middle - grid.index(x));
    level.redistance();
    Some(level)
}

/// A point just inside the surface near `x`, along the gradient of φ.
fn nearest(level: &LevelSet<f32>, x: Vec3<f32>) -> Option<Vec3<f32>> {
    const STEPS: usize = 8;
    let bounds = level.domain().bounds;
    // The spline is constant in the outermost cells.
    let inset = Vec3::splat(2.0 * level.voxel());
    let mut at = x.max(bounds.min + inset).min(bounds.max - inset);
    for _ in 0..STEPS {
        let (phi, gradient) = level.sample(at);
        let size = gradient.length();
        if size == 0.0 {
            return None;
        }
        at -= gradient * ((phi + MARGIN * level.voxel()) / (size * size));
    }
    (level.value(at).abs() < 4.0 * MARGIN * level.voxel()).then_some(at)
}
