//! What a page is told of a training.

use serde::Serialize;

/// Something that happens in a training.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Training {
    /// A line of its log.
    Record {
        /// Steps done.
        step: u64,
        /// Steps in all; `null` where the time counts.
        steps: Option<u64>,
        /// Share of the training that is done.
        progress: f64,
        /// PSNR of the training rays since the last record [dB]; `null` where it is infinite.
        train_psnr: Option<f64>,
        /// PSNR of a validation view [dB], where one was rendered.
        val_psnr: Option<f64>,
        /// What the training is busy with.
        phase: &'static str,
    },
    /// Something that it has found or decided.
    Event {
        /// In a sentence.
        text: String,
    },
    /// What it does now.
    State {
        /// It waits, or soon will.
        paused: bool,
        /// What it does beside steps, or instead.
        text: String,
    },
}
