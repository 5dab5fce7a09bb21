//! The masks as files, and a picture of some of them.

use super::earlier::given;
use crate::canvas::write_png;
use crate::exit::Failure;
use crate::picture::{Content, Panel, Row, Sheet};
use crate::progress::Show;
use crate::verbs::dataset::load_photos;
use crate::verbs::files::create_folder;
use crate::verbs::sheet::chosen;
use image::ExtendedColorType;
use refraxel_data::{Dataset, Mask, Photo, PhotoSource, is_white};
use refraxel_train::detection;
use refraxel_train::evaluation::truth;
use refraxel_train::metrics::Rgb8;
use refraxel_train::model::Gate;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Masks of large photographs are projected in squares of so many pixels, so that a view takes at most about this many rays.
const PROJECTED: f64 = 4e5;
/// Brightness of what a mask leaves out, in pictures of masks.
const DIMMED: u16 = 3;

/// What was written.
pub(super) struct Written {
    pub(super) written: usize,
    pub(super) kept: usize,
    pub(super) covered: f64,
    pub(super) picture: PathBuf,
}

/// Writes masks of the views that have no file of one, and a picture of some of all.
pub(super) fn write(
    data: &Dataset,
    targets: &[PathBuf],
    gate: &Gate,
    out: &Path,
    show: Show,
) -> Result<Written, Failure> {
    create_folder(out)?;
    let found = std::slice::from_ref(gate);
    let (mut inside, mut pixels, mut kept) = (0, 0, 0);
    let shown: Vec<usize> = chosen(data.views.len()).collect();
    let photos = load_photos(data, &shown, show)?;
    let mut rows = Vec::new();
    for (k, (view, path)) in data.views.iter().zip(targets).enumerate() {
        let camera = &view.camera;
        let edge = (f64::from(camera.width) * f64::from(camera.height) / PROJECTED).sqrt().max(1.0);
        let given = given(view)?;
        let is_kept = given.is_some() && matches!(view.source, PhotoSource::Files { .. });
        kept += usize::from(is_kept);
        let mask = given.unwrap_or_else(|| Arc::new(detection::mask(found, camera, edge)));
        inside += mask.coverage.iter().filter(|c| is_white(**c)).count();
        pixels += mask.coverage.len();
        if !is_kept {
            path.parent().map_or(Ok(()), create_folder)?;
            let size = [mask.width as usize, mask.height as usize];
            write_png(path, &mask.coverage, size, ExtendedColorType::L8)?;
        }
        if let Some(row) = shown.iter().position(|&s| s == k) {
            rows.push((view.name.clone(), dimmed(&photos[row], data, &mask), mask));
        }
    }
    let name = out.file_name().unwrap_or_default().to_string_lossy();
    let picture = out.with_file_name(format!("{name}_overview.png"));
    draw(&rows, &picture)?;
    Ok(Written {
        written: data.views.len() - kept,
        kept,
        covered: inside as f64 / pixels.max(1) as f64,
        picture,
    })
}

/// The photograph, dark beside what its mask shows.
fn dimmed(photo: &Photo, data: &Dataset, mask: &Mask) -> Vec<[u8; 3]> {
    let dim = |(rgb, coverage): ([u8; 3], &u8)| {
        if is_white(*coverage) { rgb } else { rgb.map(|c| (u16::from(c) / DIMMED) as u8) }
    };
    truth(photo, data.backdrop).into_iter().zip(&mask.coverage).map(dim).collect()
}

fn draw(rows: &[(String, Vec<[u8; 3]>, Arc<Mask>)], path: &Path) -> Result<(), Failure> {
    let rows = rows.iter().map(|(name, pixels, mask)| {
        let image = Rgb8::new(pixels, mask.width as usize, mask.height as usize);
        let panel = Panel { content: Content::Image(image), note: name.clone() };
        Row { panels: vec![panel], ..Row::default() }
    });
    let title = "masks: dark is left out".to_owned();
    let sheet = Sheet { title, columns: Vec::new(), rows: rows.collect() };
    Ok(sheet.draw().save_png(path)?)
}
