//! Image quality in one named protocol: both images in 8-bit sRGB, one figure per image, then the mean over images.

mod error;
#[cfg(test)]
mod examples;
mod psnr;
mod rgb8;
mod scores;
mod ssim;

pub use error::MetricsError;
pub use psnr::{masked_psnr, psnr};
pub use rgb8::Rgb8;
pub use scores::{ImageScore, PROTOCOL, Scores};
pub use ssim::ssim;
