//! What each verb of the command line does.

pub mod bench;
pub mod compare;
pub mod dataset;
pub mod demo;
pub mod detail;
pub mod eval;
pub mod evaluation;
pub mod export;
pub mod files;
pub mod import;
pub mod inspect;
pub mod interrupts;
pub mod known_index;
pub mod loaded;
pub mod mask;
pub mod options;
pub mod ply_header;
pub mod render;
pub mod reopen;
pub mod sheet;
pub mod sweep;
pub mod synth;
pub mod threads;
pub mod train;
pub mod view;
