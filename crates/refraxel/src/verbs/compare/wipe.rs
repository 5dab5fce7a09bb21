//! Two renderings of one view, a boundary that wanders between them: an animated GIF.
//!
//! Each frame holds the strip alone that the boundary has passed, so that the file is about as large as three pictures.

use crate::canvas::{Align, Canvas, Colour, Font, INK, PAPER, Rect};
use crate::exit::{Exit, Failure, OrExit};
use gif::{DisposalMethod, Encoder, EncodingError, Frame, Repeat};
use refraxel_data::atomic::write_atomic;
use refraxel_train::metrics::Rgb8;
use std::io;
use std::path::Path;

/// Narrower pictures are enlarged by a whole factor [pixel].
const WIDTH: usize = 400;
/// Height of the line with the captions [pixel].
const CAPTIONS: usize = 26;
/// Width of the boundary [pixel].
const BOUNDARY: usize = 2;
/// Frames in which the boundary crosses the picture.
const FRAMES: usize = 28;
/// Time of a frame, and of those at which the boundary turns [1/100 s].
const TIMES: [u16; 2] = [5, 120];
/// Colours of a frame are sought in one of so many pixels.
const SPEED: i32 = 1;

/// One of the two renderings.
pub struct Side<'a> {
    /// What it shows.
    pub caption: String,
    /// sRGB, rows from the top.
    pub pixels: &'a [[u8; 3]],
}

/// Refuses names that are not those of a GIF, and more or less than two runs.
pub fn check(out: &Path, runs: usize) -> Result<(), Failure> {
    let (is_gif, out) = (out.extension().is_some_and(|e| e.eq_ignore_ascii_case("gif")), out.display());
    let why = match runs {
        2 if is_gif => return Ok(()),
        2 => format!("--wipe {out}: found another ending than .gif; give a name such as wipe.gif"),
        _ => format!("--wipe {out} shows two runs; found {runs}"),
    };
    Err(Exit::Usage.because(why))
}

/// Writes the film of two renderings of this size: the first is shown in full at the beginning, the second half-way.
pub fn write(sides: &[Side<'_>; 2], size: [usize; 2], out: &Path) -> Result<(), Failure> {
    let film = encode(&sheets(sides, size)).map_err(io::Error::other).or_exit(Exit::Io)?;
    Ok(write_atomic(out, |f| f.write_all(&film))?)
}

/// Both pictures with the captions above them.
fn sheets(sides: &[Side<'_>; 2], [width, height]: [usize; 2]) -> [Canvas; 2] {
    let factor = WIDTH.div_ceil(width).max(1);
    let (wide, high) = (factor * width, factor * height);
    let [left, right] = [&sides[0].caption, &sides[1].caption];
    [0, 1].map(|k| {
        let mut sheet = Canvas::new(wide, CAPTIONS + high, PAPER);
        sheet.text((2, 3), left, Font::Strong.style(Align::Left, INK));
        sheet.text((wide as i64 - 2, 3), right, Font::Strong.style(Align::Right, INK));
        let from = sides[k].pixels;
        let pixel = |p: usize| from[p / wide / factor * width + p % wide / factor];
        let large: Vec<Colour> = (0..wide * high).map(pixel).collect();
        sheet.paste(0, CAPTIONS, Rgb8::new(&large, wide, high));
        sheet
    })
}

fn encode(sheets: &[Canvas; 2]) -> Result<Vec<u8>, EncodingError> {
    let (width, height) = (sheets[0].width(), sheets[0].height());
    let mut film = Vec::new();
    let too_large =
        |_| EncodingError::from(io::Error::other("a GIF has at most 65 535 pixels along an edge"));
    let size = [u16::try_from(width).map_err(too_large)?, u16::try_from(height).map_err(too_large)?];
    let mut encoder = Encoder::new(&mut film, size[0], size[1], &[])?;
    encoder.set_repeat(Repeat::Infinite)?;
    let places = places(width);
    for (k, &place) in places.iter().enumerate() {
        let before = if k == 0 { None } else { Some(places[k - 1]) };
        let rect = match before {
            None => Rect { x: 0, y: 0, width, height },
            Some(before) => {
                let (low, high) = (place.min(before), (place.max(before) + BOUNDARY).min(width));
                Rect { x: low, y: CAPTIONS, width: high - low, height: height - CAPTIONS }
            }
        };
        let pixels: Vec<u8> = strip(sheets, rect, place).into_flattened();
        let mut frame = Frame::from_rgb_speed(rect.width as u16, rect.height as u16, &pixels, SPEED);
        (frame.left, frame.top) = (rect.x as u16, rect.y as u16);
        let turns = place == 0 || place == width;
        (frame.delay, frame.dispose) = (TIMES[usize::from(turns)], DisposalMethod::Keep);
        encoder.write_frame(&frame)?;
    }
    drop(encoder);
    Ok(film)
}

/// Where the boundary is in each frame: from the right edge to the left one and back, slow at both.
fn places(width: usize) -> Vec<usize> {
    let place = |k: usize| {
        let angle = std::f64::consts::PI * k as f64 / FRAMES as f64;
        (0.5 * (1.0 + angle.cos()) * width as f64).round() as usize
    };
    (0..2 * FRAMES).map(place).collect()
}

/// The pixels of a part of the picture: the first sheet at the left of the boundary, the second at its right.
fn strip(sheets: &[Canvas; 2], rect: Rect, boundary: usize) -> Vec<Colour> {
    let is_inside = boundary > 0 && boundary < sheets[0].width();
    let colour = |x: usize, y: usize| {
        if is_inside && y >= CAPTIONS && (boundary..boundary + BOUNDARY).contains(&x) {
            return PAPER;
        }
        sheets[usize::from(x >= boundary)].pixel(x, y)
    };
    (rect.y..rect.y + rect.height)
        .flat_map(|y| (rect.x..rect.x + rect.width).map(move |x| (x, y)))
        .map(|(x, y)| colour(x, y))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::AnimationDecoder;
    use image::codecs::gif::GifDecoder;

    #[test]
    fn the_film_begins_with_the_first_picture_and_shows_the_second_half_way() {
        let (red, blue) = (vec![[200, 30, 30]; 12], vec![[20, 40, 210]; 12]);
        let side = |pixels| Side { caption: "a".to_owned(), pixels };
        let film = encode(&sheets(&[side(&red), side(&blue)], [4, 3])).unwrap();
        let frames = GifDecoder::new(io::Cursor::new(film)).unwrap().into_frames();
        let frames: Vec<_> = frames.map(|f| f.unwrap().into_buffer()).collect();
        assert_eq!((frames.len(), frames[0].dimensions()), (2 * FRAMES, (400, 300 + CAPTIONS as u32)));
        let near = |frame: usize, x: u32, wanted: [u8; 3]| {
            let found = frames[frame].get_pixel(x, 200).0;
            (0..3).all(|c| found[c].abs_diff(wanted[c]) < 12)
        };
        for x in [1, 200, 398] {
            assert!(near(0, x, red[0]) && near(FRAMES, x, blue[0]), "{x}");
        }
        assert!(near(FRAMES / 2, 100, red[0]) && near(FRAMES / 2, 300, blue[0]));
        assert!(near(FRAMES + FRAMES / 2, 100, red[0]) && near(FRAMES + FRAMES / 2, 300, blue[0]));
    }

    #[test]
    fn other_endings_and_other_numbers_of_runs_are_refused() {
        assert!(check(Path::new("wipe.gif"), 2).is_ok());
        assert!(check(Path::new("wipe.mp4"), 2).unwrap_err().report().contains(".gif"));
        assert!(check(Path::new("wipe.gif"), 3).unwrap_err().report().contains("found 3"));
    }
}
