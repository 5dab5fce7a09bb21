//! Mutation of valid files: what is changed, in which case, and what came of it.

mod bytes;
pub mod checkpoint;
pub mod parent;
mod png;
mod text;
pub mod worker;

use crate::targets::{Answer, Bench, Target};
use std::panic::{self, AssertUnwindSafe};
use std::sync::Mutex;

/// One change of a file. What the numbers mean depends on the [`Format`]; every value means something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// Which kind of change.
    pub kind: u64,
    /// Where.
    pub at: u64,
    /// What to.
    pub value: u64,
}

/// How files of a target are changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Numbers, words and lines are replaced, removed and repeated, and bytes.
    Text,
    /// Bits, bytes, integers and floats are replaced; pieces are removed and repeated.
    Binary,
    /// The same, and most files get right checksums again.
    Png,
    /// Values of the description, and shapes, types and numbers of tensors; all checksums are right.
    Checkpoint,
}

/// A valid file with some changes.
pub fn apply(format: Format, valid: &[u8], changes: &[Change]) -> Vec<u8> {
    match format {
        Format::Checkpoint => checkpoint::changed(valid, changes),
        _ => {
            let mut file = valid.to_vec();
            for change in changes {
                match format {
                    Format::Text if change.kind % 8 < 6 => text::change(&mut file, change),
                    _ => bytes::change(&mut file, change),
                }
            }
            let is_repaired = format == Format::Png && changes.first().is_some_and(|c| c.value % 4 > 0);
            if is_repaired { png::with_right_sums(&file) } else { file }
        }
    }
}

/// The changes of a case: the same for the same target, seed and number.
pub fn changes(target: &str, seed: u64, case: u64) -> Vec<Change> {
    let name = u64::from(crc32fast::hash(target.as_bytes()));
    let mut random = fastrand::Rng::with_seed(seed ^ (name << 32) ^ case.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let count = [1, 1, 1, 2, 3, 8][random.usize(..6)];
    (0..count).map(|_| Change { kind: random.u64(..), at: random.u64(..), value: random.u64(..) }).collect()
}

/// What a case showed that must not be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// One line.
    pub what: String,
    /// The fewest of its changes that show it.
    pub changes: Vec<Change>,
}

/// Gives a file to a target. A panic is a finding, and so is what the target calls one.
pub fn ask(target: &Target, bench: &Bench, file: &[u8]) -> Answer {
    let last_panic = || LAST_PANIC.lock().unwrap_or_else(|e| e.into_inner());
    last_panic().clear();
    let asked = panic::catch_unwind(AssertUnwindSafe(|| bench.ask(target, file)));
    let place = last_panic().clone();
    match asked {
        // Also a panic of another thread, which nobody waited for, would end the program.
        Ok(answer) if place.is_empty() => answer,
        _ => Answer::Broken(format!("panic {place}")),
    }
}

/// Runs one case; a finding comes with the fewest changes that show one of the same kind.
pub fn run_case(target: &Target, bench: &Bench, changes: &[Change]) -> Result<Answer, Finding> {
    let asked = |changes: &[Change]| ask(target, bench, &apply(target.format, bench.valid(), changes));
    let mut what = match asked(changes) {
        Answer::Broken(what) => what,
        answer => return Ok(answer),
    };
    let mut least = changes.to_vec();
    let mut k = 0;
    while k < least.len() && least.len() > 1 {
        let mut fewer = least.clone();
        fewer.remove(k);
        match asked(&fewer) {
            Answer::Broken(again) => (least, what) = (fewer, again),
            _ => k += 1,
        }
    }
    Err(Finding { what, changes: least })
}

static LAST_PANIC: Mutex<String> = Mutex::new(String::new());

/// From now on panics are kept for the report instead of being printed.
pub fn keep_panics() {
    panic::set_hook(Box::new(|panic| {
        let place = panic.location().map(|l| format!("at {}:{}", l.file(), l.line())).unwrap_or_default();
        let what = panic.payload_as_str().unwrap_or("without words");
        let mut last = LAST_PANIC.lock().unwrap_or_else(|e| e.into_inner());
        if last.is_empty() {
            *last = format!("{place}: {}", what.lines().next().unwrap_or_default());
        }
    }));
}
