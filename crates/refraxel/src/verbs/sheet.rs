//! Pictures on disk: renderings, and sheets of truth, renderings and errors side by side.

use crate::canvas::write_png;
use crate::exit::Failure;
use crate::picture::{self, ColourScale, Content, Panel, Sheet};
use image::ExtendedColorType;
use refraxel_train::evaluation::Rendering;
use refraxel_train::metrics::Rgb8;
use std::path::{Path, PathBuf};

/// Rows of a sheet.
pub const ROWS: usize = 6;
/// Error, in 8-bit steps, that gets the brightest colour.
const FULL_ERROR: u8 = 64;

/// One image of a sheet and its renderings.
pub struct Row {
    /// Name of the image.
    pub name: String,
    /// Width and height [pixel].
    pub size: [usize; 2],
    /// The photograph, where it is shown.
    pub truth: Option<Vec<[u8; 3]>>,
    /// One per run.
    pub renderings: Vec<Scored>,
}

/// A rendering and its score.
pub struct Scored {
    /// sRGB, rows from the top.
    pub pixels: Vec<[u8; 3]>,
    /// [dB]
    pub psnr: f64,
}

/// Which of `count` images a sheet shows: at most [`ROWS`], evenly spread.
pub fn chosen(count: usize) -> impl Iterator<Item = usize> {
    (0..count).step_by(count.div_ceil(ROWS).max(1))
}

/// Draws the rows: the truth, then each run's rendering and, where the truth is shown, its error.
///
/// # Panics
/// When rows differ in their number of renderings, or an image is not of its row's size.
pub fn draw(rows: &[Row], runs: &[String], title: &str, path: &Path) -> Result<(), Failure> {
    let with_truth = rows.iter().all(|r| r.truth.is_some());
    let mut columns: Vec<String> = Vec::new();
    columns.extend(with_truth.then(|| "truth".to_owned()));
    for run in runs {
        columns.push(run.clone());
        columns.extend(with_truth.then(|| "error".to_owned()));
    }
    // One bar explains all rows.
    let scale = |k: usize| (k == 0).then_some(ColourScale::Errors(FULL_ERROR));
    let row =
        |(k, row)| picture::Row { caption: String::new(), panels: panels(row, with_truth), scale: scale(k) };
    let sheet = Sheet { title: title.to_owned(), columns, rows: rows.iter().enumerate().map(row).collect() };
    Ok(sheet.draw().save_png(path)?)
}

fn panels(row: &Row, with_truth: bool) -> Vec<Panel<'_>> {
    let view = |pixels| Rgb8::new(pixels, row.size[0], row.size[1]);
    let truth = row.truth.as_deref().filter(|_| with_truth).map(view);
    let mut panels: Vec<Panel> =
        truth.iter().map(|&t| Panel { content: Content::Image(t), note: row.name.clone() }).collect();
    for (k, Scored { pixels, psnr }) in row.renderings.iter().enumerate() {
        let name = if truth.is_none() && k == 0 { format!("{}  ", row.name) } else { String::new() };
        let note = format!("{name}{psnr:.2} dB");
        panels.push(Panel { content: Content::Image(view(pixels)), note });
        let error = truth.map(|t| Content::Error(view(pixels), t));
        panels.extend(error.map(|content| Panel { content, note: String::new() }));
    }
    panels
}

/// `r_0.png` for `r_0.png`, `IMG_1.png` for `IMG_1.jpg`.
pub fn png_path(folder: &Path, name: &str) -> PathBuf {
    folder.join(name).with_extension("png")
}

/// Writes the colours of a rendering as PNG, atomically.
pub fn save_image(path: &Path, r: &Rendering) -> Result<(), Failure> {
    let size = [r.width as usize, r.height as usize];
    Ok(write_png(path, r.colour.as_flattened(), size, ExtendedColorType::Rgb8)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_shows_few_images_evenly_spread() {
        assert_eq!(chosen(3).collect::<Vec<_>>(), [0, 1, 2]);
        assert_eq!(chosen(40).collect::<Vec<_>>(), [0, 7, 14, 21, 28, 35]);
        assert_eq!(chosen(0).count(), 0);
    }

    #[test]
    fn names_with_dots_keep_them() {
        assert_eq!(png_path(Path::new("d"), "IMG_1.JPG"), Path::new("d/IMG_1.png"));
    }
}
