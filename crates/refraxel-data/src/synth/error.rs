//! What can go wrong while a scene is made.

use super::shape::MeshError;
use crate::atomic::WriteError;
use std::path::PathBuf;

/// Why no dataset was written.
#[derive(Debug, thiserror::Error)]
pub enum SynthError {
    /// No scene of that name.
    #[error("there is no scene {found:?}; choose one of: {known}")]
    UnknownScene {
        /// The name that was given.
        found: String,
        /// All names, separated by commas.
        known: String,
    },
    /// A number outside of its range.
    #[error("{option} is {found}, expected {expected}")]
    Range {
        /// The option as on the command line.
        option: &'static str,
        /// What was found.
        found: String,
        /// What is allowed, and why.
        expected: String,
    },
    /// The folder holds something else.
    #[error(
        "{folder} already holds a dataset that this program did not make ({file}); choose another folder or empty it"
    )]
    Foreign {
        /// The folder.
        folder: PathBuf,
        /// What was found there.
        file: String,
    },
    /// A file or folder could not be read, made or removed.
    #[error("cannot {action} {path}: {source}")]
    Io {
        /// `read`, `create`, `clear` or `remove`.
        action: &'static str,
        /// Which file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file could not be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// A picture could not be encoded or decoded.
    #[error("cannot {action} the picture {path}: {source}")]
    Picture {
        /// `encode` or `decode`.
        action: &'static str,
        /// Which file.
        path: PathBuf,
        /// What the codec said.
        source: image::ImageError,
    },
    /// An imported mesh is not usable.
    #[error("the mesh {path}: {source}")]
    Mesh {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it.
        source: MeshError,
    },
    /// No thread pool of that size.
    #[error("cannot start {threads} threads: {source}")]
    Threads {
        /// The number that was given.
        threads: usize,
        /// What the pool said.
        source: rayon::ThreadPoolBuildError,
    },
    /// The progress callback asked to stop; finished pictures are kept and a second run goes on from there.
    #[error("stopped after {done} of {total} pictures; run the same command again to continue")]
    Stopped {
        /// Pictures finished, including those of earlier runs.
        done: usize,
        /// Pictures in all.
        total: usize,
    },
}
