//! Photographs that are there twice, and poses that are.

use super::compared::Compared;
use super::doubt::{Doubt, Kind};
use super::look::Look;
use super::measures::Measures;
use super::statistics::median;
use refraxel_core::Camera;
use refraxel_data::View;

/// Mean difference of two signatures up to which the pictures are one [level of 255]: JPEG changes less.
const ONE: f64 = 0.6;
/// The same as a part of what neighbours differ by, where that is less; up to it, views from elsewhere are doubted too.
const PART: f64 = 0.25;
/// Pictures with less contrast than this all look alike [level of 255].
const PLAIN: f64 = 4.0;
/// Poses further apart show something else: position in distances of the camera, direction [radian].
const ELSEWHERE: f64 = 0.1;
/// Poses as near as this are one.
const SAME_POSE: f64 = 1e-5;
/// Correlation of signatures below which two pictures show different things.
const ALIKE: f64 = 0.5;

/// One picture that is compared with others.
struct Signed<'a> {
    view: usize,
    signature: &'a [u8],
    mean: f64,
    /// The least difference from a neighbour; infinite where there is none.
    nearest: f64,
}

/// Doubts about views that show the picture of another one, or have its pose; `distance` is that of the cameras
/// [scene unit].
pub fn doubts(
    views: &[View],
    names: &[String],
    parts: &[&str],
    looks: &[Look],
    compared: &[Compared],
    distance: f64,
) -> Vec<Doubt> {
    let mut signed = signed(looks, compared);
    signed.sort_by(|a, b| a.mean.total_cmp(&b.mean));
    let usual = median(signed.iter().map(|s| s.nearest)).unwrap_or(0.0);
    let apart = |a: usize, b: usize| apart(&views[a].camera, &views[b].camera, distance);
    let mut found: Vec<Doubt> = Vec::new();
    for (k, a) in signed.iter().enumerate() {
        // Means differ by no more than pictures do.
        for b in
            signed[k + 1..].iter().take_while(|b| b.mean - a.mean <= ONE.max(PART * a.nearest.min(usual)))
        {
            let difference = difference(a.signature, b.signature);
            let away = apart(a.view, b.view);
            let one = difference <= ONE.min(PART * usual);
            let alike = away > ELSEWHERE && difference < PART * a.nearest.min(b.nearest).min(usual);
            if one || alike {
                let (first, second) = (a.view.min(b.view), a.view.max(b.view));
                let is_told = found.iter().any(|d| d.kind == Kind::Same && d.view == second);
                if !is_told {
                    found.push(same(names, parts, first, second, away, one));
                }
            }
        }
    }
    found.extend(same_poses(names, &signed, &apart));
    found.sort_by_key(|d| d.view);
    found
}

fn signed<'a>(looks: &'a [Look], compared: &[Compared]) -> Vec<Signed<'a>> {
    let usable = |k: usize| looks[k].measures.as_ref().ok().filter(|m: &&Measures| m.contrast > PLAIN);
    let sign = |k: usize| {
        let signature = &usable(k)?.signature;
        let others = compared[k].neighbours.iter().filter_map(|&n| usable(n));
        let nearest = others.map(|o| difference(signature, &o.signature)).fold(f64::INFINITY, f64::min);
        let mean = signature.iter().map(|v| f64::from(*v)).sum::<f64>() / signature.len().max(1) as f64;
        Some(Signed { view: looks[k].view, signature, mean, nearest })
    };
    (0..looks.len()).filter_map(sign).collect()
}

/// Mean absolute difference [level of 255]; infinite for pictures of different shapes.
fn difference(a: &[u8], b: &[u8]) -> f64 {
    if a.len() != b.len() || a.is_empty() {
        return f64::INFINITY;
    }
    let sum: u32 = a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(*b))).sum();
    f64::from(sum) / a.len() as f64
}

/// How far two poses are apart: a camera distance counts as much as a radian.
fn apart(a: &Camera, b: &Camera, distance: f64) -> f64 {
    let away = (a.world_from_camera.translation - b.world_from_camera.translation).length();
    away / distance.max(f64::MIN_POSITIVE) + angle(a, b)
}

fn angle(a: &Camera, b: &Camera) -> f64 {
    (0..3)
        .map(|k| {
            let [a, b] = [a, b].map(|c| c.world_from_camera.rotation.columns[k]);
            2.0 * (0.5 * (a - b).length()).clamp(0.0, 1.0).asin()
        })
        .fold(0.0, f64::max)
}

fn same(names: &[String], parts: &[&str], first: usize, second: usize, away: f64, one: bool) -> Doubt {
    let (a, b) = (&names[first], &names[second]);
    let what = if one { "show the same picture" } else { "show nearly the same picture" };
    let message = if away > ELSEWHERE {
        format!(
            "{b} and {a} {what}, but their cameras stand or look elsewhere: one of the poses is wrong; leave one out"
        )
    } else if parts[first] != parts[second] {
        format!(
            "{b} ({}) and {a} ({}) {what}: the score of a view that training sees, too, is meaningless; leave one out",
            parts[second], parts[first]
        )
    } else {
        format!("{b} and {a} {what}: one of them adds no information; leave one out")
    };
    Doubt { view: second, kind: Kind::Same, message, short: format!("same as {a}") }
}

/// Views that have the pose of another one and show something else.
fn same_poses(names: &[String], signed: &[Signed<'_>], apart: &dyn Fn(usize, usize) -> f64) -> Vec<Doubt> {
    let mut found = Vec::new();
    for (k, a) in signed.iter().enumerate() {
        let other = signed.iter().enumerate().find(|(l, b)| {
            *l != k
                && b.view < a.view
                && apart(a.view, b.view) < SAME_POSE
                && correlation(a.signature, b.signature) < ALIKE
        });
        if let Some((_, b)) = other {
            let (a_name, b_name) = (&names[a.view], &names[b.view]);
            let message = format!(
                "{a_name} and {b_name} have the same pose and show different things: one of the poses is wrong; \
                leave one out"
            );
            let short = format!("pose of {b_name}");
            found.push(Doubt { view: a.view, kind: Kind::SamePose, message, short });
        }
    }
    found
}

fn correlation(a: &[u8], b: &[u8]) -> f64 {
    if a.len() != b.len() || a.is_empty() {
        return 0.0;
    }
    let mean = |v: &[u8]| v.iter().map(|x| f64::from(*x)).sum::<f64>() / v.len() as f64;
    let (ma, mb) = (mean(a), mean(b));
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        let (x, y) = (f64::from(*x) - ma, f64::from(*y) - mb);
        ab += x * y;
        aa += x * x;
        bb += y * y;
    }
    ab / (aa * bb).sqrt().max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::super::compared::compare;
    use super::*;
    use refraxel_core::{Vec3, vec3};

    const VIEWS: usize = 12;

    /// Cameras on a ring, and of each what `signature` says.
    fn found(pose: impl Fn(usize) -> usize, signature: impl Fn(usize, usize) -> u8) -> Vec<Doubt> {
        let place = |k: usize| {
            let angle = pose(k) as f64 / VIEWS as f64 * std::f64::consts::TAU;
            let eye = vec3(3.0 * angle.cos(), 3.0 * angle.sin(), 1.0);
            View::of_file(
                format!("{k}.png"),
                Camera::look_at(eye, Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.8, [8, 8]),
            )
        };
        let look = |view: usize| {
            let signature = (0..64).map(|p| signature(view, p)).collect();
            let measures = Measures { contrast: 40.0, signature, ..Measures::default() };
            Look { view, measures: Ok(measures), picture: None }
        };
        let views: Vec<View> = (0..VIEWS).map(place).collect();
        let looks: Vec<Look> = (0..VIEWS).map(look).collect();
        let names: Vec<String> = views.iter().map(|v| v.name.clone()).collect();
        let parts: Vec<&str> = (0..VIEWS).map(|k| if k == 0 { "test" } else { "train" }).collect();
        doubts(&views, &names, &parts, &looks, &compare(&views, &looks, 3.0), 3.0)
    }

    fn noise(view: usize, pixel: usize) -> u8 {
        let mixed = (view as u32 * 64 + pixel as u32 + 1).wrapping_mul(2_654_435_761);
        ((mixed ^ (mixed >> 15)).wrapping_mul(2_246_822_519) >> 20) as u8
    }

    #[test]
    fn a_picture_with_two_names_is_told_with_what_is_wrong_about_it() {
        let of = |a: usize, b: usize, pose: &dyn Fn(usize) -> usize| {
            let mut found = found(pose, |v, p| noise(if v == b { a } else { v }, p));
            assert_eq!(found.len(), 1, "{found:?}");
            found.remove(0)
        };
        let elsewhere = of(3, 8, &|k| k);
        assert!(elsewhere.view == 8 && elsewhere.message.contains("one of the poses is wrong"));
        let twice = of(3, 8, &|k| if k == 8 { 3 } else { k });
        assert!(twice.message.contains("8.png and 3.png") && twice.message.contains("adds no information"));
        let held_out = of(0, 8, &|k| if k == 8 { 0 } else { k });
        assert!(held_out.message.contains("that training sees, too"), "{}", held_out.message);
    }

    #[test]
    fn two_pictures_with_one_pose_are_told() {
        let found = found(|k| if k == 8 { 3 } else { k }, noise);
        assert_eq!(found.iter().map(|d| (d.view, d.kind)).collect::<Vec<_>>(), [(8, Kind::SamePose)]);
    }

    #[test]
    fn scenes_that_look_alike_from_everywhere_are_not_doubted() {
        assert_eq!(found(|k| k, |view, p| noise(0, p) / 2 + (noise(view, p) % 8)), []);
        assert_eq!(found(|k| k, noise), []);
    }
}
