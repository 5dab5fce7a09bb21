//! `refraxel import`: poses for plain photographs or a video, by COLMAP and ffmpeg.

mod calls;
mod frames;
mod make;
mod photos;
mod plan;
mod report;
mod script;
mod sharp;
mod source;
mod stage;
mod tools;
mod verb;
mod work;

pub use verb::run;
