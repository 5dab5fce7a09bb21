//! Rendering views and scoring them: pictures, a part of the data, errors of the index.

mod error;
mod evaluate;
mod index_error;
mod rendering;
mod score;

pub use error::EvaluateError;
pub use evaluate::{Evaluation, Learned, evaluate, evaluate_by};
pub use index_error::{IndexError, index_error, index_errors};
pub use rendering::{Light, Rendering, SUBPIXELS, render, render_by};
pub use score::{TruthChecksum, score, truth};
