//! The refractive media that the rays of a view meet: index, depth of the surface and normal.

use crate::colour_map::ColourMap;
use crate::picture::{ColourScale, Content, Map, Panel, Row, Sheet};
use rayon::prelude::*;
use refraxel_core::optics::Path;
use refraxel_core::{Camera, Domain, Vec3};
use refraxel_train::Refraction;
use refraxel_train::rays::pixel_ray;

/// A ray counts as meeting a refractive medium where |n − 1| exceeds this.
const VISIBLE: f32 = 0.01;
/// A place counts as surface if ∇n there has this share of its largest length along the ray.
const STEEP: f32 = 0.5;
/// Steps of the 16-bit pictures per unit of n.
pub const INDEX_STEPS: f32 = 1e4;

/// The refractive medium that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Met {
    /// The n that differs most from 1 on the way.
    pub index: f32,
    /// Unit normal of the first surface, towards the camera, in the camera's frame.
    pub normal: Vec3<f32>,
    /// Arc length from the camera to the first surface [scene unit]; where the edge is soft, to a voxel.
    pub depth: f32,
}

/// The refractive media that a view meets, also behind opaque things.
pub struct Refractive {
    size: [u32; 2],
    met: Vec<Option<Met>>,
}

/// A place on a ray where n changes.
struct Change {
    /// |∇n|; of a sharp surface the jump over a voxel [1 / scene unit].
    steepness: f32,
    /// Whether it is a sharp surface.
    is_sharp: bool,
    /// Unit normal against the ray.
    normal: Vec3<f32>,
    /// Arc length from the camera [scene unit].
    depth: f32,
}

impl Refractive {
    /// Follows all rays of a camera; pixels outside the lens, and rays that meet no medium, have no entry.
    pub fn of(refraction: &Refraction, domain: &Domain<f32>, near: f32, camera: &Camera) -> Self {
        let tracer = refraction.tracer(domain, near);
        let camera_from_world = camera.world_from_camera.rotation.transpose();
        let look = |path: &mut Path<f32>, pixel: usize| {
            let ray = pixel_ray(camera, pixel).filter(|ray| refraction.admits(ray))?;
            tracer.trace_into(&ray, path);
            let met = meet(refraction, path)?;
            Some(Met { normal: (camera_from_world * met.normal.cast::<f64>()).cast(), ..met })
        };
        let count = camera.width as usize * camera.height as usize;
        let met = (0..count).into_par_iter().map_init(Path::default, look).collect();
        Self { size: [camera.width, camera.height], met }
    }

    /// What each pixel's ray meets, rows from the top.
    pub fn met(&self) -> &[Option<Met>] {
        &self.met
    }

    /// n in steps of 1e-4 as 16-bit samples in the machine's order; 0 where no medium is met.
    pub fn index_samples(&self) -> Vec<u8> {
        let code = |met: &Option<Met>| met.map_or(0, |m| (m.index * INDEX_STEPS).round().max(1.0) as u16);
        self.met.iter().flat_map(|m| code(m).to_ne_bytes()).collect()
    }

    /// Arc lengths from the camera to the first surface [scene unit].
    pub fn depths(&self) -> impl Iterator<Item = Option<f32>> {
        self.met.iter().map(|met| met.map(|m| m.depth))
    }

    /// n in colours with their bar, from the smallest to the largest of `range`.
    pub fn index_sheet(&self, title: &str, range: [f32; 2]) -> Sheet<'static> {
        let values = self.met.iter().map(|m| m.map_or(f32::NAN, |m| m.index)).collect();
        let map = Map { size: self.size.map(|n| n as usize), values, ..Map::default() };
        let panel = Panel { content: Content::Map(map), note: String::new() };
        let row = Row {
            caption: format!("{title}: index of refraction"),
            panels: vec![panel],
            scale: Some(ColourScale::Values(ColourMap::Viridis, range)),
        };
        Sheet { rows: vec![row], ..Sheet::default() }
    }

    /// A normal map with opacity: red grows to the right, green upwards, blue towards the camera; clear where nothing
    /// is met.
    pub fn normal_colours(&self) -> Vec<[u8; 4]> {
        let level = |v: f32| (127.5 * (v + 1.0)).round() as u8;
        let colour = |m: Met| [level(m.normal.x), level(-m.normal.y), level(-m.normal.z), 255];
        self.met.iter().map(|m| m.map_or([0; 4], colour)).collect()
    }
}

/// What lies on a path; the normal is in the world.
fn meet(refraction: &Refraction, path: &Path<f32>) -> Option<Met> {
    let (mut index, mut changes, mut passed) = (1.0, Vec::new(), 0.0);
    let regions = refraction.medium.regions();
    for (segment, step) in path.segments.iter().zip(&path.steps) {
        let (toward, speed) = (-segment.momentum.normalized(), segment.momentum.length());
        let mut add = |is_sharp: bool, steepness: f32, gradient: Vec3<f32>, t: f32| {
            let normal = gradient.normalized();
            let facing = if normal.dot(toward) < 0.0 { -normal } else { normal };
            changes.push(Change { steepness, is_sharp, normal: facing, depth: passed + speed * t });
        };
        // Segments are short where n changes, so that their middles are enough.
        let middle = segment.at(0.5 * step.drift);
        let region = refraction.medium.ruling_at(middle);
        let n = refraction.index(middle);
        let smooth = region.map(|r| &regions[r]).filter(|r| r.level_set().is_none() && !r.is_flat(middle));
        if let Some(grid) = smooth {
            let gradient = grid.w_gradient(middle) / n;
            add(false, gradient.length(), gradient, 0.5 * step.drift);
        }
        let mut seen = vec![n];
        let body = &regions[usize::from(step.region).min(regions.len() - 1)];
        if let (Some(event), Some(level)) = (&step.event, body.level_set()) {
            let place = segment.at(step.drift);
            let of = |region: Option<u16>| region.map_or(1.0, |r| regions[usize::from(r)].index(place));
            let [before, beyond] = [step.within, event.beyond].map(of);
            seen.extend([before, beyond]);
            let steepness = (beyond - before).abs() / level.voxel();
            add(true, steepness, level.sample(place).1, step.drift);
        }
        passed += speed * step.drift;
        index =
            seen.into_iter().fold(index, |a: f32, b| if (b - 1.0).abs() > (a - 1.0).abs() { b } else { a });
    }
    let first = first_surface(&changes).filter(|_| (index - 1.0).abs() >= VISIBLE)?;
    Some(Met { index, normal: first.normal, depth: first.depth })
}

/// The first place about as steep as any: a sharp surface, or the crest of a soft one.
fn first_surface(changes: &[Change]) -> Option<&Change> {
    let least = STEEP * changes.iter().map(|c| c.steepness).fold(0.0, f32::max);
    let is_surface = |(k, change): &(usize, &Change)| {
        let is_crest = changes.get(k + 1).is_none_or(|next| next.steepness <= change.steepness);
        change.steepness > 0.0 && change.steepness >= least && (change.is_sharp || is_crest)
    };
    changes.iter().enumerate().find(is_surface).map(|(_, change)| change)
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Aabb, Extent, IndexGrid, Interpolation, LevelSet, vec3};

    fn view(grid: IndexGrid<f32>) -> (Refractive, Camera) {
        let refraction = Refraction::of(vec![grid]);
        let domain = Domain::with_longest(Aabb::cube(1.0), Extent::Bounded, 32);
        let camera = Camera::look_at(vec3(4.0, 0.0, 0.0), Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.5, [31, 31]);
        (Refractive::of(&refraction, &domain, 0.0, &camera), camera)
    }

    fn sharp() -> IndexGrid<f32> {
        let ball = LevelSet::from_samples(Aabb::cube(1.0), [33; 3], |x: Vec3<f32>| x.length() - 0.6);
        IndexGrid::sharp(ball, 1.5)
    }

    fn smooth() -> IndexGrid<f32> {
        let n = |x: Vec3<f32>| 1.25 - 0.25 * ((x.length() - 0.6) * 20.0).tanh();
        IndexGrid::from_control_values(Aabb::cube(1.0), [49; 3], Interpolation::CubicBSpline, n)
    }

    /// Where the ray meets a ball of radius 0.6: the distance, and the normal in the camera's frame.
    fn of_ball(camera: &Camera, pixel: usize) -> Option<(f64, Vec3<f64>)> {
        let ray = pixel_ray(camera, pixel)?.cast::<f64>();
        let b = ray.direction.dot(ray.origin);
        let root = b * b - ray.origin.dot(ray.origin) + 0.36;
        let depth = -b - (root > 0.0).then(|| root.sqrt())?;
        Some((depth, camera.world_from_camera.rotation.transpose() * ray.at(depth).normalized()))
    }

    #[test]
    fn index_normals_and_depths_of_a_ball_are_those_of_its_surface() {
        // A crest is found to the step of the ray, half a voxel of 0.042, and its neighbour may be as steep.
        for (grid, tolerance, near) in [(sharp(), 0.02, 1e-4), (smooth(), 0.15, 0.042)] {
            let (seen, camera) = view(grid);
            let middle = seen.met[15 * 31 + 15].unwrap();
            assert!((middle.index - 1.5).abs() < 2e-3, "{middle:?}");
            let mut compared = 0;
            for (pixel, met) in seen.met.iter().enumerate() {
                let (Some(met), Some((depth, normal))) = (met, of_ball(&camera, pixel)) else { continue };
                if normal.z > -0.5 {
                    continue; // near its outline a soft ball has another one
                }
                assert!((met.normal.cast() - normal).length() < tolerance, "{pixel}: {met:?} {normal:?}");
                assert!((f64::from(met.depth) - depth).abs() < near, "{pixel}: {met:?} {depth}");
                compared += 1;
            }
            assert!(compared > 100, "{compared}");
            assert_eq!((seen.met[0], seen.normal_colours()[0]), (None, [0; 4]));
            assert_eq!(seen.depths().next(), Some(None));
            assert_eq!(&seen.index_samples()[..2], &[0; 2]);
        }
    }
}
