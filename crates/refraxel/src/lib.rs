//! The parts of the `refraxel` program: its command line, exit codes, progress, and the pictures in its reports.

pub mod canvas;
pub mod cli;
pub mod colour_map;
pub mod console;
pub mod device;
pub mod exit;
mod locked;
pub mod picture;
pub mod plot;
pub mod progress;
pub mod sentences;
pub mod shell;
pub mod start;
pub mod table;
#[cfg(test)]
mod typescript;
pub mod verbs;
pub mod viewer;
pub mod worker;
