//! Bent rays as a picture in a plane, and as polylines in space.

use crate::canvas::Colour;
use crate::colour_map::ColourMap;
use crate::picture::{ColourScale, Content, Line, Map, Panel, Row, Sheet};
use crate::table::decimals;
use crate::verbs::ply_header::{Element, write_header};
use rayon::prelude::*;
use refraxel_core::optics::PathEnd;
use refraxel_core::{Aabb, Camera, Domain, Path, Ray, Vec3};
use refraxel_data::LocalOrigin;
use refraxel_train::Refraction;
use refraxel_train::model::index_edit::index_range;
use std::io::{self, Write};

/// Width of the picture [pixel].
const WIDTH: usize = 900;
/// What the picture shows around a region [half extent of its box].
const AROUND: [f64; 2] = [2.2, 1.15];
/// A camera in or near a region sends its rays no further to the side than this [rad].
const WIDEST: f64 = 1.0;
const BENT: Colour = [213, 94, 0];
const STRAIGHT: Colour = [150, 154, 164];

/// Rays of a camera around the middle of a region, side by side in the horizontal plane of the camera.
pub struct Fan {
    bounds: Aabb<f64>,
    /// Unit vectors: from the camera to the middle, to the right, and across the plane.
    axes: [Vec3<f64>; 3],
    /// The rays from left to right.
    pub rays: Vec<Traced>,
}

/// A ray, and the same ray in vacuum.
pub struct Traced {
    /// Corners of the bent ray, from the camera on [scene unit].
    pub bent: Vec<Vec3<f64>>,
    straight: [Vec3<f64>; 2],
}

impl Fan {
    /// `count` rays per region, to as far behind it as the camera is in front.
    pub fn of_regions(
        refraction: &Refraction,
        domain: &Domain<f32>,
        camera: &Camera,
        count: usize,
    ) -> Vec<Self> {
        let regions = refraction.medium.regions().iter();
        regions.map(|r| Self::new(refraction, domain, camera, r.domain().bounds.cast(), count)).collect()
    }

    fn new(
        refraction: &Refraction,
        domain: &Domain<f32>,
        camera: &Camera,
        bounds: Aabb<f64>,
        count: usize,
    ) -> Self {
        let eye = camera.world_from_camera.translation;
        let to_middle = bounds.center() - eye;
        let ahead = if to_middle.length() > 0.0 { to_middle.normalized() } else { camera.forward() };
        let down = camera.world_from_camera.rotation * Vec3::new(0.0, 1.0, 0.0);
        let right = down.cross(ahead).normalized();
        let axes = [ahead, right, ahead.cross(right)];
        let ball = Ball { middle: bounds.center(), radius: to_middle.length().max(bounds.extent().length()) };
        let widest =
            (half_extent(&bounds, right) / to_middle.length().max(f64::MIN_POSITIVE)).atan().min(WIDEST);
        let ray = |k: usize| {
            let angle = widest * (2.0 * (k as f64 + 0.5) / count as f64 - 1.0);
            let ray = Ray { origin: eye, direction: ahead * angle.cos() + right * angle.sin() };
            Traced { bent: trace(refraction, domain, &ray, ball), straight: [eye, ball.exit(&ray)] }
        };
        Self { bounds, axes, rays: (0..count).into_par_iter().map(ray).collect() }
    }

    /// The fan over the index in its plane.
    fn panel(&self, refraction: &Refraction) -> Panel<'static> {
        let [ahead, right, across] = self.axes;
        let middle = self.bounds.center();
        let half =
            [AROUND[0] * half_extent(&self.bounds, ahead), AROUND[1] * half_extent(&self.bounds, right)];
        let unit = 2.0 * half[0] / WIDTH as f64;
        let height = (2.0 * half[1] / unit).round().max(1.0) as usize;
        // Up in the picture is the camera's left, as seen from above.
        let at = |i: usize| {
            let (u, v) = ((i % WIDTH) as f64 + 0.5, (i / WIDTH) as f64 + 0.5);
            middle + ahead * (u * unit - half[0]) + right * (v * unit - half[1])
        };
        let place = |x: &Vec3<f64>| {
            let x = *x - middle;
            ((x.dot(ahead) + half[0]) / unit, (x.dot(right) + half[1]) / unit)
        };
        let line = |points: &[Vec3<f64>], colour, width| Line {
            points: points.iter().map(place).collect(),
            colour,
            width,
        };
        let straight = self.rays.iter().map(|r| line(&r.straight, STRAIGHT, 1.0));
        // Two corners make a straight line.
        let bent = self.rays.iter().filter(|r| r.bent.len() > 2).map(|r| line(&r.bent, BENT, 1.5));
        let is_shown = |x: &&Vec3<f64>| (**x - middle).dot(ahead).abs() < half[0];
        let shown = self.rays.iter().flat_map(|r| &r.bent).filter(is_shown);
        let off = shown.map(|x| (*x - middle).dot(across).abs()).fold(0.0, f64::max);
        let map = Map {
            size: [WIDTH, height],
            values: (0..WIDTH * height).into_par_iter().map(|i| refraction.index(at(i).cast())).collect(),
            unit: Some(unit),
            lines: straight.chain(bent).collect(),
        };
        let note = format!(
            "orange: bent, grey: straight; bent rays leave this plane by up to {off:.0$} scene units",
            decimals(self.bounds.extent().max_element(), 3)
        );
        Panel { content: Content::Map(map), note }
    }
}

/// A page with one picture per region.
pub fn sheet(fans: &[Fan], refraction: &Refraction, camera: &str) -> Sheet<'static> {
    let [low, high] = index_range(refraction);
    let scale = ColourScale::Values(ColourMap::Tint, [low, high.max(low + 1e-3)]);
    let row = |(k, fan): (usize, &Fan)| Row {
        caption: format!(
            "region {}: {} rays from the camera of view {camera}, coming from the left",
            k + 1,
            fan.rays.len()
        ),
        panels: vec![fan.panel(refraction)],
        scale: Some(scale),
    };
    Sheet {
        title: "Bent rays and the index".to_owned(),
        columns: Vec::new(),
        rows: fans.iter().enumerate().map(row).collect(),
    }
}

/// Writes the bent rays as vertices and edges of a PLY file, in world coordinates; those of the rays begin at `origin`.
pub fn write_ply(fans: &[Fan], origin: LocalOrigin, out: &mut dyn Write) -> io::Result<()> {
    let paths: Vec<&[Vec3<f64>]> = fans.iter().flat_map(|f| &f.rays).map(|r| &r.bent[..]).collect();
    let vertices: usize = paths.iter().map(|p| p.len()).sum();
    let comment = format!("{} bent rays, world coordinates of the dataset", paths.len());
    let vertex = Element::new("vertex", vertices).with("double", ["x", "y", "z"]);
    let edge = Element::new("edge", vertices - paths.len()).with("int", ["vertex1", "vertex2"]);
    write_header("ascii", &[comment], &[vertex, edge], out)?;
    for x in paths.iter().copied().flatten().map(|x| origin.to_world(*x)) {
        writeln!(out, "{} {} {}", x.x, x.y, x.z)?;
    }
    let mut first = 0;
    for path in paths {
        for k in first..first + path.len() - 1 {
            writeln!(out, "{k} {}", k + 1)?;
        }
        first += path.len();
    }
    Ok(())
}

/// Half the extent of a box in a direction.
fn half_extent(bounds: &Aabb<f64>, direction: Vec3<f64>) -> f64 {
    0.5 * bounds.extent().dot(direction.map(f64::abs))
}

/// Corners of the path of a ray, to where it leaves the ball. At least two.
fn trace(refraction: &Refraction, domain: &Domain<f32>, ray: &Ray<f64>, ball: Ball) -> Vec<Vec3<f64>> {
    let narrow = ray.cast::<f32>();
    if !refraction.admits(&narrow) {
        return vec![ray.origin, ball.exit(ray)];
    }
    corners(&refraction.tracer(domain, 0.0).trace(&narrow), ball)
}

/// Corners of a path, to where it leaves the ball. At least two.
pub fn corners(path: &Path<f32>, ball: Ball) -> Vec<Vec3<f64>> {
    let mut points: Vec<Vec3<f64>> = path.segments.iter().map(|s| s.start.cast()).collect();
    points.dedup();
    let exit = path.exit.cast::<f64>();
    match path.segments.last() {
        // The last hop leads to the end of the scene, wherever that is.
        Some(last) if path.end == PathEnd::Escaped => {
            points.push(ball.exit(&Ray { origin: last.start.cast(), direction: exit.direction }));
        }
        _ => points.push(exit.origin),
    }
    points
}

/// How far rays are followed: around a region, with the camera inside.
#[derive(Clone, Copy)]
pub struct Ball {
    /// Its middle [world].
    pub middle: Vec3<f64>,
    /// Its radius [scene unit].
    pub radius: f64,
}

impl Ball {
    /// Where a ray that starts inside leaves it; its start, if that lies outside and the ray does not come near.
    pub fn exit(self, ray: &Ray<f64>) -> Vec3<f64> {
        let from_middle = ray.origin - self.middle;
        let b = from_middle.dot(ray.direction);
        let square = b * b - from_middle.dot(from_middle) + self.radius * self.radius;
        ray.at((square.max(0.0).sqrt() - b).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Extent, IndexGrid, LevelSet, vec3};

    fn ball() -> (Refraction, Domain<f32>, Camera) {
        let cube = Aabb::cube(1.0);
        let surface = LevelSet::from_samples(cube, [41; 3], |x: Vec3<f32>| x.length() - 0.7);
        let refraction = Refraction::of(vec![IndexGrid::sharp(surface, 1.5)]);
        let domain = Domain::with_longest(cube, Extent::Bounded, 32);
        let camera = Camera::look_at(vec3(4.0, 0.0, 0.0), Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.5, [8, 8]);
        (refraction, domain, camera)
    }

    #[test]
    fn rays_near_the_axis_of_a_ball_meet_at_its_focus() {
        let (refraction, domain, camera) = ball();
        let fans = Fan::of_regions(&refraction, &domain, &camera, 101);
        let middle = &fans[0].rays[53]; // next but two to the axis
        assert_eq!(middle.bent.len(), 4, "camera, entry, exit, end");
        let (exit, end) = (middle.bent[2], middle.bent[3]);
        let t = exit.y / (exit.y - end.y);
        let focus = exit.x + t * (end.x - exit.x);
        // Ball lens of R = 0.7, n = 1.5: 1/f = 2(n − 1)/(nR), and 1/image = 1/f − 1/4 from the middle.
        let image = 1.0 / (2.0 * 0.5 / (1.5 * 0.7) - 0.25);
        assert!((focus + image).abs() < 0.03, "{focus} {image}");
        let off_plane = fans[0].rays.iter().flat_map(|r| &r.bent).map(|x| x.z.abs()).fold(0.0, f64::max);
        assert!(off_plane < 1e-3, "{off_plane}");
    }

    #[test]
    fn polylines_have_an_edge_fewer_than_vertices_each() {
        let (refraction, domain, camera) = ball();
        let fans = Fan::of_regions(&refraction, &domain, &camera, 7);
        let mut text = Vec::new();
        write_ply(&fans, LocalOrigin::default(), &mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        let count = |name: &str| -> usize {
            let line = text.lines().find_map(|l| l.strip_prefix(&format!("element {name} ")));
            line.unwrap().parse().unwrap()
        };
        assert_eq!(count("vertex") - count("edge"), 7);
        let body = text.split("end_header\n").nth(1).unwrap();
        assert_eq!(body.lines().count(), count("vertex") + count("edge"));
    }
}
