//! What COLMAP's models hold, for reports.

use super::files::{images, models_in, points};
use crate::DataError;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// What one model holds.
#[derive(Clone, Debug, PartialEq)]
pub struct ColmapModel {
    /// Its folder.
    pub folder: PathBuf,
    /// The images that it poses, by their paths below the image folder, sorted.
    pub images: Vec<String>,
    /// Triangulated points.
    pub points: usize,
    /// Mean reprojection error over all points [pixel], as `colmap model_analyzer` states it; `None` where no point states one.
    pub mean_error: Option<f64>,
}

/// The models directly in a folder, in folders named by numbers or in itself; the one with most images first.
pub fn colmap_models(folder: &Path) -> Result<Vec<ColmapModel>, DataError> {
    let summary = |folder: PathBuf| {
        let mut images: Vec<String> = images(&folder)?.all.into_iter().map(|image| image.name).collect();
        images.sort();
        let points = points(&folder, &HashSet::new())?;
        let errors: Vec<f64> =
            points.iter().filter_map(|point| point.error).filter(|e| e.is_finite()).collect();
        let mean_error = (!errors.is_empty()).then_some(errors.iter().sum::<f64>() / errors.len() as f64);
        Ok(ColmapModel { folder, images, points: points.len(), mean_error })
    };
    let mut models = models_in(folder).into_iter().map(summary).collect::<Result<Vec<_>, DataError>>()?;
    models.sort_by_key(|model| std::cmp::Reverse(model.images.len()));
    Ok(models)
}
