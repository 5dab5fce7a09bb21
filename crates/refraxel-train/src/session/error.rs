//! Why a session cannot go on.

use super::BackendError;
use crate::cancel::Cancelled;
use crate::evaluation::EvaluateError;
use crate::options::OptionError;
use crate::plan::PlanError;
use crate::refraction_search::SearchError;
use crate::run::PathNotText;
use crate::trainer::TrainError;
use refraxel_data::{DataError, OutOfScale};

/// Why a session cannot start or go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// Nothing to learn from.
    #[error(
        "the dataset has no training images; name some in its training split, or hold out fewer (`holdout`)"
    )]
    NoTrainingViews,
    /// Exposures are to learn from transparent pictures.
    #[error(
        "exposures cannot learn: the pictures are transparent, and what is put behind them has no exposure; switch \
         `exposure.enabled` off"
    )]
    TransparentPictures,
    /// Lenses are to learn, and poses are not.
    #[error(
        "a lens cannot learn alone, for cameras further away look like a longer lens: let the poses learn, too (`pose.enabled`, \
         `--poses learn`), or switch `pose.lens` off"
    )]
    LensWithoutPoses,
    /// A saved run was trained on something else.
    #[error(
        "the run was trained on other images ({was} of them) than {data} offers now ({found}); resume with the same dataset \
         and split, or start a new run"
    )]
    OtherViews {
        /// The data.
        data: String,
        /// Training images of the run.
        was: usize,
        /// Training images of the data.
        found: usize,
    },
    /// A saved run was trained on something else of the same names.
    #[error(
        "the run was trained on other photographs or cameras than the data offer now under the same names; bring back the same \
         dataset (with its poses, lenses, sizes and --crop, --up, --downscale), or start a new run"
    )]
    OtherPhotographs,
    /// Options make no sense.
    #[error(transparent)]
    Options(#[from] OptionError),
    /// The scene has no place in single precision.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// What is refractive is out of scale with the scene.
    #[error(transparent)]
    Scale(#[from] OutOfScale),
    /// A checkpoint could not name the data.
    #[error(transparent)]
    Path(#[from] PathNotText),
    /// Photographs cannot be used.
    #[error(transparent)]
    Data(#[from] DataError),
    /// Nothing says what is refractive.
    #[error(transparent)]
    Search(#[from] SearchError),
    /// Training failed.
    #[error(transparent)]
    Train(#[from] TrainError),
    /// An evaluation failed.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    /// There is no backend for the model.
    #[error(transparent)]
    Backend(BackendError),
    /// Somebody wished to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
