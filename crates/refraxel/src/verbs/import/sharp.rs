//! The sharpest frame of neighbours.

use crate::exit::{Exit, Failure, OrExit};
use crate::verbs::detail::detail;
use anyhow::Context;
use rayon::prelude::*;
use refraxel_data::photographs::stored_pixels;
use std::path::{Path, PathBuf};

/// Of every `group` files in the order given, the one that shows most detail.
pub fn sharpest(files: &[PathBuf], group: usize) -> Result<Vec<PathBuf>, Failure> {
    let scores: Vec<f64> = files.par_iter().map(|file| score(file)).collect::<Result<_, _>>()?;
    let best = |(files, scores): (&[PathBuf], &[f64])| {
        let ranked = files.iter().zip(scores).max_by(|a, b| a.1.total_cmp(b.1));
        ranked.map(|(file, _)| file.clone())
    };
    Ok(files.chunks(group).zip(scores.chunks(group)).filter_map(best).collect())
}

fn score(file: &Path) -> Result<f64, Failure> {
    let cannot = || format!("cannot decode the frame {}", file.display());
    Ok(detail(&stored_pixels(file).with_context(cannot).or_exit(Exit::Io)?.into_luma8()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{GrayImage, Luma};

    #[test]
    fn of_each_group_the_frame_without_blur_is_taken() {
        let folder = tempfile::tempdir().unwrap();
        let sharp =
            GrayImage::from_fn(32, 32, |x, y| Luma([if (x / 4 + y / 4) % 2 == 0 { 220 } else { 30 }]));
        let blurred = image::imageops::blur(&sharp, 1.5);
        let files: Vec<PathBuf> = (0..5).map(|i| folder.path().join(format!("{i}.png"))).collect();
        for (i, file) in files.iter().enumerate() {
            if [1, 3].contains(&i) { &sharp } else { &blurred }.save(file).unwrap();
        }
        assert_eq!(sharpest(&files, 3).unwrap(), [files[1].clone(), files[3].clone()]);
    }
}
