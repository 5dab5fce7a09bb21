//! The cameras seen from above and from the side.

use super::palette::{WARNING, of_part};
use crate::canvas::{Align, Canvas, Colour, FAINT, Font, INK, PALE, PAPER, shortened, text_width};
use refraxel_core::{Aabb, Camera, Vec3, vec3};
use refraxel_train::metrics::Rgb8;

/// Around the page and between the two views [pixel].
const MARGIN: usize = 24;
/// Edge of a view [pixel].
const SIDE: usize = 860;
/// Free space around what is drawn, as a part of its extent.
const SPACE: f64 = 0.08;
/// Length of the drawn pyramid of one camera alone, and its range, as a part of the extent.
const PYRAMID: f64 = 0.35;
const PYRAMIDS: [f64; 2] = [0.018, 0.05];
/// The box is drawn whole where it is up to so many times as large as the cameras' extent.
const BOX: f64 = 4.0;
/// Points that are drawn.
const POINTS: usize = 30_000;
/// Diameters of fewer points than this, and of more [pixel].
const FEW: usize = 2000;
const DOTS: [f64; 2] = [3.0, 1.4];
const POINT: Colour = [176, 180, 190];
/// Names that are written.
const NAMED: usize = 12;
/// Share of a view that its scale may take.
const SCALE_SHARE: f64 = 0.25;
/// Length of the axes of the world [pixel].
const AXIS: f64 = 44.0;

/// One camera.
pub struct Shown<'a> {
    pub camera: &'a Camera,
    /// Part of the split.
    pub part: &'static str,
    /// Its name, where its place or direction is doubted.
    pub doubted: Option<&'a str>,
    /// It stands so far away that it is drawn at the edge.
    pub is_far: bool,
}

/// What is drawn.
pub struct Scene<'a> {
    pub title: String,
    pub cameras: Vec<Shown<'a>>,
    pub points: &'a [Vec3<f64>],
    pub bounds: Aabb<f64>,
    /// Unit vector.
    pub up: Vec3<f64>,
    /// Along this the cameras extend farthest.
    pub along: Vec3<f64>,
}

/// Draws both views beside each other, at one scale.
pub fn draw(scene: &Scene<'_>) -> Canvas {
    let top = MARGIN + Font::Heading.height() + 10 + Font::Body.height() + 14;
    let caption = Font::Strong.height() + 8;
    let mut page = Canvas::new(3 * MARGIN + 2 * SIDE, top + caption + SIDE + MARGIN, PAPER);
    let title = shortened(Font::Heading, &scene.title, page.width() - 2 * MARGIN);
    page.text((MARGIN as i64, MARGIN as i64), &title, Font::Heading.style(Align::Left, INK));
    page.legend(MARGIN, MARGIN + Font::Heading.height() + 10, &legend(scene));
    for (k, view) in views(scene).into_iter().enumerate() {
        let x = MARGIN + k * (SIDE + MARGIN);
        page.text((x as i64, top as i64), &view.caption, Font::Strong.style(Align::Left, INK));
        let drawn = view.draw(scene);
        page.paste(x, top + caption, Rgb8::new(drawn.pixels(), SIDE, SIDE));
    }
    page
}

/// What the colours mean.
fn legend(scene: &Scene<'_>) -> Vec<(Colour, String)> {
    let count = |part: &str| scene.cameras.iter().filter(|c| c.part == part).count();
    let mut entries: Vec<(Colour, String)> = ["train", "val", "test", "unused"]
        .iter()
        .filter(|part| count(part) > 0)
        .map(|part| (of_part(part), format!("{} {part}", count(part))))
        .collect();
    if scene.cameras.iter().any(|c| c.doubted.is_some()) {
        entries.push((WARNING, "doubted".to_owned()));
    }
    entries.push((INK, "box".to_owned()));
    if !scene.points.is_empty() {
        entries.push((POINT, "points of the reconstruction".to_owned()));
    }
    entries
}

/// One orthographic view.
struct View {
    caption: String,
    /// Unit vectors to the right and upwards on the page.
    right: Vec3<f64>,
    upwards: Vec3<f64>,
    center: Vec3<f64>,
    /// What the edge of the view covers [scene unit].
    extent: f64,
}

/// From above and from the side, along the direction in which the cameras extend farthest.
fn views(scene: &Scene<'_>) -> [View; 2] {
    let up = scene.up;
    let level = |v: Vec3<f64>| v - up * v.dot(up);
    let axis = [vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(0.0, 0.0, 1.0)];
    let any = axis.into_iter().max_by(|a, b| level(*a).length().total_cmp(&level(*b).length()));
    let along = level(scene.along);
    let is_usable = along.is_finite() && along.length() > 1e-3;
    let right = if is_usable { along } else { level(any.unwrap_or(scene.along)) }.normalized();
    let back = up.cross(right);
    let mut places: Vec<Vec3<f64>> =
        scene.cameras.iter().filter(|c| !c.is_far).map(|c| c.camera.world_from_camera.translation).collect();
    let of_cameras = Aabb::around(places.iter().copied()).map_or(0.0, |b| b.extent().max_element());
    if of_cameras <= 0.0 || scene.bounds.extent().max_element() <= BOX * of_cameras {
        places.extend(corners(&scene.bounds));
    }
    let range = |axis: Vec3<f64>| {
        places
            .iter()
            .map(|p| p.dot(axis))
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)])
    };
    let ranges = [right, back, up].map(range);
    let extent =
        ranges.iter().map(|[l, h]| h - l).fold(0.0, f64::max).max(f64::MIN_POSITIVE) * (1.0 + 2.0 * SPACE);
    let [x, y, z] = ranges.map(|[l, h]| 0.5 * (l + h));
    let center = right * x + back * y + up * z;
    let view = |caption, upwards| View { caption, right, upwards, center, extent };
    let [x, y, z] = up.to_array();
    let side = format!("seen from the side; up is ({x:.2}, {y:.2}, {z:.2})");
    [view("seen from above".to_owned(), back), view(side, up)]
}

fn corners(b: &Aabb<f64>) -> [Vec3<f64>; 8] {
    std::array::from_fn(|k| {
        let at = |axis: usize| if k >> axis & 1 == 0 { b.min[axis] } else { b.max[axis] };
        vec3(at(0), at(1), at(2))
    })
}

impl View {
    /// A point of the world on the page [pixel].
    fn place(&self, p: Vec3<f64>) -> (f64, f64) {
        let scale = SIDE as f64 / self.extent;
        let away = p - self.center;
        let middle = 0.5 * SIDE as f64;
        (middle + away.dot(self.right) * scale, middle - away.dot(self.upwards) * scale)
    }

    fn draw(&self, scene: &Scene<'_>) -> Canvas {
        let mut canvas = Canvas::new(SIDE, SIDE, PAPER);
        self.frame(&mut canvas);
        let step = scene.points.len().div_ceil(POINTS).max(1);
        let diameter = if scene.points.len() < FEW { DOTS[0] } else { DOTS[1] };
        for point in scene.points.iter().step_by(step) {
            let (x, y) = self.place(*point);
            let is_inside = |v: f64| (2.0..SIDE as f64 - 2.0).contains(&v);
            if is_inside(x) && is_inside(y) {
                canvas.polyline(&[(x, y)], diameter, POINT);
            }
        }
        self.edges_of(&scene.bounds, &mut canvas);
        let is_doubted = |c: &&Shown<'_>| c.doubted.is_some();
        let length = self.extent
            * (PYRAMID / (scene.cameras.len().max(1) as f64).sqrt()).clamp(PYRAMIDS[0], PYRAMIDS[1]);
        let (last, first): (Vec<_>, Vec<_>) = scene.cameras.iter().partition(is_doubted);
        first.iter().chain(&last).for_each(|c| self.pyramid(c, length, &mut canvas));
        canvas.scale(20, SIDE - 30, self.extent / SIDE as f64, SCALE_SHARE * SIDE as f64);
        self.axes(&mut canvas);
        self.names(&last, &mut canvas);
        canvas
    }

    fn frame(&self, canvas: &mut Canvas) {
        let (low, high) = (0.5, SIDE as f64 - 0.5);
        canvas.polyline(&[(low, low), (high, low), (high, high), (low, high), (low, low)], 1.0, PALE);
    }

    fn edges_of(&self, bounds: &Aabb<f64>, canvas: &mut Canvas) {
        let corners = corners(bounds);
        for (k, axis) in (0..8).flat_map(|k| (0..3).map(move |axis| (k, axis))) {
            if k >> axis & 1 == 0 {
                let ends = [corners[k], corners[k | 1 << axis]].map(|p| self.place(p));
                canvas.polyline(&ends, 1.6, INK);
            }
        }
    }

    /// Position, optical axis, and the borders of the picture at this distance.
    fn pyramid(&self, shown: &Shown<'_>, length: f64, canvas: &mut Canvas) {
        let camera = shown.camera;
        let colour = if shown.doubted.is_some() { WARNING } else { of_part(shown.part) };
        let apex = camera.world_from_camera.translation;
        let place = self.clamped(apex);
        if !shown.is_far {
            let (width, height) = (f64::from(camera.width), f64::from(camera.height));
            let corner = |(u, v): (f64, f64)| {
                let ray = camera.ray(u, v)?;
                let ahead = ray.direction.dot(camera.forward());
                // Wide lenses: no farther than the length itself.
                Some(self.place(ray.at(length / ahead.max(0.5))))
            };
            let border: Vec<_> = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)]
                .into_iter()
                .filter_map(corner)
                .collect();
            for end in &border {
                canvas.polyline(&[place, *end], 1.0, colour);
            }
            if let [a, b, c, d] = border[..] {
                canvas.polyline(&[a, b, c, d, a], 1.0, colour);
            } else {
                canvas.polyline(&[place, self.place(apex + camera.forward() * length)], 1.6, colour);
            }
        }
        canvas.polyline(&[place], if shown.doubted.is_some() { 9.0 } else { 5.0 }, colour);
    }

    /// On the page, at its edge where it lies outside.
    fn clamped(&self, p: Vec3<f64>) -> (f64, f64) {
        let (x, y) = self.place(p);
        let inside = |v: f64| v.clamp(7.0, SIDE as f64 - 7.0);
        (inside(x), inside(y))
    }

    /// The axes of the data's coordinates, at the lower right.
    fn axes(&self, canvas: &mut Canvas) {
        let origin = (SIDE as f64 - 76.0, SIDE as f64 - 76.0);
        let unit = [vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(0.0, 0.0, 1.0)];
        let mut ends: Vec<(f64, f64, &str)> = unit
            .into_iter()
            .zip(["x", "y", "z"])
            .map(|(axis, name)| (AXIS * axis.dot(self.right), -AXIS * axis.dot(self.upwards), name))
            .collect();
        ends.sort_by(|a, b| b.0.hypot(b.1).total_cmp(&a.0.hypot(a.1)));
        let mut drawn: Vec<(f64, f64)> = Vec::new();
        for (dx, dy, name) in ends {
            let length = dx.hypot(dy);
            let is_crowded = drawn.iter().any(|(x, y)| (x - dx).hypot(y - dy) < 0.5 * AXIS);
            if length < 0.3 * AXIS || is_crowded {
                continue; // towards or away from the reader, or one on the other
            }
            drawn.push((dx, dy));
            canvas.polyline(&[origin, (origin.0 + dx, origin.1 + dy)], 1.6, FAINT);
            let beyond = 1.0 + 11.0 / length;
            let place = (origin.0 + dx * beyond, origin.1 + dy * beyond - Font::Body.height() as f64 / 2.0);
            canvas.text((place.0 as i64, place.1 as i64), name, Font::Strong.style(Align::Centre, FAINT));
        }
    }

    /// Names beside what is doubted, where there is room for them.
    fn names(&self, doubted: &[&Shown<'_>], canvas: &mut Canvas) {
        let mut taken: Vec<[i64; 4]> = Vec::new();
        let (high, side) = (Font::Strong.height() as i64, SIDE as i64);
        for shown in doubted.iter().take(NAMED) {
            let Some(name) = shown.doubted else { continue };
            let name = shortened(Font::Strong, name, SIDE / 3);
            let wide = text_width(Font::Strong, &name) as i64;
            let (x, y) = self.clamped(shown.camera.world_from_camera.translation);
            let (x, y) = (x as i64, y as i64);
            let beside = [(10, -high / 2), (-10 - wide, -high / 2), (-wide / 2, -high - 8), (-wide / 2, 8)];
            let onto_page = |(dx, dy): (i64, i64)| {
                ((x + dx).clamp(4, side - 4 - wide), (y + dy).clamp(4, side - 4 - high))
            };
            let is_beside_point = |&(left, top): &(i64, i64)| {
                x < left - 5 || x > left + wide + 5 || y < top - 5 || y > top + high + 5
            };
            let is_free = |&(left, top): &(i64, i64)| {
                let apart =
                    |[l, t, r, b]: &[i64; 4]| left > *r || left + wide < *l || top > *b || top + high < *t;
                taken.iter().all(apart)
            };
            let mut places = beside.map(onto_page).into_iter();
            if let Some((left, top)) = places.find(|place| is_beside_point(place) && is_free(place)) {
                canvas.text_on_lines((left, top), &name, Font::Strong.style(Align::Left, WARNING), PAPER);
                taken.push([left, top, left + wide, top + high]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cameras() -> Vec<Camera> {
        let place = |k: usize| {
            let angle = k as f64 * 0.4;
            Camera::look_at(
                vec3(4.0 * angle.cos(), 4.0 * angle.sin(), 2.0),
                Vec3::zero(),
                vec3(0.0, 0.0, 1.0),
                0.7,
                [20, 20],
            )
        };
        (0..14).map(place).collect()
    }

    fn scene<'a>(cameras: &'a [Camera], points: &'a [Vec3<f64>]) -> Scene<'a> {
        let shown = |camera| Shown { camera, part: "train", doubted: None, is_far: false };
        Scene {
            title: "ring".into(),
            cameras: cameras.iter().map(shown).collect(),
            points,
            bounds: Aabb::cube(1.0),
            up: vec3(0.0, 0.0, 1.0),
            along: vec3(8.0, 1.0, 0.0),
        }
    }

    #[test]
    fn views_turn_like_the_world_and_agree_about_what_is_right() {
        let (cameras, points) = (cameras(), []);
        let [above, side] = views(&scene(&cameras, &points));
        let turned = above.right.cross(above.upwards) - vec3(0.0, 0.0, 1.0);
        assert!(turned.length() < 1e-12, "seen from above, up comes towards the reader");
        assert!((side.upwards - vec3(0.0, 0.0, 1.0)).length() < 1e-12 && side.right == above.right);
        for camera in &cameras {
            let (x, y) = side.place(camera.world_from_camera.translation);
            assert!((0.0..SIDE as f64).contains(&x) && (0.0..SIDE as f64).contains(&y));
        }
        let [(_, low), (_, high)] = [-1.0, 1.0].map(|z| side.place(vec3(0.0, 0.0, z)));
        assert!(high < low, "up is up");
    }

    #[test]
    fn doubted_cameras_are_named_in_colour_and_far_ones_do_not_squeeze_the_others() {
        let (mut cameras, points) = (cameras(), vec![vec3(0.1, 0.2, 0.3); 5]);
        let plain = draw(&scene(&cameras, &points));
        assert_eq!(plain.count(WARNING), 0);
        assert!(plain.count(of_part("train")) > 400 && plain.count(POINT) > 2);
        cameras[3].world_from_camera.translation = vec3(900.0, 0.0, 0.0);
        let mut far = scene(&cameras, &points);
        (far.cameras[3].doubted, far.cameras[3].is_far) = (Some("far.png"), true);
        assert!(draw(&far).count(WARNING) > 100);
        assert!(views(&far)[0].extent < 20.0);
    }

    #[test]
    fn degenerate_layouts_are_drawn() {
        let camera = &cameras()[..1];
        let mut one = scene(camera, &[]);
        (one.along, one.bounds) = (Vec3::zero() * f64::NAN, Aabb::new(Vec3::zero(), Vec3::zero()));
        assert!(draw(&one).count(INK) > 100);
    }
}
