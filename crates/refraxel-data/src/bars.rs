//! Frames, bars and corners of one colour that are no part of a photograph: films, scanners, lenses and programs leave them.

use crate::image::Image;
use crate::looks::{Look, SAME, common_colour, is_within, rgb};
use crate::{Backdrop, Crop, Problem};

/// Share of a row that has the colour of a bar.
const FULL: f64 = 0.98;
/// Mean share of the first row behind it that has it, too, at most. Things before a plain backdrop leave more of it beside them.
const BEHIND: f64 = 0.1;
/// A bar is as wide in all photographs to within so many pixels of the small ones.
const EVEN: usize = 1;
/// Edge of a corner in the shorter edge of the picture.
const CORNER: f64 = 0.04;
/// Fewest photographs that show what they have in common.
const FEWEST: usize = 3;

/// What all photographs that were looked at have around what they show.
pub(crate) struct Bars {
    /// Their width on the left, on top, on the right, at the bottom [pixel of the small photographs].
    widths: [usize; 4],
    pub problem: Problem,
}

/// The bars that all of these photographs have.
pub(crate) fn bars(looks: &[Look]) -> Option<Bars> {
    let size = |look: &Look| [look.small.width, look.small.height];
    let first = looks
        .first()
        .filter(|first| looks.len() >= FEWEST && looks.iter().all(|l| size(l) == size(first)))?;
    let plain = SIDES.map(|side| plain(looks, side));
    let colour = plain.iter().flatten().map(|bar| bar.colour).next()?;
    let has_end =
        |side: usize, bar: &Plain| is_within(bar.colour, colour, SAME) && ends(looks, side, bar, &plain);
    let widths =
        SIDES.map(|side| plain[side].as_ref().filter(|bar| has_end(side, bar)).map_or(0, |bar| bar.width));
    // Pixels of the files, and one more where some of the small ones are mixed.
    let scale = f64::from(first.size[0]) / f64::from(first.small.width);
    let wide = |n: usize| if n == 0 { 0 } else { (n as f64 * scale).ceil() as u32 + u32::from(scale > 1.0) };
    let [left, top, right, bottom] = widths.map(wide);
    let crop = Crop { left, top, right, bottom };
    crop.size(first.size).filter(|_| !crop.is_none())?;
    let problem = Problem::warning(format!(
        "all photographs that were looked at have bars of the colour {} around what they show; --crop {crop} cuts them off, otherwise they \
         are taken for things before the cameras",
        Backdrop::Color(colour)
    ));
    Some(Bars { widths, problem })
}

impl Bars {
    /// The pixels behind the bars, around what a photograph shows.
    pub fn inner_border(&self, look: &Look) -> Vec<[f32; 4]> {
        let image = &look.small;
        let [left, top, right, bottom] = self.widths.map(|w| if w > 0 { w + EVEN } else { 0 });
        let (w, h) = (image.width as usize, image.height as usize);
        let (columns, rows) = (left..w - right, top..h - bottom);
        let across = [top, h - bottom - 1].into_iter().flat_map(|y| columns.clone().map(move |x| [x, y]));
        let down = [left, w - right - 1].into_iter().flat_map(|x| rows.clone().map(move |y| [x, y]));
        across.chain(down).map(|[x, y]| image.rgba(y * w + x)).collect()
    }
}

/// Left, top, right, bottom.
const SIDES: [usize; 4] = [0, 1, 2, 3];

/// Rows or columns of one colour along a side of all photographs.
struct Plain {
    width: usize,
    colour: [f32; 3],
}

/// What is plain along one side, where that is as wide in all photographs.
fn plain(looks: &[Look], side: usize) -> Option<Plain> {
    let colour = common_colour(line(&looks.first()?.small, side, 0).into_iter())?;
    let half = looks[0].small.width.min(looks[0].small.height) as usize / 2;
    let width = |look: &Look| {
        (0..half).take_while(|&depth| share(&line(&look.small, side, depth), colour) >= FULL).count()
    };
    let widths: Vec<usize> = looks.iter().map(width).collect();
    let (least, most) = (*widths.iter().min()?, *widths.iter().max()?);
    (least > 0 && most <= least + EVEN && most + EVEN < half).then_some(Plain { width: most, colour })
}

/// Whether something else begins behind it all along, between what is plain along the other sides. One row more is a mixture, and a row
/// that is plain as well continues the shades of a backdrop.
fn ends(looks: &[Look], side: usize, bar: &Plain, all: &[Option<Plain>; 4]) -> bool {
    let width = |side: usize| all[side].as_ref().map_or(0, |bar| bar.width + EVEN);
    let [before, after] = if side.is_multiple_of(2) { [1, 3] } else { [0, 2] }.map(width);
    let behind = |look: &Look| {
        let line = line(&look.small, side, bar.width + EVEN);
        let between = line.get(before..line.len() - after).unwrap_or_default();
        let own = common_colour(between.iter().copied()).unwrap_or(bar.colour);
        if share(between, own) >= FULL { 1.0 } else { share(between, bar.colour) }
    };
    looks.iter().map(behind).sum::<f64>() < BEHIND * looks.len() as f64
}

fn share(line: &[[f32; 3]], colour: [f32; 3]) -> f64 {
    line.iter().filter(|p| is_within(**p, colour, SAME)).count() as f64 / line.len().max(1) as f64
}

/// A row or column at some depth from one side.
fn line(image: &Image, side: usize, depth: usize) -> Vec<[f32; 3]> {
    let (w, h) = (image.width as usize, image.height as usize);
    let at = |x: usize, y: usize| rgb(image.rgba(y * w + x));
    match side {
        0 => (0..h).map(|y| at(depth, y)).collect(),
        1 => (0..w).map(|x| at(x, depth)).collect(),
        2 => (0..h).map(|y| at(w - 1 - depth, y)).collect(),
        _ => (0..w).map(|x| at(x, h - 1 - depth)).collect(),
    }
}

/// A warning where all photographs have corners of one colour, and something else at the middles of their sides.
pub(crate) fn corners(looks: &[Look]) -> Option<Problem> {
    let colour = looks.first().filter(|_| looks.len() >= FEWEST).map(|look| rgb(look.small.rgba(0)))?;
    let is_plain = |look: &Look, [x, y]: [u32; 2]| {
        let edge = edge(&look.small);
        let pixels = (y..y + edge).flat_map(|y| (x..x + edge).map(move |x| [x, y]));
        pixels
            .map(|[x, y]| rgb(look.small.rgba((y * look.small.width + x) as usize)))
            .all(|p| is_within(p, colour, SAME))
    };
    let is_circle = |look: &Look| {
        let [right, bottom] = [look.small.width, look.small.height].map(|n| n - edge(&look.small));
        let corners = [[0, 0], [right, 0], [0, bottom], [right, bottom]];
        let middles = [[right / 2, 0], [right / 2, bottom], [0, bottom / 2], [right, bottom / 2]];
        corners.into_iter().all(|at| is_plain(look, at)) && !middles.into_iter().any(|at| is_plain(look, at))
    };
    looks.iter().all(is_circle).then(|| {
        Problem::warning(format!(
            "the corners of all photographs that were looked at have the colour {}, as beyond the image circle of a fisheye lens or behind a \
             correction of lenses: they are taken for things before the cameras; give masks that leave them out, or cut them off by --crop",
            Backdrop::Color(colour)
        ))
    })
}

fn edge(image: &Image) -> u32 {
    ((CORNER * f64::from(image.width.min(image.height))) as u32).max(1)
}
