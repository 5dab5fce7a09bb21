//! Doubts about where cameras stand and look.

use super::doubt::{Doubt, Kind};
use super::statistics::{median, quantile};
use refraxel_core::{Aabb, Vec3, vec3};
use refraxel_data::inspect::Finding;
use refraxel_data::{Region, Severity, View, is_one_place, sees_box};

/// Share of the cameras that see the box where a camera that does not is doubted.
const MOST_SEE: f64 = 0.8;
/// Distance from the middle of all cameras, in that of three quarters of them, at which a camera is far away.
const FAR: f64 = 4.0;
/// Cameras this near to each other, as a part of that distance, are far away together, and on purpose.
const TOGETHER: f64 = 0.25;
/// Fewer cameras say nothing about each other.
const LEAST: usize = 4;
/// Largest distance from a line, as a part of its length, of cameras on a line.
const LINE: f64 = 0.03;
/// Range of heights, as a part of the distance from the scene, of cameras at one height.
const LEVEL: f64 = 0.03;

/// How the cameras of a dataset lie.
pub struct Layout {
    /// Median distance of the cameras from the middle of the scene [scene unit].
    pub distance: f64,
    /// Unit vector along which they extend farthest.
    pub along: Vec3<f64>,
    /// What is doubted of single cameras.
    pub doubts: Vec<Doubt>,
    /// What is said of all.
    pub findings: Vec<Finding>,
}

/// Looks at the cameras of all views.
pub fn layout(views: &[View], names: &[String], region: &Region) -> Layout {
    let places: Vec<Vec3<f64>> = views.iter().map(|v| v.camera.world_from_camera.translation).collect();
    let center = region.bounds.center();
    let distance = median(places.iter().map(|p| (*p - center).length())).unwrap_or(1.0);
    let (far, away) = (far(&places), away(views, &region.bounds));
    let near: Vec<Vec3<f64>> = (0..places.len()).filter(|&i| far[i].is_none()).map(|i| places[i]).collect();
    let (along, width) = line(&near);
    let mut doubts = Vec::new();
    for (view, name) in names.iter().enumerate() {
        doubts.extend(far[view].map(|times| far_doubt(view, name, times)));
        doubts.extend((away[view] && far[view].is_none()).then(|| away_doubt(view, name)));
    }
    let findings = arrangement(views, &near, region.up, (along.length(), width), distance);
    Layout { distance, along: along.normalized(), doubts, findings }
}

fn far_doubt(view: usize, name: &str, times: f64) -> Doubt {
    let message = format!(
        "the camera of {name} stands alone, {times:.1} times as far away as three quarters of the others: its pose \
        is probably wrong; leave it out"
    );
    Doubt { view, kind: Kind::FarAway, message, short: format!("{times:.1} x as far") }
}

fn away_doubt(view: usize, name: &str) -> Doubt {
    let message = format!(
        "the camera of {name} looks away from the scene, and nothing of the box is in its picture: its pose is \
        probably wrong; leave it out"
    );
    Doubt { view, kind: Kind::LooksAway, message, short: "looks away".to_owned() }
}

/// Of each place how many times as far it is from the middle as others are, where it is far away and alone.
fn far(places: &[Vec3<f64>]) -> Vec<Option<f64>> {
    let middle = [0, 1, 2].map(|axis| median(places.iter().map(|p| p[axis])).unwrap_or(0.0));
    let middle = vec3(middle[0], middle[1], middle[2]);
    let usual = quantile(places.iter().map(|p| (*p - middle).length()), 0.75).unwrap_or(0.0);
    let of = |i: usize| {
        let radius = (places[i] - middle).length();
        let is_alone =
            || (0..places.len()).all(|k| k == i || (places[k] - places[i]).length() > TOGETHER * radius);
        (places.len() >= LEAST && usual > 0.0 && radius > FAR * usual && is_alone()).then(|| radius / usual)
    };
    (0..places.len()).map(of).collect()
}

/// Which cameras see nothing of the box, where most see it.
fn away(views: &[View], bounds: &Aabb<f64>) -> Vec<bool> {
    let sees: Vec<bool> = views.iter().map(|v| sees_box(&v.camera, bounds)).collect();
    let share = sees.iter().filter(|s| **s).count() as f64 / sees.len().max(1) as f64;
    let is_doubted = share >= MOST_SEE && views.len() >= LEAST;
    sees.into_iter().map(|s| is_doubted && !s).collect()
}

/// From one end of the places to the other, and how far any of them is from the line between.
fn line(places: &[Vec3<f64>]) -> (Vec3<f64>, f64) {
    let farthest = |from: Vec3<f64>| {
        let away = |p: &Vec3<f64>| (*p - from).length();
        places.iter().copied().max_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(from)
    };
    let Some(&first) = places.first() else { return (Vec3::zero(), 0.0) };
    let start = farthest(first);
    let along = farthest(start) - start;
    let beside = |p: &Vec3<f64>| {
        let unit = along.normalized();
        (*p - start - unit * (*p - start).dot(unit)).length()
    };
    let width = if along.length() > 0.0 { places.iter().map(beside).fold(0.0, f64::max) } else { 0.0 };
    (along, width)
}

fn arrangement(
    views: &[View],
    places: &[Vec3<f64>],
    up: Vec3<f64>,
    (length, width): (f64, f64),
    distance: f64,
) -> Vec<Finding> {
    if places.len() < LEAST || is_one_place(views.iter().map(|v| &v.camera)) {
        return Vec::new();
    }
    if width <= LINE * length {
        let message = "all cameras stand on one line: depth across it is hardly known, and the reconstruction will \
        be poor; add photographs from other sides and heights";
        return vec![Finding { severity: Severity::Warning.name(), message: message.to_owned() }];
    }
    let heights = || places.iter().map(|p| p.dot(up));
    let range = quantile(heights(), 0.95).unwrap_or(0.0) - quantile(heights(), 0.05).unwrap_or(0.0);
    let message = "all cameras stand at one height: what only other heights show, such as flat tops and bottoms, \
    will be poor; add photographs from two more heights";
    let finding = || Finding { severity: Severity::Note.name(), message: message.to_owned() };
    (range < LEVEL * distance).then(finding).into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::Camera;

    fn views(eyes: &[[f64; 3]]) -> (Vec<View>, Vec<String>) {
        let look = |e: &[f64; 3]| {
            Camera::look_at(vec3(e[0], e[1], e[2]), Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.6, [20, 20])
        };
        let names: Vec<String> = (0..eyes.len()).map(|k| format!("{k}.png")).collect();
        (eyes.iter().zip(&names).map(|(e, n)| View::of_file(n, look(e))).collect(), names)
    }

    fn ring(height: impl Fn(usize) -> f64) -> Vec<[f64; 3]> {
        let place = |k: usize| {
            let angle = k as f64 * 0.5;
            [4.0 * angle.cos(), 4.0 * angle.sin(), height(k)]
        };
        (0..12).map(place).collect()
    }

    fn found(eyes: &[[f64; 3]], edit: impl FnOnce(&mut [View])) -> Layout {
        let (mut views, names) = views(eyes);
        edit(&mut views);
        let bounds = Aabb::cube(1.0);
        layout(
            &views,
            &names,
            &Region { bounds, up: vec3(0.0, 0.0, 1.0), unbounded: false, projection: None },
        )
    }

    fn said(layout: &Layout, word: &str) -> bool {
        layout.findings.len() == 1 && layout.findings[0].message.contains(word)
    }

    #[test]
    fn good_cameras_are_not_doubted() {
        let good = found(&ring(|k| 1.0 + (k % 3) as f64), |_| {});
        assert!(good.doubts.is_empty() && good.findings.is_empty(), "{:?}", good.doubts);
    }

    #[test]
    fn cameras_on_a_line_and_at_one_height_are_told() {
        assert!(said(&found(&ring(|_| 1.0), |_| {}), "one height"));
        let line: Vec<[f64; 3]> = (0..9).map(|k| [4.0, k as f64 - 4.0, 0.1 * k as f64]).collect();
        assert!(said(&found(&line, |_| {}), "one line"));
    }

    #[test]
    fn single_cameras_far_away_or_looking_away_are_named() {
        let mut eyes = ring(|k| 1.0 + (k % 3) as f64);
        eyes[5] = [90.0, 10.0, 1.0];
        let layout = found(&eyes, |views| {
            let c = &mut views[2].camera;
            let eye = c.world_from_camera.translation;
            *c = Camera::look_at(eye, eye * 2.0, vec3(0.0, 0.0, 1.0), 0.6, [20, 20]);
        });
        let told: Vec<(usize, Kind)> = layout.doubts.iter().map(|d| (d.view, d.kind)).collect();
        assert_eq!(told, [(2, Kind::LooksAway), (5, Kind::FarAway)]);
        assert!(layout.doubts[0].message.contains("2.png"));
    }

    #[test]
    fn cameras_that_look_around_are_not_doubted() {
        let outward = found(&ring(|k| (k % 3) as f64), |views| {
            for view in views {
                let eye = view.camera.world_from_camera.translation;
                view.camera = Camera::look_at(eye, eye * 2.0, vec3(0.0, 0.0, 1.0), 0.6, [20, 20]);
            }
        });
        assert!(outward.doubts.is_empty());
    }
}
