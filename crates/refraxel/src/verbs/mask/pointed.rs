//! What somebody points at: clicks, boxes and outlines in photographs.

use crate::cli::MaskArgs;
use crate::exit::{Exit, Failure};
use refraxel_core::Camera;
use refraxel_data::{Dataset, Mask};
use refraxel_train::detection::Hints;
use std::path::Path;
use std::sync::Arc;

/// Words on the command line per click and per box.
const CLICK: usize = 3;
const BOX: usize = 5;

/// What is known by pointing at it.
pub struct Pointed {
    /// Lines of sight and boxes.
    pub hints: Hints,
    /// Outlines as masks, with the numbers of their views.
    pub outlines: Vec<(usize, Arc<Mask>)>,
}

impl Pointed {
    /// Understands the command line.
    pub fn new(args: &MaskArgs, data: &Dataset) -> Result<Self, Failure> {
        let mut hints = Hints::default();
        for words in args.click.chunks(CLICK) {
            let view = view(data, &words[0])?;
            let camera = &data.views[view].camera;
            let at = [number(&words[1], "--click")?, number(&words[2], "--click")?];
            within(camera, at, &words[0])?;
            let ray = camera
                .ray(at[0], at[1])
                .ok_or_else(|| Exit::Usage.because(format!("the lens of {} sees nothing there", words[0])))?;
            hints.clicks.push(ray.cast());
        }
        for words in args.boxes.chunks(BOX) {
            let view = view(data, &words[0])?;
            let camera = data.views[view].camera;
            let mut corners = [[0.0; 2]; 2];
            for (k, word) in words[1..].iter().enumerate() {
                corners[k / 2][k % 2] = number(word, "--box")?;
            }
            let [a, b] = corners;
            let inside = |x: f64, y: f64| {
                x >= a[0].min(b[0]) && x <= a[0].max(b[0]) && y >= a[1].min(b[1]) && y <= a[1].max(b[1])
            };
            let mask = drawn(&camera, inside);
            if mask.coverage.iter().all(|c| *c == 0) {
                return Err(Exit::Usage.because(format!(
                    "the box in {} holds no pixel of {}",
                    words[0],
                    size(&camera)
                )));
            }
            hints.within.push((camera, Arc::new(mask)));
        }
        let outlines = polygons(&args.outline, data)?;
        // Those in training views guide as masks do, too; held-out photographs are not looked at.
        let outlined = outlines.iter().filter(|(view, _)| !data.split.train.contains(view));
        hints.within.extend(outlined.map(|(view, mask)| (data.views[*view].camera, Arc::clone(mask))));
        Ok(Self { hints, outlines })
    }
}

/// Outlines as masks, with their views: a word that is no point begins another one.
fn polygons(words: &[String], data: &Dataset) -> Result<Vec<(usize, Arc<Mask>)>, Failure> {
    let mut all: Vec<(usize, Vec<[f64; 2]>)> = Vec::new();
    for word in words {
        match (point(word), all.last_mut()) {
            (Some(at), Some((_, points))) => points.push(at),
            _ => all.push((view(data, word)?, Vec::new())),
        }
    }
    let mut masks: Vec<(usize, Arc<Mask>)> = Vec::new();
    for (view, points) in all {
        let (camera, name) = (&data.views[view].camera, &data.views[view].name);
        if points.len() < 3 {
            return Err(Exit::Usage.because(format!(
                "the outline in {name} has {} points; give at least three, as X,Y",
                points.len()
            )));
        }
        let mut mask = drawn(camera, |x, y| is_inside(&points, x, y));
        if mask.coverage.iter().all(|c| *c == 0) {
            return Err(
                Exit::Usage.because(format!("the outline in {name} holds no pixel of {}", size(camera)))
            );
        }
        // Several outlines in one photograph are several things.
        if let Some((_, other)) = masks.iter_mut().find(|(v, _)| *v == view) {
            mask.coverage.iter_mut().zip(&other.coverage).for_each(|(c, o)| *c = (*c).max(*o));
            *other = Arc::new(mask);
        } else {
            masks.push((view, Arc::new(mask)));
        }
    }
    Ok(masks)
}

/// The view of a name, with or without extension.
fn view(data: &Dataset, name: &str) -> Result<usize, Failure> {
    let stem = |n: &str| Path::new(n).with_extension("").to_string_lossy().into_owned();
    let by = |same: &dyn Fn(&str) -> bool| {
        (0..data.views.len()).filter(|&v| same(&data.views[v].name)).collect::<Vec<_>>()
    };
    let exact = by(&|n| n == name);
    let found = if exact.is_empty() { by(&|n| stem(n) == name) } else { exact };
    match found[..] {
        [view] => Ok(view),
        [] => {
            let some: Vec<&str> = data.views.iter().take(3).map(|v| v.name.as_str()).collect();
            Err(Exit::Usage
                .because(format!("no photograph is called '{name}'; the data have {} …", some.join(", "))))
        }
        _ => {
            // The same name in several parts of the split: training views come first.
            let in_train = found.iter().copied().find(|v| data.split.train.contains(v));
            in_train.ok_or_else(|| {
                Exit::Usage.because(format!("{} photographs are called '{name}'", found.len()))
            })
        }
    }
}

/// A mask that is white where a pixel's centre is inside.
fn drawn(camera: &Camera, inside: impl Fn(f64, f64) -> bool) -> Mask {
    let (width, height) = (camera.width, camera.height);
    let pixel = |p: u32| if inside(f64::from(p % width) + 0.5, f64::from(p / width) + 0.5) { 255 } else { 0 };
    Mask { width, height, coverage: (0..width * height).map(pixel).collect() }
}

/// Whether a point lies in a polygon: a ray from it crosses the edges an odd number of times.
fn is_inside(points: &[[f64; 2]], x: f64, y: f64) -> bool {
    let edges = points.iter().zip(points.iter().cycle().skip(1));
    let crossed = edges
        .filter(|(a, b)| (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) * (b[0] - a[0]) / (b[1] - a[1]));
    crossed.count() % 2 == 1
}

fn point(word: &str) -> Option<[f64; 2]> {
    let (x, y) = word.split_once(',')?;
    let number = |w: &str| w.trim().parse().ok().filter(|n: &f64| n.is_finite());
    Some([number(x)?, number(y)?])
}

fn number(word: &str, flag: &str) -> Result<f64, Failure> {
    let number = word.parse().ok().filter(|n: &f64| n.is_finite());
    number.ok_or_else(|| {
        Exit::Usage.because(format!("{flag} got '{word}', expected a number of pixels, such as 640"))
    })
}

fn within(camera: &Camera, at: [f64; 2], name: &str) -> Result<(), Failure> {
    let is_within =
        (0.0..=f64::from(camera.width)).contains(&at[0]) && (0.0..=f64::from(camera.height)).contains(&at[1]);
    let outside = || {
        Exit::Usage.because(format!(
            "({}, {}) is outside of {name}, which has {}",
            at[0],
            at[1],
            size(camera)
        ))
    };
    is_within.then_some(()).ok_or_else(outside)
}

fn size(camera: &Camera) -> String {
    format!("{} x {} pixels", camera.width, camera.height)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_that_is_not_convex_leaves_its_notch_out() {
        let notched = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [5.0, 3.0], [0.0, 10.0]];
        assert!(is_inside(&notched, 5.0, 2.0) && is_inside(&notched, 1.0, 7.0));
        assert!(!is_inside(&notched, 5.0, 6.0) && !is_inside(&notched, 11.0, 5.0));
    }

    #[test]
    fn points_are_numbers_with_a_comma() {
        assert_eq!(point("3,-4.5"), Some([3.0, -4.5]));
        assert!(["IMG_1,2.jpg", "3", "3,", "nan,1"].iter().all(|w| point(w).is_none()));
    }
}
