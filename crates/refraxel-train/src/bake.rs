//! Probes look at the field, theory (7.9): where they stand, which way they look, and what is made of it. A backend shows what rays
//! from there see.

use crate::cancel::{Cancel, Cancelled};
use crate::model::index_edit::half_way_index;
use crate::model::{Mirror, Reflection, Refraction};
use rayon::prelude::*;
use refraxel_core::optics::PathEnd;
use refraxel_core::radiance::clearcoat::Clearcoat;
use refraxel_core::radiance::{Pixel, probes::even_direction};
use refraxel_core::{Domain, IndexGrid, LevelSet, Medium, Path, Ray, Vec3};

/// How rays from a probe go through bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayKind {
    /// Straight, as if there were none.
    Straight,
    /// Bent.
    Bent,
}

/// Directions in which a probe looks: 16 per coefficient of degree 3.
const DIRECTIONS: usize = 256;
/// Distance from a surface at which probes look that lie on its other side [voxel of the level set].
const MARGIN: f32 = 1.0;
/// Probes farther from a surface than this are asked by no ray [distance of neighbouring probes]: the diagonal of a cell.
const REACH: f32 = 1.8;
/// Probes that look at the same time: bounds the memory of their rays, and the time until a wish to stop is seen.
const PORTION: usize = 64;

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

/// A look at the field as it is.
pub struct Look<'a, See> {
    /// The bodies whose surfaces mirror.
    pub refraction: &'a Refraction,
    /// Where the field lies.
    pub domain: &'a Domain<f32>,
    /// What rays show, without what surfaces mirror.
    pub see: See,
    /// Says when to stop.
    pub cancel: &'a Cancel,
}

impl<See: Fn(&[Ray<f32>], RayKind) -> Vec<Pixel<f32>>> Look<'_, See> {
    /// All probes near a surface look: those of the outer caches along straight rays, as if the bodies were not there, those
    /// of the inner caches along bent ones that begin inside.
    pub fn reflection(&self, reflection: &Reflection) -> Result<Reflection, Cancelled> {
        let mut baked = reflection.clone();
        let of_mirrors = self.refraction.medium.regions().iter().zip(&baked.mirrors);
        let levels: Vec<Option<LevelSet<f32>>> = of_mirrors.map(|(region, _)| level_of(region)).collect();
        for inner in [false, true] {
            let regions = Regions { medium: &self.refraction.medium, levels: &levels };
            for lookouts in regions.lookouts(&baked.mirrors, inner).chunks(PORTION) {
                self.cancel.check()?;
                self.project(lookouts, inner, &mut baked.mirrors);
            }
        }
        Ok(baked)
    }

    /// Give the probes of some lookouts what they see.
    fn project(&self, lookouts: &[Lookout], inner: bool, mirrors: &mut [Mirror]) {
        let rays: Vec<Ray<f32>> = lookouts.iter().flat_map(Lookout::rays).collect();
        let escapes = self.escapes(&rays, inner);
        let free: Vec<Ray<f32>> = rays.iter().zip(&escapes).filter(|(_, e)| **e).map(|(r, _)| *r).collect();
        let through = if inner { RayKind::Bent } else { RayKind::Straight };
        let mut seen = (self.see)(&free, through).into_iter().map(|p| p.colour);
        for (lookout, escapes) in lookouts.iter().zip(escapes.chunks_exact(DIRECTIONS)) {
            let own: Vec<Option<[f32; 3]>> =
                escapes.iter().map(|e| e.then(|| seen.next()).flatten()).collect();
            let mirror = &mut mirrors[lookout.region];
            let cache = if inner { &mut mirror.inner } else { &mut mirror.outer };
            let mean = mean(&own);
            let views = own.iter().enumerate();
            let views = views.map(|(i, s)| (even_direction(i, DIRECTIONS), s.unwrap_or(mean)));
            cache.project(lookout.probe, views);
        }
    }

    /// The probes of a clearcoat look along straight rays.
    pub fn clearcoat(&self, clearcoat: &Clearcoat<f32>) -> Result<Clearcoat<f32>, Cancelled> {
        let mut baked = clearcoat.clone();
        let at = |probe| Lookout { region: 0, probe, position: clearcoat.radiance.position(probe) };
        let lookouts: Vec<Lookout> = (0..clearcoat.radiance.probes()).map(at).collect();
        for lookouts in lookouts.chunks(PORTION) {
            self.cancel.check()?;
            let rays: Vec<Ray<f32>> = lookouts.iter().flat_map(Lookout::rays).collect();
            let seen = (self.see)(&rays, RayKind::Straight);
            let of_probes = rays.chunks_exact(DIRECTIONS).zip(seen.chunks_exact(DIRECTIONS));
            for (lookout, (rays, seen)) in lookouts.iter().zip(of_probes) {
                let views = rays.iter().zip(seen).map(|(ray, pixel)| (ray.direction, pixel.colour));
                baked.radiance.project(lookout.probe, views);
            }
        }
        Ok(baked)
    }

    /// Which rays find out of all bodies. The others see nothing in particular.
    fn escapes(&self, rays: &[Ray<f32>], bent: bool) -> Vec<bool> {
        if !bent {
            return vec![true; rays.len()];
        }
        let tracer = self.refraction.secondary_tracer(self.domain);
        let escapes = |path: &mut Path<f32>, ray: &Ray<f32>| {
            tracer.trace_into(ray, path);
            path.end == PathEnd::Escaped
        };
        rays.par_iter().map_init(Path::default, escapes).collect()
    }
}

/// The regions of a medium and their surfaces, soft edges included.
struct Regions<'a> {
    medium: &'a Medium<f32>,
    levels: &'a [Option<LevelSet<f32>>],
}

impl Regions<'_> {
    /// The probes near the surfaces of each region that look, and from where.
    fn lookouts(&self, mirrors: &[Mirror], inner: bool) -> Vec<Lookout> {
        let mut out = Vec::new();
        for (region, mirror) in mirrors.iter().enumerate() {
            let cache = mirror.cache(inner);
            let last = cache.resolution().map(|n| (n - 1) as f32);
            let extent = cache.bounds().extent();
            let spacing = (0..3).map(|a| extent[a] / last[a]).fold(0.0, f32::max);
            let reach = REACH * spacing;
            out.extend((0..cache.probes()).filter_map(|probe| {
                let at = cache.position(probe);
                let position =
                    if inner { self.inside(region, at, reach) } else { self.outside(region, at, reach) };
                position.map(|position| Lookout { region, probe, position })
            }));
        }
        out
    }

    /// From where a probe at `x` looks at the surroundings of a region; `None` where its surface is farther than `reach`, or
    /// not in vacuum.
    fn outside(&self, region: usize, x: Vec3<f32>, reach: f32) -> Option<Vec3<f32>> {
        let near = |side| nearest(self.levels[region].as_ref()?, x, side);
        near(Side::Inside).filter(|near| (*near - x).length() < reach)?;
        let lies_in_vacuum = self.medium.neighbours(region).is_empty()
            || near(Side::Outside).is_some_and(|x| self.medium.ruling_at(x).is_none());
        lies_in_vacuum.then_some(x)
    }

    /// From where a probe at `x` looks inside a region: from where it is, or from the nearest point beside a surface that
    /// the region rules; `None` where all of its surfaces are farther than `reach`. Besides its own these are those of the
    /// bodies that cut into it.
    fn inside(&self, region: usize, x: Vec3<f32>, reach: f32) -> Option<Vec3<f32>> {
        let own = self.levels[region].as_ref()?;
        let (neighbours, rules) = (self.medium.neighbours(region), |x| self.rules(region, own, x));
        let cutting = neighbours.iter().filter(|other| **other > region);
        let cutting = cutting.filter_map(|&other| nearest(self.levels[other].as_ref()?, x, Side::Outside));
        let mut near: Vec<Vec3<f32>> = nearest(own, x, Side::Inside).into_iter().chain(cutting).collect();
        near.retain(|near| (*near - x).length() < reach);
        let first = *near.first()?;
        if rules(x) {
            return Some(x);
        }
        near.retain(|near| rules(*near));
        near.sort_by(|a, b| (*a - x).length().total_cmp(&(*b - x).length()));
        // Beside a wall that is too thin for a point in its middle the light is hardly another.
        Some(near.first().copied().unwrap_or(first))
    }

    /// Whether the light inside a region passes through `x`.
    fn rules(&self, region: usize, own: &LevelSet<f32>, x: Vec3<f32>) -> bool {
        own.is_inside(x)
            && (self.medium.neighbours(region).is_empty() || self.medium.ruling_at(x) == Some(region))
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

/// A side of a surface.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Inside,
    Outside,
}

/// A point just on one side of the surface near `x`, along the gradient of φ.
fn nearest(level: &LevelSet<f32>, x: Vec3<f32>, side: Side) -> Option<Vec3<f32>> {
    const STEPS: usize = 8;
    let margin = if side == Side::Inside { MARGIN } else { -MARGIN } * level.voxel();
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
        at -= gradient * ((phi + margin) / (size * size));
    }
    (level.value(at).abs() < 4.0 * MARGIN * level.voxel()).then_some(at)
}
